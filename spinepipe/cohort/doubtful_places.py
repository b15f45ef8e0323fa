"""Lengths that are most likely in another unit: joints too near each other, points elsewhere.

Metres for millimetres make a file unsound (`check_geometry`); centimetres and inches do not, and a
load point in another unit than the landmarks only moves the load.
"""

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from spinepipe.cohort.answers import of_specimens, typical
from spinepipe.cohort.cohort import Cohort
from spinepipe.cohort.csv_table import read_rows
from spinepipe.cohort.motion_size import LIKE, PLAUSIBLE, is_plausible
from spinepipe.cohort.specimen import joint_frames
from spinepipe.effects.contract import Array
from spinepipe.problems import Problem
from spinepipe.units import MM_PER_M

APART_MM = 35.0
"""Between neighbouring joints of the lumbar spine (Gould 2024a, Table 7: 39 mm from L1L2 to L2L3);
cervical joints are half as far apart."""

NEARER = 1.5
"""Times that another unit must bring a point nearer to its vertebra."""

UNITS = {1e3: "m", 10.0: "cm", 25.4: "inches"}
"""What a number must be multiplied by to be mm, and what it is in."""

FORCE = ("fx_n", "fy_n", "fz_n")

Origins = Mapping[str, Array]
"""(J, 3) mm of each specimen, caudal to cranial."""


def doubtful_places(cohort: Cohort) -> Iterator[Problem]:
    """Doubts about where joints, centres of mass and load points are, one for each file."""
    if not cohort.has_frames:
        return
    origins = {
        name: np.array([pose.origin for pose in joint_frames(cohort, name)]) * MM_PER_M
        for name in cohort.specimen_names
    }
    yield from _spacing(cohort, origins)
    yield from _points(cohort, origins, "bodies", ("com_x_mm", "com_y_mm", "com_z_mm"))
    yield from _points(cohort, origins, "loads", ("px_mm", "py_mm", "pz_mm"))


def first_line(cohort: Cohort, stem: str, row: int) -> int | None:
    """Line, as an editor shows it, of a row of a table, counted from 0."""
    rows, _ = read_rows(cohort.folder / f"{stem}.csv", stem)
    return None if rows is None or row >= len(rows.lines) else rows.lines[row]


def file_of(cohort: Cohort, stem: str) -> str:
    """A table's file in messages."""
    return f"{cohort.folder.resolve().name}/{stem}.csv"


def _spacing(cohort: Cohort, origins: Origins) -> Iterator[Problem]:
    """Neighbouring joints as far apart as in no spine; in all specimens that are so, at once."""
    found: dict[str, float] = {}
    for name, of_specimen in origins.items():
        apart = [float(np.linalg.norm(upper - lower)) for lower, upper in pairwise(of_specimen)]
        if apart and not is_plausible(typical(apart) / APART_MM):
            found[name] = typical(apart)
    if not found:
        return
    size = typical(list(found.values()))
    unit = min(UNITS, key=lambda factor: abs(np.log(size * factor / APART_MM)))
    told = f"lengths in {UNITS[unit]} and not mm ({1.0 / unit:.3g})"
    likely = abs(np.log(size * unit / APART_MM)) < np.log(LIKE)
    remedy = f"suspected: {told}; convert the file" if likely else "look at the unit of lengths"
    stem = "landmarks" if cohort.joints is None else "joints"
    whose = of_specimens(found, cohort.specimen_names)
    shown = f"neighbouring joints {size:.3g} mm apart ({whose})"
    allowed = f"{APART_MM / PLAUSIBLE:g} to {APART_MM * PLAUSIBLE:g} mm in a person's spine"
    yield Problem(file_of(cohort, stem), None, "x_mm", shown, allowed, remedy)


def _points(
    cohort: Cohort, origins: Origins, stem: str, columns: Sequence[str]
) -> Iterator[Problem]:
    """Points far from their vertebra that another unit brings near it."""
    table: Any = getattr(cohort, stem)
    if table is None:
        return
    acting = table[list(columns)].notna().all(axis=1)
    if stem == "loads":
        acting &= (table[list(FORCE)] != 0.0).any(axis=1)
    units: dict[str, list[int]] = {}
    for row in np.flatnonzero(acting):
        specimen, vertebra = table["specimen"].iloc[row], table["vertebra"].iloc[row]
        point = table[list(columns)].iloc[row].to_numpy(float)
        names = cohort.specimen_names if specimen == "*" else (specimen,)
        better = {_unit(point, _near(cohort, origins[name], vertebra)) for name in names}
        if len(better) == 1 and None not in better:
            units.setdefault(str(*better), []).append(int(row))
    for unit, rows in units.items():
        found = f"{len(rows)} of {int(acting.sum())} points far from their vertebra"
        allowed = "points at or near the vertebra of their row"
        remedy = f"suspected: points in {unit} and not mm, which would be nearer; convert them"
        place = (file_of(cohort, stem), first_line(cohort, stem, rows[0]), columns[0])
        yield Problem(*place, found, allowed, remedy)


def _near(cohort: Cohort, origins: Array, vertebra: str) -> Array:
    """(3,) mm: a place in a vertebra, midway between its joints or at the only one."""
    level = cohort.vertebrae.index(vertebra)
    beside = origins[max(level - 1, 0) : level + 1]
    middle: Array = beside.mean(axis=0)
    return middle


def _unit(point: Array, near: Array) -> str | None:
    """The unit that brings a point much nearer to its vertebra; None where mm are near enough."""
    here = float(np.linalg.norm(point - near))
    if here <= APART_MM:
        return None
    factor = min(UNITS, key=lambda one: float(np.linalg.norm(one * point - near)))
    there = float(np.linalg.norm(factor * point - near))
    return UNITS[factor] if there * NEARER < here else None
