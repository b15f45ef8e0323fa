"""Joint laws that make a joint's own spring another spring: factors on the load it carries.

Each returns what is added: ``carried * (factor(q) - 1)``. Exact laws with sharp corners.
"""

from dataclasses import dataclass

import numpy as np

from .scope import Scope
from .world import Now

SUPERIOR = 1
SMALL = 1e-4
"""rad: below it a series replaces a quotient of two vanishing numbers."""


def exponential(x: np.ndarray) -> np.ndarray:
    """(exp|x| - 1) / |x|: load k (exp(a|q|) - 1) / a with x = a q."""
    size = np.maximum(np.abs(x), SMALL)
    return np.where(np.abs(x) < SMALL, 1.0 + np.abs(x) / 2.0 + x**2 / 6.0, np.expm1(size) / size)


def tangent(x: np.ndarray) -> np.ndarray:
    """tan(x) / x: load k tan(b q) / b with x = b q."""
    size = np.clip(np.abs(x), SMALL, 1.5)
    return np.where(np.abs(x) < SMALL, 1.0 + x**2 / 3.0, np.tan(size) / size)


def cubic(x: np.ndarray) -> np.ndarray:
    """1 + x^2: load k q (1 + c^2 q^2) with x = c q."""
    return 1.0 + x**2


SHAPES = {"exponential": exponential, "tangent": tangent, "cubic": cubic}


@dataclass(frozen=True)
class Stiffening:
    """Resistance grows with the rotation; ``rate`` 1/rad, see `SHAPES`."""

    scope: Scope
    shape: str
    rate: float

    def __call__(self, q, carried, memory, now: Now):
        factor = SHAPES[self.shape](self.rate * self.scope.of(q))
        return self.scope.into(carried, self.scope.of(carried) * (factor - 1.0))


@dataclass(frozen=True)
class NeutralZone:
    """Stiffness times 1 - ``softness`` within ``half_width`` (rad) of zero, unchanged beyond."""

    scope: Scope
    half_width: float
    softness: float

    def __call__(self, q, carried, memory, now: Now):
        size = np.abs(self.scope.of(q))
        lost = np.minimum(1.0, self.half_width / np.maximum(size, 1e-12))
        return self.scope.into(carried, -self.softness * lost * self.scope.of(carried))


@dataclass(frozen=True)
class Asymmetry:
    """Stiffness times 1 + ``share`` where the coordinate is positive, 1 - share where negative."""

    scope: Scope
    share: float

    def __call__(self, q, carried, memory, now: Now):
        side = np.sign(self.scope.of(q))
        return self.scope.into(carried, self.share * side * self.scope.of(carried))


@dataclass(frozen=True)
class Factors:
    """Stiffness of each joint times ``ratios`` (J,): levels that differ, or one lax joint."""

    scope: Scope
    ratios: np.ndarray

    def __call__(self, q, carried, memory, now: Now):
        return self.scope.into(carried, (self.ratios - 1.0) * self.scope.of(carried))


@dataclass(frozen=True)
class Preloaded:
    """Stiffness times 1 + ``per_newton`` times the axial compression that the joint carries."""

    scope: Scope
    per_newton: float

    def __call__(self, q, carried, memory, now: Now):
        compression = -carried[..., SUPERIOR]
        factor = self.per_newton * compression
        return self.scope.into(carried, factor * self.scope.of(carried))
