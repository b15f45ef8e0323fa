"""What factors add up to: one array per kind of change, whatever their number and order."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from spinepipe.cohort.varied.change import Change, Of
from spinepipe.effects.contract import Array
from spinepipe.frames import FRAME_LANDMARKS


@dataclass(frozen=True, eq=False)
class Variation:
    """Changes of M spines with J joints and J + 1 vertebrae; factors multiply, offsets add up.

    Attributes
    ----------
    stiffness : (M, J, 6) factors.
    landmarks : (M, J + 1, 4, 3) m, ground, of the landmarks that make frames, in their order.
    frames : (M, J, 6) m and rad: how far each joint frame is moved along, then turned about its
        own axes, as `transform_of` says.
    load_points : (M, 3) m, ground.
    load_turns : (M, 3) rad, rotation vector in ground: several axes are turned about at once, in
        no order.
    load_sizes : (M,) factors.
    masses : (M, J) factors. coms : (M, J, 3) m, ground.
    damping : (M,) factors.
    """

    stiffness: Array
    landmarks: Array
    frames: Array
    load_points: Array
    load_turns: Array
    load_sizes: Array
    masses: Array
    coms: Array
    damping: Array

    @classmethod
    def none(cls, count: int, n_joints: int) -> "Variation":
        """Nothing is changed, that many times."""
        offsets, factors = np.zeros, np.ones
        return cls(
            stiffness=factors((count, n_joints, 6)),
            landmarks=offsets((count, n_joints + 1, len(FRAME_LANDMARKS), 3)),
            frames=offsets((count, n_joints, 6)),
            load_points=offsets((count, 3)),
            load_turns=offsets((count, 3)),
            load_sizes=factors(count),
            masses=factors((count, n_joints)),
            coms=offsets((count, n_joints, 3)),
            damping=factors(count),
        )


def variation(
    changes: Sequence[Change], values: Array, joints: Sequence[str], vertebrae: Sequence[str]
) -> Variation:
    """Changes with their values as one variation.

    Parameters
    ----------
    values : (M, D) of D changes: m, rad, or factors.
    joints, vertebrae : of the spine, caudal to cranial.
    """
    total = Variation.none(len(values), len(joints))
    places = _Places(tuple(joints), tuple(vertebrae))
    for change, column in zip(changes, values.T, strict=True):
        if change.of is not Of.NOTHING:
            _APPLY[change.of](total, change, places, column)
    return total


@dataclass(frozen=True)
class _Places:
    joints: tuple[str, ...]
    vertebrae: tuple[str, ...]

    def of_joints(self, change: Change) -> list[int]:
        return [self.joints.index(name) for name in change.at or self.joints]

    def of_bodies(self, change: Change) -> list[int]:
        """Places among the moving vertebrae."""
        moving = self.vertebrae[1:]
        return [moving.index(name) for name in change.at or moving]


def _stiffness(total: Variation, change: Change, places: _Places, column: Array) -> None:
    total.stiffness[:, places.of_joints(change), change.axis] *= column[:, None]


def _landmark(total: Variation, change: Change, places: _Places, column: Array) -> None:
    point = FRAME_LANDMARKS.index(change.landmark)
    for vertebra in change.at:
        total.landmarks[:, places.vertebrae.index(vertebra), point, change.axis] += column


def _joint_centre(total: Variation, change: Change, places: _Places, column: Array) -> None:
    total.frames[:, places.of_joints(change), change.axis] += column[:, None]


def _joint_axes(total: Variation, change: Change, places: _Places, column: Array) -> None:
    total.frames[:, places.of_joints(change), 3 + change.axis] += column[:, None]


def _load_point(total: Variation, change: Change, places: _Places, column: Array) -> None:
    total.load_points[:, change.axis] += column


def _load_direction(total: Variation, change: Change, places: _Places, column: Array) -> None:
    total.load_turns[:, change.axis] += column


def _load_size(total: Variation, change: Change, places: _Places, column: Array) -> None:
    total.load_sizes[:] *= column


def _mass(total: Variation, change: Change, places: _Places, column: Array) -> None:
    total.masses[:, places.of_bodies(change)] *= column[:, None]


def _centre_of_mass(total: Variation, change: Change, places: _Places, column: Array) -> None:
    total.coms[:, places.of_bodies(change), change.axis] += column[:, None]


def _damping(total: Variation, change: Change, places: _Places, column: Array) -> None:
    total.damping[:] *= column


_APPLY: dict[Of, Callable[[Variation, Change, _Places, Array], None]] = {
    Of.STIFFNESS: _stiffness,
    Of.LANDMARK: _landmark,
    Of.JOINT_CENTRE: _joint_centre,
    Of.JOINT_AXES: _joint_axes,
    Of.LOAD_POINT: _load_point,
    Of.LOAD_DIRECTION: _load_direction,
    Of.LOAD_SIZE: _load_size,
    Of.MASS: _mass,
    Of.CENTRE_OF_MASS: _centre_of_mass,
    Of.DAMPING: _damping,
}
