"""What the joints of a trunk resist before any muscle pulls.

Moments follow curves of one rotation each, stiffer the more the joint is pressed; the upper
vertebra moves on the lower as far as the joint's own compliance lets the force push it. The paper
prints no curves (Ghezelbash 2016 Fig 2); those here are measured ones of others, whole segments or
discs alone.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import PchipInterpolator

from spinepipe.anatomy import published
from spinepipe.effects.contract import Array
from spinepipe.muscles.trunk import LEVELS
from spinepipe.units import DEG_PER_RAD

AXES = ("right_bending", "left_rotation", "extension")
"""Order of rotation vectors and moments: about x, y, z."""

T11T12, T12L1 = LEVELS.index("T11T12"), LEVELS.index("T12L1")

AXIAL_N_PER_M = {
    "L5S1": 1.47e6,
    "L4L5": 1.87e6,
    "L3L4": 2.00e6,
    "L2L3": 2.00e6,
    "L1L2": 2.13e6,
    "T12L1": 1.80e6,
    "T11T12": 1.50e6,
}
"""Kitazaki and Griffin 1997, Table 4."""

PRELOADS_N, PRELOAD_FACTORS = (0.0, 250.0, 500.0), (1.0, 1.71, 2.11)
"""Stiffness over that without preload, lumbar segments (Gardner-Morse 2004); held beyond 500 N."""


@dataclass(frozen=True)
class Curve:
    """Moment that resists a rotation, through measured points on either side of nought.

    Attributes
    ----------
    degrees, newton_metres : rotation and moment of the points, both rising, nought among them.
    """

    degrees: tuple[float, ...]
    newton_metres: tuple[float, ...]

    def __post_init__(self) -> None:
        if np.any(np.diff(self.degrees) <= 0.0) or np.any(np.diff(self.newton_metres) <= 0.0):
            raise ValueError("a moment-rotation curve must rise throughout")

    @cached_property
    def _through(self) -> PchipInterpolator:
        return PchipInterpolator(
            np.array(self.degrees) / DEG_PER_RAD, self.newton_metres, extrapolate=True
        )

    def moment(self, rad: Array) -> Array:
        """N m at rotations; straight on beyond the last points."""
        ends = np.array(self.degrees)[[0, -1]] / DEG_PER_RAD
        inside = np.clip(rad, *ends)
        found: Array = self._through(inside) + self._end_slopes(rad, ends) * (rad - inside)
        return found

    def slope(self, rad: Array) -> Array:
        """N m/rad at rotations."""
        ends = np.array(self.degrees)[[0, -1]] / DEG_PER_RAD
        inside = np.clip(rad, *ends)
        at = np.where(inside == rad, self._through(inside, 1), self._end_slopes(rad, ends))
        return np.asarray(at, dtype=float)

    def _end_slopes(self, rad: Array, ends: Array) -> Array:
        """Slope of the outermost chord on the side of each rotation."""
        chords = np.diff(self.newton_metres) / np.diff(np.array(self.degrees) / DEG_PER_RAD)
        found: Array = np.where(rad < ends[0], chords[0], chords[-1])
        return found


def _linear(nm_per_rad: float) -> Curve:
    return _both_sides((10.0,), (10.0 * nm_per_rad / DEG_PER_RAD,))


def _both_sides(degrees: tuple[float, ...], newton_metres: tuple[float, ...]) -> Curve:
    return Curve(
        (*(-d for d in reversed(degrees)), 0.0, *degrees),
        (*(-m for m in reversed(newton_metres)), 0.0, *newton_metres),
    )


def _sagittal(
    flexion_deg: tuple[float, ...],
    extension_deg: tuple[float, ...],
    newton_metres: tuple[float, ...],
) -> Curve:
    return Curve(
        (*(-d for d in reversed(flexion_deg)), 0.0, *extension_deg),
        (*(-m for m in reversed(newton_metres)), 0.0, *newton_metres),
    )


_GOULD = published("gould_2024b")["uniform_stiffness"]
_HEUER_NM = (1.0, 2.5, 5.0, 7.5)
_JARAMILLO_NM = (2.0, 4.0, 6.0, 8.0)

_SCHMIDT = (  # Schmidt 1998, whole segments: 2.3, 8.4 and 1.8 (flexion), 2.6 (extension) N m/deg
    _both_sides((10.0,), (23.0,)),
    _both_sides((10.0,), (84.0,)),
    Curve((-10.0, -5.0, -0.5, 0.0, 0.5, 5.0, 10.0), (-18.0, -9.0, -0.9, 0.0, 1.3, 13.0, 26.0)),
)
_HEUER = (  # Heuer 2007, disc L4L5 alone, medians
    _both_sides((2.27, 3.6, 5.08, 6.43), _HEUER_NM),
    _both_sides((1.32, 2.7, 4.36, 5.73), _HEUER_NM),
    _sagittal((4.95, 6.64, 8.38, 10.11), (1.23, 5.15, 7.92, 10.28), _HEUER_NM),
)

CURVES: Mapping[str, tuple[Curve, Curve, Curve]] = {
    "segment_gould": (  # Gould 2024b Table 2, uniform: linear, whole segments
        _linear(_GOULD["right_bending_nm_per_rad"]),
        _linear(_GOULD["left_rotation_nm_per_rad"]),
        _linear(_GOULD["extension_nm_per_rad"]),
    ),
    "mixed": (_HEUER[0], _SCHMIDT[1], _SCHMIDT[2]),
    "segment": _SCHMIDT,
    "disc_heuer": _HEUER,
    "disc_jaramillo": (  # Jaramillo, in Gruber 2024, disc L4L5 alone, means
        _both_sides((4.39, 5.77, 6.58, 7.1), _JARAMILLO_NM),
        _both_sides((3.21, 4.51, 5.43, 5.79), _JARAMILLO_NM),
        _sagittal((7.32, 9.26, 10.76, 11.87), (5.47, 6.77, 7.65, 8.27), _JARAMILLO_NM),
    ),
    "disc_han": (  # Han 2010, lumbar disc
        _both_sides((2.0, 4.0, 6.0, 8.0, 10.0), (1.43, 2.93, 4.51, 6.15, 7.86)),
        _both_sides((1.0, 2.0, 3.0, 4.0), (1.03, 2.09, 3.22, 4.47)),
        _both_sides((2.0, 4.0, 6.0, 8.0, 10.0), (0.90, 1.79, 2.76, 3.90, 5.32)),
    ),
}
"""About x, y and z: right bending, left rotation, extension.

mixed: sideways the disc alone, else whole segments. Ligaments and facets hardly resist bending
sideways; a segment as stiff sideways as Schmidt's needs muscles to bend it where people lean.
"""


@dataclass(frozen=True, eq=False)
class JointLaws:
    """The seven joints of one person.

    Attributes
    ----------
    curves : about x, y, z of the disc.
    angular : (7, 3) factors of the curves: the person's size, and whatever is varied.
    axial, shear : (7,) and (7, 2) N/m, along the disc's axis; forwards and to the right.
    stiffens : whether compression stiffens the curves.
    """

    curves: tuple[Curve, Curve, Curve]
    angular: Array
    axial: Array
    shear: Array
    stiffens: bool

    def stiffening(self, compression: Array) -> Array:
        """(..., 7) factor of the moments under compressions (..., 7) N."""
        if not self.stiffens:
            return np.ones(np.shape(compression))
        return np.interp(compression, PRELOADS_N, PRELOAD_FACTORS)

    def moments(self, turned: Array, compression: Array) -> Array:
        """(..., 7, 3) N m on what is above, axes of the disc, for rotation vectors (..., 7, 3)."""
        curve = np.stack([c.moment(turned[..., k]) for k, c in enumerate(self.curves)], axis=-1)
        found: Array = -self.stiffening(compression)[..., None] * self.angular * curve
        return found

    def slopes(self, turned: Array, compression: Array) -> Array:
        """(7, 3) N m/rad, how fast the resistance grows with the rotations."""
        slope = np.stack([c.slope(turned[:, k]) for k, c in enumerate(self.curves)], axis=1)
        found: Array = self.stiffening(compression)[:, None] * self.angular * slope
        return found

    def translations(self, pushes: Array) -> Array:
        """(..., 7, 3) m by which the upper vertebra moves, pushed with (..., 7, 3) N, disc axes."""
        forwards, right = (pushes[..., k] / self.shear[:, n] for n, k in enumerate((0, 2)))
        return np.stack([forwards, pushes[..., 1] / self.axial, right], axis=-1)
