"""The one scorer: how well a quantity fits its usual range once a mistake is undone.

Its knowledge is two tables. `ranges.csv` has what a quantity is in sound data (`low` to `high`,
told beyond) and what it should be once a mistake is undone (`usual_low` to `usual_high`), with the
source of both. `hypotheses.csv` has what people get wrong: the factor that undoes it, its words,
the remedy, and how often it happens beside the other mistakes of the same quantity.
"""

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from math import exp, inf, log
from typing import final

from spinepipe.units import TRANSLATIONS

PACKAGE = "spinepipe.plausibility"

AGAINST = -0.9
"""Correlation of motion and load below which a joint moves against its load."""

CLEAR = 5.0
"""SDs of one reading that motion must exceed to tell a sign or a unit."""

BETTER = 2.0
"""Times nearer that undoing a mistake must bring points and axes to where they should be, chosen:
undone where it was not made, it takes them away as a rule."""


@dataclass(frozen=True)
class UsualRange:
    """A row of `ranges.csv`; without a limit it is infinite."""

    low: float
    high: float
    usual_low: float
    usual_high: float

    def holds(self, value: float) -> bool:
        """Whether nothing is told of a value."""
        return self.low <= value <= self.high

    def __str__(self) -> str:
        """As messages say what is allowed."""
        if self.low == -inf:
            return f"at most {self.high:g}"
        if self.high == inf:
            return f"at least {self.low:g}"
        factor = self.low < 1.0 and abs(self.low * self.high - 1.0) < 1e-9
        return f"{'1/' if factor else ''}{self.high if factor else self.low:g} to {self.high:g}"

    def likelihood(self, value: float) -> float:
        """Logarithm of that of a value, from the middle of what is usual; none beyond its ends.

        Normal on a scale of factors, the ends at one SD; where the range has one end, flat.
        """
        if not self.usual_low <= value <= self.usual_high:
            return -inf
        if self.usual_low <= 0.0 or self.usual_high == inf:
            return 0.0
        width = log(self.usual_high / self.usual_low) / 2.0
        return -0.5 * (log(value / self.usual_low) / width - 1.0) ** 2


@final
@dataclass(frozen=True)
class MistakeHypothesis:
    """A row of `hypotheses.csv`.

    Attributes
    ----------
    factor : what the numbers must be multiplied by to undo the mistake. table : that has it.
    """

    factor: float
    table: str
    words: str
    remedy: str
    prior: float

    @property
    def size(self) -> str:
        """How many times too large the mistake makes the numbers."""
        return f"{1.0 / self.factor:.3g}"

    def mend(self, **values: object) -> str:
        """The remedy with its numbers and names filled in."""
        factor = f"{round(self.factor, 4):g}"
        known = {"words": self.words, "factor": factor, "size": self.size}
        return self.remedy.format(**known, **values)


@cache
def table(package: str, name: str) -> tuple[dict[str, str], ...]:
    """Rows of a csv that lies beside the files of a package."""
    with files(package).joinpath(f"{name}.csv").open(encoding="utf-8") as file:
        return tuple(csv.DictReader(file))


def _number(text: str) -> float:
    """``1/1.8`` too: a factor either way is easier to read so."""
    over, _, under = text.partition("/")
    return float(over) / float(under or 1.0)


@cache
def _ranges() -> dict[str, UsualRange]:
    found = {}
    for row in table(PACKAGE, "ranges"):
        low = _number(row["low"] or "-inf")
        high = _number(row["high"] or "inf")
        usual = (row["usual_low"], low), (row["usual_high"], high)
        found[row["quantity"]] = UsualRange(
            low, high, *(_number(t) if t else end for t, end in usual)
        )
    return found


@cache
def hypotheses(what: str) -> tuple[MistakeHypothesis, ...]:
    """Mistakes that are known of a quantity, in the order of the table."""
    return tuple(
        MistakeHypothesis(
            _number(row["factor"]), row["table"], row["words"], row["remedy"], float(row["prior"])
        )
        for row in table(PACKAGE, "hypotheses")
        if row["what"] == what
    )


def usual(quantity: str) -> UsualRange:
    """The row of a quantity."""
    return _ranges()[quantity]


def has_range(quantity: str) -> bool:
    """Whether there is such a row."""
    return quantity in _ranges()


def suspect(what: str, value: float, quantity: str) -> MistakeHypothesis | None:
    """The mistake that most likely explains a value; None where none makes it a usual one.

    Posterior odds: the prior of each times the likelihood of the value with the mistake undone.
    """
    limits = usual(quantity)
    odds = [
        (log(one.prior) + limits.likelihood(value * one.factor), one)
        for one in (hypotheses(what) if value > 0.0 else ())
    ]
    best = max(odds, key=lambda pair: pair[0], default=(-inf, None))
    return best[1] if best[0] > -inf else None


# --- motion and load ------------------------------------------------------------------------------
# Motion that differs by more than a factor of five from what published stiffness gives is of no
# stiffness that was measured before: a joint is fused or cut, or a unit is wrong.


def is_plausible(ratio: float) -> bool:
    """Whether motion over the expected motion, above 0, is one that joints were seen to have."""
    return usual("motion_over_expected").holds(ratio)


def implausible(slope: float | None) -> str:
    """What is wrong with measured over expected motion, in words; nothing where it may be right."""
    if slope is None or slope <= 0.0 or is_plausible(slope):
        return ""
    return f"{slope:.3g} times the motion that published stiffness gives"


def unit_of(slopes: Sequence[float], coordinate: str) -> str:
    """The unit that explains the motion of all joints of a test, in words; nothing if none does.

    One joint alone may be fused or cut; a unit is of all.
    """
    if not slopes or not all(implausible(slope) for slope in slopes):
        return ""
    unit = unit_like(geometric_mean(slopes), coordinate)
    return "" if unit is None else f"{unit.words} ({unit.size})"


def unit_like(
    ratio: float, coordinate: str, quantity: str = "motion_over_expected"
) -> MistakeHypothesis | None:
    """The mistaken unit that makes so large a motion of a coordinate; None if none does."""
    return suspect("translation" if coordinate in TRANSLATIONS else "rotation", ratio, quantity)


def geometric_mean(ratios: Sequence[float]) -> float:
    """The mean on a scale of factors; all above 0."""
    return exp(sum(map(log, ratios)) / len(ratios))
