"""Tangent laws of a spine from its two bending films, as Jalalian 2017 characterises them.

All angles are right bending, rad: the paper's left rotations are negative here. Its films give two
pairs (r, tau) for each segment; tau is the moment of a lateral force at the top vertebra.

The paper chooses the two forces by the least sum of errors over segments (Eq 5). Errors in tau are
least with no force at all (consistency check J7), so errors in r are taken. These do not change
when both forces grow by one factor, so films decide the ratio of the forces alone. Their size, and
with it the size of all A, comes from outside.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from spinepipe.effects.bounded_tangent import argument
from spinepipe.effects.contract import Array

Flags = NDArray[np.bool_]

SMALLEST_END = float(np.deg2rad(0.1))
"""Step in which tilt was read on the films: a segment moves by no less."""

STANDS_STILL = 1e-9
"""Rad: what a difference of equal tilts rounds to is less."""

LEAST_SHARE, MOST_SHARE = 0.05, 20.0
"""Least and largest A, over the patient's median. Films may ask for a negative one, or for one
without limit where a segment stood still; arms of a force at the top differ some 20 times."""

FARTHEST_RATIO = np.log(30.0)
"""The two forces differ by less than this factor."""

RATIOS_TRIED = 61


@dataclass(frozen=True)
class Pairs:
    """What two films give of S segments.

    Attributes
    ----------
    right, left : (S,) rad, r on the right and on the left bending film.
    arm_right, arm_left : (S,) m, from each segment's joint to the line of the force.
    apex : the segment below the apical vertebra of the thoracolumbar or lumbar curve.
    """

    right: Array
    left: Array
    arm_right: Array
    arm_left: Array
    apex: int

    @cached_property
    def opposite(self) -> Flags:
        """(S,) segments that turn against a bend, or not at all."""
        found: Flags = (self.right < STANDS_STILL) | (self.left > -STANDS_STILL)
        return found


@dataclass(frozen=True)
class EndRotations:
    """(S,) rad: the rotations that each segment comes near and never has."""

    lower: Array
    upper: Array

    @cached_property
    def shape(self) -> tuple[Array, Array]:
        """(S,) B and C, Eq 2."""
        return argument(self.lower, self.upper)

    def load(self, r: Array) -> Array:
        """(S,) tau / A at r (S,): tan(B r + C) + D, Eqs 1 and 3."""
        b, c = self.shape
        found: Array = np.tan(b * r + c) - np.tan(c)
        return found

    def at_rest(self, stretch: Array) -> Array:
        """(S,) N m/rad: the slope at r = 0 for A (S,)."""
        b, c = self.shape
        found: Array = stretch * b * (1.0 + np.tan(c) ** 2)
        return found

    def rotation(self, load: Array) -> Array:
        """(S,) r at which tau / A is the load (S,)."""
        b, c = self.shape
        found: Array = (np.arctan(load + np.tan(c)) - c) / b
        return found


@dataclass(frozen=True)
class LinearShape:
    """The shape of linear laws: as many times the rotation as its stiffness says."""

    def load(self, r: Array) -> Array:
        """(S,) tau over stiffness, rad."""
        return r

    def rotation(self, load: Array) -> Array:
        """(S,) r at which it is so."""
        return load


Shape = EndRotations | LinearShape
"""How the moments of segments grow with their rotation, but for a factor of each."""


def ends_of(pairs: Pairs, enlargement: float) -> EndRotations:
    """The ends at so many times the rotations of the films.

    A segment that turns against a bend has both ends at so many times its larger rotation.
    """
    larger = np.maximum(np.abs(pairs.right), np.abs(pairs.left))
    upper = np.where(pairs.opposite, larger, pairs.right)
    lower = np.where(pairs.opposite, -larger, pairs.left)
    return EndRotations(
        np.minimum(enlargement * lower, -SMALLEST_END),
        np.maximum(enlargement * upper, SMALLEST_END),
    )


@dataclass(frozen=True)
class Laws:
    """The characterised laws of S segments.

    Attributes
    ----------
    ratio : force of the left bend over that of the right one.
    stretch : (S,) A, N m (of linear laws the stiffness, N m/rad), for forces of which the larger
        has an apical moment as asked.
    constrained : (S,) whether A would have been less or more than it may be.
    errors : (S, 2) rad, r of the law less r of the film, right and left bend.
    force_right_n, force_left_n : size of the two forces.
    """

    ratio: float
    stretch: Array
    constrained: Flags
    errors: Array
    force_right_n: float
    force_left_n: float

    @property
    def rmse(self) -> float:
        """Sum over segments of the root of the mean square of the two errors, rad: Eq 5 in r."""
        return float(np.sqrt((self.errors**2).mean(axis=1)).sum())


def characterise(pairs: Pairs, shape: Shape, apical_nm: float) -> Laws:
    """The laws whose rotations under two forces are nearest those of the films.

    Parameters
    ----------
    apical_nm : the larger of the two moments about the apical segment, N m.
    """
    loads = np.stack([shape.load(pairs.right), shape.load(pairs.left)], axis=1)

    def rmse(log_ratio: float) -> float:
        return _laws(pairs, shape, loads, float(np.exp(log_ratio)), apical_nm).rmse

    # it may have several minima: a grid, then Brent's method between the best one's neighbours
    tried = np.linspace(-FARTHEST_RATIO, FARTHEST_RATIO, RATIOS_TRIED)
    best = int(np.argmin([rmse(one) for one in tried]))
    low, high = tried[max(best - 1, 0)], tried[min(best + 1, len(tried) - 1)]
    found = minimize_scalar(rmse, bounds=(low, high), method="bounded", options={"xatol": 1e-10})
    return _laws(pairs, shape, loads, float(np.exp(found.x)), apical_nm)


def _laws(pairs: Pairs, shape: Shape, loads: Array, ratio: float, apical_nm: float) -> Laws:
    """The laws with forces of one ratio, regression of their loads (S, 2) through nought (Eq 4)."""
    force = apical_nm / max(pairs.arm_right[pairs.apex], ratio * pairs.arm_left[pairs.apex])
    # two forces of opposite sense about each segment; regression through nought gives A (Eq 4)
    moments = np.stack([force * pairs.arm_right, -ratio * force * pairs.arm_left], axis=1)
    rotations = np.stack([pairs.right, pairs.left], axis=1)
    # films that ask for nothing above nought leave no median: the limits are then about 1 N m
    asked = (moments * loads).sum(axis=1) / (loads**2).sum(axis=1)
    middle = float(np.median(asked[asked > 0.0])) if (asked > 0.0).any() else 1.0
    stretch = np.clip(asked, LEAST_SHARE * middle, MOST_SHARE * middle)
    reached = np.stack([shape.rotation(one / stretch) for one in moments.T], axis=1)
    return Laws(ratio, stretch, asked != stretch, reached - rotations, force, ratio * force)
