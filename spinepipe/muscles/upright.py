"""How a person stands: the posture near the source's that asks least of the muscles.

The sum of the moments that each vertebra's own equilibrium lacks, in size, is made least by
successive linear programmes (Ghezelbash 2016 Eq 2): bodies turn in the sagittal plane, within a
range of the start. The sum has several hollows, and muscles pull twenty times as much in the wrong
one: the search begins at several places, and the lowest hollow counts.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog

from spinepipe.effects.contract import Array
from spinepipe.muscles.masses import arm_masses
from spinepipe.muscles.person import Person
from spinepipe.muscles.trunk import BODIES, EXTENSION, LEVELS, SIDES
from spinepipe.units import STANDARD_GRAVITY

MOST_ROUNDS = 30
BEGINNINGS = 12
"""Places where the search begins: the start, and others drawn from the range, always the same."""

_STEP_RAD = 1e-6
"""Of the slopes by forward differences: half the digits of an angle."""

_SMALL_NM = 1e-6
"""A sum of moments as small as this is nought, and a gain as small none."""

_SAME_NM = 1e-3
"""Sums that differ by less are the same: then the earlier beginning counts."""


@dataclass(frozen=True, eq=False)
class Upright:
    """How a person stands.

    Attributes
    ----------
    angles, start : (8,) rad, extension of the bodies from the source's pose; found, and where the
        search began.
    at_bound : (8,) whether at the end of the range.
    before, after : (7,) N m lacking at L5 to T11, extension positive, at the start and upright.
    """

    angles: Array
    start: Array
    at_bound: NDArray[np.bool_]
    before: Array
    after: Array

    @property
    def turned(self) -> Array:
        """(8, 3) rad, as tasks have it: extension alone."""
        still = np.zeros(len(BODIES))
        return np.stack([self.angles, still, still], axis=1)


def moment_deficit(person: Person, angles: Array) -> Array:
    """(..., 7) N m that L5 to T11 lack for their own equilibrium, no muscle pulling.

    What acts on the vertebra itself, the joints' moments on it, and the force of the joint above,
    about the joint below: what all above the joint below lacks less what all above the joint above
    lacks. Joints are as far pressed and as stiff as the weight makes them. All is in the sagittal
    plane, where turns add up; arms hang, so their weight acts at the shoulders.

    Parameters
    ----------
    angles : (..., 8) rad, extension of the bodies from the source's pose.
    """
    # weights (K,) N, the bodies (K,) that carry them, and where (K, 2) m, forwards and up
    arms = (
        one
        for side, shoulder in zip(SIDES, person.lines.trunk.shoulders, strict=True)
        for one in arm_masses(side, shoulder, shoulder, person.subject)
    )
    masses = (*person.masses, *arms)
    weights = -STANDARD_GRAVITY[1] * np.array([mass.kg for mass in masses])
    bodies = np.array([mass.body for mass in masses])
    at = np.array([mass.at[:2] for mass in masses])
    # what each joint carries moves the vertebra above it on the axes of the disc
    chain, turns = person.chain, _turns(angles)
    discs = _turns(0.5 * (angles[..., 1:] + angles[..., :-1])) @ chain.discs[:, :2, :2]
    carried = np.cumsum(np.bincount(bodies, weights, len(BODIES))[:0:-1])[::-1]
    pushes = np.zeros((*angles.shape[:-1], len(LEVELS), 3))
    pushes[..., :2] = -carried[:, None] * discs[..., 1, :]
    moved = np.einsum("...ij,...j->...i", discs, person.laws.translations(pushes)[..., :2])
    # forward kinematics: joints and bodies from the pelvis upwards
    up = (chain.centres - chain.origins[:-1])[:, :2]
    legs = np.einsum("...ij,...j->...i", turns[..., :-1, :, :], up)
    centres = chain.origins[0, :2] + np.cumsum(legs, axis=-2)
    centres[..., 1:, :] += np.cumsum(moved, axis=-2)[..., :-1, :]
    places = np.concatenate([centres[..., :1, :], centres + moved], axis=-2)
    # moments of all weights above each joint about it, and of the joint itself
    off = at - chain.origins[bodies, :2]
    forwards = places[..., bodies, 0] + np.einsum("...j,...j->...", turns[..., bodies, 0, :], off)
    above = bodies > np.arange(len(LEVELS))[:, None]
    turning = carried * centres[..., 0] - (weights * forwards) @ above.T
    bent = np.zeros_like(pushes)
    bent[..., EXTENSION] = np.diff(angles, axis=-1)
    total = turning + person.laws.moments(bent, -pushes[..., 1])[..., EXTENSION]
    # of each vertebra alone: less what all above the joint above it lacks
    own = total.copy()
    own[..., :-1] -= total[..., 1:]
    return -own


def _turns(angles: Array) -> Array:
    """(..., 2, 2) rotations in the sagittal plane."""
    cosine, sine = np.cos(angles), np.sin(angles)
    rows = [np.stack([cosine, -sine], axis=-1), np.stack([sine, cosine], axis=-1)]
    return np.stack(rows, axis=-2)


def upright(person: Person, start: Array, reach_rad: float) -> Upright:
    """The posture within `reach_rad` of the start (8,) rad."""
    drawn = np.random.default_rng(0).uniform(-reach_rad, reach_rad, (BEGINNINGS - 1, len(BODIES)))
    found = [
        _descend(person, start, reach_rad, first)
        for first in np.vstack([start[None], start + drawn])
    ]
    angles, at = min(found, key=lambda one: round(float(np.abs(one[1]).sum()) / _SAME_NM))
    at_bound = np.abs(angles - start) > reach_rad - 1e-9
    return Upright(angles, start, at_bound, moment_deficit(person, start), at)


def _descend(person: Person, start: Array, reach_rad: float, first: Array) -> tuple[Array, Array]:
    """A hollow: angles (8,) rad and what lacks there (7,) N m, from a first posture (8,) rad.

    Successive linear programming (Griffith and Stewart 1961, Manage Sci 7:379) within a trust
    region that shrinks where the sum does not fall.
    """
    angles = first.copy()
    at, slope = _deficit_and_slope(person, angles)
    least, trust = float(np.abs(at).sum()), reach_rad
    for _ in range(MOST_ROUNDS):
        step = _linear_step(
            at, slope, start - reach_rad - angles, start + reach_rad - angles, trust
        )
        size = float(np.abs(moment_deficit(person, angles + step)).sum())
        if size < least - _SMALL_NM:
            angles, least = angles + step, size
            at, slope = _deficit_and_slope(person, angles)
        else:
            trust *= 0.25
        if trust < 1e-7 or least < _SMALL_NM:
            break
    return angles, at


def _deficit_and_slope(person: Person, angles: Array) -> tuple[Array, Array]:
    """(7,) N m lacking, and (7, 8) N m/rad, how fast that grows with each angle."""
    steps = np.vstack([np.zeros(len(BODIES)), _STEP_RAD * np.eye(len(BODIES))])
    found = moment_deficit(person, angles + steps)
    return found[0], (found[1:] - found[0]).T / _STEP_RAD


def _linear_step(at: Array, slope: Array, low: Array, high: Array, trust: float) -> Array:
    """(8,) step with the least sum of sizes of the linearised moments; HiGHS.

    Of the steps that do equally well the smallest is wanted: turning costs next to nothing.
    """
    # unknowns, none below nought: turns up and turns down, and a bound on the size of each moment
    rows, columns = slope.shape
    one = np.eye(rows)
    wide = np.hstack([slope, -slope])
    limits = [(0.0, max(0.0, min(up, trust))) for up in high]
    limits += [(0.0, max(0.0, min(-down, trust))) for down in low]
    solved = linprog(
        np.concatenate([np.full(2 * columns, 1e-4), np.ones(rows)]),
        A_ub=np.vstack([np.hstack([wide, -one]), np.hstack([-wide, -one])]),
        b_ub=np.concatenate([-at, at]),
        bounds=[*limits, *[(0.0, None)] * rows],
        method="highs",
    )
    if solved.x is None:
        raise ValueError(f"no step of the upright posture: {solved.message}")
    found: Array = solved.x[:columns] - solved.x[columns : 2 * columns]
    return found
