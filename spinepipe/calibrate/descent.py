"""Bounded least squares over points of which some have no equilibrium: the driver of every fit."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from spinepipe.decomposition import bounded_least_squares
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
    point: Point,
    start: Array,
    bounds: tuple[Array, Array],
    scale: Array,
    size: int,
    settled: Settled,
) -> Descent:
    """Least squares from a start that has an equilibrium.

    Parameters
    ----------
    start : (m,), inside the bounds (m,) each. scale : (m,) size of a first step.
    size : number of residuals.
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
