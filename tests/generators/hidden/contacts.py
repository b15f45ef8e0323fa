"""Joint laws that add a load of their own: couplings and one-sided stops."""

from dataclasses import dataclass

import numpy as np

from .anatomy import COORDINATES
from .scope import Scope
from .world import Now

BENDING, ROTATION = COORDINATES.index("right_bending"), COORDINATES.index("left_rotation")


@dataclass(frozen=True)
class Coupling:
    """Off-diagonal stiffness N m/rad between lateral bending and axial rotation, symmetric."""

    joints: np.ndarray
    stiffness: float

    def __call__(self, q, carried, memory, now: Now):
        load = np.zeros_like(carried)
        load[..., BENDING] = self.stiffness * q[..., ROTATION] * self.joints
        load[..., ROTATION] = self.stiffness * q[..., BENDING] * self.joints
        return load


@dataclass(frozen=True)
class Facet:
    """A stop of ``stiffness`` N m/rad beyond ``gap`` (rad) on one side (+1 or -1) of zero."""

    scope: Scope
    side: int
    gap: float
    stiffness: float

    def __call__(self, q, carried, memory, now: Now):
        depth = np.maximum(0.0, self.side * self.scope.of(q) - self.gap)
        return self.scope.into(carried, self.side * self.stiffness * depth)


@dataclass(frozen=True)
class OffDiagonals:
    """A small symmetric stiffness matrix (J, 6, 6) without diagonal."""

    matrix: np.ndarray

    def __call__(self, q, carried, memory, now: Now):
        return np.einsum("jab,...jb->...ja", self.matrix, q)
