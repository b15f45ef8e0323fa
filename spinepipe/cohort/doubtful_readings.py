"""Readings, loads and their errors that no instrument gives: constant, repeated, zero, absurd."""

from collections.abc import Iterator, Sequence
from itertools import combinations
from typing import Any

import numpy as np
import pandas as pd

from spinepipe.cohort.answers import of_specimens
from spinepipe.cohort.cohort import Cohort
from spinepipe.cohort.columns import COHORT_YAML
from spinepipe.cohort.doubt import Doubt, Group
from spinepipe.cohort.doubtful_places import COLUMNS, file_of, first_line
from spinepipe.problems import Problem
from spinepipe.units import COORDINATE_COLUMNS

LEAST_SD = 1e-6
"""deg, mm, N, N m: no instrument is so fine; a fit believes such readings more than anything."""

FINEST_SD = {"rotation_deg": 1e-3, "translation_mm": 1e-4, "force_n": 1e-4, "moment_nm": 1e-5}
"""Laboratory encoders and interferometers resolve this."""

LEAST_PALPATION_MM = 0.02
"""Nobody digitises a point of bone more finely."""

COARSEST_SD = {"rotation_deg": 10.0, "translation_mm": 10.0, "force_n": 500.0, "moment_nm": 20.0}
"""A joint of the spine hardly moves so far, a rig hardly loads it so much."""

LARGEST_DEG = 45.0
"""To one side, chosen: what was read is less by half. Flexion and extension together reach 20 deg
in lumbar joints (mean and two SDs; BMC Musculoskelet Disord 2006 7:45, Table 5) and 14 deg at T1T2
under 7.5 N m (Wilke 2017, abstract). C1C2 alone turns by up to 53 deg (Roche 2002, doi
10.1053/crad.2001.0703)."""

ATLAS_DEG = 60.0
"""Of C1C2 alone."""

LARGEST_MM = 25.0
"""Vertebrae slide by 9 mm at most in vivo (as Wang 2021 cites it)."""

LEAST_DEG = 0.1
"""Rotations of a whole cohort that are all smaller are no answer to a load that spines are tested
with."""

LEAST_FORCE_N, LEAST_MOMENT_NM = 1.0, 0.02
"""A cohort whose largest load is smaller was not loaded: a spine carries its own weight."""

SHARE_OF_SD = 0.2
"""Of the SD of a reading: at least eight readings that are all smaller have no such error."""

SURE_SDS = 100.0
"""Two or three readings alike to the last digit are no chance where their SD is so small."""

CYCLES = 6
"""Cycles of tests whose step 0 reads exactly zero before that is no chance."""

ZERO = 1e-6
"""deg, mm: what rounding leaves of a reading less itself."""

LOADS = ["fx_n", "fy_n", "fz_n", "mx_nm", "my_nm", "mz_nm"]
_CYCLE = ["specimen", "test", "cycle"]


def doubtful_readings(cohort: Cohort) -> Iterator[Doubt]:
    """Doubts about errors, loads and motion as columns of numbers."""
    yield from _errors(cohort)
    yield from _repeated(cohort)
    if cohort.motion is None or cohort.loads is None:
        return
    yield from _unloaded(cohort)
    yield from _unmoved(cohort)
    constant = list(_constant(cohort))
    yield from constant
    yield from _never(cohort)
    yield from _absurd(cohort)
    yield from () if constant else _step_0(cohort)


def doubtful_sizes_of_readings(cohort: Cohort) -> Iterator[Doubt]:
    """Loads and motion too small whatever joint answers them, where no answer can be judged."""
    if cohort.motion is not None and cohort.loads is not None:
        yield from _feeble(cohort)
        yield from _below_their_sd(cohort)


def _errors(cohort: Cohort) -> Iterator[Doubt]:
    told = {} if cohort.measurement_sd is None else cohort.measurement_sd.model_dump()
    file = f"{cohort.folder.resolve().name}/{COHORT_YAML}"
    for name, sd in told.items():
        if sd is None or FINEST_SD[name] <= sd <= COARSEST_SD[name]:
            continue
        allowed = f"{FINEST_SD[name]:g} to {COARSEST_SD[name]:g}: SDs that instruments have"
        key = f"measurement_sd.{name}"
        problem = Problem(file, None, key, f"{sd:.3g}", allowed, "give the SD of one reading")
        yield Doubt(problem, "errors", certain=sd < LEAST_SD)
    if cohort.landmarks is not None:
        sd = cohort.landmarks["sd_mm"].to_numpy(float)
        odd = np.flatnonzero(((sd > 0.0) & (sd < LEAST_PALPATION_MM)) | (sd > 20.0))
        if len(odd):
            line = first_line(cohort, "landmarks", int(odd[0]))
            place = (file_of(cohort, "landmarks"), line, "sd_mm")
            allowed = f"0 where a point is known, or {LEAST_PALPATION_MM:g} to 20 mm"
            remedy = "give the SD of one palpation"
            if sd[odd[0]] < LEAST_PALPATION_MM:
                remedy += "; suspected: m and not mm; multiply sd_mm by 1000"
            problem = Problem(*place, f"{sd[odd[0]]:.3g}", allowed, remedy)
            yield Doubt(problem, "errors", certain=bool(sd[odd[0]] < LEAST_SD))


def _repeated(cohort: Cohort) -> Iterator[Doubt]:
    """Two columns with the same numbers in every row."""
    groups: tuple[tuple[str, Sequence[str], Group], ...] = (
        ("motion", COORDINATE_COLUMNS, "motion"),
        ("loads", LOADS, "loads"),
        ("joints", COLUMNS["landmarks"], "lengths"),
        ("landmarks", COLUMNS["landmarks"], "lengths"),
        ("bodies", COLUMNS["bodies"], "lengths"),
    )
    for stem, columns, group in groups:
        table: Any = getattr(cohort, stem)
        for first, second in combinations(columns if table is not None else (), 2):
            values = table[first]
            if values.equals(table[second]) and values[values != 0.0].nunique() > 1:
                row = int(np.flatnonzero(values.notna() & (values != 0.0))[0])
                place = (file_of(cohort, stem), first_line(cohort, stem, row), second)
                found, allowed = f"the same numbers as in {first}", "numbers of its own"
                remedy = "suspected: a column copied into another"
                yield Doubt(Problem(*place, found, allowed, remedy), group)


def _held(cohort: Cohort, test: object) -> bool:
    """Whether something but the loads of its steps may move the spine in a test."""
    for table in (cohort.supports, cohort.preload):
        if table is not None and table["test"].isin([test, "*"]).any():
            return True
    return False


def _unloaded(cohort: Cohort) -> Iterator[Doubt]:
    """Tests with motion whose loads are all zero."""
    assert cohort.loads is not None
    assert cohort.motion is not None
    for test, rows in cohort.loads.groupby("test", sort=False):
        moved = cohort.motion.loc[cohort.motion["test"] == test, list(COORDINATE_COLUMNS)]
        if (rows[LOADS] != 0.0).any(axis=None) or _held(cohort, test):
            continue
        if (rows["follower_n"] > 0.0).any() or not (moved.fillna(0.0) != 0.0).any(axis=None):
            continue
        line = first_line(cohort, "loads", int(rows.index[0]))
        place = (file_of(cohort, "loads"), line, f"{LOADS[0]} to {LOADS[-1]}")
        found = f"no load in any of the {len(rows)} rows of test '{test}', and motion"
        remedy = "fill in the loads, or say in supports.csv or preload.csv what moved the joints"
        problem = Problem(*place, found, "a load that makes the motion", remedy)
        yield Doubt(problem, "loads", certain=True)


def _unmoved(cohort: Cohort) -> Iterator[Doubt]:
    """Specimens that do not move at all under the loads of a test."""
    motion = cohort.motion
    assert motion is not None
    values = motion[list(COORDINATE_COLUMNS)]
    for (specimen, test), rows in values.groupby([motion["specimen"], motion["test"]], sort=False):
        later = rows[motion.loc[rows.index, "step"] > 0]
        if later.notna().any(axis=None) and not (later.fillna(0.0) != 0.0).any(axis=None):
            line = first_line(cohort, "motion", int(rows.index[0]))
            column = str(later.notna().any().idxmax())
            place = (file_of(cohort, "motion"), line, column)
            found = f"zero in every reading of {specimen}, test '{test}'"
            remedy = "leave cells empty where nothing was measured"
            yield Doubt(Problem(*place, found, "motion under load", remedy), "motion")
    yield from _read_unloaded(cohort)


def _read_unloaded(cohort: Cohort) -> Iterator[Doubt]:
    """Tests whose only readings stand beside steps without load."""
    loads, motion = cohort.loads, cohort.motion
    assert loads is not None
    assert motion is not None
    for test, rows in loads.groupby("test", sort=False):
        loaded = set(rows.loc[(rows[LOADS] != 0.0).any(axis=1), "step"])
        own = motion[motion["test"] == test]
        read = own[own[list(COORDINATE_COLUMNS)].fillna(0.0).ne(0.0).any(axis=1)]
        if loaded and len(read) and not read["step"].isin(loaded).any() and not _held(cohort, test):
            line = first_line(cohort, "motion", int(read.index[0]))
            place = (file_of(cohort, "motion"), line, "step")
            found = f"motion of test '{test}' at unloaded steps alone"
            remedy = "suspected: steps in reverse order; number them as the loads"
            yield Doubt(Problem(*place, found, "motion at loaded steps", remedy), "motion")


def _feeble(cohort: Cohort) -> Iterator[Doubt]:
    """Loads or rotations of a whole cohort that are too small to be what was tested with."""
    loads, motion = cohort.loads, cohort.motion
    assert loads is not None
    assert motion is not None
    kinds = ((LOADS[:3], LEAST_FORCE_N, "kN and not N"), (LOADS[3:], LEAST_MOMENT_NM, "kN m"))
    largest = [float(loads[columns].abs().to_numpy().max(initial=0.0)) for columns, _, _ in kinds]
    for (columns, least, words), size in zip(kinds, largest, strict=True):
        if 0.0 < size < least:
            row = int(np.argmax((loads[columns] != 0.0).any(axis=1)))
            column = str(loads[columns].iloc[row].abs().idxmax())
            place = (file_of(cohort, "loads"), first_line(cohort, "loads", row), column)
            allowed = f"a largest load of at least {least:g}"
            problem = Problem(*place, f"at most {size:.3g}", allowed, f"suspected: {words}")
            yield Doubt(problem, "loads")
    angles = motion[list(COORDINATE_COLUMNS[3:])].abs()
    turned = float(np.nan_to_num(angles.to_numpy()).max(initial=0.0))
    if 0.0 < turned < LEAST_DEG and (largest[0] >= 20.0 or largest[1] >= 1.0):
        row = int(np.argmax((angles.fillna(0.0) > 0.0).any(axis=1)))
        column = str(angles.iloc[row].idxmax())
        place = (file_of(cohort, "motion"), first_line(cohort, "motion", row), column)
        found = f"rotations of at most {turned:.3g} deg in all tests"
        remedy = "suspected: angles in radians and not degrees (0.0175); convert the columns"
        problem = Problem(*place, found, f"{LEAST_DEG:g} deg and more under such loads", remedy)
        yield Doubt(problem, "motion")


def _below_their_sd(cohort: Cohort) -> Iterator[Doubt]:
    """Columns whose readings are all much smaller than the error that they are said to have."""
    motion, sd = cohort.motion, cohort.measurement_sd
    assert motion is not None
    for column in COORDINATE_COLUMNS if sd is not None else ():
        assert sd is not None
        error = sd.rotation_deg if column.endswith("_deg") else sd.translation_mm
        read = motion[column].dropna().abs()
        read = read[read > ZERO]
        if len(read) >= 8 and float(read.max()) < SHARE_OF_SD * error:
            row = int(read.index[0])
            place = (file_of(cohort, "motion"), first_line(cohort, "motion", row), column)
            found = f"readings of at most {read.max():.3g}, whose SD is said to be {error:g}"
            allowed = "readings that scatter as their SD says"
            unit = "radians and not degrees; multiply by 57.3"
            unit = unit if column.endswith("_deg") else "in m and not mm; multiply by 1000"
            remedy = f"suspected: {unit}; or look at measurement_sd"
            yield Doubt(Problem(*place, found, allowed, remedy), "motion")


def _constant(cohort: Cohort) -> Iterator[Doubt]:
    """Columns of motion with one number, not zero, in all rows of a specimen."""
    motion = cohort.motion
    assert motion is not None
    for column in COORDINATE_COLUMNS:
        told = {
            str(specimen): values.dropna()
            for specimen, values in motion.groupby("specimen", sort=False)[column]
            if _is_constant(cohort, column, values.dropna())
        }
        if told:
            read = next(iter(told.values()))
            line = first_line(cohort, "motion", int(read.index[0]))
            whose = of_specimens(told, cohort.specimen_names)
            found = f"{read.iloc[0]:.4g} in all {len(read)} readings of {whose}"
            place = (file_of(cohort, "motion"), line, column)
            remedy = "look for a column filled down, or take it out"
            problem = Problem(*place, found, "readings that follow the loads", remedy)
            yield Doubt(problem, "motion")


def _is_constant(cohort: Cohort, column: str, read: pd.Series) -> bool:
    """One number in more than three readings, or in fewer where they err by far less."""
    if len(read) < 2 or read.nunique() != 1 or read.iloc[0] == 0.0:
        return False
    sd = cohort.measurement_sd
    if len(read) > 3 or sd is None:
        return len(read) > 3
    error = sd.rotation_deg if column.endswith("_deg") else sd.translation_mm
    return bool(abs(read.iloc[0]) > SURE_SDS * error)


def _never(cohort: Cohort) -> Iterator[Doubt]:
    """Rotations that are zero in every row, beside motion that is not."""
    motion = cohort.motion
    assert motion is not None
    moved = [c for c in COORDINATE_COLUMNS if motion[c].fillna(0.0).ne(0.0).any()]
    for column in COORDINATE_COLUMNS[3:] if moved else ():
        read = motion[column].dropna()
        if len(read) and column not in moved and (motion.loc[read.index, "step"] > 0).any():
            line = first_line(cohort, "motion", int(read.index[0]))
            place = (file_of(cohort, "motion"), line, column)
            found = f"0 in all {len(read)} readings"
            remedy = "leave the cells empty where it was not measured"
            yield Doubt(Problem(*place, found, "readings with their error", remedy), "motion")


def _absurd(cohort: Cohort) -> Iterator[Doubt]:
    """Single readings beyond what any joint of the spine does."""
    motion = cohort.motion
    assert motion is not None
    for column in COORDINATE_COLUMNS:
        limit = LARGEST_DEG if column.endswith("_deg") else LARGEST_MM
        atlas = (motion["joint"] == "C1C2") & column.endswith("_deg")
        beyond = np.flatnonzero(motion[column].abs() > np.where(atlas, ATLAS_DEG, limit))
        if len(beyond):
            row = int(beyond[0])
            place = (file_of(cohort, "motion"), first_line(cohort, "motion", row), column)
            found = f"{motion[column].iloc[row]:.4g}" + (
                f" and {len(beyond) - 1} more so large" if len(beyond) > 1 else ""
            )
            allowed = f"at most {limit:g} to each side: no joint of the spine moves further"
            remedy = "look for a slip of the decimal point, or a wrong unit"
            yield Doubt(Problem(*place, found, allowed, remedy), "motion")


def _ends_at_zero(motion: pd.DataFrame) -> bool:
    """Whether the last step of every cycle reads zero, as the first should."""
    last = motion.groupby(_CYCLE, sort=False)["step"].transform("max") == motion["step"]
    read = motion.loc[last, list(COORDINATE_COLUMNS)]
    return bool(read.notna().any(axis=None) and not (read.abs() > ZERO).any(axis=None))


def _step_0(cohort: Cohort) -> Iterator[Doubt]:
    """Readings at step 0 that contradict ``zeroed_at_step_0``."""
    motion = cohort.motion
    assert motion is not None
    start = motion.loc[motion["step"] == 0, list(COORDINATE_COLUMNS)]
    size = start.abs().max(axis=1)
    zeroed = cohort.zeroed_at_step_0
    if zeroed and (size > ZERO).any():
        row = int(size.index[size > ZERO][0])
        column = str(start.loc[row].abs().idxmax())
        place = (file_of(cohort, "motion"), first_line(cohort, "motion", row), column)
        found = f"{float(start[column][row]):.4g} at step 0, and zeroed_at_step_0: true"
        remedy = "set zeroed_at_step_0: false, subtract step 0, or put steps in order"
        if _ends_at_zero(motion):
            remedy = "suspected: steps in reverse order; number them as the loads"
        yield Doubt(Problem(*place, found, "0 at step 0", remedy), "zeroing", certain=True)
    read = start[size.notna()]
    cycles = len(pd.MultiIndex.from_frame(motion.loc[read.index, _CYCLE]).unique())
    if not zeroed and cycles >= CYCLES and cohort.measurement_sd and not (size > 0.0).any():
        row = int(read.index[0])
        place = (file_of(cohort, "motion"), first_line(cohort, "motion", row), "step")
        found = f"exactly 0 in all readings at step 0 of {cycles} cycles"
        allowed = "readings with their error, where zeroed_at_step_0 is false"
        remedy = "suspected: step 0 was subtracted; set zeroed_at_step_0: true in cohort.yaml"
        yield Doubt(Problem(*place, found, allowed, remedy), "zeroing")
