"""Marker bias: a fixed error of the frames that a joint's two vertebrae are registered in."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from spinepipe.effects.contract import Array, EffectKind, Observation, Parameter
from spinepipe.effects.registry import PlaceSpread, TriedValues, register
from spinepipe.effects.tilting import tilt_parameters, tilted, tilted_by_tilt
from spinepipe.units import COORDINATES, TRANSLATIONS

FORMS = ("offset", "tilt")

TYPICAL_RAD = float(np.deg2rad(2.0))
TYPICAL_M = 2e-3
LARGEST_IN_TYPICAL = 10.0


def _offset(coordinate: str) -> Parameter:
    moves = coordinate in TRANSLATIONS
    typical = TYPICAL_M if moves else TYPICAL_RAD
    return Parameter(
        name=coordinate,
        unit="m" if moves else "rad",
        low=-LARGEST_IN_TYPICAL * typical,
        high=LARGEST_IN_TYPICAL * typical,
        default=typical,
        prior_scale=typical,
        logarithmic=False,
        meaning=f"what the reading of {coordinate} is too large by",
        off=0.0,
    )


_PARAMETERS = {
    "offset": tuple(map(_offset, COORDINATES)),
    "tilt": tilt_parameters(TYPICAL_RAD),
}


@register("marker_bias")
@dataclass(frozen=True)
class MarkerBias:
    """Reported coordinates are true ones plus an offset, or those seen in a tilted frame.

    Form ``offset``: ``q + b``, when the two vertebrae are registered differently; at rest it
    reports b. Form ``tilt``: both vertebrae are registered in a frame tilted by T (Z-X'-Y''
    angles), so that rotations R are reported as ``T' R T`` and translations t as ``T' t``; at rest
    it reports zero. Both are off at 0.
    """

    form: str = "offset"

    name: ClassVar[str] = "marker_bias"
    kind: ClassVar[EffectKind] = EffectKind.MEASUREMENT
    per_joint: ClassVar[bool] = True
    trial: ClassVar[TriedValues] = TriedValues(
        variants=({"form": "offset"}, {"form": "tilt"}),
        spreads=(PlaceSpread.EACH, PlaceSpread.BY_JOINT, PlaceSpread.ONE_JOINT, PlaceSpread.ONE),
        told_by="offset: readings not zeroed at the unloaded step; "
        "tilt: motion about several axes, each of which shows in the others",
    )

    def __post_init__(self) -> None:
        if self.form not in FORMS:
            raise ValueError(f"marker_bias: form {self.form!r}; allowed: {', '.join(FORMS)}")

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Six offsets in the order of the coordinates, or three tilts."""
        return _PARAMETERS[self.form]

    def observe(self, q: Array, parameters: Array) -> Observation:
        """Reported coordinates and their derivative by the true ones."""
        if self.form == "offset":
            return Observation(q + parameters, np.tile(np.eye(6), (len(q), 1, 1)))
        seen = tilted(q, parameters)
        return Observation(seen.q, seen.by_coordinate)

    def by_parameter(self, q: Array, parameters: Array) -> Array:
        """(J, 6, 6) or (J, 6, 3)."""
        if self.form == "offset":
            return np.tile(np.eye(6), (len(q), 1, 1))
        return tilted_by_tilt(q, parameters).q
