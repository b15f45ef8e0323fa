"""Joint laws that make a joint's own spring another spring: factors on the load it carries.

Each returns what is added: ``carried * (factor(q) - 1)``. Exact laws with sharp corners, and other
formulas of the same physics (`formulas.py` says which of them the library has too).
"""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.special import erf

from .scope import Scope
from .world import Now

SUPERIOR = 1
SMALL = 1e-4
"""Below it a series replaces a quotient of two vanishing numbers."""


def exponential(x: np.ndarray, knee: float) -> np.ndarray:
    """(exp|x| - 1) / |x|: load k (exp(a|q|) - 1) / a with x = a q."""
    size = np.maximum(np.abs(x), SMALL)
    return np.where(np.abs(x) < SMALL, 1.0 + np.abs(x) / 2.0 + x**2 / 6.0, np.expm1(size) / size)


def tangent(x: np.ndarray, knee: float) -> np.ndarray:
    """tan(x) / x: load k tan(b q) / b with x = b q."""
    size = np.clip(np.abs(x), SMALL, 1.5)
    return np.where(np.abs(x) < SMALL, 1.0 + x**2 / 3.0, np.tan(size) / size)


def cubic(x: np.ndarray, knee: float) -> np.ndarray:
    """1 + x^2: load k q (1 + c^2 q^2) with x = c q."""
    return 1.0 + x**2


def bilinear(x: np.ndarray, knee: float) -> np.ndarray:
    """Stiffness 1 up to |x| = knee and 1 + 1 / knee times beyond, in load over motion."""
    size = np.maximum(np.abs(x), SMALL)
    return 1.0 + np.maximum(size - knee, 0.0) / (knee * size)


def power(x: np.ndarray, knee: float) -> np.ndarray:
    """1 + |x|^p, p = 1.2 + 2 knee: between the exponential's and steeper than the cubic's rise."""
    return 1.0 + np.abs(x) ** (1.2 + 2.0 * knee)


def hyperbolic(x: np.ndarray, knee: float) -> np.ndarray:
    """1 / (1 - |x|): a load that grows without end at x = 1; straight beyond 0.9."""
    size = np.minimum(np.abs(x), 0.9)
    return 1.0 / (1.0 - size)


def sinh(x: np.ndarray, knee: float) -> np.ndarray:
    """sinh(x) / x: load k sinh(a q) / a."""
    size = np.clip(np.abs(x), SMALL, 30.0)
    return np.where(np.abs(x) < SMALL, 1.0 + x**2 / 6.0, np.sinh(size) / size)


# A curve with a long toe and a steep end, as measured ones are: stiffness over that at rest, by x.
_TOE = PchipInterpolator([0.0, 0.3, 0.7, 1.0, 1.4, 2.0], [1.0, 1.02, 1.3, 1.8, 2.6, 4.0])
_TOE_LOAD = _TOE.antiderivative()


def tabulated(x: np.ndarray, knee: float) -> np.ndarray:
    """Load over motion of a tabulated curve; straight beyond x = 2."""
    size = np.maximum(np.abs(x), SMALL)
    inside = np.minimum(size, 2.0)
    return (_TOE_LOAD(inside) + 4.0 * (size - inside)) / size


SHAPES = {
    one.__name__: one
    for one in (exponential, tangent, cubic, bilinear, power, hyperbolic, sinh, tabulated)
}


@dataclass(frozen=True)
class Stiffening:
    """Resistance grows with the motion; ``rate`` 1/rad or 1/m, see `SHAPES`."""

    scope: Scope
    shape: str
    rate: float
    knee: float = 0.5

    def __call__(self, q, carried, memory, now: Now):
        factor = SHAPES[self.shape](self.rate * self.scope.of(q), self.knee)
        return self.scope.into(carried, self.scope.of(carried) * (factor - 1.0))


def corner(u: np.ndarray) -> np.ndarray:
    """Share of the softness that is left at u = q / half width: all up to 1, then 1 / |u|."""
    return np.minimum(1.0, 1.0 / np.maximum(np.abs(u), 1e-12))


def _over(rounded, u):
    size = np.maximum(np.abs(u), SMALL)
    return np.where(np.abs(u) < SMALL, 1.0, rounded(size) / size)


def zone_tanh(u: np.ndarray) -> np.ndarray:
    """tanh(u) / u: load k q - lost w tanh(q / w)."""
    return _over(np.tanh, u)


def zone_erf(u: np.ndarray) -> np.ndarray:
    """Slope 1 at zero and limit 1, by the error function."""
    return _over(lambda size: erf(np.sqrt(np.pi) / 2.0 * size), u)


def zone_arctan(u: np.ndarray) -> np.ndarray:
    """Slope 1 at zero and limit 1, by the arc tangent: a zone that ends slowly."""
    return _over(lambda size: 2.0 / np.pi * np.arctan(np.pi / 2.0 * size), u)


ZONES = {"corner": corner, "tanh": zone_tanh, "erf": zone_erf, "arctan": zone_arctan}


@dataclass(frozen=True)
class NeutralZone:
    """Stiffness lower by the share ``softness`` within ``half_width`` of ``centre``.

    Off centre: load ``- softness k w (f((q - c) / w) + f(c / w))`` with f(u) = u times `ZONES`.
    """

    scope: Scope
    half_width: float
    softness: float
    formula: str = "corner"
    centre: float = 0.0

    def __call__(self, q, carried, memory, now: Now):
        lost = ZONES[self.formula]
        if not self.centre:
            share = lost(self.scope.of(q) / self.half_width)
            return self.scope.into(carried, -self.softness * share * self.scope.of(carried))
        shift = self.centre / self.half_width
        u = self.scope.of(q) / self.half_width
        risen = (u - shift) * lost(u - shift) + shift * lost(np.array(shift))
        safe = np.where(np.abs(u) < SMALL, SMALL, u)
        slope = np.where(np.abs(u) < SMALL, self._slope(lost, shift), risen / safe)
        return self.scope.into(carried, -self.softness * slope * self.scope.of(carried))

    def _slope(self, lost, shift):
        ends = np.array([-SMALL, SMALL]) - shift
        return np.diff(ends * lost(ends))[0] / (2.0 * SMALL)


@dataclass(frozen=True)
class Asymmetry:
    """Stiffness times 1 + ``share`` where the coordinate is positive, 1 - share where negative.

    ``width`` : 0, or over which the change is smooth.
    """

    scope: Scope
    share: float
    width: float = 0.0

    def __call__(self, q, carried, memory, now: Now):
        at = self.scope.of(q)
        side = np.tanh(at / self.width) if self.width else np.sign(at)
        return self.scope.into(carried, self.share * side * self.scope.of(carried))


@dataclass(frozen=True)
class Factors:
    """Stiffness of each joint times ``ratios`` (J,): levels that differ, or one lax joint.

    ``fades`` : 0, or the motion over which a ratio returns towards 1.
    """

    scope: Scope
    ratios: np.ndarray
    fades: float = 0.0

    def __call__(self, q, carried, memory, now: Now):
        left = np.exp(-((self.scope.of(q) / self.fades) ** 2)) if self.fades else 1.0
        return self.scope.into(carried, (self.ratios - 1.0) * left * self.scope.of(carried))


@dataclass(frozen=True)
class Preloaded:
    """Stiffness grows with the axial compression N that the joint carries.

    By ``per_newton`` times N ("linear"), N0 (1 - exp(-N / N0)) ("saturating") or sqrt(N N0)
    ("root") with N0 = 150 N.
    """

    scope: Scope
    per_newton: float
    formula: str = "linear"

    def __call__(self, q, carried, memory, now: Now):
        compression = -carried[..., SUPERIOR]
        factor = self.per_newton * self._risen(compression)
        return self.scope.into(carried, factor * self.scope.of(carried))

    def _risen(self, newton):
        middle = 150.0
        if self.formula == "saturating":
            return middle * -np.expm1(-newton / middle)
        if self.formula == "root":
            return np.sign(newton) * (np.sqrt(middle * (np.abs(newton) + 1.0)) - np.sqrt(middle))
        return newton
