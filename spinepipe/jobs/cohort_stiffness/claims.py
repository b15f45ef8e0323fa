"""A finding that is claimed, and the rules by which numbers decide about it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from scipy import stats

from spinepipe.effects.contract import Array

Row = dict[str, Any]

SAME = 1e-9
"""Values that differ by less than this share of their size differ by rounding."""


@dataclass(frozen=True)
class Claim:
    """What is claimed; see the columns of table ``findings``."""

    finding: str
    statement: str
    quantity: str
    unit: str

    def row(
        self,
        holds: str,
        message: str,
        value: float | None = None,
        interval: tuple[float, float] | None = None,
        p: float | None = None,
    ) -> Row:
        """The row of a claim that was looked at."""
        low, high = interval or (None, None)
        named = {"finding": self.finding, "statement": self.statement}
        named |= {"quantity": self.quantity, "unit": self.unit}
        found = {"value": value, "low": low, "high": high, "p": p}
        return {**named, **found, "holds": holds, "message": message}

    def unknown(self, message: str) -> Row:
        """The row of a claim about which there are no numbers."""
        return self.row("undecided", message)


@dataclass(frozen=True)
class Mean:
    """Mean of values that are independent of each other; numbers are None where there are none.

    Attributes
    ----------
    interval : 95 % t interval. p : of the t test against zero, two-sided.
    message : why there is no interval, or how many values there are.
    """

    value: float | None
    interval: tuple[float, float] | None
    p: float | None
    message: str


def mean_of(values: Array) -> Mean:
    """Mean of values (specimens,) and its t interval."""
    n = len(values)
    if n == 0:
        return Mean(None, None, None, "no specimen has all results")
    value = float(values.mean())
    if n == 1:
        return Mean(value, None, None, "one specimen only: no interval")
    if np.ptp(values) <= SAME * np.abs(values).max():
        return Mean(value, None, None, f"the same in all {n} specimens: no interval")
    tested = stats.ttest_1samp(values, 0.0)
    ends = tested.confidence_interval(0.95)
    interval = float(ends.low), float(ends.high)
    return Mean(value, interval, float(tested.pvalue), f"{n} specimens")


def above_zero(claim: Claim, values: pd.Series, significance: float, note: str = "") -> Row:
    """Claim that the mean over specimens is above zero.

    Yes and no where the t test tells the mean from zero, by its sign; else undecided.
    """
    mean = mean_of(values.to_numpy(float))
    holds = "undecided"
    if mean.p is not None and mean.value is not None and mean.p < significance:
        holds = "yes" if mean.value > 0.0 else "no"
    return claim.row(holds, joined(mean.message, note), mean.value, mean.interval, mean.p)


def joined(*notes: str) -> str:
    """Notes as one message."""
    return "; ".join(note for note in notes if note)


def words(name: str) -> str:
    """A name of the tables in a sentence."""
    return name.replace("_", " ")


def listed(names: Sequence[str]) -> str:
    """Names in a row, for a message."""
    return ", ".join(names) or "none"
