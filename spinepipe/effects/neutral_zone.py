"""Neutral zone: little resistance near the neutral pose, the joint's own beyond."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from spinepipe.effects.carried_share import CarriedShare, Share, require
from spinepipe.effects.contract import Array, Kind, Parameter
from spinepipe.effects.registry import PER_JOINT, Trial, register
from spinepipe.effects.rounding import ramp
from spinepipe.units import COORDINATES, ROTATIONS, TRANSLATIONS

ROUNDED = 0.1
"""Share of the width, to each side of the corner, over which the corner is rounded."""

WIDEST = 5.0
"""Times the usual width at most: beyond, all motion lies inside and the joint is but softer."""

# Half widths near those of lumbar joints: Yamamoto 1989 (Spine 14:1256), 1 to 2 deg in bending
# of either kind and less in axial rotation. Translations: a tenth of a millimetre.
_HALF_WIDTH_DEG = {"extension": 1.5, "right_bending": 1.5, "left_rotation": 0.5}


@register("neutral_zone")
@dataclass(frozen=True)
class NeutralZone(CarriedShare):
    """Load ``carried (1 - (1 - ratio) g(q / width))`` on one coordinate; a ratio of 1 is off.

    g is 1 within ±1 and 1/|u| beyond: a linear spring has ``ratio`` times its stiffness inside
    the zone and runs parallel to its old line outside. The corner is rounded over a tenth of the
    width to each side. Neutral zone: Panjabi 1992 (J Spinal Disord 5:390).
    """

    coordinate: str = "extension"
    name: ClassVar[str] = "neutral_zone"
    kind: ClassVar[Kind] = Kind.JOINT_LAW
    per_joint: ClassVar[bool] = True
    trial: ClassVar[Trial] = Trial(
        variants=tuple({"coordinate": c} for c in ROTATIONS),
        spreads=PER_JOINT,
        told_by="load steps small enough to stay near the neutral pose, and large ones",
    )

    def __post_init__(self) -> None:
        require(self.name, "coordinate", self.coordinate, COORDINATES)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The stiffness ratio inside the zone, and the zone's half width."""
        ratio = Parameter(
            "stiffness_ratio",
            "1",
            0.0,
            1.0,
            0.3,
            0.5,
            False,
            f"stiffness in {self.coordinate} inside the zone over that outside",
            off=1.0,
        )
        meaning = f"half width of the neutral zone in {self.coordinate}"
        if self.coordinate in TRANSLATIONS:
            return ratio, Parameter("width", "m", 1e-6, 0.02, 1e-4, 1.0, True, meaning)
        width = float(np.deg2rad(_HALF_WIDTH_DEG[self.coordinate]))
        return ratio, Parameter("width", "rad", 1e-4, WIDEST * width, width, 0.7, True, meaning)

    def share(self, q: Array, parameters: Array) -> Share:
        """``(ratio - 1) g(q / width)``."""
        ratio, width = parameters[:, :1], parameters[:, 1:]
        g, by_u = _inside(q / width)
        slope = (ratio - 1.0) * by_u / width
        return Share((ratio - 1.0) * g, slope, np.stack([g, -slope * q / width], axis=2))


def _inside(u: Array) -> tuple[Array, Array]:
    """``min(1, 1 / |u|)`` with its corner rounded, and its slope."""
    size = np.abs(u)
    over, slope = ramp(size - 1.0, ROUNDED)
    safe = np.maximum(size, 1.0 - ROUNDED)  # nothing is over nearer to zero
    return 1.0 - over / safe, -np.sign(u) * (slope - over / safe) / safe
