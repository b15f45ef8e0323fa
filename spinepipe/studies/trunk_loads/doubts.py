"""Persons and tasks that are sound cell by cell and most likely wrong."""

from collections.abc import Iterator

import numpy as np

from spinepipe.cohort import Cohort
from spinepipe.cohort.doubt import Doubt
from spinepipe.problems import Problem
from spinepipe.studies.doubtful_subjects import subject_doubts
from spinepipe.studies.trunk_loads.forms import TASKS

KPA_PER_MMHG = 0.133322

PRESSURE_KPA = (0.5, 30.0)
"""In the belly: 10 to 25 kPa while lifting (Ghezelbash 2016, Table 3)."""

STRESS_MPA = (0.1, 1.5)
"""Largest active stress of muscles: 0.6 to 1.0 MPa (Ghezelbash 2016, 2.4)."""

RADIANS = 2.3
"""Rotations of trunks of all tasks that are no larger: 130 deg."""


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
    turns = [name for name in tasks.columns if name.endswith("_deg")]
    sizes = tasks[turns].abs()
    largest = float(np.nan_to_num(sizes.to_numpy()).max(initial=0.0))
    if 0.0 < largest < RADIANS and (sizes > 0.0).sum(axis=None) > 3:
        column = str(sizes.max().idxmax())
        line = int(str(sizes[column].idxmax()))
        remedy = "suspected: radians and not degrees; multiply the columns that end in _deg by 57.3"
        problem = Problem(file, line, column, f"at most {largest:.3g}", "degrees", remedy)
        yield Doubt(problem, "postures")


def _pressure(kpa: float) -> str:
    if kpa < PRESSURE_KPA[0]:
        return "suspected: MPa, or bar, and not kPa; multiply by 1000, or 100"
    return f"suspected: mmHg and not kPa; {kpa * KPA_PER_MMHG:.3g}?"


def _stress(mpa: float) -> str:
    if mpa < STRESS_MPA[0]:
        return "suspected: GPa, or a slip of the decimal point"
    return "suspected: N/cm2 or kPa and not MPa; divide by 100, or 1000"
