"""Preloads and prescribed motion that no rig has: kN, N mm, tension, radians, too far."""

from collections.abc import Iterator

import numpy as np
import pandas as pd

from spinepipe.cohort.cohort import Cohort
from spinepipe.cohort.doubt import Doubt
from spinepipe.cohort.doubtful_places import file_of, first_line
from spinepipe.cohort.supports import PRESCRIBED
from spinepipe.problems import Problem
from spinepipe.units import COORDINATE_COLUMNS, COORDINATES

FORCES = ["fx_n", "fy_n", "fz_n"]
MOMENTS = ["mx_nm", "my_nm", "mz_nm"]

LEAST_N, MOST_N = 5.0, 5000.0
"""Of a preload's force, chosen: from a vertebra's weight to twice what a lumbar joint carries."""

MOST_NM = 60.0
"""Of a preload's moment, chosen: eight times what spines are tested with, 7.5 N m."""

MOST_FOLLOWER_N, LEAST_FOLLOWER_N = 1500.0, 5.0

LEAST_DEG, MOST_DEG = 0.2, 40.0
LEAST_MM, MOST_MM = 0.02, 25.0
"""Of the largest prescribed motion of a test, chosen: what rigs move joints by."""


def doubtful_rigs(cohort: Cohort) -> Iterator[Doubt]:
    """Doubts about preload.csv, followers, and coordinates that supports.csv prescribes."""
    if cohort.preload is not None:
        yield from _preloads(cohort, cohort.preload)
    if cohort.loads is not None:
        yield from _followers(cohort, cohort.loads)
    if cohort.supports is not None and cohort.motion is not None:
        yield from _prescribed(cohort, cohort.supports, cohort.motion)


def _preloads(cohort: Cohort, table: pd.DataFrame) -> Iterator[Doubt]:
    forces, moments = table[FORCES].to_numpy(float), table[MOMENTS].to_numpy(float)
    sizes, turns = np.linalg.norm(forces, axis=1), np.linalg.norm(moments, axis=1)
    faults = (
        ((sizes > 0.0) & (sizes < LEAST_N), forces, FORCES, "kN and not N; multiply by 1000"),
        (sizes > MOST_N, forces, FORCES, "forces multiplied by 1000, or grams; divide them"),
        (turns > MOST_NM, moments, MOMENTS, "N mm and not N m; multiply by 0.001"),
    )
    for odd, values, columns, words in faults:
        if odd.any():
            row = int(np.argmax(odd))
            column = columns[int(np.argmax(np.abs(values[row])))]
            size = float(np.linalg.norm(values[row]))
            allowed = f"{LEAST_N:g} to {MOST_N:g} N, at most {MOST_NM:g} N m"
            yield _of(cohort, "preload", row, column, f"{size:.4g}", allowed, words)
    up = (forces[:, 1] > 0.0) & (forces[:, 1] > 0.7 * sizes)
    if up.any() and up.sum() == (sizes > 0.0).sum():
        row = int(np.argmax(up))
        words = "the sign of fy_n: compression of the spine is negative; turn it"
        found = f"{forces[row, 1]:.4g}, which pulls the spine apart"
        yield _of(cohort, "preload", row, "fy_n", found, "a preload that compresses", words)


def _followers(cohort: Cohort, table: pd.DataFrame) -> Iterator[Doubt]:
    if "follower_n" not in table:
        return
    pulled = table["follower_n"].fillna(0.0)
    odd = (pulled > 0.0) & ~pulled.between(LEAST_FOLLOWER_N, MOST_FOLLOWER_N)
    if odd.any():
        row = int(np.argmax(odd.to_numpy()))
        small = pulled.iloc[row] < LEAST_FOLLOWER_N
        words = "kN and not N; multiply by 1000" if small else "a slip of the decimal point"
        allowed = f"{LEAST_FOLLOWER_N:g} to {MOST_FOLLOWER_N:g} N"
        yield _of(cohort, "loads", row, "follower_n", f"{pulled.iloc[row]:.4g}", allowed, words)


def _prescribed(cohort: Cohort, supports: pd.DataFrame, motion: pd.DataFrame) -> Iterator[Doubt]:
    """Coordinates that are moved hardly at all, or further than joints go."""
    told = set()
    for test, coordinate, state in zip(
        supports["test"], supports["coordinate"], supports["state"], strict=True
    ):
        if state != PRESCRIBED or coordinate not in COORDINATES or coordinate in told:
            continue
        column = COORDINATE_COLUMNS[COORDINATES.index(coordinate)]
        rows = motion if test == "*" else motion[motion["test"] == test]
        size = float(rows[column].abs().max()) if len(rows) else 0.0
        turned = column.endswith("_deg")
        least, most = (LEAST_DEG, MOST_DEG) if turned else (LEAST_MM, MOST_MM)
        if not size > 0.0 or least <= size <= most:
            continue
        told.add(coordinate)
        unit = "angles in radians and not degrees; multiply by 57.3"
        unit = unit if turned else "translations in m and not mm; multiply by 1000"
        words = unit if size < least else "a slip, or another unit"
        row = int(str(rows[column].abs().idxmax()))
        found = f"prescribed motion of at most {size:.3g} (test {test})"
        yield _of(cohort, "motion", row, column, found, f"{least:g} to {most:g}", words)


def _of(
    cohort: Cohort, stem: str, row: int, column: str, found: str, allowed: str, words: str
) -> Doubt:
    place = (file_of(cohort, stem), first_line(cohort, stem, row), column)
    problem = Problem(*place, found, allowed, f"suspected: {words}")
    return Doubt(problem, "motion" if stem == "motion" else "loads")
