"""Findings about differences: of stiffness, and of errors, between specimens and levels."""

from collections.abc import Iterator

import numpy as np
import pandas as pd
from scipy import stats
from statsmodels.stats.anova import AnovaRM

from spinepipe.jobs.cohort_stiffness.claims import Claim, Row, joined, listed, words
from spinepipe.report.stage_errors import joint_label_of
from spinepipe.statics import Status
from spinepipe.statistics.mean import SAME
from spinepipe.studies.fitted_to import NOBODY

LITTLE = 0.1
"""A share whose whole interval lies below this is called no difference."""

FACTORS = {"specimens": ("specimen", "joint"), "levels": ("joint", "specimen")}
"""What differs, and what it is seen in again and again."""

ERROR_CLAIMS = {
    "per_specimen": ("", "one stiffness for all joints"),
    "level_ratio": ("level_ratio_", "the published ratio of levels"),
}


def stiffness_spreads(
    stiffness: pd.DataFrame, pooling: pd.DataFrame | None, significance: float
) -> Iterator[Row]:
    """Do specimens, and do levels, differ in stiffness? One finding per coordinate."""
    label = joint_label_of(stiffness)
    own = stiffness[(stiffness["fitted_to"] == label) & (stiffness["source"] == "own")]
    own = own[own["representation"] == "per_joint"]
    for coordinate in stiffness["coordinate"].unique():
        rows = own[own["coordinate"] == coordinate]
        for what, (factor, block) in FACTORS.items():
            claim = _spread_claim(what, str(coordinate))
            note = _pooled_spread(pooling, label, str(coordinate), what)
            yield share_between(claim, rows, factor, block, significance, note)


def _spread_claim(what: str, coordinate: str) -> Claim:
    other = "levels" if what == "specimens" else "specimens"
    return Claim(
        f"stiffness_differs_between_{what}_{coordinate}",
        f"{what.capitalize()} differ in {words(coordinate)} stiffness: some are stiffer "
        f"than others in all {other} alike.",
        f"share of the variance of its logarithm, means of {other} removed, that lies between "
        f"{what} (intraclass correlation, exact F interval; each joint its own, all load cases)",
        "",
    )


def _pooled_spread(pooling: pd.DataFrame | None, label: str, coordinate: str, what: str) -> str:
    """What the pooled fit says of the same, for the message."""
    if pooling is None:
        return ""
    here = (pooling["fitted_to"] == label) & (pooling["without"] == NOBODY)
    rows = pooling[here & (pooling["coordinate"] == coordinate)]
    usable = rows["status"].map(lambda name: Status(name).usable).astype(bool)
    if not usable.all():
        return joined("no pooled fit", *rows.loc[~usable, "message"])
    found = rows[f"between_{what}"].dropna()
    return f"pooled fit: SD of the logarithm {found.iloc[0]:.2g}" if len(found) else ""


def share_between(
    claim: Claim, rows: pd.DataFrame, factor: str, block: str, significance: float, note: str
) -> Row:
    """Yes where the F test is significant, no where the whole interval of the share is small.

    The share is ICC(C,1) of McGraw and Wong 1996, doi:10.1037/1082-989X.1.1.30, Table 7.
    """
    values = log_grid(rows)
    left_out = rows["specimen"].nunique() - len(values)
    note = joined(note, f"{left_out} specimens without all joints left out" if left_out else "")
    if min(values.shape) < 2:
        return claim.unknown(joined("at least 2 specimens with 2 joints are needed", note))
    if _additive(values):
        return claim.unknown(joined("nothing is left beside specimens and levels", note))
    f, between, within, p = _anova(values, factor, block)
    times = values.shape[1] if block == "joint" else values.shape[0]
    low = _share(f / float(stats.f.isf(0.025, between, within)), times)
    high = _share(f * float(stats.f.isf(0.025, within, between)), times)
    holds = "yes" if p < significance else "no" if high < LITTLE else "undecided"
    message = joined(f"F({between:.0f}, {within:.0f}) {f:.3g}", note)
    return claim.row(holds, message, _share(f, times), (low, high), p)


def log_grid(rows: pd.DataFrame) -> pd.DataFrame:
    """Logarithm of stiffness (specimens, joints) of the specimens with all joints identifiable."""
    known = rows[rows["identifiable"].eq(True) & rows["stiffness"].notna()]
    grid = known.pivot(index="specimen", columns="joint", values="stiffness").astype(float)
    return grid.dropna().map(np.log)


def _anova(values: pd.DataFrame, factor: str, block: str) -> tuple[float, float, float, float]:
    """F of a factor, its degrees of freedom, those of the rest, and p; one value per cell."""
    long = values.reset_index().melt(id_vars="specimen", var_name="joint", value_name="log")
    table = AnovaRM(long, "log", block, [factor]).fit().anova_table
    f, between, within, p = (float(value) for value in table.iloc[0])
    return f, between, within, p


def _additive(values: pd.DataFrame) -> bool:
    """Whether specimens and levels explain values (specimens, joints) but for rounding."""
    rest = values.to_numpy(float)
    rest = rest - rest.mean(axis=0) - rest.mean(axis=1, keepdims=True) + rest.mean()
    return bool(np.abs(rest).max() <= SAME)


def _share(f: float, times: int) -> float:
    """Intraclass correlation from F, each group seen so many times; below chance counts as 0."""
    return max(0.0, (f - 1.0) / (f - 1.0 + times))


def error_spreads(statistics: pd.DataFrame, significance: float) -> Iterator[Row]:
    """Do errors in the loaded coordinate differ between specimens, and between levels?"""
    for representation, (prefix, described) in ERROR_CLAIMS.items():
        for what in FACTORS:
            claim = Claim(
                f"{prefix}errors_differ_between_{what}",
                f"With {described}, fitted, errors in the loaded coordinate differ between {what} "
                "under some load case.",
                "largest Kendall's W of Friedman tests over load cases; p smallest, Holm",
                "",
            )
            family = statistics["family"] == f"between_{what}/{representation}/fitted"
            tests = statistics[family & (statistics["test"] == "Friedman")]
            yield _errors_differ(claim, tests[tests["response"] == "loaded_error"], significance)


def _errors_differ(claim: Claim, tests: pd.DataFrame, significance: float) -> Row:
    """Yes where a test is significant, else undecided: a small cohort cannot tell no difference."""
    known = tests.dropna(subset="p_holm")
    if known.empty:
        return claim.unknown(joined(*tests["message"].unique()) or "no such fits in this study")
    p = float(known["p_holm"].min())
    below = known.loc[known["p_holm"] < significance, "stratum"]
    message = f"significant under: {listed(list(below))}; {len(known)} load cases; no interval"
    value = float(known["effect"].max())
    return claim.row("yes" if p < significance else "undecided", message, value, None, p)
