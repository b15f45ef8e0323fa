"""How much of a person's strength a task takes, and what is left at every level."""

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.muscles.forces import most_along
from spinepipe.muscles.muscle_equilibrium import SolvedTask
from spinepipe.muscles.person import above
from spinepipe.muscles.trunk import LEVELS

_EXTENSION = 2


def load_factor(held: SolvedTask) -> float | None:
    """How many times the loads could be as large before no forces hold them; None: not even none.

    Weight, hands, exertion and pressure grow alike; posture and joints stay as they are.
    """
    loads = held.applied
    _, turning = above(loads.forces, loads.moments, held.poses.centres)
    joints = np.einsum("kij,kj->ki", held.poses.discs, held.joint_moments)
    return most_along(held.demand, -turning.ravel(), -joints.ravel())


def capacity_left(held: SolvedTask) -> Array | None:
    """(7,) N m, flexion moment that could be added at each level alone; None beyond strength."""
    if not held.found.enough:
        return None
    found = np.zeros(len(LEVELS))
    for level, disc in enumerate(held.poses.discs):
        direction = np.zeros(held.demand.required.shape)
        direction[3 * level : 3 * level + 3] = disc[:, _EXTENSION]
        most = most_along(held.demand, direction, held.demand.required - held.found.slack)
        found[level] = most or 0.0
    return found
