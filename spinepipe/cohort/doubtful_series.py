"""Single readings and series that no test gives: slips, silence, copies, lost signs, odd times."""

from collections.abc import Iterator

import numpy as np
import pandas as pd

from spinepipe.cohort.cohort import Cohort
from spinepipe.cohort.doubt import Doubt
from spinepipe.cohort.doubtful_places import file_of, first_line
from spinepipe.problems import Problem
from spinepipe.units import COORDINATE_COLUMNS

LOADS = ["fx_n", "fy_n", "fz_n", "mx_nm", "my_nm", "mz_nm"]

SLIP = 4.0
"""Times as large as the next of its test: a tenth of it lies among the others."""

ENOUGH = 4
"""Numbers of a test, not zero, among which one can stand out."""

COPIED = 12
"""Readings, not zero, at least, of which two thirds differ, before equal ones are no chance."""

LONGEST_S, SHORTEST_S = 7200.0, 1e-3
"""From step to step: nobody waits longer in a rig, and nobody reads faster."""

_CYCLE = ["specimen", "test", "cycle"]


def doubtful_series(cohort: Cohort) -> Iterator[Doubt]:
    """Doubts about loads and readings as series of numbers, one line for each column."""
    if cohort.loads is not None:
        yield from _slips(cohort, "loads", LOADS)
        yield from _times(cohort)
    if cohort.motion is not None:
        yield from _slips(cohort, "motion", list(COORDINATE_COLUMNS))
        yield from _silent(cohort)
        yield from _copies(cohort)
        yield from _unsigned(cohort)


def _slips(cohort: Cohort, stem: str, columns: list[str]) -> Iterator[Doubt]:
    """The one number of a test that is several times as large as all others of its column."""
    table: pd.DataFrame = getattr(cohort, stem)
    for column in columns:
        for (specimen, test), values in table.groupby(["specimen", "test"], sort=False)[column]:
            sizes = values.abs().dropna().sort_values()
            sizes = sizes[sizes > 0.0]
            if len(sizes) < ENOUGH or sizes.iloc[-1] < SLIP * sizes.iloc[-2]:
                continue
            row, value = sizes.index[-1], float(values[sizes.index[-1]])
            if not sizes.iloc[0] <= abs(value) / 10.0 <= 2.0 * sizes.iloc[-2]:
                continue
            place = (file_of(cohort, stem), first_line(cohort, stem, int(row)), column)
            found = f"{value:.4g} beside {sizes.iloc[-2]:.4g} at most ({specimen}, test {test})"
            remedy = f"suspected: a slip of the decimal point; {value / 10.0:.4g}?"
            problem = Problem(*place, found, f"less than {SLIP:g} times the others", remedy)
            yield Doubt(problem, "loads" if stem == "loads" else "motion")
            break


def _times(cohort: Cohort) -> Iterator[Doubt]:
    """Steps so long or so short that times are in another unit."""
    table = cohort.loads
    assert table is not None
    if "time_s" not in table or table["time_s"].isna().all():
        return
    steps = table.groupby(_CYCLE, dropna=False, sort=False)["time_s"].diff()
    steps = steps[steps > 0.0]
    if not len(steps) or SHORTEST_S <= float(steps.median()) <= LONGEST_S:
        return
    long = float(steps.median()) > LONGEST_S
    row = int(steps.index[0])
    place = (file_of(cohort, "loads"), first_line(cohort, "loads", row), "time_s")
    remedy = (
        "suspected: times in ms and not s; multiply time_s by 0.001"
        if long
        else "suspected: times in hours or minutes; multiply time_s by 3600 or 60"
    )
    found = f"{steps.median():.4g} s from step to step"
    problem = Problem(*place, found, f"{SHORTEST_S:g} to {LONGEST_S:g} s", remedy)
    yield Doubt(problem, "loads")


def _silent(cohort: Cohort) -> Iterator[Doubt]:
    """Joints that read exactly zero under load while others of their specimen move."""
    motion = cohort.motion
    assert motion is not None
    cells = list(COORDINATE_COLUMNS)
    later = motion[motion["step"] > 0]
    told = set()
    for (specimen, test), rows in later.groupby(["specimen", "test"], sort=False):
        moved = rows[cells].fillna(0.0).ne(0.0).any(axis=1).groupby(rows["joint"]).any()
        read = rows[cells].notna().any(axis=1).groupby(rows["joint"]).any()
        for joint in moved.index[~moved & read] if moved.any() else ():
            if joint in told:
                continue
            told.add(joint)
            own = rows[(rows["joint"] == joint)]
            column = str(own[cells].notna().any().idxmax())
            line = first_line(cohort, "motion", int(own.index[0]))
            found = f"zero in every reading of {joint} ({specimen}, test {test}) and of no other"
            remedy = "leave cells empty where nothing was measured"
            place = (file_of(cohort, "motion"), line, column)
            yield Doubt(Problem(*place, found, "motion under load", remedy), "motion")


def _copies(cohort: Cohort) -> Iterator[Doubt]:
    """Cycles, or specimens, with the very same readings as another."""
    motion = cohort.motion
    assert motion is not None
    seen: dict[bytes, tuple[object, object, object]] = {}
    told = set()
    for (specimen, test, cycle), rows in motion.groupby(_CYCLE, sort=False):
        values = rows.sort_values(["step", "joint"])[list(COORDINATE_COLUMNS)].to_numpy(float)
        read = values[np.isfinite(values) & (values != 0.0)]
        if len(read) < COPIED or len(np.unique(read)) < 2 * len(read) / 3:
            continue
        first = seen.setdefault(np.nan_to_num(values, nan=1e9).tobytes(), (specimen, test, cycle))
        if first == (specimen, test, cycle):
            continue
        which = next(k for k in range(3) if first[k] != (specimen, test, cycle)[k])
        column = _CYCLE[which]
        if column in told:
            continue
        told.add(column)
        line = first_line(cohort, "motion", int(rows.index[0]))
        found = (
            f"the very readings of {first[0]}, test {first[1]}, cycle {first[2]} once more as "
            f"{specimen}, test {test}, cycle {cycle}"
        )
        remedy = "suspected: rows copied; put in what was read, or delete them"
        place = (file_of(cohort, "motion"), line, column)
        yield Doubt(Problem(*place, found, "readings of its own", remedy), "motion")


def _unsigned(cohort: Cohort) -> Iterator[Doubt]:
    """Rotations that are never negative, in tests to both sides."""
    motion, loads = cohort.motion, cohort.loads
    assert motion is not None
    if loads is None:
        return
    for column, moment in zip(COORDINATE_COLUMNS[3:], ("mz_nm", "mx_nm", "my_nm"), strict=True):
        read = motion.loc[motion[column].notna(), column]
        large = loads[moment].abs().max()
        both = loads[moment].min() <= -0.5 * large and loads[moment].max() >= 0.5 * large
        turned = read[read != 0.0]
        if large > 0.0 and both and len(turned) >= COPIED and (turned > 0.0).all():
            line = first_line(cohort, "motion", int(turned.index[0]))
            place = (file_of(cohort, "motion"), line, column)
            found = f"no negative one among {len(turned)} readings, under {moment} to both sides"
            remedy = f"suspected: the sign of {column} was lost; give it to readings of one side"
            yield Doubt(Problem(*place, found, "readings of both signs", remedy), "motion")
