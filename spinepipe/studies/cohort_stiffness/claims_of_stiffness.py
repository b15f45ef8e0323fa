"""What is claimed of stiffness: that it hangs on the load case, specimen and level."""

from collections.abc import Iterator

import numpy as np
import pandas as pd
from scipy import stats
from statsmodels.stats.anova import AnovaRM

from spinepipe.statistics import mean_of
from spinepipe.statistics.outcome import SAME
from spinepipe.status import USABLE, joined
from spinepipe.studies.cohort_stiffness.claims import (
    BY_SIZE,
    NO_SUCH_FITS,
    CohortClaim,
    Row,
    sample_words,
    words,
)
from spinepipe.studies.cohort_stiffness.representations import POOLED
from spinepipe.studies.cohort_stiffness.settings import NOBODY, label_of_others
from spinepipe.studies.cohort_stiffness.significance import FAMILY
from spinepipe.studies.cohort_stiffness.stages import FACTORS, joint_label_of, own_fits

LITTLE_DEG = 0.05
"""Adjusted share of the squared error below which what is not significant is called absent."""

MARGIN = 1.1
"""A ratio that is surely within this factor of 1 is called no difference."""

SHARE = (
    "share of specimens with a significant F test (Holm) of separate against joint fits, exact "
    "binomial interval; not this share decides but p, combined over specimens (Fisher)"
)

SPECIFIC = {
    "per_joint": CohortClaim(
        "stiffness_is_load_case_specific",
        "With a stiffness for each joint, load cases ask for different stiffness.",
        SHARE,
        "",
    ),
    "per_specimen": CohortClaim(
        "uniform_stiffness_is_load_case_specific",
        "With one stiffness for all joints, load cases ask for different stiffness.",
        SHARE,
        "",
    ),
}

NO_BY_SIZE = "no by the size of this share alone: no test of its absence, so none corrected"

MISFIT = "also misfit of a uniform stiffness, which differs between load cases, counts here"

STIFFER = CohortClaim(
    "loaded_stiffness_differs",
    "A joint is stiffer, or softer, against the main moment than the other load cases tell.",
    "stiffness against the loaded coordinate, fitted to that load case, over that fitted to the "
    "others; each joint its own; mean over joints and load cases, weighted by precision, then over "
    "specimens, t interval",
    "",
)

LITTLE = 0.1
"""A share that is surely below this is called no difference."""


def load_case_findings(
    stiffness: pd.DataFrame, errors: pd.DataFrame, statistics: pd.DataFrame, significance: float
) -> Iterator[Row]:
    """Rows of the table ``findings`` about load cases."""
    for representation, claim in SPECIFIC.items():
        found = statistics[statistics["family"] == f"{FAMILY}/{representation}"]
        note = MISFIT if representation == "per_specimen" else ""
        yield load_case_claim(claim, found, significance, note)
    loaded = errors[errors["loaded"].astype(bool)]
    directions = loaded[["specimen", "test", "coordinate"]].drop_duplicates()
    ratios = loaded_ratios(stiffness[stiffness["representation"] == "per_joint"], directions)
    yield _ratio(ratios, significance)


def load_case_claim(
    claim: CohortClaim, tests: pd.DataFrame, significance: float, note: str = ""
) -> Row:
    """Yes where the F tests together are significant; no where none is and they explain little."""
    known = tests.dropna(subset="p")
    if tests.empty:
        return claim.not_asked(NO_SUCH_FITS)
    if known.empty:
        return claim.unknown(joined(*tests["message"].unique()))
    n = len(known)
    below = int((known["p_holm"] < significance).sum())
    tiny = float(np.finfo(float).tiny)  # Fisher takes the logarithm
    p = float(stats.combine_pvalues(known["p"].clip(lower=tiny).to_list()).pvalue)  # Fisher's
    ends = stats.binomtest(below, n).proportion_ci(0.95)
    explained = adjusted_share(known)
    absent = below == 0 and explained < LITTLE_DEG
    holds = "yes" if p < significance else "no" if absent else "undecided"
    found = (
        f"{below} of {n} specimens; p is combined over specimens; separate fits explain "
        f"{100 * explained:.2g} % of the squares, adjusted for their unknowns"
    )
    lost = f"no test of {len(tests) - n} specimens" if len(tests) > n else ""
    untested = NO_BY_SIZE if holds == "no" else ""
    interval = float(ends.low), float(ends.high)
    row = claim.row(holds, joined(found, untested, lost, note), below / n, interval, p, n)
    return row | {BY_SIZE: holds == "no"}


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
    # Each loaded coordinate twice: fitted to the load case alone, and to all the others.
    loaded = own.merge(directions.assign(fitted_to=directions["test"]))
    labels = stiffness["fitted_to"].unique()
    to_others = {test: label_of_others(labels, test) for test in directions["test"].unique()}
    others = own.merge(directions.assign(fitted_to=directions["test"].map(to_others)))
    both = loaded.merge(others, on=keys, suffixes=("", "_of_others"))
    error = (both["error"] ** 2 + both["error_of_others"] ** 2) ** 0.5
    return both[keys].assign(ratio=both["log"] - both["log_of_others"], error=error)


def _ratio(ratios: pd.DataFrame, significance: float) -> Row:
    """Yes where the mean differs from 1, no where it is surely near 1."""
    if ratios.empty:
        return STIFFER.unknown("no joint has both stiffnesses, constrained by the data")
    excess = mean_excess(ratios).to_numpy(float)
    mean = mean_of(excess)
    assert mean.value is not None
    spread = float(np.sqrt(np.mean((ratios["ratio"] / ratios["error"]) ** 2)))
    many = f"{len(ratios)} ratios, {spread:.2g} of their standard errors from 1 (root mean square)"
    ends = mean.interval
    p_no = None
    if ends is not None:
        # p that the mean is not between the margins: the larger of two t tests, doubled. So it is
        # below 0.05 where the 95 % interval of the mean lies between them.
        ratio = 1.0 + excess
        above = float(stats.ttest_1samp(ratio, 1.0 / MARGIN, alternative="greater").pvalue)
        below = float(stats.ttest_1samp(ratio, MARGIN, alternative="less").pvalue)
        p_no = min(1.0, 2.0 * max(above, below))
    holds = "undecided"
    if mean.p is not None and mean.p < significance:
        holds = "yes"
    elif p_no is not None and p_no < significance:
        holds = "no"
    interval = None if ends is None else (1.0 + ends[0], 1.0 + ends[1])
    value = 1.0 + mean.value
    return STIFFER.row(
        holds, joined(sample_words(mean), many), value, interval, mean.p, mean.n, p_no
    )


def mean_excess(ratios: pd.DataFrame) -> pd.Series:
    """Mean by specimen of how far the ratio is above 1, weighted by its own standard error.

    The ratio of stiffness is the other load cases' compliance over the loaded one's. Compliance
    that other load cases tell is the uncertain one and linear in the readings, so noise makes
    neither the ratio nor its weight lean to one side. A logarithm does: its error, and so its
    weight, hangs on the value itself.
    """
    # Weights by the variance of the ratio itself, to first order (ratio x SD of its logarithm)2.
    ratio = np.exp(ratios["ratio"])
    weight = (ratio * ratios["error"]) ** -2.0
    sums = ((ratio - 1.0) * weight).groupby(ratios["specimen"]).sum()
    return sums / weight.groupby(ratios["specimen"]).sum()


def stiffness_spreads(
    stiffness: pd.DataFrame, pooling: pd.DataFrame | None, significance: float
) -> Iterator[Row]:
    """Do specimens, and do levels, differ in stiffness? One finding per coordinate."""
    label = joint_label_of(stiffness)
    own = own_fits(stiffness)
    own = own[own["representation"] == "per_joint"]
    for coordinate in stiffness["coordinate"].unique():
        rows = own[own["coordinate"] == coordinate]
        for what, (factor, block) in FACTORS.items():
            other = "levels" if what == "specimens" else "specimens"
            claim = CohortClaim(
                f"stiffness_differs_between_{what}_{coordinate}",
                f"{what.capitalize()} differ in {words(str(coordinate))} stiffness: some are "
                f"stiffer than others in all {other} alike.",
                f"share of the variance of its logarithm, means of {other} removed, that lies "
                f"between {what} (intraclass correlation, exact F interval; each joint its own, "
                "all load cases)",
                "",
            )
            note = _pooled_spread(pooling, label, str(coordinate), what)
            yield share_between(claim, rows, factor, block, significance, note)


def _pooled_spread(pooling: pd.DataFrame | None, label: str, coordinate: str, what: str) -> str:
    """What the pooled fit says of the same, for the message."""
    if pooling is None:
        return ""
    here = (pooling["fitted_to"] == label) & (pooling["without"] == NOBODY)
    here &= pooling["representation"] == POOLED[0]
    rows = pooling[here & (pooling["coordinate"] == coordinate)]
    usable = rows["status"].isin(USABLE)
    if not usable.all():
        return joined("no pooled fit", *rows.loc[~usable, "message"])
    found = rows[f"between_{what}"].dropna()
    return f"pooled fit: SD of the logarithm {found.iloc[0]:.2g}" if len(found) else ""


def share_between(
    claim: CohortClaim, rows: pd.DataFrame, factor: str, block: str, significance: float, note: str
) -> Row:
    """Yes where the F test is significant, no where the share is surely small.

    The share is ICC(C,1) of McGraw and Wong 1996, doi:10.1037/1082-989X.1.1.30, Table 7.
    """
    # Logarithms (specimens, joints) of the specimens with all joints identifiable.
    known = rows[rows["identifiable"].eq(True) & rows["stiffness"].notna()]
    grid = known.pivot(index="specimen", columns="joint", values="stiffness").astype(float)
    values = grid.dropna().map(np.log)
    left_out = rows["specimen"].nunique() - len(values)
    note = joined(note, f"{left_out} specimens without all joints left out" if left_out else "")
    if min(values.shape) < 2:
        return claim.unknown(joined("at least 2 specimens with 2 joints are needed", note))
    # What specimens and levels together leave may be rounding alone.
    logs = values.to_numpy(float)
    rest = logs - logs.mean(axis=0) - logs.mean(axis=1, keepdims=True) + logs.mean()
    if np.abs(rest).max() <= SAME:
        return claim.unknown(joined("nothing is left beside specimens and levels", note))
    long = values.reset_index().melt(id_vars="specimen", var_name="joint", value_name="log")
    table = AnovaRM(long, "log", block, [factor]).fit().anova_table  # one value per cell
    f, between, within, p = (float(value) for value in table.iloc[0])
    times = values.shape[1] if block == "joint" else values.shape[0]
    # F of a share rho scales F by 1 + times rho / (1 - rho): quantiles of F make its interval.
    low = _share(f / float(stats.f.isf(0.025, between, within)), times)
    high = _share(f * float(stats.f.isf(0.025, within, between)), times)
    # Twice the chance of so small an F where the share is LITTLE: below 0.05 if high < LITTLE.
    of_little = f / (1.0 + times * LITTLE / (1.0 - LITTLE))
    p_no = min(1.0, 2.0 * float(stats.f.cdf(of_little, between, within)))
    holds = "yes" if p < significance else "no" if p_no < significance else "undecided"
    message = joined(f"F({between:.0f}, {within:.0f}) {f:.3g}", note)
    return claim.row(holds, message, _share(f, times), (low, high), p, len(values), p_no)


def _share(f: float, times: int) -> float:
    """Intraclass correlation from F, each group seen so many times; below chance counts as 0."""
    return max(0.0, (f - 1.0) / (f - 1.0 + times))
