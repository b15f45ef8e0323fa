"""Findings about load cases: does a stiffness hang on the load case it was fitted to?"""

from collections.abc import Iterator

import numpy as np
import pandas as pd
from scipy import stats

from spinepipe.jobs.cohort_stiffness.claims import Claim, Row, joined, told
from spinepipe.jobs.cohort_stiffness.load_case_tests import FAMILY
from spinepipe.statistics import mean_of
from spinepipe.studies.fitted_to import label_of_others

LITTLE = 0.05
"""Adjusted share of the squared error below which what is not significant is called absent."""

MARGIN = 1.1
"""A ratio whose whole interval lies within this factor of 1 is called no difference."""

SHARE = (
    "share of specimens with a significant F test (Holm) of separate against joint fits, exact "
    "binomial interval; not this share decides but p, combined over specimens (Fisher)"
)
SPECIFIC = {
    "per_joint": Claim(
        "stiffness_is_load_case_specific",
        "With a stiffness for each joint, load cases ask for different stiffness.",
        SHARE,
        "",
    ),
    "per_specimen": Claim(
        "uniform_stiffness_is_load_case_specific",
        "With one stiffness for all joints, load cases ask for different stiffness.",
        SHARE,
        "",
    ),
}
MISFIT = "also misfit of a uniform stiffness, which differs between load cases, counts here"
RATIO = Claim(
    "loaded_stiffness_differs",
    "A joint is stiffer, or softer, against the main moment than the other load cases tell.",
    "stiffness against the loaded coordinate, fitted to that load case, over that fitted to the "
    "others; each joint its own; mean over joints and load cases, weighted by precision, then over "
    "specimens, t interval",
    "",
)


def load_case_findings(
    stiffness: pd.DataFrame, errors: pd.DataFrame, statistics: pd.DataFrame, significance: float
) -> Iterator[Row]:
    """Rows of the table ``findings`` about load cases."""
    for representation, claim in SPECIFIC.items():
        found = statistics[statistics["family"] == f"{FAMILY}/{representation}"]
        note = MISFIT if representation == "per_specimen" else ""
        yield specific(claim, found, significance, note)
    loaded = errors[errors["loaded"].astype(bool)]
    directions = loaded[["specimen", "test", "coordinate"]].drop_duplicates()
    ratios = loaded_ratios(stiffness[stiffness["representation"] == "per_joint"], directions)
    yield _ratio(ratios, significance)


def specific(claim: Claim, tests: pd.DataFrame, significance: float, note: str = "") -> Row:
    """Yes where the F tests together are significant; no where none is and they explain little."""
    known = tests.dropna(subset="p")
    if known.empty:
        return claim.unknown(joined(*tests["message"].unique()) or "no such fits in this study")
    n = len(known)
    below = int((known["p_holm"] < significance).sum())
    tiny = float(np.finfo(float).tiny)  # Fisher takes the logarithm
    p = float(stats.combine_pvalues(known["p"].clip(lower=tiny).to_list()).pvalue)  # Fisher's
    ends = stats.binomtest(below, n).proportion_ci(0.95)
    explained = adjusted_share(known)
    absent = below == 0 and explained < LITTLE
    holds = "yes" if p < significance else "no" if absent else "undecided"
    found = (
        f"{below} of {n} specimens; p combined over specimens decides; separate fits explain "
        f"{100 * explained:.2g} % of the squares, adjusted for their unknowns"
    )
    lost = f"no test of {len(tests) - n} specimens" if len(tests) > n else ""
    interval = float(ends.low), float(ends.high)
    return claim.row(holds, joined(found, lost, note), below / n, interval, p)


def adjusted_share(tests: pd.DataFrame) -> float:
    """Mean over specimens of adjusted partial R2, 1 - (1 - R2) df_small / df_large.

    That is R2 (1 - 1 / F), of which chance alone makes 0; R2 is 0 where F is.

    Parameters
    ----------
    tests : nested F tests, with R2 in ``effect`` and F in ``statistic``.
    """
    r2, f = tests["effect"].astype(float), tests["statistic"].astype(float)
    return float((r2 * (1.0 - 1.0 / f.where(f > 0.0, 1.0))).mean())


def loaded_ratios(stiffness: pd.DataFrame, directions: pd.DataFrame) -> pd.DataFrame:
    """Logarithm of the ratio by specimen, test and joint, where the data constrain both.

    Column ``error`` is its standard error.

    Parameters
    ----------
    stiffness : rows of one representation. directions : specimen, test and loaded coordinate.
    """
    own = stiffness[(stiffness["source"] == "own") & (stiffness["at_bound"] == "no")]
    own = own[own["identifiable"].eq(True)].dropna(subset=["stiffness", "standard_error"])
    logs = np.log(own["stiffness"].astype(float)), own["standard_error"] / own["stiffness"]
    own = own.assign(log=logs[0], error=logs[1])
    own = own[own["error"] > 0.0]
    keys = ["specimen", "test", "joint", "coordinate"]
    loaded = own.merge(directions.assign(fitted_to=directions["test"]))
    labels = stiffness["fitted_to"].unique()
    to_others = {test: label_of_others(labels, test) for test in directions["test"].unique()}
    others = own.merge(directions.assign(fitted_to=directions["test"].map(to_others)))
    both = loaded.merge(others, on=keys, suffixes=("", "_of_others"))
    error = (both["error"] ** 2 + both["error_of_others"] ** 2) ** 0.5
    return both[keys].assign(ratio=both["log"] - both["log_of_others"], error=error)


def _ratio(ratios: pd.DataFrame, significance: float) -> Row:
    """Yes where the mean differs from 1, no where all of the interval is near 1."""
    if ratios.empty:
        return RATIO.unknown("no joint has both stiffnesses, constrained by the data")
    mean = mean_of(mean_excess(ratios).to_numpy(float))
    assert mean.value is not None
    spread = float(np.sqrt(np.mean((ratios["ratio"] / ratios["error"]) ** 2)))
    many = f"{len(ratios)} ratios, {spread:.2g} of their standard errors from 1 (root mean square)"
    ends = mean.interval
    holds = "undecided"
    if mean.p is not None and mean.p < significance:
        holds = "yes"
    elif ends is not None and 1.0 + ends[0] > 1.0 / MARGIN and 1.0 + ends[1] < MARGIN:
        holds = "no"
    interval = None if ends is None else (1.0 + ends[0], 1.0 + ends[1])
    return RATIO.row(holds, joined(told(mean), many), 1.0 + mean.value, interval, mean.p)


def mean_excess(ratios: pd.DataFrame) -> pd.Series:
    """Mean by specimen of how far the ratio is above 1, weighted by its own standard error.

    The ratio of stiffness is the other load cases' compliance over the loaded one's. Compliance
    that other load cases tell is the uncertain one and linear in the readings, so noise makes
    neither the ratio nor its weight lean to one side. A logarithm does: its error, and so its
    weight, hangs on the value itself.
    """
    ratio = np.exp(ratios["ratio"])
    weight = (ratio * ratios["error"]) ** -2.0
    sums = ((ratio - 1.0) * weight).groupby(ratios["specimen"]).sum()
    return sums / weight.groupby(ratios["specimen"]).sum()
