"""Load misalignment: the applied load points another way than stated."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from spinepipe.effects.contract import Array, EffectKind, Indices, Neutral, Parameter
from spinepipe.effects.dead_load import DeadLoad, Wrenches, WrenchSlopes
from spinepipe.effects.registry import PlaceSpread, TriedValues, register

TYPICAL_RAD = float(np.deg2rad(3.0))
LARGEST_RAD = 0.5

TURNS = ("moments", "wrench", "forces")


def _tilt(name: str, meaning: str) -> Parameter:
    return Parameter(
        name=name,
        unit="rad",
        low=-LARGEST_RAD,
        high=LARGEST_RAD,
        default=TYPICAL_RAD,
        prior_scale=TYPICAL_RAD,
        logarithmic=False,
        meaning=meaning,
        off=0.0,
    )


_AFTER_MAIN = tuple(
    _tilt(name, f"tilt of the moment about the {which} ground axis after its main one (x, y, z, x)")
    for name, which in (("tilt_1", "first"), ("tilt_2", "second"))
)
_OF_FRAME = tuple(
    _tilt(f"tilt_{axis}", f"tilt of the loading frame about {axis} of ground") for axis in "xyz"
)


@register("load_misalignment")
@dataclass(frozen=True)
class LoadMisalignment(DeadLoad):
    """The listed load acts turned; its point stays where it is. Off at 0.

    With ``turns: moments`` the axis of the moment is tilted, ``R1(tilt_1) R2(tilt_2) moment``, and
    forces act as listed. The main axis is the ground axis with the largest share of a step's
    moments (sizes summed over the listed wrenches); tilt_1 is about the next axis in the order x,
    y, z, x and tilt_2 about the one after: y and z for a moment about x, z and x about y, x and y
    about z.

    With ``turns: wrench`` the loading frame stands askew: every force and every moment about its
    point turns by ``Rx(tilt_x) Ry(tilt_y) Rz(tilt_z)``, in ground. With ``turns: forces`` forces
    alone do so, as those of a preload that is applied apart from the moments.
    """

    turns: str = "moments"

    name: ClassVar[str] = "load_misalignment"
    kind: ClassVar[EffectKind] = EffectKind.LOAD
    per_joint: ClassVar[bool] = False
    trial: ClassVar[TriedValues] = TriedValues(
        variants=({"turns": "moments"}, {"turns": "wrench"}),
        spreads=(PlaceSpread.SHARED, PlaceSpread.BY_SPECIMEN, PlaceSpread.BY_TEST),
        told_by="motion in several coordinates, with loads about or along more than one axis "
        "so that tilted joint frames do not explain it",
    )

    def __post_init__(self) -> None:
        if self.turns not in TURNS:
            allowed = ", ".join(TURNS)
            raise ValueError(f"load_misalignment: turns {self.turns!r}; allowed: {allowed}")

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Two tilts of the moment, or three of the loading frame."""
        return _AFTER_MAIN if self.turns == "moments" else _OF_FRAME

    def wrenches(
        self, listed: Wrenches, neutral: Neutral, joints: Indices, parameters: Array
    ) -> Wrenches:
        """Turned less listed forces and moments."""
        forces, moments = np.zeros(listed.forces.shape), np.zeros(listed.moments.shape)
        if self.turns == "moments":
            moments = _tilts(listed, parameters)[1] - listed.moments
        else:
            forces = _askew(listed.forces, parameters)[0] - listed.forces
        if self.turns == "wrench":
            moments = _askew(listed.moments, parameters)[0] - listed.moments
        return Wrenches(listed.bodies, listed.points, forces, moments)

    def slopes(
        self, listed: Wrenches, neutral: Neutral, joints: Indices, parameters: Array
    ) -> WrenchSlopes:
        """By the tilts."""
        if self.turns == "moments":
            axes, turned = _tilts(listed, parameters)
            first, second = axes[..., :1, :], axes[..., 1:, :]
            by_first = np.cross(first, turned)
            by_second = np.cross(_turned(second, first, parameters[..., 0]), turned)
            moments = np.stack([by_first, by_second], axis=-1)
            return WrenchSlopes(np.zeros(moments.shape), moments)
        forces, moments = (_askew(v, parameters)[1] for v in (listed.forces, listed.moments))
        return WrenchSlopes(forces, moments if self.turns == "wrench" else np.zeros(moments.shape))


def _tilts(listed: Wrenches, tilts: Array) -> tuple[Array, Array]:
    """(..., 2, 3) ground axes of the two tilts, and the listed moments turned, (..., W, 3)."""
    sizes = np.abs(listed.moments).sum(axis=-2)
    main = np.argmax(sizes, axis=-1)  # without moments any will do
    axes = np.eye(3)[np.stack([(main + 1) % 3, (main + 2) % 3], axis=-1)]
    half = _turned(listed.moments, axes[..., 1:, :], tilts[..., 1])
    return axes, _turned(half, axes[..., :1, :], tilts[..., 0])


def _askew(vectors: Array, tilts: Array) -> tuple[Array, Array]:
    """Vectors (..., W, 3) turned by Rx Ry Rz of tilts (..., 3), and slopes (..., W, 3, 3)."""
    x, y, z = np.eye(3)[:, None]
    about_y = _turned(y, x, tilts[..., 0])
    about_z = _turned(_turned(z, y, tilts[..., 1]), x, tilts[..., 0])
    turned = vectors
    for axis, column in ((z, 2), (y, 1), (x, 0)):
        turned = _turned(turned, axis, tilts[..., column])
    slopes = [np.cross(axis, turned) for axis in (x, about_y, about_z)]
    return turned, np.stack(slopes, axis=-1)


def _turned(vectors: Array, axis: Array, angle: Array) -> Array:
    """Vectors (..., W, 3) turned about axes (..., 1, 3) by angles (...), by Rodrigues."""
    cosine, sine = np.cos(angle)[..., None, None], np.sin(angle)[..., None, None]
    along = np.sum(axis * vectors, axis=-1, keepdims=True) * axis
    result: Array = along + cosine * (vectors - along) + sine * np.cross(axis, vectors)
    return result
