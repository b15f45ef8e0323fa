"""What a published number is compared with: the range inside which ours agrees with it."""

from dataclasses import dataclass
from math import atanh, sqrt, tanh

from scipy.stats import norm, t
from statsmodels.stats.proportion import proportion_confint

LEVEL = 0.95
_Z = float(norm.ppf(0.5 + LEVEL / 2.0))
_QUARTILE = float(norm.ppf(0.75))
IQR_PER_SD = 2.0 * _QUARTILE
"""Interquartile range of a normal distribution of SD 1: 1.349."""


@dataclass(frozen=True)
class Range:
    """A closed range, None for an open end, and what it is in words."""

    low: float | None
    high: float | None
    what: str

    def holds(self, value: float) -> bool:
        """Whether a value lies in it, ends included."""
        above = self.low is None or value >= self.low
        return above and (self.high is None or value <= self.high)


def within_width(value: float, width: float, name: str) -> Range:
    """A median and the width of a spread around it whose ends are not printed."""
    what = (
        f"the paper's value less and plus its {name}: the ends are not printed, "
        "but lie no farther from the median than this width"
    )
    return Range(max(value - width, 0.0), value + width, what)


def half_width(value: float, iqr: float) -> Range:
    """A median and the IQR of values that are normal by construction."""
    what = "the paper's IQR, taken as centred on its median"
    return Range(value - iqr / 2.0, value + iqr / 2.0, what)


def factor_of_two(value: float) -> Range:
    """Half to twice a value that is printed without any spread."""
    what = "half to twice the paper's value, chosen here: no uncertainty of it is printed"
    return Range(value / 2.0, value * 2.0, what)


def at_most(bound: float) -> Range:
    """Zero to a bound that the paper states."""
    return Range(0.0, bound, "below the paper's bound")


def no_larger(value: float) -> Range:
    """Zero to twice the error of one model, printed without any spread."""
    return Range(0.0, 2.0 * value, "up to twice the paper's value: a smaller error agrees")


def exactly(value: float) -> Range:
    """A count or a yes or no."""
    return Range(value, value, "the paper's value itself")


def wilson_percent(count: int, of: int) -> tuple[float, float]:
    """Ends of the 95 % Wilson interval of a share, percent."""
    low, high = proportion_confint(count, of, alpha=1.0 - LEVEL, method="wilson")
    ends = (0.0 if count == 0 else float(low)), (1.0 if count == of else float(high))
    return 100.0 * ends[0], 100.0 * ends[1]  # rounding would exclude a share of none or all


def binomial(count: int, of: int) -> Range:
    """Where the share lies, in percent, that gave this count."""
    return Range(*wilson_percent(count, of), f"95 % Wilson interval of the paper's {count} of {of}")


def normal_iqr(iqr: float, n: int) -> Range:
    """Where the IQR of another sample of the normal distribution lies of which n had this IQR.

    The asymptotic standard error of an IQR is SD / (2 phi(z) sqrt(n)), z the upper quartile; the
    other sample is taken to be as large.
    """
    relative = 0.5 / float(norm.pdf(_QUARTILE)) / IQR_PER_SD / sqrt(n)
    reach = _Z * sqrt(2.0) * relative * iqr
    what = f"where 95 % of other samples' IQRs lie, after the paper's {n} normal values"
    return Range(iqr - reach, iqr + reach, what)


def spearman_interval(rho: float, n: int) -> Range:
    """Where the rank correlation lies that gave rho in n pairs (Bonett and Wright 2000)."""
    reach = _Z * sqrt((1.0 + rho**2 / 2.0) / (n - 3))
    what = f"95 % interval of the paper's rho of {n} pairs"
    return Range(tanh(atanh(rho) - reach), tanh(atanh(rho) + reach), what)


def spearman_p(rho: float, n: int) -> float:
    """Two-sided p of a rank correlation by the t approximation."""
    return float(2.0 * t.sf(abs(rho) * sqrt((n - 2) / (1.0 - rho**2)), n - 2))


def kendall_p(tau: float, n: int) -> float:
    """Two-sided p of a Kendall correlation without ties by the normal approximation."""
    return float(2.0 * norm.sf(abs(tau) * sqrt(9.0 * n * (n - 1) / (2.0 * (2.0 * n + 5.0)))))


def spearman_threshold(p: float, n: int) -> float:
    """The smallest absolute rank correlation of n pairs that has a p below this."""
    critical = float(t.ppf(1.0 - p / 2.0, n - 2))
    return critical / sqrt(n - 2 + critical**2)


def insignificant(p: float, n: int) -> Range:
    """Rank correlations that n pairs cannot tell from none."""
    threshold = spearman_threshold(p, n)
    what = f"not significant in the paper: smaller than the threshold of p = {p:g} at n = {n}"
    return Range(-threshold, threshold, what)
