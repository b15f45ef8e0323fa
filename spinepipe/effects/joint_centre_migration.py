"""Joint centre migration: the centre that a joint's laws act about moves with its extension."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from spinepipe.effects.contract import (
    Array,
    EffectKind,
    Parameter,
    Placement,
    PlacementByParameter,
)
from spinepipe.effects.registry import PlaceSpread, TriedValues, register
from spinepipe.effects.turning import turning
from spinepipe.units import COORDINATES, DEG_PER_RAD, MM_PER_M

TYPICAL_M_PER_RAD = DEG_PER_RAD / MM_PER_M
"""1 mm per degree."""

LARGEST_M_PER_RAD = 10.0 * TYPICAL_M_PER_RAD

DIRECTIONS = ("anterior", "superior")
_EXTENSION = COORDINATES.index("extension")


def _rate(direction: str) -> Parameter:
    return Parameter(
        name=direction,
        unit="m/rad",
        low=-LARGEST_M_PER_RAD,
        high=LARGEST_M_PER_RAD,
        default=TYPICAL_M_PER_RAD,
        prior_scale=TYPICAL_M_PER_RAD,
        logarithmic=False,
        meaning=f"how far the centre moves along the joint's {direction} axis per extension angle",
        off=0.0,
    )


@register("joint_centre_migration")
@dataclass(frozen=True)
class JointCentreMigration:
    """The laws see the translation ``t + (R - 1) m extension`` instead of t; angles as they are.

    m (anterior, superior) is the path of the centre in the joint frame per extension angle; in the
    neutral pose the centre is where it was stated. Off at 0.
    """

    name: ClassVar[str] = "joint_centre_migration"
    kind: ClassVar[EffectKind] = EffectKind.GEOMETRY
    per_joint: ClassVar[bool] = True
    parameters: ClassVar[tuple[Parameter, ...]] = tuple(map(_rate, DIRECTIONS))
    trial: ClassVar[TriedValues] = TriedValues(
        variants=({},),
        spreads=(
            *(PlaceSpread.SHARED, PlaceSpread.BY_JOINT, PlaceSpread.BY_SPECIMEN),
            *(PlaceSpread.EACH, PlaceSpread.ONE_JOINT, PlaceSpread.ONE),
        ),
        told_by="translations measured at several angles of flexion and extension, "
        "or forces beside the moments",
    )

    def place(self, q: Array, parameters: Array) -> Placement:
        """Translation of the migrating centre (J, 3), angles as they are."""
        turned, path = turning(q[:, 3:]), parameters
        angle = q[:, _EXTENSION, None]
        away = np.einsum("jxy,jy->jx", _away(turned.rotation), path)
        by_angle = np.einsum("jaxy,jy->jxa", turned.first[..., :2], path)
        moved, first = q.copy(), np.tile(np.eye(6), (len(q), 1, 1))
        second = np.zeros((len(q), 6, 6, 6))
        moved[:, :3] += angle * away
        first[:, :3, 3:] = angle[..., None] * by_angle
        first[:, :3, _EXTENSION] += away
        twice = np.einsum("jabxy,jy->jxab", turned.second[..., :2], path)
        second[:, :3, 3:, 3:] = angle[..., None, None] * twice
        second[:, :3, _EXTENSION, 3:] += by_angle
        second[:, :3, 3:, _EXTENSION] += by_angle
        return Placement(moved, first, second)

    def by_parameter(self, q: Array, parameters: Array) -> PlacementByParameter:
        """Linear in the path of the centre."""
        turned = turning(q[:, 3:])
        angle = q[:, _EXTENSION, None, None]
        by_q, first = np.zeros((len(q), 6, 2)), np.zeros((len(q), 6, 6, 2))
        by_q[:, :3] = angle * _away(turned.rotation)
        first[:, :3, 3:] = angle[..., None] * turned.first[..., :2].swapaxes(1, 2)
        first[:, :3, _EXTENSION] += _away(turned.rotation)
        return PlacementByParameter(by_q, first)


def _away(rotation: Array) -> Array:
    """(J, 3, 2) what the rotation moves points on the first two axes by, per distance."""
    return (rotation - np.eye(3))[..., :2]
