"""Load offset: a constant load on the top vertebra that is not listed (sensor bias, cable)."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from spinepipe.effects.carried_share import require
from spinepipe.effects.contract import Array, EffectKind, Indices, Neutral, Parameter
from spinepipe.effects.dead_load import DeadLoad, Wrenches, WrenchSlopes, centres
from spinepipe.effects.registry import PlaceSpread, TriedValues, register
from spinepipe.units import TRANSLATIONS

TYPICAL_NM, LARGEST_NM = 0.3, 10.0
TYPICAL_N, LARGEST_N = 5.0, 200.0


def _moment(axis: str) -> Parameter:
    return Parameter(
        name=f"moment_{axis}",
        unit="N m",
        low=-LARGEST_NM,
        high=LARGEST_NM,
        default=TYPICAL_NM,
        prior_scale=TYPICAL_NM,
        logarithmic=False,
        meaning=f"extra moment about {axis} of ground",
        off=0.0,
    )


def _force(direction: str, name: str = "force") -> Parameter:
    return Parameter(
        name=name,
        unit="N",
        low=-LARGEST_N,
        high=LARGEST_N,
        default=TYPICAL_N,
        prior_scale=TYPICAL_N,
        logarithmic=False,
        meaning=f"extra force towards {direction} in ground",
        off=0.0,
    )


_MOMENTS = tuple(map(_moment, "xyz"))
_FORCES = tuple(_force(direction, f"force_{direction}") for direction in TRANSLATIONS)

MOMENT, FORCE = "moment", "force"


@register("load_offset")
@dataclass(frozen=True)
class LoadOffset(DeadLoad):
    """A load fixed in ground on the most cranial vertebra in scope, in every step; off at 0.

    A moment, or a force at the vertebra's centre: with a coordinate (a translation) along the
    ground axis that points that way, anterior x, superior y, right z, else in any direction, as a
    cable pulls that was not listed. It acts in unloaded steps too: all motion is from the pose
    without it.
    """

    coordinate: str | None = None
    applies: str = MOMENT

    name: ClassVar[str] = "load_offset"
    kind: ClassVar[EffectKind] = EffectKind.LOAD
    per_joint: ClassVar[bool] = False
    trial: ClassVar[TriedValues] = TriedValues(
        variants=({}, {"applies": FORCE}, *({"coordinate": c} for c in TRANSLATIONS)),
        spreads=(PlaceSpread.SHARED, PlaceSpread.BY_SPECIMEN, PlaceSpread.BY_TEST),
        told_by="readings not zeroed at the unloaded step; if zeroed, a joint that is not linear, "
        "or loads large enough to turn the vertebrae in the moment",
    )

    def __post_init__(self) -> None:
        if self.coordinate is not None:
            require(self.name, "coordinate", self.coordinate, TRANSLATIONS)
        require(self.name, "applies", self.applies, (MOMENT, FORCE))

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Three components of the moment or the force, or the force in one direction."""
        if self.coordinate is not None:
            return (_force(self.coordinate),)
        return _MOMENTS if self.applies == MOMENT else _FORCES

    def wrenches(
        self, listed: Wrenches, neutral: Neutral, joints: Indices, parameters: Array
    ) -> Wrenches:
        """The load on the most cranial vertebra."""
        top = int(joints.max())
        zeros = np.zeros((*parameters.shape[:-1], 1, 3))
        bodies = np.full(zeros.shape[:-1], top)
        if self._is_moment:
            return Wrenches(bodies, zeros, zeros, parameters[..., None, :])
        points = np.broadcast_to(centres(neutral)[..., [top], :], zeros.shape)
        return Wrenches(bodies, points, (parameters @ self._axes.T)[..., None, :], zeros)

    def slopes(
        self, listed: Wrenches, neutral: Neutral, joints: Indices, parameters: Array
    ) -> WrenchSlopes:
        """The load itself is what the parameters are."""
        shape = (*parameters.shape[:-1], 1, 3, parameters.shape[-1])
        zeros = np.zeros(shape)
        if self._is_moment:
            return WrenchSlopes(zeros, np.broadcast_to(np.eye(3), shape))
        return WrenchSlopes(np.broadcast_to(self._axes, shape), zeros)

    @property
    def _is_moment(self) -> bool:
        return self.coordinate is None and self.applies == MOMENT

    @property
    def _axes(self) -> Array:
        """(3, P) directions in ground of the components of a force."""
        if self.coordinate is None:
            return np.eye(3)
        return np.eye(3)[:, [TRANSLATIONS.index(self.coordinate)]]
