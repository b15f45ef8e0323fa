"""Where an effect acts: one coordinate of some joints."""

from dataclasses import dataclass

import numpy as np

from .anatomy import COORDINATES


@dataclass(frozen=True)
class Scope:
    """Index of a joint coordinate, and a mask (J,) of 0 and 1 over the joints."""

    coordinate: int
    joints: np.ndarray

    def of(self, q: np.ndarray) -> np.ndarray:
        """(..., J) this coordinate of all joints."""
        return q[..., self.coordinate]

    def into(self, like: np.ndarray, values: np.ndarray) -> np.ndarray:
        """(..., J, 6) zero but for ``values`` (..., J) on the coordinate of joints in scope."""
        loads = np.zeros_like(like)
        loads[..., self.coordinate] = values * self.joints
        return loads


def scope(coordinate: str | None, joint: int | None, n_joints: int) -> Scope:
    """The scope of a coordinate's name and a joint's index, None for all joints."""
    mask = np.ones(n_joints) if joint is None else np.eye(n_joints)[joint]
    return Scope(COORDINATES.index(coordinate or "extension"), mask)
