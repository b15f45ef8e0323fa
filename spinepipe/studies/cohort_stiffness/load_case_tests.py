"""Does stiffness hang on the load case? Separate fits per load case against one joint fit."""

from collections.abc import Iterator

import pandas as pd

from spinepipe.jobs.cohort_stiffness.criteria import SHARED_ERROR
from spinepipe.jobs.tested_rows import Tested
from spinepipe.statistics import Ended, Outcome, f_test_nested
from spinepipe.statistics.nested import NESTED
from spinepipe.studies.fitted_to import ALL, POOLED, joint_label, load_cases

FAMILY = "load_case_specific"


def load_case_specific(fits: pd.DataFrame) -> Iterator[Tested]:
    """The extra sum of squares F test for each specimen and each plain representation.

    Pooled fits are no least squares fits: they are drawn towards the cohort.
    """
    plain = fits[fits["representation"] != POOLED]
    for (representation, specimen), rows in plain.groupby(
        ["representation", "specimen"], sort=False
    ):
        family = f"{FAMILY}/{representation}"
        outcome = _without(SHARED_ERROR) if _correlated(rows) else nested_fits(rows)
        yield Tested(family, "*", "stiffness", "load case", "", outcome, str(specimen))


def nested_fits(rows: pd.DataFrame) -> Outcome:
    """The test for the fits of one specimen in one representation."""
    if joint_label(rows["fitted_to"]) != ALL:
        return _without("one load case only: nothing to compare")
    joint = rows[rows["fitted_to"] == ALL]
    single = rows[rows["fitted_to"].isin(load_cases(rows["fitted_to"]))]
    single = single[single["readings"] > 0]  # the specimen has no such load case
    if joint["cost"].isna().any() or joint.empty or single["cost"].isna().any():
        return _without("a fit is missing")
    if len(single) < 2:
        return _without("one load case only: nothing to compare")
    readings, unknowns = int(joint["readings"].sum()), int(joint["unknowns"].sum())
    if readings != int(single["readings"].sum()):
        return _without("the fits are not to the same readings")
    free = readings - int(single["unknowns"].sum())
    costs = float(joint["cost"].sum()), float(single["cost"].sum())
    return f_test_nested(costs[0], readings - unknowns, costs[1], free)


def _correlated(rows: pd.DataFrame) -> bool:
    """Whether a fit says that its sum of squares is not one of independent errors."""
    notes = rows["message"] if "message" in rows else pd.Series(dtype=str)
    return bool(notes.str.contains(SHARED_ERROR, regex=False).any())


def _without(message: str) -> Outcome:
    return NESTED.without(Ended.TOO_FEW, 0, message)
