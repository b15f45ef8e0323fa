"""Readings and loads that no test gives: constant, repeated, copied, silent, slipped, unsigned.

What a single number cannot show: it is compared with other columns, rows and tables.
"""

from collections.abc import Iterator, Sequence
from itertools import combinations
from typing import Any

import numpy as np
import pandas as pd

from spinepipe.cohort.cohort import Cohort, Group
from spinepipe.cohort.load_tests import DRIVEN
from spinepipe.plausibility.score import suspect, usual
from spinepipe.plausibility.warnings.columns import beyond_ranges, declared_errors
from spinepipe.plausibility.warnings.lengths import COLUMNS
from spinepipe.plausibility.warnings.warning import PlausibilityWarning, TableCell, warn
from spinepipe.units import COORDINATE_COLUMNS, DEG_PER_RAD, MM_PER_M

LOADS = ["fx_n", "fy_n", "fz_n", "mx_nm", "my_nm", "mz_nm"]
READ = list(COORDINATE_COLUMNS)
MOMENTS = {f"{name}_deg": f"m{axis}_nm" for name, axis in zip(DRIVEN, "xyz", strict=True)}
"""Column of loads.csv that drives each rotation."""

ENOUGH = 4
"""Numbers of a test, not zero, among which one can stand out; readings alike that are no chance."""

COPIED = 12
"""Readings, not zero, at least, of which two thirds differ, before equal ones are no chance."""

SURE_SDS = 100.0
"""Two or three readings alike to the last digit are no chance where their SD is so small."""

CYCLES = 6
"""Cycles of tests whose step 0 reads exactly zero before that is no chance."""

ZERO = 1e-6
"""deg, mm: what rounding leaves of a reading less itself."""

PART_OF_LARGEST = 0.2
"""Of the largest reading: a last step that stands first has more, what a mean leaves has less."""

SHARE_OF_SD = 0.2
"""Of the SD of a reading: at least eight readings that are all smaller have no such error."""

_CYCLE = ["specimen", "test", "cycle"]

Warnings = Iterator[PlausibilityWarning]


def _sd_of(cohort: Cohort, column: str) -> float:
    """Of one reading as the cohort says, deg or mm; 0 where it does not."""
    sd = cohort.measurement_sd
    if sd is None:
        return 0.0
    return sd.rotation_deg if column.endswith("_deg") else sd.translation_mm


# --- readings and loads as a whole ----------------------------------------------------------------


def readings(cohort: Cohort) -> Warnings:
    """Errors, loads and motion as columns of numbers."""
    yield from declared_errors(cohort)
    yield from beyond_ranges(cohort, "landmark_sd")
    yield from _repeated(cohort)
    motion, loads = cohort.motion, cohort.loads
    if motion is not None and loads is not None:
        yield from _unloaded(cohort, motion, loads)
        yield from _unmoved(cohort, motion)
        yield from _read_unloaded(cohort, motion, loads)
        constant = list(_constant(cohort, motion))
        yield from constant
        yield from _never(cohort, motion)
        yield from _absurd(cohort, motion)
        yield from () if constant else _step_0(cohort, motion)
    if loads is not None:
        yield from _slips(cohort, "loads", loads, LOADS)
        yield from _times(cohort, loads)
    if motion is not None:
        yield from _slips(cohort, "motion", motion, READ)
        yield from _silent(cohort, motion)
        yield from _copies(cohort, motion)
        yield from () if loads is None else _unsigned(cohort, motion, loads)


def too_small(cohort: Cohort) -> Warnings:
    """Loads and motion too small whatever joint answers them, where no answer can be judged."""
    motion, loads = cohort.motion, cohort.loads
    if motion is None or loads is None:
        return
    yield from beyond_ranges(cohort, "largest_force", "largest_moment")
    sizes = motion[READ[3:]].abs().fillna(0.0)
    turned = float(sizes.to_numpy().max(initial=0.0))
    moment = float(loads[LOADS[3:]].abs().to_numpy().max(initial=0.0))
    force = float(loads[LOADS[:3]].abs().to_numpy().max(initial=0.0))
    tested = usual("tested_with_force").holds(force) or usual("tested_with_moment").holds(moment)
    if tested and turned > 0.0 and not usual("largest_rotation").holds(turned):
        row = int(np.argmax(sizes.max(axis=1)))
        place = TableCell("motion", row, str(sizes.iloc[row].idxmax()))
        yield warn(cohort, "largest_rotation", place, factor=DEG_PER_RAD, value=turned)
    for column in READ:
        read = motion[column].dropna().abs()
        read = read[read > ZERO]
        error = _sd_of(cohort, column)
        if len(read) >= 8 and float(read.max()) < SHARE_OF_SD * error:
            turns = column.endswith("_deg")
            name = "rotations_below_sd" if turns else "translations_below_sd"
            place = TableCell("motion", read.index[0], column)
            factor = DEG_PER_RAD if turns else MM_PER_M
            yield warn(cohort, name, place, factor=factor, value=read.max(), sd=error)


def _repeated(cohort: Cohort) -> Warnings:
    """Two columns with the same numbers in every row."""
    groups: tuple[tuple[str, Sequence[str], Group], ...] = (
        ("motion", READ, "motion"),
        ("loads", LOADS, "loads"),
        ("joints", COLUMNS["landmarks"], "lengths"),
        ("landmarks", COLUMNS["landmarks"], "lengths"),
        ("bodies", COLUMNS["bodies"], "lengths"),
    )
    for stem, columns, group in groups:
        table: Any = getattr(cohort, stem)
        for first, second in combinations(columns if table is not None else (), 2):
            values = table[first]
            given = values.notna() & (values != 0.0)
            if values.equals(table[second]) and values[given].nunique() > 1:
                place = TableCell(stem, given.idxmax(), second)
                yield warn(cohort, "column_repeated", place, group=group, first=first)


def _held(cohort: Cohort, test: object) -> bool:
    """Whether something but the loads of its steps may move the spine in a test."""
    tables = (cohort.supports, cohort.preload)
    return any(t is not None and bool(t["test"].isin([test, "*"]).any()) for t in tables)


def _unloaded(cohort: Cohort, motion: pd.DataFrame, loads: pd.DataFrame) -> Warnings:
    """Tests with motion whose loads are all zero."""
    for test, rows in loads.groupby("test", sort=False):
        loaded = (rows[[*LOADS, "follower_n"]].fillna(0.0) != 0.0).any(axis=None)
        moved = motion.loc[motion["test"] == test, READ].fillna(0.0).ne(0.0).any(axis=None)
        if moved and not loaded and not _held(cohort, test):
            place = TableCell("loads", rows.index[0], f"{LOADS[0]} to {LOADS[-1]}")
            yield warn(cohort, "motion_without_load", place, count=len(rows), test=test)


def _unmoved(cohort: Cohort, motion: pd.DataFrame) -> Warnings:
    """Specimens that do not move at all under the loads of a test."""
    for (specimen, test), rows in motion.groupby(["specimen", "test"], sort=False):
        later = rows.loc[rows["step"] > 0, READ]
        if later.notna().any(axis=None) and not later.fillna(0.0).ne(0.0).any(axis=None):
            place = TableCell("motion", rows.index[0], str(later.notna().any().idxmax()))
            yield warn(cohort, "load_without_motion", place, whose=[specimen], test=test)


def _read_unloaded(cohort: Cohort, motion: pd.DataFrame, loads: pd.DataFrame) -> Warnings:
    """Tests whose only readings stand beside steps without load."""
    for test, rows in loads.groupby("test", sort=False):
        loaded = set(rows.loc[(rows[LOADS] != 0.0).any(axis=1), "step"])
        own = motion[motion["test"] == test]
        read = own[own[READ].fillna(0.0).ne(0.0).any(axis=1)]
        if loaded and len(read) and not read["step"].isin(loaded).any() and not _held(cohort, test):
            place = TableCell("motion", read.index[0], "step")
            yield warn(cohort, "motion_at_unloaded_steps", place, test=test)


def _constant(cohort: Cohort, motion: pd.DataFrame) -> Warnings:
    """Columns of motion with one number, not zero, in all rows of a specimen."""
    for column in READ:
        told = {}
        for specimen, values in motion.groupby("specimen", sort=False)[column]:
            read = values.dropna()
            sd = _sd_of(cohort, column)
            if len(read) < 2 or read.nunique() != 1 or read.iloc[0] == 0.0:
                continue
            if len(read) >= ENOUGH or (sd > 0.0 and abs(read.iloc[0]) > SURE_SDS * sd):
                told[str(specimen)] = read
        if told:
            read = next(iter(told.values()))
            place, value = TableCell("motion", read.index[0], column), read.iloc[0]
            yield warn(cohort, "column_constant", place, value=value, count=len(read), whose=told)


def _never(cohort: Cohort, motion: pd.DataFrame) -> Warnings:
    """Rotations that are zero in every row, beside motion that is not."""
    moved = [name for name in READ if motion[name].fillna(0.0).ne(0.0).any()]
    for column in READ[3:] if moved else ():
        read = motion[column].dropna()
        if len(read) and column not in moved and (motion.loc[read.index, "step"] > 0).any():
            place = TableCell("motion", read.index[0], column)
            yield warn(cohort, "column_zero", place, count=len(read))


def _absurd(cohort: Cohort, motion: pd.DataFrame) -> Warnings:
    """Single readings beyond what any joint of the spine does."""
    for column in READ:
        turns = column.endswith("_deg")
        limit = usual("joint_rotation" if turns else "joint_translation").high
        atlas = (motion["joint"] == "C1C2") & turns
        most = np.where(atlas, usual("atlas_rotation").high, limit)
        beyond = motion.index[motion[column].abs() > most]
        if len(beyond):
            more = f" and {len(beyond) - 1} more so large" if len(beyond) > 1 else ""
            place, value = TableCell("motion", beyond[0], column), motion.loc[beyond[0], column]
            yield warn(cohort, "reading_absurd", place, value=value, more=more, limit=limit)


def _step_0(cohort: Cohort, motion: pd.DataFrame) -> Warnings:
    """Readings at step 0 that contradict ``zeroed_at_step_0``."""
    start = motion.loc[motion["step"] == 0, READ].abs()
    size = start.max(axis=1).dropna()
    if cohort.zeroed_at_step_0:
        if (size > ZERO).any():
            row = size.index[size > ZERO][0]
            column = str(start.loc[row].idxmax())
            last = motion.groupby(_CYCLE, sort=False)["step"].transform("max") == motion["step"]
            end = motion.loc[last, READ].abs()
            turned = bool(end.notna().any(axis=None) and not (end > ZERO).any(axis=None))
            # a loop ends at 0 as well, and what a mean leaves is no end of a loop
            turned &= start.loc[row, column] > PART_OF_LARGEST * motion[column].abs().max()
            name = "step_0_at_the_end" if turned else "step_0_not_zero"
            yield warn(
                cohort, name, TableCell("motion", row, column), value=motion.loc[row, column]
            )
        return
    cycles = len(motion.loc[size.index, _CYCLE].drop_duplicates())
    if cycles >= CYCLES and cohort.measurement_sd and not (size > 0.0).any():
        yield warn(cohort, "step_0_zero", TableCell("motion", size.index[0], "step"), cycles=cycles)


# --- single readings and series -------------------------------------------------------------------


def _slips(cohort: Cohort, stem: str, table: pd.DataFrame, columns: Sequence[str]) -> Warnings:
    """The one number of a test that is several times as large as all others of its column."""
    for column in columns:
        for (specimen, test), values in table.groupby(["specimen", "test"], sort=False)[column]:
            sizes = values.abs().dropna().sort_values()
            sizes = sizes[sizes > 0.0]
            if len(sizes) < ENOUGH or sizes.iloc[-1] < usual("slip").high * sizes.iloc[-2]:
                continue
            row, next_one = sizes.index[-1], sizes.iloc[-2]
            if sizes.iloc[0] <= sizes.iloc[-1] / 10.0 <= 2.0 * next_one:
                value = float(values[row])
                yield warn(
                    cohort,
                    "slip",
                    TableCell(stem, row, column),
                    group="loads" if stem == "loads" else "motion",
                    whose=[specimen],
                    test=test,
                    value=value,
                    next=next_one,
                    mended=value / 10.0,
                )
                break


def _times(cohort: Cohort, loads: pd.DataFrame) -> Warnings:
    """Steps so long or so short that times are in another unit."""
    if "time_s" not in loads or loads["time_s"].isna().all():
        return
    steps = loads.groupby(_CYCLE, dropna=False, sort=False)["time_s"].diff()
    steps = steps[steps > 0.0]
    if len(steps) and not usual("time_step").holds(typical := float(steps.median())):
        unit = suspect("time_step", typical, "time_step")
        place = TableCell("loads", steps.index[0], "time_s")
        remedy, factor = (unit.mend(), unit.factor) if unit else (None, None)
        yield warn(cohort, "time_step", place, remedy=remedy, factor=factor, value=typical)


def _silent(cohort: Cohort, motion: pd.DataFrame) -> Warnings:
    """Joints that read exactly zero under load while others of their specimen move."""
    told = set()
    for (specimen, test), rows in motion[motion["step"] > 0].groupby(
        ["specimen", "test"], sort=False
    ):
        moved = rows[READ].fillna(0.0).ne(0.0).any(axis=1).groupby(rows["joint"]).any()
        read = rows[READ].notna().any(axis=1).groupby(rows["joint"]).any()
        for joint in moved.index[~moved & read] if moved.any() else ():
            if joint not in told:
                told.add(joint)
                own = rows[rows["joint"] == joint]
                place = TableCell("motion", own.index[0], str(own[READ].notna().any().idxmax()))
                yield warn(cohort, "joint_silent", place, whose=[specimen], joint=joint, test=test)


def _copies(cohort: Cohort, motion: pd.DataFrame) -> Warnings:
    """Cycles, or specimens, with the very same readings as another."""
    seen: dict[bytes, tuple[object, ...]] = {}
    told = set()
    for place, rows in motion.groupby(_CYCLE, sort=False):
        values = rows.sort_values(["step", "joint"])[READ].to_numpy(float)
        read = values[np.isfinite(values) & (values != 0.0)]
        if len(read) < COPIED or len(np.unique(read)) < 2 * len(read) / 3:
            continue
        first = seen.setdefault(np.nan_to_num(values, nan=1e9).tobytes(), place)
        which = next(
            (name for name, a, b in zip(_CYCLE, first, place, strict=True) if a != b), None
        )
        if which is not None and which not in told:
            told.add(which)
            said = [f"{one[0]}, test {one[1]}, cycle {one[2]}" for one in (first, place)]
            at = TableCell("motion", rows.index[0], which)
            yield warn(cohort, "readings_copied", at, first=said[0], second=said[1])


def _unsigned(cohort: Cohort, motion: pd.DataFrame, loads: pd.DataFrame) -> Warnings:
    """Rotations that are never negative, in tests to both sides."""
    for column in READ[3:]:
        moment = MOMENTS[column]
        large = loads[moment].abs().max()
        both = loads[moment].min() <= -0.5 * large and loads[moment].max() >= 0.5 * large
        turned = motion.loc[motion[column].fillna(0.0) != 0.0, column]
        if large > 0.0 and both and len(turned) >= COPIED and (turned > 0.0).all():
            place, count = TableCell("motion", turned.index[0], column), len(turned)
            yield warn(cohort, "signs_lost", place, count=count, moment=moment, column=column)
