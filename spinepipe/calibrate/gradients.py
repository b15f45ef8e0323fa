"""Derivative of a problem's cost at its start: exact, and by careful differences to check it."""

from dataclasses import replace

import numpy as np
from scipy.differentiate import jacobian

from spinepipe.calibrate.problem import Evaluator, Problem
from spinepipe.effects.contract import Array
from spinepipe.statics import Course

FIRST_STEP = 0.05
"""Of a logarithm: far enough from a pose that snaps, and halved until the error is rounding."""


def exact_gradient(problem: Problem, course: Course | None = None) -> Array | None:
    """(m,) derivative of the cost by the unknowns at the start; None where nothing stands there.

    With a course, that of runs which end after it.
    """
    start = np.zeros(len(problem.free))
    found = Evaluator(replace(problem, course=course)).at(start)
    if found.residual is None or found.jacobian is None:
        return None
    return 2.0 * found.residual @ found.jacobian


def differenced_gradient(problem: Problem) -> Array | None:
    """The same at rest by central differences of high order, with steps that adapt (scipy's)."""
    evaluator = Evaluator(replace(problem, course=None))
    found = jacobian(
        lambda points: np.apply_along_axis(lambda x: _cost(evaluator, x), 0, points),
        np.zeros(len(problem.free)),
        initial_step=FIRST_STEP,
    )
    gradient: Array = found.df
    return gradient if np.isfinite(gradient).all() else None


def relative_error(gradient: Array | None, exact: Array | None) -> float | None:
    """Size of a gradient's error relative to the exact one's size; None without both."""
    if gradient is None or exact is None:
        return None
    size = float(np.linalg.norm(exact))
    return float(np.linalg.norm(gradient - exact)) / size if size > 0.0 else None


def _cost(evaluator: Evaluator, x: Array) -> float:
    residual = evaluator.at(np.ascontiguousarray(x)).residual
    return np.nan if residual is None else float(residual @ residual)
