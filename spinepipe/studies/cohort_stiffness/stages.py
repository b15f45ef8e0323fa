"""From the table ``errors``: which of its rows tell a stage, and one error per specimen of them."""

from collections.abc import Iterable, Mapping

import numpy as np
import pandas as pd

from spinepipe.studies.cohort_stiffness.settings import joint_label, label_of_others
from spinepipe.units import ROTATIONS, TRANSLATIONS

SHARED_ERROR = (
    "readings zeroed at step 0 share its error, which the published cost takes no account of"
)

LITERATURE, FITTED = "literature", "fitted"
LEFT_OUT_SPECIMEN, LEFT_OUT_CASE = "left_out_specimen", "left_out_case"

FACTORS = {"specimens": ("specimen", "joint"), "levels": ("joint", "specimen")}
"""What differs, and what it is seen in again and again: blocks of a test."""


def of_single_cases(errors: pd.DataFrame, stage: str) -> pd.DataFrame:
    """Errors of a stage under each test, of the fits to that test alone, as published."""
    return _of(errors, stage, errors["fitted_to"] == errors["test"])


def of_joint_fits(errors: pd.DataFrame, stage: str) -> pd.DataFrame:
    """Errors of a stage under each test, of the fits to all tests together."""
    return _of(errors, stage, errors["fitted_to"] == joint_label_of(errors))


def joint_label_of(table: pd.DataFrame) -> str:
    """What fits to all load cases are called in a table."""
    return joint_label(_labels(table))


def own_fits(stiffness: pd.DataFrame) -> pd.DataFrame:
    """Stiffness of each specimen's own fit to all load cases."""
    whole = stiffness["fitted_to"] == joint_label_of(stiffness)
    return stiffness[whole & (stiffness["source"] == "own")]


def _labels(table: pd.DataFrame) -> list[str]:
    """Labels of a table, with tests whose own fits may have left no row."""
    return [*table["fitted_to"].unique(), *(table["test"].unique() if "test" in table else ())]


def _of(errors: pd.DataFrame, stage: str, fits: pd.Series) -> pd.DataFrame:
    if stage == LITERATURE:
        return errors[errors["stage"] == LITERATURE]
    if stage == LEFT_OUT_CASE:  # of the fits to all tests but that of the row
        labels = _labels(errors)
        others = {test: label_of_others(labels, test) for test in errors["test"].unique()}
        fits = errors["fitted_to"] == errors["test"].map(others)
    return errors[(errors["stage"] == stage) & fits]


KINDS = {"deg": ROTATIONS, "mm": TRANSLATIONS}
"""Coordinates by the unit of their errors: those of one unit are compared."""

MOTIONS = {"deg": "rotations", "mm": "translations"}
"""What they are called."""


def unit_of(errors: pd.DataFrame) -> str:
    """The unit that errors are compared in: deg where a load drives a rotation, else mm.

    Where no load drives anything that was read: deg where rotations were.
    """
    loaded = errors[errors["loaded"].astype(bool)]
    told = loaded if len(loaded) else errors
    return "deg" if told["coordinate"].isin(ROTATIONS).any() or not len(told) else "mm"


def compared_motion(errors: pd.DataFrame, unit: str | None = None) -> pd.DataFrame:
    """The rows of motion that is compared, in a unit, or in that of these errors."""
    return errors[errors["coordinate"].isin(KINDS[unit or unit_of(errors)])]


def specimen_rms(chosen: pd.DataFrame, errors: pd.DataFrame) -> pd.Series:
    """Root mean square error by specimen, in the unit of the errors, weighted by readings.

    Only of specimens with an error for all that was measured of them: others would be compared
    over other readings.

    Parameters
    ----------
    chosen : errors of one stiffness per specimen. errors : all, for what was measured.
    """
    unit = unit_of(errors)
    seen = compared_motion(errors, unit).drop_duplicates(
        ["specimen", "test", "joint", "coordinate"]
    )
    # How many readings' places each specimen has, to be compared with how many have an error.
    measured = seen["specimen"].value_counts()
    known = compared_motion(chosen, unit).dropna(subset="rmse")
    known = known[known["readings"] > 0]
    squares = (known["rmse"].astype(float) ** 2 * known["readings"]).groupby(known["specimen"])
    by_specimen = known.groupby("specimen")["readings"]
    complete = by_specimen.size() == measured.reindex(squares.sum().index)
    return (squares.sum() / by_specimen.sum())[complete].map(np.sqrt)


def measured_specimens(errors: pd.DataFrame) -> list[str]:
    """Specimens of which the motion that is compared was measured."""
    return [str(name) for name in compared_motion(errors)["specimen"].unique()]


def without_result(found: Mapping[str, pd.Series], specimens: Iterable[str]) -> str:
    """Specimens that some candidates have no result of, and which, for a message.

    Parameters
    ----------
    found : results by specimen of each candidate, without missing values.
    """
    named = (
        (specimen, [name for name, values in found.items() if specimen not in values.dropna()])
        for specimen in sorted(specimens)
    )
    return ", ".join(f"{one} ({', '.join(failed)})" for one, failed in named if failed)


def largest_mean_motion(rows: pd.DataFrame, motion: str = "measured_peak") -> float | None:
    """Largest over specimens of the mean size of motion over joints; None without any.

    Parameters
    ----------
    rows : of one test and coordinate, each joint once. motion : column of the measured motion.
    """
    means = rows[motion].abs().groupby(rows["specimen"]).mean().dropna()
    return float(means.max()) if len(means) else None
