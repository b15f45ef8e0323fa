"""How a person stands: the posture near the source's that asks least of the muscles.

The sum of the moments that each vertebra's own equilibrium lacks, in size, is made least by
successive linear programmes (Ghezelbash 2016 Eq 2): bodies turn in the sagittal plane, within a
range of the start.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog

from spinepipe.effects.contract import Array
from spinepipe.muscles.applied import applied
from spinepipe.muscles.person import Person, above
from spinepipe.muscles.pose import posed, rotations_of
from spinepipe.muscles.task import Task
from spinepipe.muscles.trunk import BODIES, LEVELS

MOST_ROUNDS = 30
_STEP_RAD = 1e-6
_SMALL_NM = 1e-6


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
        """(8, 3) rad, as tasks have it."""
        return turned(self.angles)


def turned(angles: Array) -> Array:
    """(8, 3) rad of extensions (8,)."""
    return np.stack([angles, np.zeros(len(BODIES)), np.zeros(len(BODIES))], axis=1)


def lacking(person: Person, angles: Array) -> Array:
    """(7,) N m that L5 to T11 lack for their own equilibrium, no muscle pulling.

    What acts on the vertebra itself, the joints' moments on it, and the force of the joint above,
    about the joint below: what all above the joint below lacks less what all above the joint above
    lacks. Joints are as far pressed and as stiff as the weight makes them.
    """
    rotations = rotations_of(person.chain, turned(angles))
    pushes = np.zeros((len(LEVELS), 3))
    nothing = Task("upright", None, turned(angles), from_upright=False)
    for _ in range(3):
        poses = posed(person.chain, rotations, person.laws.translations(pushes))
        loads = applied(person, nothing, poses)
        forces, turning = above(loads.forces, loads.moments, poses.centres)
        pushes = np.einsum("kji,kj->ki", poses.discs, forces)
    joint = person.laws.moments(poses.turned, -pushes[:, 1])
    total = (turning + np.einsum("kij,kj->ki", poses.discs, joint))[:, 2]
    own = total.copy()
    own[:-1] -= total[1:]
    return -own


def upright(person: Person, start: Array, reach_rad: float) -> Upright:
    """The posture within `reach_rad` of the start (8,) rad."""
    angles = start.copy()
    before = lacking(person, angles)
    least, trust = float(np.abs(before).sum()), reach_rad
    for _ in range(MOST_ROUNDS):
        at = lacking(person, angles)
        slope = np.stack(
            [
                (lacking(person, angles + _STEP_RAD * one) - at) / _STEP_RAD
                for one in np.eye(len(BODIES))
            ],
            axis=1,
        )
        step = _least_sum(at, slope, start - reach_rad - angles, start + reach_rad - angles, trust)
        size = float(np.abs(lacking(person, angles + step)).sum())
        if size < least - _SMALL_NM:
            angles, least = angles + step, size
        else:
            trust *= 0.25
        if trust < 1e-7 or least < _SMALL_NM:
            break
    at_bound = np.abs(angles - start) > reach_rad - 1e-9
    return Upright(angles, start, at_bound, before, lacking(person, angles))


def _least_sum(at: Array, slope: Array, low: Array, high: Array, trust: float) -> Array:
    """(8,) step with the least sum of sizes of the linearised moments; HiGHS.

    Of the steps that do equally well the smallest is wanted: turning costs next to nothing.
    """
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
