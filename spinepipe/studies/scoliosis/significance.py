"""Job: Wilcoxon's signed rank test over patients between every two models.

The value of a patient is the root mean square of its errors over the films of a group. Tests of one
measure on one group of films are a family, corrected together.
"""

from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations
from typing import Any

import pandas as pd

from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.jobs.tested_rows import FamilyTest, corrected_rows
from spinepipe.statistics import StatisticalTest, wilcoxon_signed_rank
from spinepipe.status import joined
from spinepipe.studies.scoliosis.errors import by_patient, errors_by_measure
from spinepipe.studies.scoliosis.settings import Scoliosis
from spinepipe.studies.scoliosis.tables import MEASURES, STATISTICS
from spinepipe.tables import from_rows, read_frames, write


def run(root: str, study: str, tables: list[str], output: str) -> None:
    """Write ``statistics.parquet``."""
    settings, cohort = study_of_kind(Scoliosis, root, study)
    read = read_frames(tables)
    tests = all_tests(read["positions"], read["displacements"], read["curves"])
    rows = list(corrected_rows(tests))
    write(from_rows(STATISTICS, rows), output, provenance("statistics", settings, cohort))


def all_tests(
    positions: pd.DataFrame, displacements: pd.DataFrame, curves: pd.DataFrame
) -> Iterator[FamilyTest]:
    """Every pair of models, measure by measure, on fitted and on held-out films.

    The response is the one model, the factor the other; an effect below zero says that the one has
    the smaller errors.
    """
    for group, measure, errors in errors_by_measure(positions, displacements, curves):
        values = by_patient(errors)
        for one, other in combinations(values.columns, 2):
            outcome = compared(values[one], values[other], MEASURES[measure][0])
            yield FamilyTest(f"{group}/{measure}", "*", str(one), str(other), group, outcome)


def compared(one: "pd.Series[Any]", other: "pd.Series[Any]", unit: str) -> StatisticalTest:
    """The test of two models, with who has the smaller errors and by how much in its message.

    Parameters
    ----------
    one, other : errors of the same patients in each, named as the models; NaN where one is missing.
    """
    pairs = pd.concat([one, other], axis=1)
    known = pairs.dropna()
    values = known.to_numpy(float)
    outcome = wilcoxon_signed_rank(values[:, 0], values[:, 1])
    lost = len(pairs) - len(known)
    without = f"{lost} of {len(pairs)} patients left out, without a pose in one of the two"
    return replace(
        outcome, message=joined(_smaller(known, unit), without if lost else "", outcome.message)
    )


def _smaller(known: pd.DataFrame, unit: str) -> str:
    """Which model has the smaller errors, by the median of the patients' differences."""
    if known.empty:
        return ""
    one, other = known.columns
    median = float((known[one] - known[other]).median())
    if median == 0.0:
        return f"the median difference of {one} and {other} is 0 {unit}"
    better = one if median < 0.0 else other
    return f"{better} has the smaller errors, by a median of {abs(median):.3g} {unit}"
