"""Linear bushing: six uncoupled springs, one per joint coordinate (the papers' joint)."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from spinepipe.effects.contract import Array, EffectKind, JointResponse, Parameter
from spinepipe.effects.registry import register
from spinepipe.units import COORDINATES, STIFFNESS_COLUMNS, TRANSLATIONS

_DIAGONAL = np.arange(6)

_MEANING = {
    "anterior": "resistance to anterior-posterior translation",
    "superior": "resistance to compression and traction",
    "right": "resistance to right-left translation",
    "extension": "resistance to flexion-extension",
    "right_bending": "resistance to lateral bending",
    "left_rotation": "resistance to axial rotation",
}

# Bounds span what is published for any level and direction (Gould 2024a Table 1: 3e4 to 3e6 N/m,
# 9 to 1250 N m/rad) by three decades on each side, so that a fit and not the library decides.
_TRANSLATION = {"unit": "N/m", "low": 1.0, "high": 1e10, "default": 1e5}
_ROTATION = {"unit": "N m/rad", "low": 1e-4, "high": 1e7, "default": 50.0}


def _stiffness(coordinate: str, column: str) -> Parameter:
    numbers = _TRANSLATION if coordinate in TRANSLATIONS else _ROTATION
    return Parameter(
        name=column,
        **numbers,  # type: ignore[arg-type]
        prior_scale=1.0,
        logarithmic=True,
        meaning=_MEANING[coordinate],
    )


@register("linear_bushing")
@dataclass(frozen=True)
class LinearBushing:
    """Holding load ``k_i q_i`` conjugate to each coordinate; six stiffnesses per joint.

    The law of OpenSim's coordinate forces on a joint with the same axis order.
    """

    name: ClassVar[str] = "linear_bushing"
    kind: ClassVar[EffectKind] = EffectKind.JOINT_LAW
    per_joint: ClassVar[bool] = True
    straight_over: ClassVar[float] = np.inf
    parameters: ClassVar[tuple[Parameter, ...]] = tuple(
        _stiffness(c, s) for c, s in zip(COORDINATES, STIFFNESS_COLUMNS, strict=True)
    )

    def respond(self, q: Array, parameters: Array, carried: Array) -> JointResponse:
        """Load (J, 6) and diagonal tangent (J, 6, 6)."""
        tangent = np.zeros((*q.shape, 6))
        tangent[:, _DIAGONAL, _DIAGONAL] = parameters
        return JointResponse(parameters * q, tangent)

    def by_parameter(self, q: Array, parameters: Array, carried: Array) -> Array:
        """(J, 6, 6): each stiffness moves its own load only."""
        derivative = np.zeros((*q.shape, 6))
        derivative[:, _DIAGONAL, _DIAGONAL] = q
        return derivative
