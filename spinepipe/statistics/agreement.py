"""Agreement of predicted with measured values (Bland and Altman 1986, 1999)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from spinepipe.statistics.correlation import spearman
from spinepipe.statistics.outcome import (
    ComputationStatus,
    StatisticalTest,
    constant,
    finite_pairs,
)

FEWEST = 3
LIMIT_SDS = 1.96
COMPARABLE = 2.0
"""SDs of predicted and measured values within this factor of each other are comparable."""
TAILS = (0.025, 0.975)


@dataclass(frozen=True)
class Agreement:
    """Bland-Altman analysis; difference = predicted - measured, in the unit of the values.

    Attributes
    ----------
    bias, bias_low, bias_high : mean difference and its 95 % t interval.
    sd : standard deviation of the differences.
    lower_limit, upper_limit : limits of agreement, bias -+ 1.96 SD.
    lower_limit_low ... upper_limit_high : 95 % intervals of the limits.
    proportional : Spearman correlation of difference and mean of each pair; a bias that grows
        with the size of the values shows here, if ``comparable``.
    measured_sd, predicted_sd : of the values themselves; None of fewer than two.
    comparable : whether one of these is at most `COMPARABLE` times the other. If not, the values
        that vary more make both the difference and the mean, which correlate whatever the bias:
        the covariance of difference and mean is half the difference of the variances.

    Numbers that the values do not give are None: all but ``n`` when they are too few, the
    intervals when the difference is the same everywhere.
    """

    n: int
    proportional: StatisticalTest
    status: ComputationStatus
    comparable: bool
    measured_sd: float | None
    predicted_sd: float | None
    message: str = ""
    bias: float | None = None
    bias_low: float | None = None
    bias_high: float | None = None
    sd: float | None = None
    lower_limit: float | None = None
    lower_limit_low: float | None = None
    lower_limit_high: float | None = None
    upper_limit: float | None = None
    upper_limit_low: float | None = None
    upper_limit_high: float | None = None


def bland_altman(measured: ArrayLike, predicted: ArrayLike) -> Agreement:
    """Agreement of predicted (n,) with measured (n,) values.

    The intervals of the limits are exact for normal differences: bias + 1.96 SD is a quantile of
    theirs, and (limit - mean) sqrt(n) / SD has a noncentral t distribution (Carkeet 2015,
    doi:10.1097/OPX.0000000000000513). Bland and Altman's own, limit -+ t sqrt(3/n) SD, is their
    approximation for many pairs.
    """
    first, second = finite_pairs(measured, predicted)
    proportional = spearman(0.5 * (first + second), second - first)
    difference, n = second - first, len(first)
    sds: tuple[bool, float | None, float | None] = (False, None, None)
    if n >= 2:
        one, other = float(first.std(ddof=1)), float(second.std(ddof=1))
        sds = max(one, other) <= COMPARABLE * min(one, other), one, other
    if n < FEWEST:
        message = f"{n} pairs; at least {FEWEST} are needed"
        return Agreement(n, proportional, ComputationStatus.TOO_FEW, *sds, message=message)
    if constant(difference):
        same = float(difference[0])
        message = "the difference is the same in all pairs"
        return Agreement(
            *(n, proportional, ComputationStatus.CONSTANT, *sds),
            message=message,
            bias=same,
            sd=0.0,
            lower_limit=same,
            upper_limit=same,
        )
    bias, sd = float(difference.mean()), float(difference.std(ddof=1))
    mean = sd * stats.t.ppf(TAILS, n - 1) / np.sqrt(n)
    # quantiles of (limit - mean) sqrt(n) / SD: noncentral t about 1.96 sqrt(n), of n - 1 freedom
    limit = sd * stats.nct.ppf(TAILS, n - 1, LIMIT_SDS * np.sqrt(n)) / np.sqrt(n)
    return Agreement(
        *(n, proportional, ComputationStatus.DONE, *sds),
        bias=bias,
        bias_low=float(bias + mean[0]),
        bias_high=float(bias + mean[1]),
        sd=sd,
        lower_limit=bias - LIMIT_SDS * sd,
        lower_limit_low=float(bias - limit[1]),
        lower_limit_high=float(bias - limit[0]),
        upper_limit=bias + LIMIT_SDS * sd,
        upper_limit_low=float(bias + limit[0]),
        upper_limit_high=float(bias + limit[1]),
    )
