"""Rotations of joints and their derivatives by the three angles, for effects on geometry."""

from dataclasses import dataclass

import numpy as np

from spinepipe.effects.contract import Array

_SPINS = {
    axis: np.cross(direction, np.eye(3)).T for axis, direction in zip("XYZ", np.eye(3), strict=True)
}
"""(3, 3) cross-product matrix of each axis."""

_FIRST, _SECOND = [0, 1, 0, 2, 1, 0], [0, 0, 1, 0, 1, 2]
"""How often the first and the second turn are differentiated in each product of these two."""

_TWO, _THIRD = [0, 1, 2, 0, 3, 4, 1, 5, 2, 0], [0, 0, 0, 1, 0, 0, 1, 0, 1, 2]
"""Those products and how often the third turn is differentiated: none, by one angle, by two."""

_BY_TWO = [[4, 5, 6], [5, 7, 8], [6, 8, 9]]
"""Which of these is the derivative by angles a and b."""


@dataclass(frozen=True)
class Turning:
    """Rotations of J joints: three turns, each about an axis that those before have moved.

    Attributes
    ----------
    rotation : (J, 3, 3).
    first : (J, 3, 3, 3) derivative by angle a, ``[j, a]``.
    second : (J, 3, 3, 3, 3) derivative by angles a and b, ``[j, a, b]``.
    """

    rotation: Array
    first: Array
    second: Array

    @property
    def axes(self) -> Array:
        """(J, 3, 3) columns: the axis each angle turns about, as the angles before have moved it.

        Angle rates times these axes are the angular velocity.
        """
        return _axial(self.first @ self._back[:, None]).swapaxes(-1, -2)

    @property
    def axes_by_angle(self) -> Array:
        """(J, 3, 3, 3) derivative of axis a by angle b, ``[j, :, a, b]``."""
        back = self.first.swapaxes(-1, -2)
        spins = self.second @ self._back[:, None, None] + self.first[:, :, None] @ back[:, None]
        return _axial(spins).transpose(0, 3, 1, 2)

    @property
    def _back(self) -> Array:
        return self.rotation.swapaxes(-1, -2)


def turning(angles: Array, order: str = "ZXY") -> Turning:
    """Rotations and derivatives at (J, 3) angles, rad, given in the order of the turns.

    The order Z-X'-Y'' is that of extension, right bending, left rotation.
    """
    spins = np.stack([_SPINS[axis] for axis in order])[:, None]
    twice = spins @ spins
    sine, cosine = np.sin(angles.T)[..., None, None], np.cos(angles.T)[..., None, None]
    turns = np.stack(  # Rodrigues: a turn about a fixed axis, and its two derivatives
        [
            np.eye(3) + sine * spins + (1.0 - cosine) * twice,
            cosine * spins + sine * twice,
            -sine * spins + cosine * twice,
        ]
    )
    two = turns[_FIRST, 0] @ turns[_SECOND, 1]
    product = (two[_TWO] @ turns[_THIRD, 2]).swapaxes(0, 1)
    return Turning(product[:, 0], product[:, 1:4], product[:, _BY_TWO])


def angles_by_angles(seen: Turning, axes: Array, axes_by_angle: Array) -> tuple[Array, Array]:
    """First (J, 3, 3) and second (J, 3, 3, 3) derivatives of the seen angles by others.

    The others make the same motion by turning about ``axes`` (J, 3, 3). Both give one angular
    velocity, ``E(seen) d(seen) = axes d(others)``; its derivative gives the second.
    """
    first = solve_axes(seen.axes, axes)
    moved = axes_by_angle - np.einsum("jxkl,jlb,jka->jxab", seen.axes_by_angle, first, first)
    return first, solve_axes(seen.axes, moved)


def solve_axes(axes: Array, by: Array) -> Array:
    """(J, 3, …) the inverse of axes (J, 3, 3) times each column of (J, 3, …)."""
    columns = by.reshape(*by.shape[:2], -1)
    return np.array(np.linalg.solve(axes, columns), dtype=float).reshape(by.shape)


def _axial(spins: Array) -> Array:
    """(…, 3) vectors of (…, 3, 3) cross-product matrices."""
    return np.stack([spins[..., 2, 1], spins[..., 0, 2], spins[..., 1, 0]], axis=-1)
