"""Bounded least squares over points of which some have no equilibrium: the driver of every fit."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spinepipe.decomposition import bounded_lstsq, lstsq
from spinepipe.effects.contract import Array

Point = Callable[[Array], tuple[Array, Array] | None]
"""Residuals (N,) and Jacobian (N, m) at x (m,), None where there is no equilibrium."""

OFF_THE_PATH = "the fitted pose is not the one that the load path leads to: the segment snaps"


def once(point: Point) -> Point:
    """The same, which looks at each x once: a descent asks for residuals, then for the Jacobian."""
    looked: dict[bytes, tuple[Array, Array] | None] = {}

    def remembered(x: Array) -> tuple[Array, Array] | None:
        key = x.tobytes()
        if key not in looked:
            looked[key] = point(x)
        return looked[key]

    return remembered


@dataclass(frozen=True)
class Settled:
    """When a descent has arrived, and when it is given up.

    Attributes
    ----------
    cost, step, slope : tolerances of the cost, of a step and of the slope of the cost.
    evaluations : most points that are looked at.
    """

    cost: float
    step: float
    slope: float
    evaluations: int

    @property
    def given_up(self) -> str:
        """What is said of a descent that looked at so many points in vain."""
        return f"no optimum within {self.evaluations} evaluations"


@dataclass(frozen=True)
class Descent:
    """Where a descent ended: x (m,), half the sum of squares, whether it arrived."""

    x: Array
    half_cost: float
    arrived: bool
    evaluations: int


def descend(
    point: Point, start: Array, bounds: tuple[Array, Array], scale: Array, settled: Settled
) -> Descent:
    """Least squares from a start that has an equilibrium.

    Dogleg steps in a box inside the bounds (Voglis and Lagaris 2004), one after the other as
    scipy's `dogbox` takes them, but each point is looked at once. Where nothing stands
    the box becomes smaller.

    Parameters
    ----------
    start : (m,), inside the bounds (m,) each. scale : (m,) size of a first step.
    """
    x, found, (low, high) = start, point(start), bounds
    if found is None:
        return Descent(start, np.inf, False, 1)
    residual, jacobian = found
    cost, looks, arrived = 0.5 * float(residual @ residual), 1, False
    size = float(np.abs(x / scale).max(initial=0.0)) or 1.0  # of the box, in scales
    side = np.where(x == high, 1, np.where(x == low, -1, 0))
    while not arrived:
        slope = jacobian.T @ residual
        free = side * slope >= 0.0  # the others would leave the bounds that they are on
        inner, down = jacobian[:, free], slope[free]
        arrived = bool(np.abs(down).max(initial=0.0) < settled.slope)
        if arrived or looks == settled.evaluations:
            break
        newton, _ = lstsq(inner, -residual)
        gained = -1.0
        while gained <= 0.0 and looks < settled.evaluations:
            box = size * scale[free]
            reach = np.array([(low - x)[free], (high - x)[free]])
            ends = np.array([np.maximum(reach[0], -box), np.minimum(reach[1], box)])
            step, hit = _dogleg(newton, down, inner, ends)
            whole = np.zeros(len(x))
            whole[free] = step
            trial = np.clip(x + whole, low, high)
            new, looks = point(trial), looks + 1
            length = float(np.abs(whole / scale).max())
            if new is None or not np.isfinite(new[0]).all():
                size = 0.25 * length
                continue
            made = inner @ step
            promised = -(0.5 * float(made @ made) + float(down @ step))
            gained = cost - 0.5 * float(new[0] @ new[0])
            share = gained / promised if promised > 0.0 else float(promised == gained == 0.0)
            at_box = (hit < 0) & (ends[0] == -box) | (hit > 0) & (ends[1] == box)
            if share < 0.25:
                size = 0.25 * length
            elif share > 0.75 and at_box.any():
                size *= 2.0
            short = np.linalg.norm(whole) < settled.step * (settled.step + np.linalg.norm(x))
            if short or (gained < settled.cost * cost and share > 0.25):
                arrived = True
                break
        if gained > 0.0:
            assert new is not None
            residual, jacobian = new
            cost = 0.5 * float(residual @ residual)
            on_bound = (hit < 0) & (ends[0] == reach[0]) | (hit > 0) & (ends[1] == reach[1])
            side[free] = np.where(on_bound, hit, 0)
            x = np.where(side > 0, high, np.where(side < 0, low, trial))
            if not np.array_equal(x, trial):
                # a rounding error away: where a segment is about to snap that may stand no more
                found = point(x)
                jacobian = jacobian if found is None else found[1]
    return Descent(x, cost, arrived, looks)


def _dogleg(
    newton: Array, slope: Array, jacobian: Array, ends: Array
) -> tuple[Array, NDArray[np.int64]]:
    """(m,) step towards Newton's, by way of the least cost down the slope, inside ends (2, m).

    And which of the ends it reaches, -1 or 1; 0 for none.
    """
    if ((newton >= ends[0]) & (newton <= ends[1])).all():
        return newton, np.zeros(len(newton), dtype=np.int64)
    down = jacobian @ slope
    furthest, _ = _to_ends(np.zeros(len(slope)), -slope, ends)
    bend = float(down @ down)
    best = float(slope @ slope) / bend if bend > 0.0 else np.inf
    cauchy = -min(furthest, best) * slope
    way = newton - cauchy
    part, hit = _to_ends(cauchy, way, ends)
    return cauchy + part * way, hit


def _to_ends(start: Array, way: Array, ends: Array) -> tuple[float, NDArray[np.int64]]:
    """How much of a way leads to the first of the ends (2, m), and which these are."""
    going = way != 0.0
    parts = np.full(len(way), np.inf)
    parts[going] = ((ends - start)[:, going] / way[going]).max(axis=0)
    least = float(parts.min())
    return least, np.where(parts == least, np.sign(way), 0.0).astype(np.int64)


DAMPING, LEAST_DAMPING, MOST_DAMPING = 1e-3, 1e-9, 1e9
"""Of a step along bounds, in squares of the Jacobian's columns: at first, and its ends."""

EASED, STIFFENED = 0.1, 5.0
"""Factors of the damping after a step that kept its promise, and after one that did not."""

PROMISE = 1e-3
"""Share of the gain that the linearised cost promises, below which a step is not taken."""


def descend_along(
    point: Point, start: Array, bounds: tuple[Array, Array], scale: Array, settled: Settled
) -> Descent:
    """The same where optima lie on bounds: each step is a damped linear fit inside the bounds.

    `descend` keeps strictly inside and crawls once some unknowns are where they end. Levenberg and
    Marquardt's method with the bounds in its linear problem; parameters as of `descend`.
    """
    x, found, damping = start, point(start), DAMPING
    if found is None:
        return Descent(start, np.inf, False, 1)
    for number in range(1, settled.evaluations):
        residual, jacobian = found
        cost = float(residual @ residual)
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
        if new is not None and gained >= PROMISE * promised:
            x, found, damping = trial, new, max(damping * EASED, LEAST_DAMPING)
        elif damping < MOST_DAMPING:
            damping *= STIFFENED
        else:
            break
    return Descent(x, 0.5 * float(found[0] @ found[0]), False, settled.evaluations)


def damped_step(residual: Array, jacobian: Array, damping: float, reach: Array) -> Array:
    """(m,) step within ``reach`` (2, m) of least linearised cost, damped by the columns' sizes.

    Parameters
    ----------
    damping : as of `DAMPING`. reach : from no step to the bounds.
    """
    sizes = np.linalg.norm(jacobian, axis=0)
    sizes = np.maximum(sizes, 1e-6 * max(float(sizes.max(initial=0.0)), 1e-300))
    rows = np.vstack([jacobian, np.diag(np.sqrt(damping) * sizes)])
    targets = np.append(-residual, np.zeros(len(sizes)))
    low, high = np.minimum(reach[0], -INSIDE), np.maximum(reach[1], INSIDE)
    return bounded_lstsq(rows, targets, (low, high))


INSIDE = 1e-12
"""Bounds of a step lie at least this far apart, in the unknowns' scale."""
