"""Which errors a stage is told by: of fits to one load case, or of fits to all of them."""

import pandas as pd

from spinepipe.jobs.cohort_stiffness.tested import ALL, ALL_BUT
from spinepipe.tables.cohort_stiffness import NOTHING

LITERATURE, FITTED = "literature", "fitted"
LEFT_OUT_SPECIMEN, LEFT_OUT_CASE = "left_out_specimen", "left_out_case"


def of_single_cases(errors: pd.DataFrame, stage: str) -> pd.DataFrame:
    """Errors of a stage under each test, of the fits to that test alone, as published."""
    return _of(errors, stage, errors["fitted_to"] == errors["test"])


def of_joint_fits(errors: pd.DataFrame, stage: str) -> pd.DataFrame:
    """Errors of a stage under each test, of the fits to all tests together."""
    return _of(errors, stage, errors["fitted_to"] == joint_label(errors))


def joint_label(table: pd.DataFrame) -> str:
    """What fits to all load cases are called; the one load case where there is no other."""
    labels = [label for label in table["fitted_to"].unique() if not label.startswith(ALL_BUT)]
    fitted = [label for label in labels if label != NOTHING]
    return str(fitted[0]) if len(fitted) == 1 else ALL


def _of(errors: pd.DataFrame, stage: str, fits: pd.Series) -> pd.DataFrame:
    if stage == LITERATURE:
        return errors[errors["stage"] == LITERATURE]
    if stage == LEFT_OUT_CASE:
        fits = _to_all_others(errors)
    return errors[(errors["stage"] == stage) & fits]


def _to_all_others(errors: pd.DataFrame) -> pd.Series:
    """Which were fitted to all tests but that of the row; of two tests, to the other one."""
    if errors["test"].nunique() == 2:
        return (errors["fitted_to"] != ALL) & (errors["fitted_to"] != errors["test"])
    return errors["fitted_to"] == ALL_BUT + errors["test"]
