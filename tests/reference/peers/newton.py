"""Root of a generalised load by Newton's method with a differenced tangent."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
LoadAt = Callable[[Array, float], Array]

DIFFERENCE_STEP = 1e-6
"""m and rad: truncation (1e-12) and round-off (1e-10) of a central difference both harmless."""

LARGEST_STEP = 1.0
"""m and rad: a longer step has left the neighbourhood of the load path; NaN counts as longer."""

SLOW_CONTRACTION = 0.01

MOST_ITERATIONS = 30
MOST_LOAD_STEPS = 64


class NoEquilibriumError(RuntimeError):
    """Newton did not converge, however finely the load was cut."""


def root(load: LoadAt, start: Array, tol: float) -> Array:
    """Solve ``load(q, 1) = 0`` for q (n,), cutting the load factor 0..1 into steps when needed.

    Stops when the last step is below ``tol`` (m and rad alike). A differenced tangent contracts the
    error about 1e-8 per step near the root, so what remains is far below the last step, and the
    floor is the round-off of ``load`` itself.
    """
    n_steps = 1
    while n_steps <= MOST_LOAD_STEPS:
        try:
            q = start
            for factor in np.arange(1, n_steps + 1) / n_steps:
                q = _newton(load, float(factor), q, tol)
            return q
        except NoEquilibriumError:
            n_steps *= 4
    raise NoEquilibriumError(f"no equilibrium found in {MOST_LOAD_STEPS} load steps")


def tangent(load: Callable[[Array], Array], q: Array, step: float = DIFFERENCE_STEP) -> Array:
    """``d load / d q`` (n, n) by central differences."""
    moves = step * np.eye(len(q))
    return np.array([(load(q + d) - load(q - d)) / (2 * step) for d in moves]).T


def _newton(load: LoadAt, factor: float, start: Array, tol: float) -> Array:
    """Newton steps; the tangent is taken anew only when a step did not shrink a hundredfold."""

    def load_here(q: Array) -> Array:
        return load(q, factor)

    q = np.array(start)
    inverse = np.linalg.inv(tangent(load_here, q))
    last = np.inf
    for _ in range(MOST_ITERATIONS):
        step = inverse @ load_here(q)
        q = q - step
        size = float(np.abs(step).max())
        if size < tol:
            return q
        if not size < LARGEST_STEP:
            break
        if size > SLOW_CONTRACTION * last:
            inverse = np.linalg.inv(tangent(load_here, q))
        last = size
    raise NoEquilibriumError(f"last step {size:.1e}")
