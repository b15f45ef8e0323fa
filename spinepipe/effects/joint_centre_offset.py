"""Joint centre offset: the centre that a joint's laws act about is not where it was stated."""

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
from spinepipe.units import TRANSLATIONS

TYPICAL_M = 5e-3
FARTHEST_M = 0.05


def _offset(direction: str) -> Parameter:
    return Parameter(
        name=direction,
        unit="m",
        low=-FARTHEST_M,
        high=FARTHEST_M,
        default=TYPICAL_M,
        prior_scale=TYPICAL_M,
        logarithmic=False,
        meaning=f"how far the centre lies from the stated one along the joint's {direction} axis",
        off=0.0,
    )


@register("joint_centre_offset")
@dataclass(frozen=True)
class JointCentreOffset:
    """The laws see the translation ``t + (R - 1) c`` of the centre c instead of t; angles as is.

    c is the centre of the laws in the joint frame, measured from the stated centre; off at 0.
    """

    name: ClassVar[str] = "joint_centre_offset"
    kind: ClassVar[EffectKind] = EffectKind.GEOMETRY
    per_joint: ClassVar[bool] = True
    parameters: ClassVar[tuple[Parameter, ...]] = tuple(map(_offset, TRANSLATIONS))
    trial: ClassVar[TriedValues] = TriedValues(
        variants=({},),
        spreads=(
            *(PlaceSpread.SHARED, PlaceSpread.BY_JOINT, PlaceSpread.BY_SPECIMEN),
            *(PlaceSpread.EACH, PlaceSpread.ONE_JOINT, PlaceSpread.ONE),
        ),
        told_by="measured translations, or forces beside the moments: "
        "rotations under pure moments do not depend on the centre",
    )

    def place(self, q: Array, parameters: Array) -> Placement:
        """Translation of the centre (J, 3), angles as they are."""
        turned = turning(q[:, 3:])
        moved, first = q.copy(), np.tile(np.eye(6), (len(q), 1, 1))
        second = np.zeros((len(q), 6, 6, 6))
        moved[:, :3] += np.einsum("jxy,jy->jx", turned.rotation - np.eye(3), parameters)
        first[:, :3, 3:] = np.einsum("jaxy,jy->jxa", turned.first, parameters)
        second[:, :3, 3:, 3:] = np.einsum("jabxy,jy->jxab", turned.second, parameters)
        return Placement(moved, first, second)

    def by_parameter(self, q: Array, parameters: Array) -> PlacementByParameter:
        """Linear in the centre: ``R - 1`` and its derivative by the angles."""
        turned = turning(q[:, 3:])
        by_q, first = np.zeros((len(q), 6, 3)), np.zeros((len(q), 6, 6, 3))
        by_q[:, :3] = turned.rotation - np.eye(3)
        first[:, :3, 3:] = turned.first.swapaxes(1, 2)
        return PlacementByParameter(by_q, first)
