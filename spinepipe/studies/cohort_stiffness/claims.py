"""A finding that is claimed, and the rule by which a mean decides about it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd

from spinepipe.statistics import Mean, mean_of
from spinepipe.status import joined

Row = dict[str, Any]


UNDECIDED, NOT_ASKED, CIRCULAR = "undecided", "not_asked", "circular"
DECIDED = ("yes", "no")
HOLDS = (*DECIDED, UNDECIDED, NOT_ASKED, CIRCULAR)
"""What may be said of a claim."""


BY_CONSTRUCTION = "by_construction"
"""Marks a row whose claim is no test: fitted to the readings it is judged by."""

BY_SIZE = "by_size"
"""Marks a row whose no is by the size of a share alone: no test decided it, whatever its p."""


FEWEST = 3
"""Specimens that a verdict needs; the scatter of two is that of one difference."""


@dataclass(frozen=True)
class CohortClaim:
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
        specimens: int | None = None,
        p_no: float | None = None,
    ) -> Row:
        """The row of a claim that was looked at.

        Parameters
        ----------
        specimens : that decide, None for all. p_no : of the test that the effect is as large as
            what is still called none.
        """
        low, high = interval or (None, None)
        named = {"finding": self.finding, "statement": self.statement}
        named |= {"quantity": self.quantity, "unit": self.unit}
        found = {"value": value, "low": low, "high": high, "p": p, "p_no": p_no}
        return {**named, **found, "specimens": specimens, "holds": holds, "message": message}

    def unknown(self, message: str) -> Row:
        """The row of a claim about which there are no numbers."""
        return self.row(UNDECIDED, message)

    def not_asked(self, message: str) -> Row:
        """The row of a claim that the study leaves out."""
        return self.row(NOT_ASKED, message)


def above_zero(claim: CohortClaim, values: pd.Series, significance: float, note: str = "") -> Row:
    """Claim that the mean over specimens is above zero.

    Yes and no where the t test tells the mean from zero, by its sign; else undecided.
    """
    mean = mean_of(values.to_numpy(float))
    holds = UNDECIDED
    if mean.p is not None and mean.value is not None and mean.p < significance:
        holds = "yes" if mean.value > 0.0 else "no"
    return claim.row(
        holds, joined(sample_words(mean), note), mean.value, mean.interval, mean.p, mean.n
    )


def sample_words(mean: Mean) -> str:
    """Of how many specimens a mean is, or why it has no interval."""
    if mean.n == 0:
        return "no specimen has all results"
    if mean.n == 1:
        return "one specimen only: no interval"
    if mean.interval is None:
        return f"the same in all {mean.n} specimens: no interval"
    return f"{mean.n} specimens"


def words(name: str) -> str:
    """A name of the tables in a sentence."""
    return name.replace("_", " ")


def listed(names: Sequence[str]) -> str:
    """Names in a row, for a message."""
    return ", ".join(names) or "none"


NO_SUCH_FITS = "no such fits in this study"
