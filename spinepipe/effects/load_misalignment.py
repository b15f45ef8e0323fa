"""Load misalignment: the axis of the applied moment is tilted against the stated one."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from spinepipe.effects.contract import Array, Indices, Kind, Neutral, Parameter
from spinepipe.effects.dead_load import DeadLoad, Wrenches, WrenchSlopes
from spinepipe.effects.registry import Spread, Trial, register

TYPICAL_RAD = float(np.deg2rad(3.0))
LARGEST_RAD = 0.5


def _tilt(name: str, which: str) -> Parameter:
    return Parameter(
        name=name,
        unit="rad",
        low=-LARGEST_RAD,
        high=LARGEST_RAD,
        default=TYPICAL_RAD,
        prior_scale=TYPICAL_RAD,
        logarithmic=False,
        meaning=f"tilt of the moment about the {which} ground axis after its main one (x, y, z, x)",
        off=0.0,
    )


@register("load_misalignment")
@dataclass(frozen=True)
class LoadMisalignment(DeadLoad):
    """Listed moments act turned: ``R1(tilt_1) R2(tilt_2) moment``; forces as listed. Off at 0.

    The main axis is the ground axis with the largest share of a step's moments (sizes summed over
    the listed wrenches); tilt_1 is about the next axis in the order x, y, z, x and tilt_2 about the
    one after: y and z for a moment about x, z and x about y, x and y about z.
    """

    name: ClassVar[str] = "load_misalignment"
    kind: ClassVar[Kind] = Kind.LOAD
    per_joint: ClassVar[bool] = False
    parameters: ClassVar[tuple[Parameter, ...]] = (
        _tilt("tilt_1", "first"),
        _tilt("tilt_2", "second"),
    )
    trial: ClassVar[Trial] = Trial(
        variants=({},),
        spreads=(Spread.SHARED, Spread.BY_SPECIMEN, Spread.BY_TEST),
        told_by="motion in all three rotations, with moments about more than one axis "
        "so that tilted joint frames do not explain it",
    )

    def wrenches(
        self, listed: Wrenches, neutral: Neutral, joints: Indices, parameters: Array
    ) -> Wrenches:
        """Turned less listed moments."""
        moments = _tilts(listed, parameters)[1] - listed.moments
        return Wrenches(listed.bodies, listed.points, np.zeros(moments.shape), moments)

    def slopes(
        self, listed: Wrenches, neutral: Neutral, joints: Indices, parameters: Array
    ) -> WrenchSlopes:
        """By the two tilts."""
        axes, turned = _tilts(listed, parameters)
        first, second = axes[..., :1, :], axes[..., 1:, :]
        by_first = np.cross(first, turned)
        by_second = np.cross(_turned(second, first, parameters[..., 0]), turned)
        moments = np.stack([by_first, by_second], axis=-1)
        return WrenchSlopes(np.zeros(moments.shape), moments)


def _tilts(listed: Wrenches, tilts: Array) -> tuple[Array, Array]:
    """(..., 2, 3) ground axes of the two tilts, and the listed moments turned, (..., W, 3)."""
    sizes = np.abs(listed.moments).sum(axis=-2)
    main = np.argmax(sizes, axis=-1)  # without moments any will do
    axes = np.eye(3)[np.stack([(main + 1) % 3, (main + 2) % 3], axis=-1)]
    half = _turned(listed.moments, axes[..., 1:, :], tilts[..., 1])
    return axes, _turned(half, axes[..., :1, :], tilts[..., 0])


def _turned(vectors: Array, axis: Array, angle: Array) -> Array:
    """Vectors (..., W, 3) turned about axes (..., 1, 3) by angles (...), by Rodrigues."""
    cosine, sine = np.cos(angle)[..., None, None], np.sin(angle)[..., None, None]
    along = np.sum(axis * vectors, axis=-1, keepdims=True) * axis
    result: Array = along + cosine * (vectors - along) + sine * np.cross(axis, vectors)
    return result
