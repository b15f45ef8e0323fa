"""Passive tissue of a trunk: what joints and stretched muscles resist before any muscle is active.

Moments of joints follow curves of one rotation each, stiffer the more the joint is pressed; the
upper vertebra moves on the lower as far as the joint's own compliance lets the force push it. The
paper prints no curves (Ghezelbash 2016 Fig 2); those here are measured ones of others, whole
segments or discs alone.

What lies behind the joints is slack when one stands and steep at the end of flexion. It is no
moment alone: it pulls, and presses the disc.

The force of a stretched muscle is an exponential of the strain of its fibres (Thelen 2003; default
of OpenSim). Fibres are slack up to the length of the upright posture and take up all that the path
gains; the curve of Davis 2003, which the paper uses, is printed nowhere that we know of.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

import numpy as np
from scipy.interpolate import PchipInterpolator

from spinepipe.anatomy import published
from spinepipe.effects.contract import Array
from spinepipe.facts import number, numbers, several
from spinepipe.muscles.trunk import EXTENSION, LEVELS
from spinepipe.units import DEG_PER_RAD

AXIAL_N_PER_M = numbers(__name__, "axial_stiffness")

PRELOADS_N, PRELOAD_FACTORS = zip(*several(__name__, "stiffening_by_preload").values(), strict=True)
"""Stiffness over that without preload, lumbar segments; held beyond the last."""

_STRETCHED = numbers(__name__, "passive_muscle")

LIGAMENT_ARM_M = number(__name__, "ligament_arm")
LIGAMENTS_BESIDE_LOWEST = numbers(__name__, "ligaments_beside_lowest")
"""Their moment in full flexion over that at L5S1."""

LUMBAR_FLEXION_DEG = number(__name__, "lumbar_full_flexion")
"""Full flexion of L5S1 to T12L1 together, from upright."""

_STEEPNESS = number(__name__, "ligament_steepness")


@dataclass(frozen=True)
class MomentCurve:
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
        inside, beyond = self._split(rad)
        found: Array = self._through(inside) + beyond * (rad - inside)
        return found

    def slope(self, rad: Array) -> Array:
        """N m/rad at rotations."""
        inside, beyond = self._split(rad)
        return np.asarray(np.where(inside == rad, self._through(inside, 1), beyond), dtype=float)

    def _split(self, rad: Array) -> tuple[Array, Array]:
        """Rotations brought within the points, and slopes of the outermost chords beyond them."""
        points = np.array(self.degrees) / DEG_PER_RAD
        chords = np.diff(self.newton_metres) / np.diff(points)
        return np.clip(rad, points[0], points[-1]), np.where(rad < points[0], chords[0], chords[-1])


Curves = tuple[MomentCurve, MomentCurve, MomentCurve]
"""About x, y and z."""


def _measured(source: str, back: str = "flexion") -> Curves:
    """Through the points of two sides, as `heuer flexion` names them in
    `facts.csv`; `back` is extension where a source has one curve for both of its sides."""
    known = several(__name__, "moment_curve")
    sides = (("right_bending",) * 2, ("left_rotation",) * 2, (back, "extension"))
    x, y, z = (
        MomentCurve(
            *(
                (
                    *(-value for value in reversed(known[f"{source} {below} {of}"])),
                    *(0.0, *known[f"{source} {beyond} {of}"]),
                )
                for of in ("deg", "nm")
            )
        )
        for below, beyond in sides
    )
    return x, y, z


def _linear(nm_per_rad: float) -> MomentCurve:
    nm = 10.0 * nm_per_rad / DEG_PER_RAD
    return MomentCurve((-10.0, 0.0, 10.0), (-nm, 0.0, nm))


_GOULD = published("gould_2024b")["uniform_stiffness"]
_SCHMIDT, _HEUER = _measured("schmidt"), _measured("heuer")

CURVES: Mapping[str, Curves] = {
    "segment_gould": (  # linear, whole segments
        _linear(_GOULD["right_bending_nm_per_rad"]),
        _linear(_GOULD["left_rotation_nm_per_rad"]),
        _linear(_GOULD["extension_nm_per_rad"]),
    ),
    "mixed": (_HEUER[0], _SCHMIDT[1], _SCHMIDT[2]),
    "segment": _SCHMIDT,
    "disc_heuer": _HEUER,
    "disc_jaramillo": _measured("jaramillo"),
    "disc_han": _measured("han", back="extension"),
}
"""About x, y and z: right bending, left rotation, extension. Sources: `facts.csv`, `anatomy`.

mixed: sideways the disc alone, else whole segments. Ligaments and facets hardly resist bending
sideways; a segment as stiff sideways as Schmidt's needs muscles to bend it where people lean.
"""

T11T12_WITH_RIBS: Curves = _measured("wilke", back="extension")
"""The segment with its rib joints."""


@dataclass(frozen=True, eq=False)
class Ligaments:
    """Ligaments and fascia behind the seven joints, which resist flexion and nothing else.

    Their moment grows exponentially with flexion, from nought upright; beyond full flexion
    straight on. Compression does not stiffen them.

    Attributes
    ----------
    at_full : (7,) N m in full flexion. full : (7,) rad, full flexion of each joint from upright.
    """

    at_full: Array
    full: Array

    def moments(self, flexion: Array) -> Array:
        """(..., 7) N m, extension positive, at flexions (..., 7) rad from upright."""
        inside = np.clip(flexion, 0.0, self.full)
        grown = np.expm1(_STEEPNESS * inside / self.full) / np.expm1(_STEEPNESS)
        beyond = np.maximum(flexion - self.full, 0.0)
        found: Array = self.at_full * grown + beyond * self.slopes(flexion)
        return found

    def slopes(self, flexion: Array) -> Array:
        """(..., 7) N m/rad, how fast that grows."""
        rate = _STEEPNESS / self.full / np.expm1(_STEEPNESS)
        inside = np.minimum(flexion, self.full)
        rising = self.at_full * rate * np.exp(_STEEPNESS * inside / self.full)
        return np.asarray(np.where(flexion > 0.0, rising, 0.0), dtype=float)


@dataclass(frozen=True, eq=False)
class JointLaws:
    """The seven joints of one person.

    Attributes
    ----------
    curves : about x, y, z of the disc.
    angular : (7, 3) factors of the curves: the person's size, and whatever is varied.
    axial, shear : (7,) and (7, 2) N/m, along the disc's axis; forwards and to the right.
    stiffens : whether compression stiffens the curves.
    t11t12 : curves of the uppermost joint; None: those of the others.
    ligaments : behind the joints; None: none.
    upright : (7,) rad, extension of the joints when standing: ligaments count from there.
    """

    curves: Curves
    angular: Array
    axial: Array
    shear: Array
    stiffens: bool
    t11t12: Curves | None = None
    ligaments: Ligaments | None = None
    upright: Array = field(default_factory=lambda: np.zeros(len(LEVELS)))

    def stiffening(self, compression: Array) -> Array:
        """(..., 7) factor of the moments under compressions (..., 7) N."""
        if not self.stiffens:
            return np.ones(np.shape(compression))
        return np.interp(compression, PRELOADS_N, PRELOAD_FACTORS)

    def moments(self, turned: Array, compression: Array) -> Array:
        """(..., 7, 3) N m on what is above, axes of the disc, for rotation vectors (..., 7, 3);
        without those of ligaments."""
        curve = self._each("moment", turned)
        found: Array = -self.stiffening(compression)[..., None] * self.angular * curve
        return found

    def ligament_moments(self, turned: Array) -> Array:
        """(..., 7) N m of ligaments on what is above, extension positive."""
        if self.ligaments is None:
            return np.zeros(turned.shape[:-1])
        return self.ligaments.moments(self.upright - turned[..., EXTENSION])

    def slopes(self, turned: Array, compression: Array) -> Array:
        """(7, 3) N m/rad, how fast the resistance grows with the rotations."""
        slope = self._each("slope", turned)
        found: Array = self.stiffening(compression)[:, None] * self.angular * slope
        if self.ligaments is not None:
            found[:, EXTENSION] += self.ligaments.slopes(self.upright - turned[:, EXTENSION])
        return found

    def _each(self, what: Literal["moment", "slope"], turned: Array) -> Array:
        """(..., 7, 3) of the curves at rotations (..., 7, 3)."""

        def of(curves: Curves, at: Array) -> Array:
            return np.stack([getattr(c, what)(at[..., k]) for k, c in enumerate(curves)], axis=-1)

        found = of(self.curves, turned)
        if self.t11t12 is not None:
            found[..., -1, :] = of(self.t11t12, turned[..., -1, :])
        return found

    def translations(self, pushes: Array) -> Array:
        """(..., 7, 3) m by which the upper vertebra moves, pushed with (..., 7, 3) N, disc axes."""
        forwards, right = (pushes[..., k] / self.shear[:, n] for n, k in enumerate((0, 2)))
        return np.stack([forwards, pushes[..., 1] / self.axial, right], axis=-1)


@dataclass(frozen=True)
class PassiveMuscle:
    """Force of a stretched muscle without any activity.

    Attributes
    ----------
    strain : of the fibres at which the force is the largest active one.
    shape : how sharply it rises.
    factor : of the force.
    fibre_share : of the path upright that stretches, where the source has no length of the fibres.
    """

    strain: float = _STRETCHED["strain"]
    shape: float = _STRETCHED["shape"]
    factor: float = 1.0
    fibre_share: float = 1.0

    def forces(self, lengths: Array, rest: Array, fibres: Array, largest: Array) -> Array:
        """(M,) N of paths of so many m, upright `rest` m, fibres of so many m.

        Parameters
        ----------
        largest : (M,) N, largest active force at the stress of 0.6 MPa or whatever is stated.
        """
        strain = self._strain(lengths, rest, fibres)
        share = np.expm1(self.shape * strain / self.strain) / np.expm1(self.shape)
        found: Array = self.factor * largest * share
        return found

    def slopes(self, lengths: Array, rest: Array, fibres: Array, largest: Array) -> Array:
        """(M,) N/m, how fast it rises with the length."""
        strain = self._strain(lengths, rest, fibres)
        rate = self.shape / self.strain / fibres
        rising = rate * np.exp(self.shape * strain / self.strain) / np.expm1(self.shape)
        found: Array = np.where(strain > 0.0, self.factor * largest * rising, 0.0)
        return found

    @staticmethod
    def _strain(lengths: Array, rest: Array, fibres: Array) -> Array:
        """(M,) of the fibres, never below nought."""
        found: Array = np.maximum((lengths - rest) / fibres, 0.0)
        return found
