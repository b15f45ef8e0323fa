"""Load misalignment: the axis of the applied moment is tilted against the stated one."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy.spatial.transform import Rotation

from spinepipe.effects.contract import (
    AppliedLoad,
    Array,
    Indices,
    Kind,
    Motion,
    Parameter,
    Wrench,
)
from spinepipe.effects.registry import Spread, Trial, register
from spinepipe.effects.vertebra_points import nothing_applied

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
class LoadMisalignment:
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

    def apply(
        self, motion: Motion, wrenches: tuple[Wrench, ...], joints: Indices, parameters: Array
    ) -> AppliedLoad:
        """Turned less listed moments, and their tangent."""
        load, tangent = nothing_applied(motion)
        axes = _tilt_axes(wrenches)
        for listed in wrenches:
            first, second = _turns(axes, parameters[0])
            change = first.apply(second.apply(listed.moment)) - listed.moment
            extra = motion.wrench(listed.body, listed.point, np.zeros(3), change)
            load, tangent = load + extra.load, tangent + extra.tangent
        return AppliedLoad(load, tangent)

    def by_parameter(
        self, motion: Motion, wrenches: tuple[Wrench, ...], joints: Indices, parameters: Array
    ) -> Array:
        """(n, 1, 2) by the two tilts."""
        derivative = np.zeros((len(motion.axes), 1, 2))
        axes = _tilt_axes(wrenches)
        first, second = _turns(axes, parameters[0])
        for listed in wrenches:
            half = second.apply(listed.moment)
            by_first = np.cross(axes[0], first.apply(half))
            by_second = first.apply(np.cross(axes[1], half))
            angular = motion.angular(listed.body)
            derivative[:, 0] += angular @ np.column_stack([by_first, by_second])
        return derivative


def _tilt_axes(wrenches: tuple[Wrench, ...]) -> Array:
    """(2, 3) ground axes of the two tilts; without moments any will do."""
    sizes = sum((np.abs(wrench.moment) for wrench in wrenches), np.zeros(3))
    main = int(np.argmax(sizes))
    return np.eye(3)[[(main + 1) % 3, (main + 2) % 3]]


def _turns(axes: Array, tilts: Array) -> tuple[Rotation, Rotation]:
    first, second = (Rotation.from_rotvec(t * axis) for t, axis in zip(tilts, axes, strict=True))
    return first, second
