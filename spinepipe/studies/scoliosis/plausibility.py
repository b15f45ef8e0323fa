"""Films that no spine makes: another unit, axes exchanged, tilts in radians or turned."""

from collections import defaultdict
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.cohort.load_response import typical
from spinepipe.plausibility.score import suspect, usual
from spinepipe.plausibility.warnings.columns import beyond_ranges
from spinepipe.plausibility.warnings.levels import spacing_mm
from spinepipe.plausibility.warnings.warning import PlausibilityWarning, TableCell, warn
from spinepipe.studies.scoliosis.films import (
    CENTRE,
    CORNERS,
    Film,
    by_reading,
    corners,
    film_of_rows,
    read_rows,
    run_around,
)
from spinepipe.units import DEG_PER_RAD, MM_PER_M

WITH = 0.7
"""Correlation of tilts with the line through the centres: tilts are read coarsely."""


class _Fault(NamedTuple):
    """A row of `warnings.csv`, the column, the remedy of a unit, and a number of it."""

    warning: str
    column: str
    remedy: str | None = None
    number: float = 0.0


def doubts(cohort: Cohort) -> Iterator[PlausibilityWarning]:
    """Warnings about films and patients, one line for each fault; its number is of the first."""
    films = cohort.further.get("films")
    told: dict[tuple[object, ...], list[tuple[str, int, _Fault]]] = defaultdict(list)
    seen: dict[bytes, str] = {}
    for patient, rows in () if films is None else films.groupby("specimen", sort=False):
        fault = _fault(cohort, rows)
        if fault is not None:
            told[fault[:3]].append((str(patient), rows.index[0], fault))
        numbers = rows[list(CENTRE) if rows[list(CENTRE)].notna().any(axis=None) else list(CORNERS)]
        first = seen.setdefault(np.nan_to_num(numbers.to_numpy(float)).tobytes(), str(patient))
        if first != patient:
            copied = _Fault("films_copied", "specimen")
            told[*copied[:3], first].append((str(patient), rows.index[0], copied))
    for key, places in told.items():
        _, line, fault = places[0]
        y, z = CORNERS[:2] if fault.column in CORNERS else CENTRE[:2]
        yield warn(
            cohort,
            fault.warning,
            TableCell("films", line, fault.column),
            remedy=fault.remedy,
            whose=[name for name, *_ in places],
            number=fault.number,
            y=y,
            z=z,
            first=key[-1],
        )
    yield from beyond_ranges(cohort, "subject_cobb")


def _fault(cohort: Cohort, rows: pd.DataFrame) -> _Fault | None:
    """What is wrong with the films of a patient, the first thing that hides the rest."""
    films, named = [], []
    rows = rows[rows[list(CENTRE)].notna().all(axis=1) | rows[list(CORNERS)].notna().all(axis=1)]
    for _, film in rows.groupby("position", sort=False):
        for reading in by_reading(read_rows(film)):
            there = reading["vertebra"]
            names = tuple(name for name in cohort.vertebrae if (there == name).any())
            if len(there) == len(names) > 1:
                films.append(film_of_rows(reading, names))
                named.append(names)
    if not films:
        return None
    if rows[list(CORNERS)].notna().all(axis=None):
        return _corners(rows) or _direction(films, *CORNERS[:2]) or _size(films, named, CORNERS)
    found = _direction(films, *CENTRE[:2]) or _size(films, named, CENTRE[:2])
    return found or _tilts(films)


def _direction(films: list[Film], y: str, z: str) -> _Fault | None:
    """Spines that lie, or stand on their heads."""
    up = float(np.median([film.up[-1] - film.up[0] for film in films]))
    across = float(np.median([abs(film.right[-1] - film.right[0]) for film in films]))
    if abs(up) < across:
        return _Fault("films_lie", y)
    return _Fault("films_upside_down", z) if up < 0.0 else None


def _size(films: list[Film], named: list[tuple[str, ...]], columns: Sequence[str]) -> _Fault | None:
    """Centres of those read much nearer or farther than those of their levels.

    Vertebrae between that were not read make a pair seem farther; the typical pair has none.
    """
    ratios = []
    for film, read in zip(films, named, strict=True):
        apart = MM_PER_M * np.hypot(np.diff(film.right), np.diff(film.up))
        levels = pairwise(map(spacing_mm, read))
        ratios += [
            float(one) / ((low + high) / 2.0)
            for one, (low, high) in zip(apart, levels, strict=True)
            if low is not None and high is not None
        ]
    size = typical(ratios) if ratios else 1.0
    if usual("spine_size").holds(size):
        return None
    unit = suspect("length", size, "spine_size")
    names = ", ".join(columns) if len(columns) == 2 else "all corners"
    remedy = unit and unit.mend(what="lengths", columns=names)
    return _Fault("films_size" if unit else "films_of_no_size", columns[0], remedy, size)


def _tilts(films: list[Film]) -> _Fault | None:
    """Tilts beside the line through the centres."""
    lines = [np.arctan2(np.gradient(f.right), np.gradient(f.up))[1:-1] for f in films]
    line, tilt = np.concatenate(lines), np.concatenate([film.tilt[1:-1] for film in films])
    if not len(line):
        return None
    if DEG_PER_RAD * float(np.sqrt(np.mean(line**2))) < usual("film_tilt").low:
        return None
    if np.ptp(tilt) == 0.0:
        return _Fault("tilts_alike", CENTRE[2])
    # cosine between tilts and line over all films, and how large the one is beside the other
    alike = float(tilt @ line) / float(np.linalg.norm(tilt) * np.linalg.norm(line))
    share = float(np.linalg.norm(tilt) / np.linalg.norm(line))
    if alike < -WITH:
        return _Fault("tilts_against", CENTRE[2])
    unit = suspect("film_tilt_over_line", share, "film_tilt_over_line")
    if alike > WITH and unit is not None:
        return _Fault("tilts_small", CENTRE[2], unit.mend(), share)
    return None


def _corners(rows: pd.DataFrame) -> _Fault | None:
    """Corners around the vertebra, upper ones below lower ones, left ones to the right."""
    corner = corners(rows)
    if run_around(rows):
        middle = np.mean(list(corner.values()), axis=0)
        held = {}
        for name, points in corner.items():
            y, z = np.median(points - middle, axis=0)
            held[name] = f"{'upper' if z > 0.0 else 'lower'}_{'left' if y > 0.0 else 'right'}"
        pairs = [f"{name} has the corner {one}" for name, one in held.items() if name != one]
        if len(set(held.values())) < len(held):  # leaning too far for their places to tell
            pairs = ["columns do not have the corners of their names"]
        words = f"suspected: corners listed around the vertebra; {', '.join(pairs)}: rename them"
        return _Fault("corners_around", CORNERS[4], words)
    upper = corner["upper_left"] + corner["upper_right"]
    lower = corner["lower_left"] + corner["lower_right"]
    left = corner["upper_left"] + corner["lower_left"]
    right = corner["upper_right"] + corner["lower_right"]
    up, across = float(np.median((upper - lower)[:, 1])), float(np.median((left - right)[:, 0]))
    height, width = (
        float(np.median(np.hypot(*(a - b).T))) for a, b in ((upper, lower), (left, right))
    )
    if abs(up) < 0.5 * height and abs(across) < 0.5 * width:
        return _Fault("corners_aside", CORNERS[0])
    if up < 0.0:
        return _Fault("corners_upside_down", CORNERS[1])
    return _Fault("corners_left_right", CORNERS[0]) if across < 0.0 else None
