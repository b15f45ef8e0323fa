"""Rules: the range inside which a value of ours agrees with a published number."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from math import atanh, sqrt, tanh

from scipy.stats import norm, t
from statsmodels.stats.proportion import proportion_confint

LEVEL = 0.95
_Z = float(norm.ppf(0.5 + LEVEL / 2.0))
_QUARTILE = float(norm.ppf(0.75))

IQR_PER_SD = 2.0 * _QUARTILE
"""Interquartile range of a normal distribution of SD 1: 1.349."""

WIDE_FROM = 4.0
"""Ends that differ by this factor are wide: half to twice a value spans it."""


class Limit(StrEnum):
    """What it takes to lie inside a range, from the strongest to the weakest."""

    TWO_SIDED = "two_sided"
    CHOSEN = "chosen"
    BORROWED = "borrowed"
    WIDE = "wide"
    ONE_SIDED = "one_sided"
    BINARY = "binary"
    NONE = "none"


@dataclass(frozen=True)
class Range:
    """A closed range, None for an open end, and what it is in words.

    An end that a value cannot pass anyway (an error below 0, a correlation above 1) is no end: it
    is None.

    Attributes
    ----------
    chosen : whether the width was chosen here, not taken from what the paper prints.
    borrowed : whether the width is printed of something else, such as an error of all tasks
        together for a single task.
    """

    low: float | None
    high: float | None
    what: str
    chosen: bool = False
    borrowed: bool = False

    @property
    def limit(self) -> Limit:
        """What being inside says, by the ends alone and by who chose the width."""
        if self.low is None or self.high is None:
            return Limit.NONE if self.low is self.high else Limit.ONE_SIDED
        if self.low == self.high:
            return Limit.BINARY
        near, far = sorted((abs(self.low), abs(self.high)))
        if self.low * self.high >= 0.0 and far >= WIDE_FROM * near:
            return Limit.WIDE
        if self.borrowed:
            return Limit.BORROWED
        return Limit.CHOSEN if self.chosen else Limit.TWO_SIDED

    def holds(self, value: float) -> bool:
        """Whether a value lies in it, ends included."""
        above = self.low is None or value >= self.low
        return above and (self.high is None or value <= self.high)


# --- rules: arguments as the cell `rule_args` has them, the last may be words ---------------------


def between(low: float | None, high: float | None, what: str) -> Range:
    """Ends that are written down, and why these."""
    return Range(low, high, what)


def chosen(low: float, high: float, what: str) -> Range:
    """Ends whose distance was chosen here."""
    return Range(low, high, what, chosen=True)


def nothing() -> Range:
    """A number that is shown and not compared."""
    return Range(None, None, "none")


def exactly(value: float) -> Range:
    """A count or a yes or no."""
    return Range(value, value, "the paper's value itself")


def at_most(bound: float) -> Range:
    """Up to a bound that the paper states."""
    return Range(None, bound, "below the paper's bound")


def at_least(bound: float) -> Range:
    """From a bound on that the paper states."""
    return Range(bound, None, "above the paper's bound")


def no_larger(value: float) -> Range:
    """Up to twice the error of one model, printed without any spread."""
    return Range(None, 2.0 * value, "up to twice the paper's value: a smaller error agrees")


def factor_of_two(value: float) -> Range:
    """Half to twice a value that is printed without any spread."""
    what = "half to twice the paper's value, chosen here: no uncertainty of it is printed"
    return Range(value / 2.0, value * 2.0, what, chosen=True)


def window(value: float) -> Range:
    """Half to twice a number of patients that are not ours."""
    what = f"half to twice {value:.3g}, a window chosen here; inside it is no agreement"
    return Range(value / 2.0, value * 2.0, what, chosen=True)


def window_of_percent(value: float) -> Range:
    """The same of a reduction, of which no more than all is possible."""
    return Range(value / 2.0, min(2.0 * value, 100.0), window(value).what, chosen=True)


def within_width(value: float, width: float, name: str) -> Range:
    """A median and the width of a spread around it whose ends are not printed."""
    what = (
        f"the paper's value less and plus its {name}: the ends are not printed, "
        "but lie no farther from the median than this width"
    )
    return Range(max(value - width, 0.0), value + width, what)


def plus_minus(value: float, reach: float, what: str) -> Range:
    """A value less and plus a spread or a tolerance that is printed with it, or follows from it."""
    return Range(value - reach, value + reach, what)


def borrowed(value: float, reach: float, what: str) -> Range:
    """A value less and plus a tolerance that the paper prints of something else."""
    return Range(value - reach, value + reach, f"borrowed: {what}", borrowed=True)


def near(value: float, to: float, why: str) -> Range:
    """A value and how far ours may be from it."""
    return Range(value - to, value + to, f"the paper's value to {to:g}{why and ': '}{why}")


def rounded(value: float, unit_of_last_digit: float) -> Range:
    """What rounds to a printed number."""
    half = unit_of_last_digit / 2.0
    return Range(value - half, value + half, "what rounds to the printed number")


def of_sign(value: float, what: str) -> Range:
    """The sign of a printed number, which alone is compared."""
    return Range(0.0, None, what) if value > 0.0 else Range(None, 0.0, what)


def half_width(value: float, iqr: float) -> Range:
    """A median and the IQR of values that are normal by construction."""
    what = "the paper's IQR, taken as centred on its median"
    return Range(value - iqr / 2.0, value + iqr / 2.0, what)


def binomial(count: float, of: float) -> Range:
    """Where the share lies, in percent, that gave this count."""
    ends = wilson_percent(int(count), int(of))
    return Range(*ends, f"95 % Wilson interval of the paper's {int(count)} of {int(of)}")


def wilson_percent(count: int, of: int) -> tuple[float, float]:
    """Ends of the 95 % Wilson interval of a share, percent."""
    low, high = proportion_confint(count, of, alpha=1.0 - LEVEL, method="wilson")
    ends = (0.0 if count == 0 else float(low)), (1.0 if count == of else float(high))
    return 100.0 * ends[0], 100.0 * ends[1]  # rounding would exclude a share of none or all


def normal_iqr(iqr: float, n: float) -> Range:
    """Where the IQR of another sample of the normal distribution lies of which n had this IQR.

    The asymptotic standard error of an IQR is SD / (2 phi(z) sqrt(n)), z the upper quartile; the
    other sample is taken to be as large.
    """
    relative = 0.5 / float(norm.pdf(_QUARTILE)) / IQR_PER_SD / sqrt(n)
    reach = _Z * sqrt(2.0) * relative * iqr
    what = f"where 95 % of other samples' IQRs lie, after the paper's {int(n)} normal values"
    return Range(iqr - reach, iqr + reach, what)


def spearman_interval(rho: float, n: float) -> Range:
    """Where the rank correlation lies that gave rho in n pairs (Bonett and Wright 2000)."""
    reach = _Z * sqrt((1.0 + rho**2 / 2.0) / (n - 3))
    what = f"95 % interval of the paper's rho of {int(n)} pairs"
    return Range(tanh(atanh(rho) - reach), tanh(atanh(rho) + reach), what)


def insignificant(p: float, n: float) -> Range:
    """Rank correlations that n pairs cannot tell from none."""
    threshold = spearman_threshold(p, n)
    what = f"not significant in the paper: smaller than the threshold of p = {p:g} at n = {int(n)}"
    return Range(-threshold, threshold, what)


def spearman_threshold(p: float, n: float) -> float:
    """The smallest absolute rank correlation of n pairs that has a p below this."""
    critical = float(t.ppf(1.0 - p / 2.0, n - 2))
    return critical / sqrt(n - 2 + critical**2)


RULES: dict[str, Callable[..., Range]] = {
    rule.__name__: rule
    for rule in (
        *(between, chosen, nothing, exactly, at_most, at_least, no_larger, factor_of_two, window),
        *(window_of_percent, within_width, plus_minus, borrowed, near, rounded, of_sign),
        *(half_width, binomial, normal_iqr, spearman_interval, insignificant),
    )
}
"""By the name that a row has in its column `rule`."""
