"""Films that no spine makes: another unit, axes exchanged, tilts in radians or turned."""

from collections import defaultdict
from collections.abc import Iterator, Mapping
from itertools import pairwise

import numpy as np
import pandas as pd

from spinepipe.anatomy.levels import SIZE_SPREAD, spacing_mm
from spinepipe.cohort import Cohort
from spinepipe.cohort.answers import of_specimens, typical
from spinepipe.cohort.doubt import Doubt, Group
from spinepipe.cohort.doubtful_places import UNITS, unit_like
from spinepipe.problems import Problem
from spinepipe.studies.scoliosis.films import CENTRE, CORNERS, Film, by_reading, corners, placed
from spinepipe.units import DEG_PER_RAD, MM_PER_M

TILTED_DEG = 4.0
"""Root mean square of the line through the centres, below which it tells no sign."""

AGAINST, WITH = -0.7, 0.7
"""Correlation of tilts with that line; those of a film go with it."""

RADIANS = (0.3 / DEG_PER_RAD, 3.0 / DEG_PER_RAD)
"""Tilts over those of the line, where they are radians."""

_Fault = tuple[str, str, str, str, Group, bool]
"""Column, found, allowed, remedy, group, whether certain."""


def doubts(cohort: Cohort) -> Iterator[Doubt]:
    """Doubts about films and patients, one line for each fault; its size is that of the first."""
    films = cohort.further.get("films")
    if films is None:
        return
    told: dict[tuple[str, str], list[tuple[str, int, _Fault]]] = defaultdict(list)
    seen: dict[bytes, str] = {}
    for patient, rows in films.groupby("specimen", sort=False):
        faults = list(_faults(cohort, rows))
        numbers = rows[list(CENTRE) if rows[list(CENTRE)].notna().any(axis=None) else list(CORNERS)]
        first = seen.setdefault(np.nan_to_num(numbers.to_numpy(float)).tobytes(), str(patient))
        if first != patient:
            found, remedy = f"the very films of {first}", "suspected: rows copied; put in its own"
            faults.append(("specimen", found, "films of its own", remedy, "motion", False))
        for fault in faults:
            told[fault[0], fault[3]].append((str(patient), int(rows.index[0]), fault))
    for places in told.values():
        whose = of_specimens(dict.fromkeys(name for name, *_ in places), cohort.specimen_names)
        _, line, (column, found, allowed, remedy, group, certain) = places[0]
        place = (f"{cohort.name}/films.csv", line, column)
        yield Doubt(Problem(*place, f"{found} ({whose})", allowed, remedy), group, certain)
    yield from _cobb(cohort)


def _faults(cohort: Cohort, rows: pd.DataFrame) -> Iterator[_Fault]:
    """What is wrong with the films of a patient, the first thing that hides the rest."""
    films = []
    for _, film in rows.groupby("position", sort=False):
        for reading in by_reading(film):
            if sorted(reading["vertebra"]) == sorted(cohort.vertebrae) and _whole(reading):
                films.append(placed(reading, cohort.vertebrae))
    if not films:
        return
    as_corners = bool(rows[list(CORNERS)].notna().all(axis=None))
    if as_corners and (fault := _corners(rows)) is not None:
        yield fault
        return
    fault = _direction(films, as_corners) or _size(cohort, films, as_corners)
    if fault is not None or (not as_corners and (fault := _tilts(films)) is not None):
        yield fault


def _whole(rows: pd.DataFrame) -> bool:
    return bool(
        rows[list(CENTRE)].notna().all(axis=None) or rows[list(CORNERS)].notna().all(axis=None)
    )


def _direction(films: list[Film], as_corners: bool) -> _Fault | None:
    """Spines that lie, or stand on their heads."""
    up = float(np.median([film.up[-1] - film.up[0] for film in films]))
    across = float(np.median([abs(film.right[-1] - film.right[0]) for film in films]))
    y, z = (CORNERS[0], CORNERS[1]) if as_corners else CENTRE[:2]
    allowed = "vertebrae above each other along z"
    if abs(up) < across:
        remedy = f"suspected: {y} and {z} exchanged; exchange them back"
        return y, "spines that lie along y", allowed, remedy, "postures", True
    if up < 0.0:
        remedy = f"suspected: the sign of {z}: counted downwards, or names of vertebrae in reverse"
        return z, "upper vertebrae below lower ones", allowed, remedy, "postures", True
    return None


def _size(cohort: Cohort, films: list[Film], as_corners: bool) -> _Fault | None:
    """Neighbouring centres much nearer or farther than those of their levels."""
    levels = [spacing_mm(name) for name in cohort.vertebrae]
    pairs = [
        (k, (low + high) / 2.0)
        for k, (low, high) in enumerate(pairwise(levels))
        if low is not None and high is not None
    ]
    ratios = [
        MM_PER_M * float(np.hypot(np.diff(film.right)[k], np.diff(film.up)[k])) / usual
        for film in films
        for k, usual in pairs
    ]
    size = typical(ratios) if ratios else 1.0
    if size > 0.0 and abs(np.log(size)) <= np.log(SIZE_SPREAD):
        return None
    unit = unit_like(size) if size > 0.0 else None
    column = CORNERS[0] if as_corners else CENTRE[0]
    names = "all corners" if as_corners else "y_mm, z_mm"
    remedy = (
        "look at the unit of lengths"
        if unit is None
        else f"suspected: {UNITS[unit]} and not mm; multiply {names} by {round(unit, 4):g}"
    )
    found = f"vertebrae {size:.1g} times as far apart as in a spine"
    allowed = f"1/{SIZE_SPREAD:g} to {SIZE_SPREAD:g} times the mean of the level"
    return column, found, allowed, remedy, "lengths", unit is not None


def _tilts(films: list[Film]) -> _Fault | None:
    """Tilts beside the line through the centres."""
    line = np.array([np.arctan2(np.gradient(f.right), np.gradient(f.up)) for f in films])
    tilt = np.array([film.tilt for film in films])
    line, tilt = line[:, 1:-1].ravel(), tilt[:, 1:-1].ravel()
    name, allowed = CENTRE[2], "degrees that go with the line of the centres"
    if DEG_PER_RAD * float(np.sqrt(np.mean(line**2))) < TILTED_DEG:
        return None
    if np.ptp(tilt) == 0.0:
        remedy = "suspected: a column filled down; put in the tilts"
        return name, "the same tilt of every vertebra", allowed, remedy, "motion", False
    alike = float(tilt @ line) / float(np.linalg.norm(tilt) * np.linalg.norm(line))
    share = float(np.linalg.norm(tilt) / np.linalg.norm(line))
    if alike < AGAINST:
        remedy = f"suspected: the sign of {name}, or of y_mm; turn it"
        return name, "tilts against the line of the centres", allowed, remedy, "postures", False
    if alike > WITH and RADIANS[0] < share < RADIANS[1]:
        remedy = f"suspected: radians and not degrees; multiply {name} by 57.3"
        found = f"tilts {share:.3g} times those of the line of the centres"
        return name, found, allowed, remedy, "postures", False
    return None


def _corners(rows: pd.DataFrame) -> _Fault | None:
    """Upper corners below lower ones, left ones to the right."""
    corner: Mapping[str, np.ndarray] = corners(rows)
    upper = corner["upper_left"] + corner["upper_right"]
    lower = corner["lower_left"] + corner["lower_right"]
    left = corner["upper_left"] + corner["lower_left"]
    right = corner["upper_right"] + corner["lower_right"]
    allowed = "upper corners above (z), left ones to the left (y)"
    up, across = (
        float(np.median((a - b)[:, k])) for a, b, k in ((upper, lower, 1), (left, right, 0))
    )
    height, width = (
        float(np.median(np.hypot(*(a - b).T))) for a, b in ((upper, lower), (left, right))
    )
    if abs(up) < 0.5 * height and abs(across) < 0.5 * width:
        remedy = "suspected: columns of y and z exchanged; exchange them back"
        return CORNERS[0], "vertebrae that lie on their sides", allowed, remedy, "postures", True
    if up < 0.0:
        remedy = "suspected: upper and lower corners exchanged, or z counted downwards"
        return CORNERS[1], "upper corners below lower ones", allowed, remedy, "postures", True
    if across < 0.0:
        remedy = "suspected: left and right corners exchanged, or y counted to the right"
        return CORNERS[0], "left corners to the right", allowed, remedy, "postures", True
    return None


def _cobb(cohort: Cohort) -> Iterator[Doubt]:
    """Cobb angles in radians."""
    patients = cohort.further.get("patients")
    if patients is None or "cobb_deg" not in patients or patients["cobb_deg"].isna().all():
        return
    largest = float(patients["cobb_deg"].max())
    if 0.0 < largest < 3.2:
        place = (f"{cohort.name}/patients.csv", int(str(patients["cobb_deg"].idxmax())), "cobb_deg")
        remedy = "suspected: radians and not degrees; multiply cobb_deg by 57.3"
        problem = Problem(*place, f"at most {largest:.3g}", "degrees; a curve has 10", remedy)
        yield Doubt(problem, "persons")
