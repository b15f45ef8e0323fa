"""How a factor is spread, and its values at the points of a design. Distributions are scipy's."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy import stats

from spinepipe.effects.contract import Array
from spinepipe.sensitivity_analysis.global_indices.design import Design, Method

SMALLEST_SHARE = 2.0**-31
"""Shares are kept this far from 0 and 1, where a normal is infinite: half a step of scipy's Sobol
points (30 bits). It is 6.2 SDs out."""

MORRIS_ENDS = (0.005, 0.995)
"""Quantiles that stand for the lowest and highest level of Morris where a spread has no ends."""


class Distribution(Protocol):
    """A distribution of one factor."""

    @property
    def bounded(self) -> bool:
        """Whether it has a lowest and a highest value."""

    def values(self, shares: Array) -> Array:
        """Quantiles at shares from 0 to 1."""


@dataclass(frozen=True)
class Uniform:
    """Equally likely from low to high."""

    low: float
    high: float
    bounded = True

    def __post_init__(self) -> None:
        _check(self.low < self.high, "low must be below high", self)

    def values(self, shares: Array) -> Array:
        """Quantiles at shares from 0 to 1."""
        return stats.uniform.ppf(shares, self.low, self.high - self.low)


@dataclass(frozen=True)
class LogUniform:
    """Its logarithm is uniform; low > 0."""

    low: float
    high: float
    bounded = True

    def __post_init__(self) -> None:
        _check(0.0 < self.low < self.high, "0 < low < high is needed", self)

    def values(self, shares: Array) -> Array:
        """Quantiles at shares from 0 to 1."""
        return stats.loguniform.ppf(shares, self.low, self.high)


@dataclass(frozen=True)
class Normal:
    """Normal, cut off at low and high where they are given (then mean and SD are before it)."""

    mean: float
    sd: float
    low: float = -np.inf
    high: float = np.inf

    def __post_init__(self) -> None:
        _check(self.sd > 0.0, "sd must be positive", self)
        _check(self.low < self.high, "low must be below high", self)

    @property
    def bounded(self) -> bool:
        """Whether it is cut off at both ends."""
        return bool(np.isfinite([self.low, self.high]).all())

    def values(self, shares: Array) -> Array:
        """Quantiles at shares from 0 to 1, which are moved inside by `SMALLEST_SHARE`."""
        ends = (np.array([self.low, self.high]) - self.mean) / self.sd
        if np.isinf(ends).all():
            return stats.norm.ppf(_inside(shares), self.mean, self.sd)
        return stats.truncnorm.ppf(_inside(shares), *ends, self.mean, self.sd)


@dataclass(frozen=True)
class LogNormal:
    """Its logarithm is normal; sd is of the natural logarithm, low and high are of the value."""

    median: float
    sd: float
    low: float = 0.0
    high: float = np.inf

    def __post_init__(self) -> None:
        _check(self.median > 0.0 and self.sd > 0.0, "median and sd must be positive", self)
        _check(0.0 <= self.low < self.high, "0 <= low < high is needed", self)

    @property
    def bounded(self) -> bool:
        """Whether it is cut off at both ends."""
        return self._log.bounded

    @property
    def _log(self) -> Normal:
        low = np.log(self.low) if self.low > 0.0 else -np.inf
        return Normal(float(np.log(self.median)), self.sd, float(low), float(np.log(self.high)))

    def values(self, shares: Array) -> Array:
        """Quantiles at shares from 0 to 1, which are moved inside by `SMALLEST_SHARE`."""
        return np.exp(self._log.values(shares))


def values_of(design: Design, spreads: Sequence[Distribution]) -> Array:
    """(n, D) values of the factors at the design's points.

    The levels of Morris reach from the lowest to the highest value; of a spread without these,
    from its 0.5 % to its 99.5 % quantile (`MORRIS_ENDS`), equally spaced in probability.

    Raises
    ------
    ValueError
        Unless there is one spread for each factor.
    """
    low, high = MORRIS_ENDS
    columns = []
    for unit, spread in zip(design.unit.T, spreads, strict=True):
        inner = design.method is Method.MORRIS and not spread.bounded
        columns.append(spread.values(low + (high - low) * unit if inner else unit))
    return np.column_stack(columns)


def _inside(shares: Array) -> Array:
    return np.clip(shares, SMALLEST_SHARE, 1.0 - SMALLEST_SHARE)


def _check(holds: bool, message: str, spread: object) -> None:
    if not holds:
        raise ValueError(f"{message}, found {spread}")
