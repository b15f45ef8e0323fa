"""The finite helical axis of a motion between two poses, and how sure it is.

Any rigid motion is a turn about a line in space and a shift along it. Closed form: Spoor and
Veldpaus 1980, Journal of Biomechanics 13, 391-393, doi:10.1016/0021-9290(80)90020-2. Its direction
and place are as noisy as the readings over the angle, so small turns have none (Woltring, Huiskes,
de Lange and Veldpaus 1985, Journal of Biomechanics 18, 379-389, doi:10.1016/0021-9290(85)90293-3).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from spinepipe.frames import transform_of

Array = NDArray[np.float64]

SMALLEST_ANGLE = float(np.deg2rad(2.0))
"""rad: of smaller turns the axis is noise."""

_STEP = 1e-6
"""m and rad: of the differences that tell derivatives; rounding leaves ten digits of them."""


@dataclass(frozen=True)
class Screw:
    """A turn about a line and a shift along it, in the joint frame fixed in the lower vertebra.

    Attributes
    ----------
    angle : rad, not negative. direction : (3,) of the axis; the turn about it is right-handed.
    centre : (3,) m, the point of the axis nearest to the origin of the joint frame.
    shift : m along the direction.
    """

    angle: float
    direction: Array
    centre: Array
    shift: float

    def numbers(self) -> Array:
        """(8,) angle, direction, centre, shift."""
        return np.array([self.angle, *self.direction, *self.centre, self.shift])


def screw_between(before: Array, after: Array) -> Screw:
    """The screw that takes a vertebra from one pose to another.

    Parameters
    ----------
    before, after : (6,) coordinates of the joint, m and rad; the poses must differ in orientation.

    Raises
    ------
    ValueError : where they do not, for then there is no axis.
    """
    motion = transform_of(after) @ transform_of(before).inverse()
    turn = Rotation.from_matrix(motion.rotation).as_rotvec()
    angle = float(np.linalg.norm(turn))
    if not angle > 0.0:
        raise ValueError("the poses have one orientation: no axis of rotation")
    direction = turn / angle
    shift = float(direction @ motion.origin)
    # What is left of the shift lies across the axis: a turn by the angle about a line makes it.
    across = motion.origin - shift * direction
    centre = 0.5 * (across + np.cross(direction, across) / np.tan(0.5 * angle))
    return Screw(angle, direction, centre, shift)


def derivatives(before: Array, after: Array) -> Array:
    """(8, 12) of `Screw.numbers` by the coordinates before and after, by central differences."""
    here = np.concatenate([before, after])

    def numbers(both: Array) -> Array:
        return screw_between(both[:6], both[6:]).numbers()

    columns = [
        (numbers(here + move) - numbers(here - move)) / (2.0 * _STEP) for move in _STEP * np.eye(12)
    ]
    return np.column_stack(columns)
