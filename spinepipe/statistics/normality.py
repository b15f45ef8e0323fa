"""Are the values normally distributed, and do more parameters fit better than chance would?

Of the first there are the two tests of Gould et al. 2024a, chi-squared and Kolmogorov-Smirnov, and
Lilliefors', the right one where mean and SD are estimated from the same values. Their effect size
is the skewness: 0 for a normal distribution, positive with a long upper tail. The second is the
extra sum of squares F test.
"""

from math import isfinite

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from spinepipe.statistics.outcome import (
    Array,
    ComputationStatus,
    StatisticalTest,
    Test,
    constant,
    finite,
)

BINS = 10
"""Bins of equal width before pooling, as many as MATLAB's ``chi2gof`` takes by default."""

LEAST_EXPECTED = 5.0
"""Values to expect in a tail bin at least, else chi-squared is no good approximation."""

ESTIMATED = 2
"""Parameters estimated from the values: mean and SD."""

FEWEST = 4
"""Fewer values than this are not tested (the Lilliefors table starts here)."""

CHI_SQUARED = Test("chi-squared goodness of fit, normal", "chi2", "skewness")
KOLMOGOROV_SMIRNOV = Test("Kolmogorov-Smirnov, normal", "D", "skewness")
LILLIEFORS = Test("Lilliefors, normal", "D", "skewness")

LILLIEFORS_RANGE = (0.001, 0.99)
"""Smallest and largest p in statsmodels' table; beyond it p is the end, and the message says so."""


def chi_squared_normality(values: ArrayLike) -> StatisticalTest:
    """Chi-squared goodness of fit to a normal with the values' mean and SD.

    As MATLAB's ``chi2gof`` does by default: 10 bins of equal width over the range, the outermost
    open to infinity, pooled from the tails inwards (`_pooled`); degrees of freedom = bins left - 1
    - 2, for mean and SD.
    """
    x = finite(values)
    if refused := _refused(CHI_SQUARED, x):
        return refused
    edges = np.linspace(x.min(), x.max(), BINS + 1)
    observed = np.histogram(x, edges)[0].astype(np.float64)
    # the outermost bins are open: all of the normal is expected somewhere
    inner = stats.norm.cdf(edges[1:-1], x.mean(), x.std(ddof=1))
    expected = len(x) * np.diff(np.concatenate(([0.0], inner, [1.0])))
    observed, expected = _pooled(observed, expected)
    bins = len(expected)
    if bins - 1 - ESTIMATED < 1:
        message = f"{bins} bins left after pooling, which leaves no degree of freedom: "
        message += "use Kolmogorov-Smirnov, as the paper did"
        return CHI_SQUARED.without(ComputationStatus.TOO_FEW, len(x), message)
    found = stats.chisquare(observed, expected, ddof=ESTIMATED)
    return CHI_SQUARED.done(found.statistic, found.pvalue, len(x), stats.skew(x), f"{bins} bins")


def kolmogorov_smirnov_normality(values: ArrayLike) -> StatisticalTest:
    """One-sample Kolmogorov-Smirnov test of the standardised values, as Gould et al. 2024a did.

    Its p is too large, so that it rejects too seldom, as mean and SD come from the same values; see
    `lilliefors_normality`.
    """
    x = finite(values)
    if refused := _refused(KOLMOGOROV_SMIRNOV, x):
        return refused
    found = stats.kstest(stats.zscore(x, ddof=1), "norm")
    message = "p is too large: mean and SD come from the same values (see Lilliefors)"
    return KOLMOGOROV_SMIRNOV.done(found.statistic, found.pvalue, len(x), stats.skew(x), message)


def lilliefors_normality(values: ArrayLike) -> StatisticalTest:
    """Kolmogorov-Smirnov test whose p allows for estimated mean and SD (Lilliefors 1967)."""
    x = finite(values)
    if refused := _refused(LILLIEFORS, x):
        return refused
    # Loaded here: it takes 0.6 s, and most who load this file test no normality.
    from statsmodels.stats.diagnostic import lilliefors

    statistic, p = lilliefors(x, dist="norm", pvalmethod="table")
    low, high = LILLIEFORS_RANGE
    message = f"p at most {low}" if p <= low else f"p at least {high}" if p >= high else ""
    return LILLIEFORS.done(statistic, p, len(x), stats.skew(x), message)


def _refused(test: Test, values: Array) -> StatisticalTest | None:
    """The outcome of values that cannot be tested, or None."""
    n = len(values)
    if n < FEWEST:
        return test.without(
            ComputationStatus.TOO_FEW, n, f"{n} values; at least {FEWEST} are needed"
        )
    if constant(values):
        return test.without(ComputationStatus.CONSTANT, n, "all values are the same")
    return None


def _pooled(observed: Array, expected: Array) -> tuple[Array, Array]:
    """Bins after pooling, again and again, the tail bin that expects less with its inner neighbour.

    As in ``chi2gof``, it ends when both tail bins and the bin next to each expect `LEAST_EXPECTED`,
    or two bins are left; inner bins may expect less.
    """
    while len(expected) > 2 and min(expected[[0, 1, -2, -1]]) < LEAST_EXPECTED:
        # lower of the two bins to merge: at the left end, or at the right one
        first = 0 if expected[0] < expected[-1] else len(expected) - 2
        starts = np.delete(np.arange(len(expected)), first + 1)
        observed, expected = np.add.reduceat(observed, starts), np.add.reduceat(expected, starts)
    return observed, expected


ROUNDING = 1e-9
"""Share of the smaller model's sum by which the larger one may be worse from rounding alone."""

NESTED = Test("nested models F", "F", "partial R2")


def f_test_nested(
    rss_small: float, df_small: int, rss_large: float, df_large: int
) -> StatisticalTest:
    """F test of two least squares fits to the same values, one model a special case of the other.

    For models that are not linear the F distribution is an approximation.

    Parameters
    ----------
    rss_small, rss_large : (weighted) residual sums of squares of the model with fewer and with
        more parameters, with the same weights.
    df_small, df_large : their residual degrees of freedom, values less parameters. The larger model
        has fewer.

    Returns
    -------
    F = ((rss_small - rss_large) / (df_small - df_large)) / (rss_large / df_large) and its upper
    tail p. n is ``df_large`` and no number of values; 0 where the larger model leaves none. Effect
    size: partial R2, the share of the smaller model's residual sum of squares that the further
    parameters explain. A larger model that fits worse was not fitted to the end: F is 0 then, p 1,
    and the message says so. One that fits exactly has no F: status ``constant``.

    Raises
    ------
    ValueError
        If the larger model has not fewer degrees of freedom, or a sum is negative or not finite.
    """
    if df_small <= df_large:
        raise ValueError(
            f"the larger model has the fewer degrees of freedom, found {df_small} and {df_large}"
        )
    for rss in (rss_small, rss_large):
        if not (isfinite(rss) and rss >= 0.0):
            raise ValueError(f"a sum of squares is finite and not negative, found {rss}")
    if df_large < 1:
        message = f"{df_large} degrees of freedom left by the larger model; at least 1 is needed"
        return NESTED.without(ComputationStatus.TOO_FEW, max(df_large, 0), message)
    if rss_large == 0.0:
        message = "the larger model fits exactly: no residual to compare with"
        return NESTED.without(ComputationStatus.CONSTANT, df_large, message)
    extra, gained = df_small - df_large, max(rss_small - rss_large, 0.0)
    f = (gained / extra) / (rss_large / df_large)
    message = f"F({extra}, {df_large})"
    if rss_large > rss_small * (1.0 + ROUNDING):
        message += f"; the larger model fits worse ({rss_large:.6g} against {rss_small:.6g})"
    effect = gained / rss_small if rss_small > 0.0 else 0.0
    return NESTED.done(f, stats.f.sf(f, extra, df_large), df_large, effect, message)
