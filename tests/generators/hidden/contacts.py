"""Joint laws that add a load of their own: couplings and one-sided stops."""

from dataclasses import dataclass

import numpy as np

from .anatomy import COORDINATES
from .scope import Scope
from .world import Now

BENDING, ROTATION = COORDINATES.index("right_bending"), COORDINATES.index("left_rotation")


@dataclass(frozen=True)
class Coupling:
    """Off-diagonal stiffness N m/rad between lateral bending and axial rotation, symmetric.

    ``reach`` : 0, or rad at which the coupling saturates: energy
    ``stiffness reach^2 tanh(b / reach) tanh(r / reach)``.
    """

    joints: np.ndarray
    stiffness: float
    reach: float = 0.0

    def __call__(self, q, carried, memory, now: Now):
        load = np.zeros_like(carried)
        bending, rotation = q[..., BENDING], q[..., ROTATION]
        load[..., BENDING] = self.stiffness * self._half(bending, rotation) * self.joints
        load[..., ROTATION] = self.stiffness * self._half(rotation, bending) * self.joints
        return load

    def _half(self, mine, other):
        """Load on one rotation by the other, per stiffness."""
        if not self.reach:
            return other
        return self.reach * np.tanh(other / self.reach) / np.cosh(mine / self.reach) ** 2


def linear(depth: np.ndarray, width: float) -> np.ndarray:
    """Depth itself."""
    return np.maximum(0.0, depth)


def hertz(depth: np.ndarray, width: float) -> np.ndarray:
    """depth^1.5, with the linear stop's load at ``width``."""
    return np.maximum(0.0, depth) ** 1.5 / np.sqrt(width)


def exponential(depth: np.ndarray, width: float) -> np.ndarray:
    """width (exp(depth / width) - 1), straight beyond five widths."""
    over = np.maximum(0.0, depth) / width
    near = np.minimum(over, 5.0)
    return width * (np.expm1(near) + np.exp(near) * (over - near))


def soft(depth: np.ndarray, width: float) -> np.ndarray:
    """A stop that is felt early: softened over half a width to each side of the gap."""
    scale = width / 4.0
    return scale * np.logaddexp(0.0, depth / scale)


STOPS = {one.__name__: one for one in (linear, hertz, exponential, soft)}


@dataclass(frozen=True)
class Facet:
    """A stop of ``stiffness`` N m/rad (N/m) beyond ``gap`` on one side (+1 or -1) of zero."""

    scope: Scope
    side: int
    gap: float
    stiffness: float
    formula: str = "linear"
    width: float = 0.02

    def __call__(self, q, carried, memory, now: Now):
        stop = STOPS[self.formula]
        at_rest = stop(np.array(-self.gap), self.width)
        over = stop(self.side * self.scope.of(q) - self.gap, self.width) - at_rest
        return self.scope.into(carried, self.side * self.stiffness * over)


@dataclass(frozen=True)
class OffDiagonals:
    """A small symmetric stiffness matrix (J, 6, 6) without diagonal."""

    matrix: np.ndarray

    def __call__(self, q, carried, memory, now: Now):
        return np.einsum("jab,...jb->...ja", self.matrix, q)
