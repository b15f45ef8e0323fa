"""Persons and tasks that are sound cell by cell and most likely wrong."""

from collections.abc import Iterator

import numpy as np
import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.cohort.doubt import Doubt
from spinepipe.problems import Problem
from spinepipe.studies.doubtful_subjects import subject_doubts
from spinepipe.studies.trunk_loads.forms import HANDS, PUSH_N, PUSH_NM, TASKS

KPA_PER_MMHG = 0.133322

PRESSURE_KPA = (0.5, 30.0)
"""In the belly: 10 to 25 kPa while lifting (Ghezelbash 2016, Table 3)."""

STRESS_MPA = (0.1, 1.5)
"""Largest active stress of muscles: 0.6 to 1.0 MPa (Ghezelbash 2016, 2.4)."""

RADIANS = 2.3
"""Rotations of trunks of all tasks that are no larger: 130 deg."""

LEAST_MM = 150.0
"""From the centre of L5S1; nearer is inside the trunk."""

LEAST_N, LEAST_NM = 1.0, 1.0
"""Less is not felt beside the weight of the trunk, 400 N."""


def doubts(cohort: Cohort) -> Iterator[Doubt]:
    """Doubts about subjects and tasks."""
    yield from subject_doubts(cohort)
    tasks = cohort.further.get(TASKS.stem)
    if tasks is None:
        return
    file = f"{cohort.name}/{TASKS.file}"
    for column, (low, high), words in (
        ("intra_abdominal_pressure_kpa", PRESSURE_KPA, _pressure),
        ("largest_stress_mpa", STRESS_MPA, _stress),
    ):
        told = tasks[column].dropna()
        odd = told[(told > 0.0) & ~told.between(low, high)]
        if len(odd):
            value, line = float(odd.iloc[0]), int(odd.index[0])
            more = f" and {len(odd) - 1} more" if len(odd) > 1 else ""
            place = (file, line, column)
            yield Doubt(
                Problem(*place, f"{value:g}{more}", f"{low:g} to {high:g}", words(value)), "loads"
            )
    yield from _angles(file, tasks)
    yield from _hands(file, tasks)
    yield from _pushes(file, tasks)


def _angles(file: str, tasks: pd.DataFrame) -> Iterator[Doubt]:
    """Rotations of all tasks that are those of one turn of a degree or two."""
    turns = [name for name in tasks.columns if name.endswith("_deg")]
    sizes = tasks[turns].abs()
    largest = float(np.nan_to_num(sizes.to_numpy()).max(initial=0.0))
    if 0.0 < largest < RADIANS and (sizes > 0.0).sum(axis=None) > 3:
        column = str(sizes.max().idxmax())
        line = int(str(sizes[column].idxmax()))
        remedy = "suspected: radians and not degrees; multiply the columns that end in _deg by 57.3"
        problem = Problem(file, line, column, f"at most {largest:.3g}", "degrees", remedy)
        yield Doubt(problem, "postures")


def _hands(file: str, tasks: pd.DataFrame) -> Iterator[Doubt]:
    places = _filled(tasks[list(HANDS)])
    away = (places**2).sum(axis=1) ** 0.5
    if len(away) and float(away.max()) < LEAST_MM:
        found = f"hands at most {away.max():.3g} mm from the centre of L5S1, in all tasks"
        place = (file, int(str(away.index[0])), HANDS[0])
        remedy = "suspected: cm, inches or m and not mm; convert the columns"
        allowed = f"{LEAST_MM:g} mm and more: outside the trunk"
        yield Doubt(Problem(*place, found, allowed, remedy), "lengths")


def _pushes(file: str, tasks: pd.DataFrame) -> Iterator[Doubt]:
    for columns, least, unit in ((PUSH_N, LEAST_N, "N"), (PUSH_NM, LEAST_NM, "N m")):
        for column in columns:
            pushes = _filled(tasks[[column]])
            if len(pushes) and (largest := float(pushes[column].abs().max())) < least:
                found = f"pushes of at most {largest:.3g} {unit} in all tasks"
                place = (file, int(str(pushes.index[0])), column)
                remedy = f"suspected: k{unit} and not {unit}; convert the column"
                allowed = f"{least:g} {unit} and more in one task"
                yield Doubt(Problem(*place, found, allowed, remedy), "loads")


def _filled(rows: pd.DataFrame) -> pd.DataFrame:
    """Rows with a number that is not nought, others nought."""
    numbers = rows.fillna(0.0)
    return numbers[(numbers != 0.0).any(axis=1)]


def _pressure(kpa: float) -> str:
    if kpa < PRESSURE_KPA[0]:
        return "suspected: MPa, or bar, and not kPa; multiply by 1000, or 100"
    return f"suspected: mmHg and not kPa; {kpa * KPA_PER_MMHG:.3g}?"


def _stress(mpa: float) -> str:
    if mpa < STRESS_MPA[0]:
        return "suspected: GPa, or a slip of the decimal point"
    return "suspected: N/cm2 or kPa and not MPa; divide by 100, or 1000"
