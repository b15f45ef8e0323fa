"""Whether more parameters fit better than chance would: the extra sum of squares F test."""

from math import isfinite

from scipy import stats

from spinepipe.statistics.outcome import Ended, Outcome, Test

ROUNDING = 1e-9
"""A larger model that fits worse by less than this share has only met rounding."""

NESTED = Test("nested models F", "F", "partial R2")


def f_test_nested(rss_small: float, df_small: int, rss_large: float, df_large: int) -> Outcome:
    """F test of two least squares fits to the same values, one model a special case of the other.

    For models that are not linear the F distribution is an approximation.

    Parameters
    ----------
    rss_small, rss_large : (weighted) residual sums of squares of the model with fewer and with
        more parameters, with the same weights.
    df_small, df_large : their residual degrees of freedom, values less parameters.

    n of the outcome is ``df_large``, 0 where the larger model leaves none. Effect size: partial
    R2, the share of the smaller model's residual sum of squares that the further parameters
    explain. A larger model that fits worse was not fitted to the end: F is 0 then, and the message
    says so.

    Raises
    ------
    ValueError
        If the larger model has not fewer degrees of freedom, or a sum is negative or not finite.
    """
    _check(rss_small, df_small, rss_large, df_large)
    if df_large < 1:
        message = f"{df_large} degrees of freedom left by the larger model; at least 1 is needed"
        return NESTED.without(Ended.TOO_FEW, max(df_large, 0), message)
    if rss_large == 0.0:
        message = "the larger model fits exactly: no residual to compare with"
        return NESTED.without(Ended.CONSTANT, df_large, message)
    extra, gained = df_small - df_large, max(rss_small - rss_large, 0.0)
    f = (gained / extra) / (rss_large / df_large)
    message = f"F({extra}, {df_large})"
    if rss_large > rss_small * (1.0 + ROUNDING):
        message += f"; the larger model fits worse ({rss_large:.6g} against {rss_small:.6g})"
    effect = gained / rss_small if rss_small > 0.0 else 0.0
    return NESTED.done(f, stats.f.sf(f, extra, df_large), df_large, effect, message)


def _check(rss_small: float, df_small: int, rss_large: float, df_large: int) -> None:
    """Raise ValueError for what can be no two nested fits."""
    if df_small <= df_large:
        raise ValueError(
            f"the larger model has the fewer degrees of freedom, found {df_small} and {df_large}"
        )
    for rss in (rss_small, rss_large):
        if not (isfinite(rss) and rss >= 0.0):
            raise ValueError(f"a sum of squares is finite and not negative, found {rss}")
