"""What a statistical test hands back: its numbers, or the reason why there are none."""

from dataclasses import dataclass
from enum import StrEnum
from typing import SupportsFloat

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


P_ZERO = "p is too small for a number: 0 stands for it"


class Ended(StrEnum):
    """Whether a statistic could be computed."""

    DONE = "done"
    CONSTANT = "constant"
    TOO_FEW = "too_few"


@dataclass(frozen=True)
class Outcome:
    """One test, ready to be a row of a table.

    Attributes
    ----------
    statistic, p, effect : None where the status is not ``done``.
    n : how many observations went in (pairs, or blocks of a Friedman test).
    effect_name : the effect size's name, e.g. ``rho``.
    message : what a reader of the numbers must know, in plain words.
    """

    test: str
    statistic_name: str
    statistic: float | None
    p: float | None
    n: int
    effect_name: str
    effect: float | None
    status: Ended
    message: str = ""


@dataclass(frozen=True)
class Test:
    """The names of a test, from which its outcomes are made."""

    test: str
    statistic_name: str
    effect_name: str

    __test__ = False  # not for pytest to collect

    def done(
        self,
        statistic: SupportsFloat,
        p: SupportsFloat,
        n: int,
        effect: SupportsFloat,
        message: str = "",
    ) -> Outcome:
        """The outcome of a test that could be computed."""
        return Outcome(
            self.test,
            self.statistic_name,
            float(statistic),
            float(p),
            n,
            self.effect_name,
            float(effect),
            Ended.DONE,
            message if float(p) > 0.0 else f"{message}; {P_ZERO}".removeprefix("; "),
        )

    def without(self, status: Ended, n: int, message: str) -> Outcome:
        """The outcome of a test that has no numbers."""
        return Outcome(
            self.test, self.statistic_name, None, None, n, self.effect_name, None, status, message
        )


def finite(values: ArrayLike, dimensions: int = 1) -> Array:
    """The values as floats.

    Raises
    ------
    ValueError
        For other than that many dimensions, or values that are not finite: whoever asks decides
        what to leave out, and says so.
    """
    array: Array = np.asarray(values, dtype=np.float64)
    if array.ndim != dimensions:
        raise ValueError(f"expected {dimensions} dimension(s), found {array.ndim}")
    if not np.isfinite(array).all():
        raise ValueError("a statistic needs finite numbers: leave out what failed, and say so")
    return array


def constant(values: Array) -> bool:
    """Whether all values are the same."""
    return bool((values == values.flat[0]).all())


def tied(values: Array) -> int:
    """How many values are equal to another one."""
    counts = np.unique(values, return_counts=True)[1]
    return int(counts[counts > 1].sum())


def finite_pairs(x: ArrayLike, y: ArrayLike) -> tuple[Array, Array]:
    """Both sets of values as floats; ValueError also where a value has no partner."""
    first, second = finite(x), finite(y)
    if len(first) != len(second):
        raise ValueError(f"pairs are needed, found {len(first)} and {len(second)} values")
    return first, second
