"""Which muscle forces hold a posture: the least sum of squared stress that balances every joint.

All joints and all axes are balanced at once (Ghezelbash 2016 Eq 1, as cuts through the trunk: what
is above a joint is in balance about it). Where no forces within the muscles' strength balance the
joints, a linear programme finds the least moment that must be left over, and the forces are the
best of those that leave no more: nothing is infeasible in silence.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import Bounds, LinearConstraint, milp

from spinepipe.effects.contract import Array
from spinepipe.muscles.least_norm import least_norm

STRESS_PA = 1e6
"""Unit of the unknowns: their size is then near 1."""


@dataclass(frozen=True, eq=False)
class Demand:
    """What M fascicles have to do at L rows.

    Attributes
    ----------
    arms : (L, M) m, moment at each row of 1 N of each fascicle.
    required : (L,) N m that muscles have to make.
    least, most : (M,) N, passive force with whatever tone is asked for; strength.
    pcsa : (M,) m2.
    sheath : (2, M) pull of each on the sheath of either side; none of them can be pushed.
    """

    arms: Array
    required: Array
    least: Array
    most: Array
    pcsa: Array
    sheath: Array


@dataclass(frozen=True, eq=False)
class Forces:
    """Forces (M,) N that meet a demand but for a slack (L,) N m; `enough` where none is needed.

    Attributes
    ----------
    multipliers : (L + 2,) of the rows and sheaths where the demand is met; else those that prove
        that no forces meet it (Farkas' lemma). None where forces were given.
    of_rest : (L + 2,) multipliers of what is met beside the slack; None where all is met.
    """

    forces: Array
    slack: Array
    enough: bool
    multipliers: Array | None = None
    of_rest: Array | None = None


def least_stress(demand: Demand, nearby: Forces | None = None) -> Forces:
    """Forces with the least sum of squared stress; those of a demand nearby, where they are known,
    shorten the way and change nothing."""
    start, rest = (None, None) if nearby is None else (nearby.multipliers, nearby.of_rest)
    found, multipliers = _quadratic(demand, demand.required, start=start)
    if found is not None:
        return Forces(found, demand.required - demand.arms @ found, True, multipliers)
    # the lemma holds for any multiple, and one of size 1 is near those of a demand that can be met
    proof = multipliers / np.abs(multipliers).max()
    slackest = least_slack_forces(demand)
    slack = demand.required - demand.arms @ slackest
    # 1e-5 N m more may be left over: the linear programme meets its rows to its own tolerance
    found, rest = _quadratic(demand, demand.required - slack, tolerance=1e-5, start=rest)
    if found is None:
        found = slackest
    return Forces(found, demand.required - demand.arms @ found, False, proof, rest)


def _quadratic(
    demand: Demand, required: Array, tolerance: float = 0.0, start: Array | None = None
) -> tuple[Array | None, Array]:
    """Forces (M,) N of the quadratic programme, None where there are none; multipliers (L + 2,).

    What may be left over, up to the tolerance, counts as forces that cost next to nothing.
    """
    # unknowns are stresses; rows of the sheath are in 100 N, so that they are as large as moments
    unit, rows = demand.pcsa * STRESS_PA, len(required)
    of_rows = np.concatenate([required, np.zeros(2)])
    columns = np.hstack([demand.arms.T * unit[:, None], demand.sheath.T * unit[:, None] / 1e2])
    least, most = demand.least / unit, demand.most / unit
    if tolerance > 0.0:
        columns = np.vstack([columns, np.eye(rows, len(of_rows))])
        least = np.concatenate([least, np.full(rows, -tolerance)])
        most = np.concatenate([most, np.full(rows, tolerance)])
    start = np.zeros(len(of_rows)) if start is None else start
    x, multipliers, met = least_norm(columns, of_rows, rows, least, most, start)
    found = np.clip(x[: len(unit)] * unit, demand.least, demand.most) if met else None
    return found, multipliers


def least_slack_forces(demand: Demand) -> Array:
    """(M,) N, that leave least over in sum.

    A linear programme by HiGHS, asked through `milp`, which adds least of its own.

    So small a programme is solved before it is simplified.
    """
    many, rows = len(demand.pcsa), len(demand.required)
    either = np.hstack([np.eye(rows), -np.eye(rows)])
    weights = np.block([[demand.arms, either], [demand.sheath, np.zeros((2, 2 * rows))]])
    low = np.concatenate([demand.required, np.zeros(2)])
    high = np.concatenate([demand.required, np.full(2, np.inf)])
    solved = milp(
        np.concatenate([np.zeros(many), np.ones(2 * rows)]),
        constraints=LinearConstraint(weights, low, high),
        bounds=Bounds(
            np.concatenate([demand.least, np.zeros(2 * rows)]),
            np.concatenate([demand.most, np.full(2 * rows, np.inf)]),
        ),
        options={"presolve": False},
    )
    if solved.x is None:
        raise ValueError(f"the linear programme of the least slack failed: {solved.message}")
    found: Array = np.asarray(solved.x[:many])
    return found
