"""Tilted axes: the axes of a joint's laws are not those of its stated frame."""

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
from spinepipe.effects.registry import register
from spinepipe.effects.tilting import tilt_parameters, tilted, tilted_by_tilt


@register("axes_tilt")
@dataclass(frozen=True)
class AxesTilt:
    """The laws see the joint's motion in tilted axes: rotation ``T' R T``, translation ``T' t``.

    T is the pose of the laws' axes in the joint frame as Z-X'-Y'' angles, exact at any size;
    off at 0. A small imperfection that real cohorts have, not itself looked for.
    """

    name: ClassVar[str] = "axes_tilt"
    kind: ClassVar[EffectKind] = EffectKind.GEOMETRY
    per_joint: ClassVar[bool] = True
    parameters: ClassVar[tuple[Parameter, ...]] = tilt_parameters(float(np.deg2rad(3.0)))

    def place(self, q: Array, parameters: Array) -> Placement:
        """Coordinates in the tilted axes."""
        return tilted(q, parameters)

    def by_parameter(self, q: Array, parameters: Array) -> PlacementByParameter:
        """Derivatives by the three tilts."""
        return tilted_by_tilt(q, parameters)
