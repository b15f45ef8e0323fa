"""Stiffness fitted to one load case as a multiple of that fitted to all."""

import pandas as pd

from spinepipe.report.cohort.chosen import doubted
from spinepipe.studies.fitted_to import ALL, load_cases

_KEYS = ["specimen", "representation", "joint", "coordinate"]
_SHARED = ("per_specimen", "level_ratio")
"""Representations with one unknown for all joints of a specimen."""


def ratios(stiffness: pd.DataFrame, errors: pd.DataFrame) -> pd.DataFrame:
    """One row per fit to a single load case, with the ratio and its interval.

    The interval is that of the fit to the single load case alone. Where joints share an unknown,
    the first joint stands for all.

    Returns
    -------
    Columns ``fitted_to``, those of the keys, ``ratio``, ``low``, ``high``, ``doubted``, and
    ``loaded``: whether that load case drives the coordinate.
    """
    own = stiffness[stiffness["source"] == "own"]
    first = own["joint"] == own["joint"].iloc[0] if len(own) else own["joint"].notna()
    own = own[~own["representation"].isin(_SHARED) | first]
    single = own[own["fitted_to"].isin(load_cases(stiffness["fitted_to"]))]
    whole = own.loc[own["fitted_to"] == ALL, [*_KEYS, "stiffness"]]
    both = single.merge(whole.rename(columns={"stiffness": "whole"}), on=_KEYS, how="left")
    divided = {
        new: both[old].astype(float) / both["whole"].astype(float)
        for new, old in (("ratio", "stiffness"), ("low", "low"), ("high", "high"))
    }
    driven = errors[errors["loaded"].astype(bool)] if len(errors) else errors
    pairs = set(zip(driven["test"], driven["coordinate"], strict=True)) if len(errors) else set()
    loads = [key in pairs for key in zip(both["fitted_to"], both["coordinate"], strict=True)]
    return both[[*_KEYS, "fitted_to"]].assign(**divided, doubted=doubted(both), loaded=loads)
