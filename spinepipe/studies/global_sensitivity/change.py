"""What one factor changes in a spine or in its loads."""

from dataclasses import dataclass
from enum import StrEnum


class Of(StrEnum):
    """What can be changed; offsets are in m and rad, everything else is multiplied."""

    STIFFNESS = "stiffness"
    LANDMARK = "landmark"
    JOINT_CENTRE = "joint_centre"
    JOINT_AXES = "joint_axes"
    LOAD_POINT = "load_point"
    LOAD_DIRECTION = "load_direction"
    LOAD_SIZE = "load_size"
    MASS = "mass"
    CENTRE_OF_MASS = "centre_of_mass"
    DAMPING = "damping"
    NOTHING = "nothing"


@dataclass(frozen=True)
class FactorChange:
    """One factor, its value left open.

    Attributes
    ----------
    at : names of joints or vertebrae; empty: of all.
    axis : place of the axis: of ground (x, y, z), of a joint frame, or of a coordinate among the
        six; 0 where there is none.
    landmark : name of the landmark that is moved.
    """

    of: Of
    at: tuple[str, ...] = ()
    axis: int = 0
    landmark: str = ""
