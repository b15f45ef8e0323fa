"""Which errors a stage is told by: of fits to one load case, or of fits to all of them."""

import pandas as pd

from spinepipe.studies.fitted_to import joint_label, label_of_others

LITERATURE, FITTED = "literature", "fitted"
LEFT_OUT_SPECIMEN, LEFT_OUT_CASE = "left_out_specimen", "left_out_case"


def of_single_cases(errors: pd.DataFrame, stage: str) -> pd.DataFrame:
    """Errors of a stage under each test, of the fits to that test alone, as published."""
    return _of(errors, stage, errors["fitted_to"] == errors["test"])


def of_joint_fits(errors: pd.DataFrame, stage: str) -> pd.DataFrame:
    """Errors of a stage under each test, of the fits to all tests together."""
    return _of(errors, stage, errors["fitted_to"] == joint_label_of(errors))


def joint_label_of(table: pd.DataFrame) -> str:
    """What fits to all load cases are called in a table."""
    return joint_label(_labels(table))


def _labels(table: pd.DataFrame) -> list[str]:
    """Labels of a table, with tests whose own fits may have left no row."""
    return [*table["fitted_to"].unique(), *(table["test"].unique() if "test" in table else ())]


def _of(errors: pd.DataFrame, stage: str, fits: pd.Series) -> pd.DataFrame:
    if stage == LITERATURE:
        return errors[errors["stage"] == LITERATURE]
    if stage == LEFT_OUT_CASE:
        fits = _to_all_others(errors)
    return errors[(errors["stage"] == stage) & fits]


def _to_all_others(errors: pd.DataFrame) -> pd.Series:
    """Which were fitted to all tests but that of the row."""
    labels = _labels(errors)
    others = {test: label_of_others(labels, test) for test in errors["test"].unique()}
    return errors["fitted_to"] == errors["test"].map(others)
