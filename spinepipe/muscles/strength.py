"""How much of a person's strength a task takes, and what is left at every level."""

import numpy as np
from scipy.optimize import linprog

from spinepipe.effects.contract import Array
from spinepipe.muscles.forces import Demand
from spinepipe.muscles.muscle_equilibrium import SolvedTask
from spinepipe.muscles.person import above
from spinepipe.muscles.trunk import LEVELS

_EXTENSION = 2


def load_factor(solved: SolvedTask) -> float | None:
    """How many times the loads could be as large before no forces hold them; None: not even none.

    Weight, hands, exertion and pressure grow alike; posture and joints stay as they are.
    """
    loads = solved.applied
    _, turning = above(loads.forces, loads.moments, solved.poses.centres)
    joints = np.einsum("kij,kj->ki", solved.poses.discs, solved.joint_moments)
    return most_along(solved.demand, -turning.ravel(), -joints.ravel())


def capacity_left(solved: SolvedTask) -> Array | None:
    """(7,) N m, flexion moment that could be added at each level alone; None beyond strength."""
    if not solved.found.enough:
        return None
    found, made = np.zeros(len(LEVELS)), solved.demand.required - solved.found.slack
    for level, disc in enumerate(solved.poses.discs):
        direction = np.zeros(made.shape)
        direction[3 * level : 3 * level + 3] = disc[:, _EXTENSION]
        found[level] = most_along(solved.demand, direction, made) or 0.0
    return found


def most_along(demand: Demand, direction: Array, start: Array) -> float | None:
    """Largest t with which forces can make `start` + t `direction`, (L,) N m; None: not even none.

    With the demand itself as the direction and nought as the start it is the factor by which the
    demand may grow; with a single row it is the moment left there.
    """
    many = len(demand.pcsa)
    solved = linprog(
        np.concatenate([np.zeros(many), [-1.0]]),
        A_eq=np.column_stack([demand.arms, -direction]),
        b_eq=start,
        A_ub=np.column_stack([-demand.sheath, np.zeros(2)]),
        b_ub=np.zeros(2),
        bounds=[*zip(demand.least, demand.most, strict=True), (0.0, 1e4)],
        method="highs",
    )
    return float(solved.x[-1]) if solved.status == 0 and solved.x is not None else None
