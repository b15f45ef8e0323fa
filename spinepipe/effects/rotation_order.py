"""Order of rotations: the true law acts on angles counted in another order than Z-X'-Y''."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy.spatial.transform import Rotation

from spinepipe.effects.contract import (
    Array,
    EffectKind,
    Parameter,
    Placement,
    PlacementByParameter,
)
from spinepipe.effects.registry import register
from spinepipe.effects.turning import angles_by_angles, turning

_XYZ = [1, 2, 0]
"""Right bending (x), left rotation (y), extension (z) among a joint's angles."""


@register("rotation_order")
@dataclass(frozen=True)
class RotationOrder:
    """The laws see ``q + order (p - q)`` instead of q; p has the same motion's X-Y'-Z'' angles.

    Translations are the same in both. Order 0 is off: Z-X'-Y''. At 1 the laws act on X-Y'-Z''
    exactly, in between on a mixture. Where no angle exceeds 10 deg the two differ by up to 1.9 deg.
    A small imperfection that real cohorts have, not itself looked for.
    """

    name: ClassVar[str] = "rotation_order"
    kind: ClassVar[EffectKind] = EffectKind.GEOMETRY
    per_joint: ClassVar[bool] = True
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="order",
            unit="1",
            low=-2.0,
            high=2.0,
            default=1.0,
            prior_scale=1.0,
            logarithmic=False,
            meaning="0: the laws act on Z-X'-Y'' angles, 1: on X-Y'-Z'' angles",
            off=0.0,
        ),
    )

    def place(self, q: Array, parameters: Array) -> Placement:
        """Coordinates that far towards the other order."""
        share = parameters[:, :1]
        away, by_coordinate, by_coordinates = _changes(q)
        return Placement(
            q + share * away,
            np.eye(6) + share[..., None] * by_coordinate,
            share[..., None, None] * by_coordinates,
        )

    def by_parameter(self, q: Array, parameters: Array) -> PlacementByParameter:
        """Linear in the order."""
        away, by_coordinate, _ = _changes(q)
        return PlacementByParameter(away[..., None], by_coordinate[..., None])


def _changes(q: Array) -> tuple[Array, Array, Array]:
    """``p - q`` (J, 6), its first (J, 6, 6) and second (J, 6, 6, 6) derivatives."""
    true = turning(q[:, 3:])
    angles = Rotation.from_matrix(true.rotation).as_euler("XYZ")
    seen = turning(angles, "XYZ")
    first, second = angles_by_angles(seen, true.axes, true.axes_by_angle)
    away, by_coordinate = np.zeros_like(q), np.zeros((len(q), 6, 6))
    by_coordinates = np.zeros((len(q), 6, 6, 6))
    rows = [3 + angle for angle in _XYZ]
    away[:, rows] = angles - q[:, rows]
    by_coordinate[:, rows, 3:] = first - np.eye(3)[_XYZ]
    by_coordinates[:, rows, 3:, 3:] = second
    return away, by_coordinate, by_coordinates
