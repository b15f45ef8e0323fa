"""How joints resist motion by themselves: two exponentials on each of six coordinates.

On each side of zero ``F = A (exp(B q) - 1)``, restoring load -F (Wang 2021 eq. 3, doi
10.1007/s10439-021-02774-3). Its stiffness is ``B (F + A)``: A B at rest, the same on both sides.
Where the exponent has grown to `STRAIGHT` the law goes on straight.

The generic values of Wang 2020 are printed nowhere, so `passive.csv` makes its own from two facts
for each joint and rotation, the stiffness k0 at rest and what the joint does at M = 7.5 N m:

- lumbar joints: the stiffness k1 there. B = (k1 - k0) / M, A = k0 / B. k0 is the slope at zero of
  the discs of Han 2010, k1 the segments of Schmidt 1998, who print one stiffness and no moment.
- thoracic joints: how far it turns there, q1 (Wilke 2017), and r = k1 / k0 (Mannen 2018 Table 2).
  B = log(r) / q1, A = M / (r - 1). T1T2 to T9T10 turn less by the rib cage, whose removal lets a
  thorax turn 59 to 64 % further (Mannen 2018); ribs 11 and 12 float.
- translations: sources print one stiffness k0, so the law hardly bends: B = 0.1 / mm, A = k0 / B.

`lower` and `upper` are factors of A and so of all loads. Upper is preload: 2.11 times at 500 N
(Gardner-Morse 2004). Lower is one SD of the specimens of Jaramillo (lumbar), or the largest range
of Wilke without the rib cage (thoracic).
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np
import pandas as pd

from spinepipe.effects.contract import Array
from spinepipe.effects.rounding import STRAIGHT
from spinepipe.motion.joint_tables import SIDES, coordinate_places, joint_places, packaged_rows
from spinepipe.motion.skeleton import JOINTS
from spinepipe.problems import InputError, InputProblem
from spinepipe.units import COORDINATES, DISPLAY_PER_SI, ROTATIONS

FILE = "passive.csv"
NUMBERS = ("a", "b", "lower", "upper")
"""a in N or N m; b in 1/mm or 1/deg; factors of a."""

SHAPE = (len(JOINTS), len(COORDINATES), len(SIDES))

LARGEST_B_PER_DEG = 2.0
"""Twice the steepest that comes along; rates per radian of joints that stiffen are above it."""

SLOPES_DIFFER = 0.01
"""Share by which a b may differ between the sides: what printing three digits does."""


@dataclass(frozen=True, eq=False)
class PassiveLaw:
    """Passive elements of all joints.

    Attributes
    ----------
    a : (17, 6, 2) N or N m, for positive and for negative coordinates. b : (17, 6, 2) 1/m or 1/rad.
    rest : (17, 6) m and rad, where nothing is stretched; sides are counted from there.
    """

    a: Array
    b: Array
    rest: Array = field(default_factory=lambda: np.zeros(6))

    def scaled(self, size: Array, shape: Array) -> "PassiveLaw":
        """Times as large (17, 6), and with exponents as many times as large (17, 6), both sides."""
        return replace(self, a=self.a * size[..., None], b=self.b * shape[..., None])

    def forces(self, q: Array) -> Array:
        """(F, 17, 6) N and N m that resist coordinates (F, 17, 6) m and rad; of their sign."""
        return self.with_slopes(q)[0]

    def with_slopes(self, q: Array) -> tuple[Array, Array, Array]:
        """Forces (F, 17, 6), their slopes by the coordinate, and by the logarithm of both B.

        The slope by the logarithm of both A is the force itself.
        """
        q = q - self.rest
        a, b = self._on_side(self.a, q), self._on_side(self.b, q)
        exponent = b * np.abs(q)
        # beyond STRAIGHT the tangent: value and slope go on where the exponential ends
        bent = np.minimum(exponent, STRAIGHT)
        grown, on = np.exp(bent), exponent - bent
        size = a * (grown - 1.0 + grown * on)
        by_shape = a * grown * exponent
        return np.sign(q) * size, a * b * grown, np.sign(q) * by_shape

    def curvatures(self, q: Array) -> tuple[Array, Array, Array]:
        """(F, 17, 6) each, second derivatives of forces: by the coordinate twice, by it and the
        logarithm of both B, and by that logarithm twice.

        Those with the logarithm of both A are the first derivatives themselves.
        """
        _, stiffness, by_shape = self.with_slopes(q)
        q = q - self.rest
        b = self._on_side(self.b, q)
        exponent = b * np.abs(q)
        bends = exponent < STRAIGHT
        by_both = 1.0 + bends * exponent
        return np.sign(q) * b * stiffness * bends, stiffness * by_both, by_shape * by_both

    def _on_side(self, values: Array, q: Array) -> Array:
        """(F, 17, 6) of values (17, 6, 2) those of the side on which coordinates are."""
        side = (q < 0.0).astype(np.int64)[..., None]
        every = np.broadcast_to(values, (*q.shape, len(SIDES)))
        return np.take_along_axis(every, side, axis=-1)[..., 0]

    def stiffness_at(self, load: Array) -> Array:
        """(17, 6, 2) N/m and N m/rad, slope where a side resists with a load: B (F + A)."""
        straight = self.a * (np.exp(STRAIGHT) - 1.0)
        found: Array = self.b * (np.minimum(load, straight) + self.a)
        return found


@dataclass(frozen=True, eq=False)
class PassiveElements:
    """Generic laws of all joints.

    Attributes
    ----------
    a : (17, 6, 2) N or N m, of positive and of negative coordinates. b : (17, 6, 2) 1/m or 1/rad.
    lower, upper : (17, 6, 2) factors of a.
    """

    a: Array
    b: Array
    lower: Array
    upper: Array


def passive_elements(own: pd.DataFrame | None = None, file: str = FILE) -> PassiveElements:
    """The laws that come along, with a cohort's own rows in place of theirs.

    Parameters
    ----------
    own : sound rows of `passive.csv`, indexed by line; mm, deg, N, N m. None: what comes along.
    file : its name in messages.

    Raises
    ------
    InputError
        Of rates per radian, and of joints that have a kink at rest.
    """
    values = {name: np.full(SHAPE, np.nan) for name in NUMBERS}
    for rows in [packaged_rows(FILE, NUMBERS), *([] if own is None else [own])]:
        coordinate = coordinate_places(rows)
        side = np.array([SIDES.index(name) for name in rows["side"]], dtype=np.int64)
        at = joint_places(rows), coordinate, side
        for name in NUMBERS:
            values[name][at] = rows[name].to_numpy(float)
        values["b"][at] *= DISPLAY_PER_SI[coordinate]
    if own is not None:
        # rates of rotations that are those of another unit
        allowed = f"at most {LARGEST_B_PER_DEG:g} per degree"
        remedy = "rates per radian are divided by 57.3"
        steep = own["coordinate"].isin(ROTATIONS) & (own["b"] > LARGEST_B_PER_DEG)
        problems = [
            InputProblem(file, int(str(line)), "b", f"{rate:g}", allowed, remedy)
            for line, rate in own["b"][steep].items()
        ]
        if problems := [*problems, *_kinks(own, values, file)]:
            raise InputError(problems)
    return PassiveElements(**values)


def _kinks(own: pd.DataFrame, values: dict[str, Array], file: str) -> Iterator[InputProblem]:
    """Joints whose two sides begin with different stiffness: a kink no solver likes."""
    slope = values["a"] * values["b"]
    apart = np.abs(np.diff(slope, axis=-1)[..., 0]) > SLOPES_DIFFER * slope.max(axis=-1)
    places = zip(own.index, joint_places(own), coordinate_places(own), strict=True)
    for line, joint, coordinate in places:
        if apart[joint, coordinate]:
            positive, negative = slope[joint, coordinate] / DISPLAY_PER_SI[coordinate]
            yield InputProblem(
                file,
                int(line),
                "a",
                f"a b is {positive:.4g} on the positive and {negative:.4g} on the negative side",
                "the same stiffness at rest on both sides",
                "give both sides, with the same product of a and b",
            )
