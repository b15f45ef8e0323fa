"""Bounded least squares over points of which some have no equilibrium: the driver of every fit.

A point is a set x of m unknowns, at which a simulator finds N residuals; a `Point` is the function
that looks there. The cost is the residuals' sum of squares. Where there is no equilibrium there is
no cost, and a step must be shorter.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from spinepipe.decomposition import bounded_least_squares, bounded_lstsq
from spinepipe.effects.contract import Array

Point = Callable[[Array], tuple[Array, Array] | None]
"""Residuals (N,) and Jacobian (N, m) at x (m,), None where there is no equilibrium."""

OFF_THE_PATH = "the fitted pose is not the one that the load path leads to: the segment snaps"
"""Said by callers of a fit: one load has several equilibria, and the fit is at another."""


def once(point: Point) -> Point:
    """The same point, which is simulated once for each x.

    `descend` asks for residuals and for the Jacobian of an x apart, `point` gives both.
    """
    looked: dict[bytes, tuple[Array, Array] | None] = {}

    def remembered(x: Array) -> tuple[Array, Array] | None:
        key = x.tobytes()
        if key not in looked:
            looked[key] = point(x)
        return looked[key]

    return remembered


@dataclass(frozen=True)
class DescentTolerances:
    """When a descent has arrived, and when it is given up.

    Attributes
    ----------
    cost : share of the cost; a step that gains less ends the descent. Of `descend_along`, one that
        promises no more.
    step : `descend`: length of a step over that of x, in the unknowns' units. `descend_along`:
        largest entry of a step over the unknowns' scale.
    slope : largest derivative of half the cost by an unknown that is free to move. `descend_along`
        does not use it.
    evaluations : most points that are looked at.
    """

    cost: float
    step: float
    slope: float
    evaluations: int

    @property
    def given_up(self) -> str:
        """What is said of a descent that ended without arriving."""
        return f"no optimum within {self.evaluations} evaluations"


@dataclass(frozen=True)
class Descent:
    """Where a descent ended: x (m,), half the sum of squares, whether it arrived.

    ``evaluations``: points that were looked at; as many as were allowed where `descend_along` did
    not arrive.
    """

    x: Array
    half_cost: float
    arrived: bool
    evaluations: int


def descend(
    point: Point,
    start: Array,
    bounds: tuple[Array, Array],
    scale: Array,
    size: int,
    settled: DescentTolerances,
) -> Descent:
    """Least squares from a start that has an equilibrium.

    Method: scipy's ``dogbox``, Gauss-Newton steps within a box around x and within the bounds. A
    point without equilibrium has NaN for residuals, on which it makes the box smaller.

    Parameters
    ----------
    start : (m,), inside the bounds (m,) each.
    scale : (m,) size of a typical change of each unknown, by which the sides of the box go.
    size : number of residuals, N.
    """
    nowhere = np.full(size, np.nan)
    last: list[Array] = []

    def residual(x: Array) -> Array:
        found = point(x)
        if found is None:
            return nowhere
        last[:] = [found[1]]
        return found[0]

    def jacobian(x: Array) -> Array:
        # asked where residuals were finite just before, but for x that is put onto its bounds: a
        # rounding error away, and where a segment is about to snap that is without equilibrium
        found = point(x)
        return last[0] if found is None else found[1]

    result = bounded_least_squares(
        residual,
        start,
        jacobian,
        bounds,
        x_scale=scale,
        ftol=settled.cost,
        xtol=settled.step,
        gtol=settled.slope,
        max_nfev=settled.evaluations,
    )
    return Descent(result.x, float(result.cost), bool(result.success), int(result.nfev))


DAMPING, LEAST_DAMPING, MOST_DAMPING = 1e-3, 1e-9, 1e9
"""Damping of `descend_along`, Levenberg and Marquardt's lambda: at first, least and most.

Without unit, as it multiplies the squared length of each column of the Jacobian. Once it is at the
most and a step is still not taken, the descent is given up.
"""

EASED, STIFFENED = 0.1, 5.0
"""Factors of the damping after a step that kept its promise, and after one that did not."""

PROMISE = 1e-3
"""Share of the gain promised by the linearised residuals that a step must keep to be taken."""


def descend_along(
    point: Point,
    start: Array,
    bounds: tuple[Array, Array],
    scale: Array,
    settled: DescentTolerances,
) -> Descent:
    """The same where optima lie on bounds: each step is a damped linear fit inside the bounds.

    A step of `descend` that leaves the bounds ends at the first of them that it meets, so that it
    takes many where many unknowns end on theirs. Here, Levenberg and Marquardt's method, the linear
    problem of each step has the bounds and may reach all of them at once. Parameters as of
    `descend`; a start without equilibrium has an infinite cost and has not arrived.
    """
    x, found, damping = start, point(start), DAMPING
    if found is None:
        return Descent(start, np.inf, False, 1)
    for number in range(1, settled.evaluations):
        residual, jacobian = found
        cost = float(residual @ residual)
        # a step of the linear problem inside the bounds, and the gain that it promises
        step = damped_step(
            residual, jacobian * scale, damping, np.array([bounds[0] - x, bounds[1] - x]) / scale
        )
        left = residual + jacobian @ (step * scale)
        promised = cost - float(left @ left)
        if promised <= settled.cost * cost or np.abs(step).max() <= settled.step:
            return Descent(x, 0.5 * cost, True, number)
        trial = np.clip(x + step * scale, *bounds)
        new = point(trial)
        gained = -np.inf if new is None else cost - float(new[0] @ new[0])
        # taken where it keeps some of its promise, else damped more
        if new is not None and gained >= PROMISE * promised:
            x, found, damping = trial, new, max(damping * EASED, LEAST_DAMPING)
        elif damping < MOST_DAMPING:
            damping *= STIFFENED
        else:
            break
    return Descent(x, 0.5 * float(found[0] @ found[0]), False, settled.evaluations)


def damped_step(residual: Array, jacobian: Array, damping: float, reach: Array) -> Array:
    """(m,) step within ``reach`` of least linearised cost, damped by the columns' sizes.

    That is the step s with the least |residual + jacobian s|^2 + damping sum_j (size_j s_j)^2,
    size_j the length of column j. The second sum is put below the first as rows of its own.

    Parameters
    ----------
    residual, jacobian : (N,) and (N, m), by unknowns over their scale; so is the step.
    damping : as of `DAMPING`.
    reach : (2, m) from x to the lower bounds (0 or less) and to the upper ones (0 or more).
    """
    # Marquardt's scaling by the columns; one that says nothing yet is damped as if a millionth of
    # the largest, so that the rows below have full rank
    sizes = np.linalg.norm(jacobian, axis=0)
    sizes = np.maximum(sizes, 1e-6 * max(float(sizes.max(initial=0.0)), 1e-300))
    rows = np.vstack([jacobian, np.diag(np.sqrt(damping) * sizes)])
    targets = np.append(-residual, np.zeros(len(sizes)))
    low, high = np.minimum(reach[0], -INSIDE), np.maximum(reach[1], INSIDE)
    return bounded_lstsq(rows, targets, (low, high))


INSIDE = 1e-12
"""Bounds of a step are at least this far from no step, in the unknowns' scale.

The linear solver refuses bounds that coincide, as they would for an unknown with no room at all.
`descend_along` puts the unknown back onto its bound.
"""
