"""A published number, the range inside which ours agrees with it, and what a run says to it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from math import atanh, sqrt, tanh
from typing import Any

import numpy as np
import pandas as pd
from scipy.stats import norm, t
from statsmodels.stats.proportion import proportion_confint

LEVEL = 0.95
_Z = float(norm.ppf(0.5 + LEVEL / 2.0))

_QUARTILE = float(norm.ppf(0.75))

IQR_PER_SD = 2.0 * _QUARTILE
"""Interquartile range of a normal distribution of SD 1: 1.349."""


class NotComputed(Exception):
    """A run lacks what a comparison needs; the message says what."""


@dataclass(frozen=True)
class Run:
    """What a run found.

    Attributes
    ----------
    tables : by name; of a paper of one specimen the rows of that specimen.
    asked : settings of the study that claims look at, by name.
    """

    tables: Mapping[str, pd.DataFrame]
    asked: Mapping[str, Any] = field(default_factory=dict)
    _chosen: dict[Any, pd.DataFrame] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )

    def rows(self, table: str, **where: Any) -> pd.DataFrame:
        """Rows whose columns have the given values, at least one; many claims ask for the same.

        Raises
        ------
        NotComputed
            Where the run has no such table or no such row.
        """
        if table not in self.tables:
            raise NotComputed(f"this run made no table {table}")
        key = table, *where.items()
        if key in self._chosen:
            return self._chosen[key]
        frame = self.tables[table]
        chosen = np.ones(len(frame), dtype=bool)
        for column, value in where.items():
            chosen &= frame[column].to_numpy() == value
        if not chosen.any():
            sought = ", ".join(f"{column} {value}" for column, value in where.items())
            raise NotComputed(f"this run's table {table} has no row of {sought or 'any kind'}")
        self._chosen[key] = frame[chosen]
        return self._chosen[key]

    def row(self, table: str, **where: Any) -> "pd.Series[Any]":
        """The first such row."""
        return self.rows(table, **where).iloc[0]

    def number(self, table: str, column: str, **where: Any) -> float:
        """One cell that is not empty."""
        row = self.row(table, **where)
        if pd.isna(row[column]):
            told = str(row.get("message") or "nothing is in this dataset")
            raise NotComputed(f"{column} is empty in {table}: {told}")
        return float(row[column])


class Limit(StrEnum):
    """What it takes to lie inside a range, from the strongest to the weakest."""

    TWO_SIDED = "two_sided"
    CHOSEN = "chosen"
    WIDE = "wide"
    ONE_SIDED = "one_sided"
    BINARY = "binary"
    NONE = "none"


WIDE_FROM = 4.0
"""Ends that differ by this factor are wide: half to twice a value spans it."""


@dataclass(frozen=True)
class Range:
    """A closed range, None for an open end, and what it is in words.

    An end that a value cannot pass anyway (an error below 0, a correlation above 1) is no end: it
    is None.

    Attributes
    ----------
    chosen : whether the width was chosen here, not taken from what the paper prints.
    """

    low: float | None
    high: float | None
    what: str
    chosen: bool = False

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
        return Limit.CHOSEN if self.chosen else Limit.TWO_SIDED

    def holds(self, value: float) -> bool:
        """Whether a value lies in it, ends included."""
        above = self.low is None or value >= self.low
        return above and (self.high is None or value <= self.high)


class Verdict(StrEnum):
    """How a run stands to a published number."""

    INSIDE = "inside"
    OUTSIDE = "outside"
    CIRCULAR = "circular"
    RECOMPUTED = "recomputed"
    CONTRADICTED = "contradicted"
    NOT_COMPUTED = "not_computed"


@dataclass(frozen=True)
class Ours:
    """Our value, the ends of our range where there is one, and what a reader must know."""

    value: float
    low: float | None = None
    high: float | None = None
    note: str = ""


@dataclass(frozen=True)
class Claim:
    """One published quantity.

    Attributes
    ----------
    id : unique, dotted.
    where : table or section of the paper.
    paper : the printed value, None where a range or a bound alone is printed.
    range : where our value counts as inside, and what this range is.
    ours : our value from the tables of a run; raises `NotComputed` where they lack it.
    outside : what is known of the reason, told only when ours is outside.
    note : what a reader must know in any case.
    contradicted : how the paper's own numbers exclude each other; empty where they do not.
    also : ranges of what else the paper prints of a contradicted quantity that a run has. A value
        of ours outside all of them disagrees with the paper whichever number is right.
    evidence : what it is called when ours is inside: `CIRCULAR` where the cohort was built to have
        the number, `RECOMPUTED` where it follows from the paper's other numbers alone.
    """

    id: str
    where: str
    quantity: str
    unit: str
    paper: float | None
    range: Range
    ours: Callable[[Run], Ours]
    outside: str
    note: str = ""
    contradicted: str = ""
    evidence: Verdict = Verdict.INSIDE
    also: tuple[Range, ...] = ()


def judged(claims: tuple[Claim, ...], run: Run) -> list[Mapping[str, Any]]:
    """All rows of the table, in the order of the claims."""
    return [judge(claim, run) for claim in claims]


def judge(claim: Claim, run: Run) -> dict[str, Any]:
    """One row of the table ``against_<paper>``."""
    ours, missing = _ours(claim, run)
    verdict = _verdict(claim, ours)
    return {
        "id": claim.id,
        "where": claim.where,
        "quantity": claim.quantity,
        "unit": claim.unit,
        "paper": claim.paper,
        "paper_low": claim.range.low,
        "paper_high": claim.range.high,
        "ours": None if ours is None else ours.value,
        "ours_low": None if ours is None else ours.low,
        "ours_high": None if ours is None else ours.high,
        "limit": claim.range.limit.value,
        "verdict": verdict.value,
        "reason": _reason(claim, verdict, ours, missing),
        "evidence": "contradicted"
        if claim.contradicted
        else {Verdict.INSIDE: "independent"}.get(claim.evidence, claim.evidence.value),
    }


def _ours(claim: Claim, run: Run) -> tuple[Ours | None, str]:
    """Our value, or None and the reason."""
    try:
        return claim.ours(run), ""
    except NotComputed as error:
        return None, str(error)


def _verdict(claim: Claim, ours: Ours | None) -> Verdict:
    if claim.contradicted and not _outside_all(claim, ours):
        return Verdict.CONTRADICTED
    if ours is None:
        return Verdict.NOT_COMPUTED
    return claim.evidence if claim.range.holds(ours.value) else Verdict.OUTSIDE


def _outside_all(claim: Claim, ours: Ours | None) -> bool:
    """Whether ours is none of several numbers that the paper prints of the same quantity."""
    printed = (claim.range, *claim.also) if claim.also else ()
    return ours is not None and bool(printed) and not any(r.holds(ours.value) for r in printed)


def _reason(claim: Claim, verdict: Verdict, ours: Ours | None, missing: str) -> str:
    """What the range is, why ours is outside it or absent, and the notes."""
    told = {
        Verdict.OUTSIDE: [_factor(claim, ours), _either(claim), claim.outside],
        Verdict.CONTRADICTED: [f"not compared: {claim.contradicted}", missing],
        Verdict.NOT_COMPUTED: [missing],
    }.get(verdict, [])
    compared = "" if verdict is Verdict.CONTRADICTED else f"range: {claim.range.what}"
    parts = [compared, *told, claim.note, ours.note if ours else ""]
    return "; ".join(part for part in parts if part)


def _either(claim: Claim) -> str:
    """That the paper contradicts itself, and that ours agrees with neither number."""
    return claim.contradicted and f"outside of all that the paper prints ({claim.contradicted})"


def _factor(claim: Claim, ours: Ours | None) -> str:
    """Ours in terms of the paper's value, where both are sizes and not a count or yes or no."""
    paper, fixed = claim.paper, claim.range.low == claim.range.high
    if paper is None or ours is None or fixed or paper <= 0.0 or ours.value < 0.0:
        return ""
    return f"ours is {ours.value / paper:.2g} times the paper's"


def tested(run: Run, test: str, **where: Any) -> pd.DataFrame:
    """Tests that have a result and whose name begins like this, in any case; at least one."""
    rows = run.rows("statistics", **where)
    rows = rows[rows["test"].str.lower().str.startswith(test)]
    done = rows.dropna(subset=["p"])
    if done.empty:
        messages = [str(text) for text in rows["message"].unique() if text]
        raise NotComputed("; ".join(["no such test has a result", *messages[:1]]))
    return done


def exactly(value: float) -> Range:
    """A count or a yes or no."""
    return Range(value, value, "the paper's value itself")


def at_most(bound: float) -> Range:
    """Up to a bound that the paper states."""
    return Range(None, bound, "below the paper's bound")


def no_larger(value: float) -> Range:
    """Up to twice the error of one model, printed without any spread."""
    return Range(None, 2.0 * value, "up to twice the paper's value: a smaller error agrees")


def factor_of_two(value: float) -> Range:
    """Half to twice a value that is printed without any spread."""
    what = "half to twice the paper's value, chosen here: no uncertainty of it is printed"
    return Range(value / 2.0, value * 2.0, what, chosen=True)


def within_width(value: float, width: float, name: str) -> Range:
    """A median and the width of a spread around it whose ends are not printed."""
    what = (
        f"the paper's value less and plus its {name}: the ends are not printed, "
        "but lie no farther from the median than this width"
    )
    return Range(max(value - width, 0.0), value + width, what)


def of_sign(value: float, what: str) -> Range:
    """The sign of a printed number, which alone is compared."""
    return Range(0.0, None, what) if value > 0.0 else Range(None, 0.0, what)


def half_width(value: float, iqr: float) -> Range:
    """A median and the IQR of values that are normal by construction."""
    what = "the paper's IQR, taken as centred on its median"
    return Range(value - iqr / 2.0, value + iqr / 2.0, what)


def binomial(count: int, of: int) -> Range:
    """Where the share lies, in percent, that gave this count."""
    return Range(*wilson_percent(count, of), f"95 % Wilson interval of the paper's {count} of {of}")


FEWEST_OF_A_RATE = 10
"""Trials of which a rate is told: all of 3 leave 44 to 100 %, all of 10 leave 72 to 100 %."""


def wilson_percent(count: int, of: int) -> tuple[float, float]:
    """Ends of the 95 % Wilson interval of a share, percent."""
    low, high = proportion_confint(count, of, alpha=1.0 - LEVEL, method="wilson")
    ends = (0.0 if count == 0 else float(low)), (1.0 if count == of else float(high))
    return 100.0 * ends[0], 100.0 * ends[1]  # rounding would exclude a share of none or all


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


def insignificant(p: float, n: int) -> Range:
    """Rank correlations that n pairs cannot tell from none."""
    threshold = spearman_threshold(p, n)
    what = f"not significant in the paper: smaller than the threshold of p = {p:g} at n = {n}"
    return Range(-threshold, threshold, what)


def spearman_threshold(p: float, n: int) -> float:
    """The smallest absolute rank correlation of n pairs that has a p below this."""
    critical = float(t.ppf(1.0 - p / 2.0, n - 2))
    return critical / sqrt(n - 2 + critical**2)


def spearman_p(rho: float, n: int) -> float:
    """Two-sided p of a rank correlation by the t approximation."""
    return float(2.0 * t.sf(abs(rho) * sqrt((n - 2) / (1.0 - rho**2)), n - 2))


def kendall_p(tau: float, n: int) -> float:
    """Two-sided p of a Kendall correlation without ties by the normal approximation."""
    return float(2.0 * norm.sf(abs(tau) * sqrt(9.0 * n * (n - 1) / (2.0 * (2.0 * n + 5.0)))))
