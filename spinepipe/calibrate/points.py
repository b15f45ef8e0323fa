"""Points of a problem: where it can start from, what is at a bound, whether loads lead there."""

import numpy as np

from spinepipe.calibrate.problem import Evaluation, Evaluator, Problem
from spinepipe.effects.contract import Array
from spinepipe.statics import moved

STIFFENING = 2.0
"""Factor by which a start without a stable equilibrium is stiffened, again and again."""

TIPPED = "no stable equilibrium up to the upper bounds: the loads tip the segment over"

AT_THE_BRINK = "the cost still falls where the loads begin to tip the segment over: no optimum"

OFF_THE_PATH = "the fitted pose is not the one that the load path leads to: the segment snaps"

SAME_POSE = 1e-6
"""Weighted residuals, mm and degrees, of one pose solved twice differ by less."""

AT_BOUND = 1e-6
ROUNDING = 1e-12


def stand_up(evaluator: Evaluator, start: Array) -> tuple[Array | None, int]:
    """The start, stiffened by factors of two until it stands; None when the bounds do not help."""
    problem, stiffened = evaluator.problem, 0
    stiffness = np.array([parameter.logarithmic for parameter in problem.free])
    step = np.where(stiffness, np.log(STIFFENING), 0.0)
    while evaluator.at(start).residual is None:
        if np.all(start[stiffness] >= problem.upper[stiffness]):
            return None, stiffened
        start = np.minimum(start + step, problem.upper)
        stiffened += 1
    return start, stiffened


def on_load_path(evaluator: Evaluator, x: Array, evaluation: Evaluation) -> bool:
    """Whether the poses at a point are those that the loads lead to from the neutral pose.

    During a descent each pose is solved from its neighbour's; where segments snap, that may follow
    another branch.
    """
    evaluator.forget()
    cold = evaluator.at(x)
    assert evaluation.residual is not None
    if cold.residual is None:
        return False
    return bool(np.allclose(cold.residual, evaluation.residual, rtol=0.0, atol=SAME_POSE))


def on_bounds(problem: Problem, x: Array) -> Array:
    """The point with unknowns that are at a bound but for rounding put exactly there."""
    x = np.where(x - problem.lower < ROUNDING, problem.lower, x)
    return np.where(problem.upper - x < ROUNDING, problem.upper, x)


def bounds_reached(problem: Problem, x: Array) -> Array:
    """(m,) -1 at the lower, 1 at the upper bound, else 0."""
    near = AT_BOUND * problem.scale
    low, high = x - problem.lower < near, problem.upper - x < near
    return high.astype(int) - low.astype(int)


def values(problem: Problem, x: Array) -> Array:
    """(m,) value of each unknown's first row, SI."""
    effects = moved(problem.model, problem.free, x).effects
    return np.array([effects[p.effect].values[p.rows[0], p.column] for p in problem.free])


def names_at_bound(problem: Problem, at_bound: Array) -> str:
    """Which unknowns are at which of their bounds, in words."""
    return ", ".join(
        f"{parameter.label} at its {'upper' if side > 0 else 'lower'} bound"
        for parameter, side in zip(problem.free, at_bound, strict=True)
        if side
    )
