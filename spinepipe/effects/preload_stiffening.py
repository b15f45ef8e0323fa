"""Preload stiffening: a joint under compression resists rotation and shear more."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from spinepipe.effects.carried_share import ALL_ROTATIONS, columns_of, require
from spinepipe.effects.contract import Array, EffectKind, JointResponse, Parameter
from spinepipe.effects.registry import PER_JOINT, TriedValues, register
from spinepipe.units import COORDINATES

_SUPERIOR = COORDINATES.index("superior")

STIFFENED = (*(c for c in COORDINATES if c != "superior"), ALL_ROTATIONS)
"""Compression itself is not among them: it would stiffen by its own motion, which is
`nonlinear_stiffening` in superior."""


@register("preload_stiffening")
@dataclass(frozen=True)
class PreloadStiffening:
    """Adds ``carried rise compression`` on one coordinate or all rotations; zero is off.

    Compression (N) is ``-carried[superior]``, the joint's own; under traction it is negative and
    the joint resists less. Other motion gives no compression back, so the law has no potential:
    with hardly any damping a strong rise can make a joint flutter. Stiffness about doubles under
    500 N (Gardner-Morse and Stokes 2003, J Orthop Res 21:547) to 2 kN (Janevic 1991, J Orthop Res
    9:228).
    """

    coordinate: str = "extension"
    name: ClassVar[str] = "preload_stiffening"
    kind: ClassVar[EffectKind] = EffectKind.JOINT_LAW
    per_joint: ClassVar[bool] = True
    trial: ClassVar[TriedValues] = TriedValues(
        variants=tuple({"coordinate": c} for c in STIFFENED),
        spreads=PER_JOINT,
        told_by="the same moments under two different compressive preloads",
    )

    def __post_init__(self) -> None:
        require(self.name, "coordinate", self.coordinate, STIFFENED)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The rise alone."""
        meaning = f"share of the stiffness in {self.coordinate} gained per newton of compression"
        return (Parameter("rise", "1/N", 0.0, 0.1, 1e-3, 1e-3, False, meaning, off=0.0),)

    def respond(self, q: Array, parameters: Array, carried: Array) -> JointResponse:
        """Load (J, 6) and its derivative by the carried load (J, 6, 6); no other tangent."""
        at = columns_of(self.coordinate)
        load, by_carried = np.zeros_like(q), np.zeros((*q.shape, 6))
        share = -parameters * carried[:, [_SUPERIOR]]
        load[:, at] = share * carried[:, at]
        by_carried[:, at, at] = share
        by_carried[:, at, _SUPERIOR] = -parameters * carried[:, at]
        return JointResponse(load, np.zeros((*q.shape, 6)), by_carried)

    def by_parameter(self, q: Array, parameters: Array, carried: Array) -> Array:
        """(J, 6, 1) derivative by the rise."""
        at = columns_of(self.coordinate)
        derivative = np.zeros((*q.shape, 1))
        derivative[:, at, 0] = -carried[:, [_SUPERIOR]] * carried[:, at]
        return derivative
