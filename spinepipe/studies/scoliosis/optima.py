"""Optima of fits to films, whose poses are those that the model takes from neutral.

Trial poses are sought from those of the trial before, which is cheap and may follow a path that the
model does not take from neutral (`statics.prescribed.hold_at`). What is told of an optimum is that
of the poses from neutral; where these are others it is fitted anew with such poses alone.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from spinepipe.calibration.descent import Descent, DescentTolerances, Point, descend, once
from spinepipe.effects.contract import Array
from spinepipe.statics.prescribed import PrescribedResult
from spinepipe.status import Status
from spinepipe.studies.scoliosis.tangent_laws import Flags

SAME_POSE = 1e-6
"""Rad: by which poses of one path differ at most."""

STILL_FALLS = 1e-2
"""Slope of the cost by an unknown's scale, as a share of the cost. A fit with poses from neutral
may end where they leave for another path, its steps cut to nothing: beyond this, it did."""

AT_BOUND = 1e-4
"""Unknowns' scales: descents keep inside their bounds, and come so near where these hold them."""

SAME_OPTIMUM = 0.1
"""Unknowns' scales: optima that differ by less are one, as fits settle in a few hundredths."""

COST_TIE = 1e-3
"""Share of the cost, for the same reason: of optima that tie the first is taken."""


class Holder(Protocol):
    """Who holds a spine in its films, from poses near by."""

    near: dict[str, PrescribedResult]


Limits = tuple[Array, Array, Array]
"""(m,) each: least and largest unknowns, and their scale."""


@dataclass(frozen=True)
class FilmOptimum:
    """Where one start ended.

    Attributes
    ----------
    x : (m,) unknowns. residual, jacobian : (N,) and (N, m) there, with the poses from neutral.
    poses : these, by position. at_bound : (m,) bool.
    """

    x: Array
    residual: Array
    jacobian: Array
    poses: Mapping[str, PrescribedResult]
    status: Status
    at_bound: Flags

    @property
    def cost(self) -> float:
        """Sum of squares."""
        return float(self.residual @ self.residual)


def optimum(
    holder: Holder,
    point: Point,
    begin: Sequence[Array],
    near: Mapping[str, PrescribedResult],
    limits: Limits,
    settled: DescentTolerances,
) -> FilmOptimum | None:
    """The end of a fit from the first of some unknowns that has poses; None where none has.

    Parameters
    ----------
    point : residuals by unknowns, whose poses begin from the holder's. near : such poses at first.
    """

    def from_neutral(x: Array) -> tuple[Array, Array] | None:
        holder.near = {}
        return point(x)

    # trials from poses near by
    holder.near = dict(near)
    ended = _ended(once(point), begin, limits, settled)
    if ended is None:
        return None
    # the same poses from neutral; where they are others, a fit with such poses alone
    trials = holder.near
    found = from_neutral(ended.x)
    led = found is not None and all(
        np.abs(holder.near[name].q - trials[name].q).max() < SAME_POSE for name in trials
    )
    if not led:
        ended = _ended(once(from_neutral), [ended.x, *begin], limits, settled)
        found = None if ended is None else from_neutral(ended.x)
    if ended is None or found is None:
        return None
    # how it ended: the slope of the sum of squares, in scales, along what no bound holds
    low, high, scale = limits
    at_bound = (ended.x - low < AT_BOUND * scale) | (high - ended.x < AT_BOUND * scale)
    slope = 2.0 * np.abs(found[0] @ found[1] * scale)[~at_bound].max(initial=0.0)
    status = Status.CONVERGED_AT_BOUND if at_bound.any() else Status.CONVERGED
    if not ended.arrived or not (led or slope <= STILL_FALLS * float(found[0] @ found[0])):
        status = Status.NOT_CONVERGED
    return FilmOptimum(ended.x, *found, dict(holder.near), status, at_bound)


def _ended(
    point: Point, begin: Sequence[Array], limits: Limits, settled: DescentTolerances
) -> Descent | None:
    low, high, scale = limits
    for one in begin:
        start = np.clip(one, low + 1e-9, high - 1e-9)
        found = point(start)
        if found is not None:
            return descend(point, start, (low, high), scale, len(found[0]), settled)
    return None


def best(ends: Sequence[FilmOptimum | None], scale: Array) -> tuple[FilmOptimum | None, int]:
    """The optimum of least cost, the first of those that tie, and how many distinct ones there are.

    Ends that are none count where there is no optimum.
    """
    there = [one for one in ends if one is not None]
    some = [one for one in there if one.status.usable]
    if not there:
        return None, 0
    least = min(one.cost for one in some or there)
    first = next(one for one in some or there if one.cost <= (1.0 + COST_TIE) * least)
    distinct: list[FilmOptimum] = []
    for one in some:
        apart = [np.abs((one.x - other.x) / scale).max() for other in distinct]
        if min(apart, default=np.inf) > SAME_OPTIMUM:
            distinct.append(one)
    return first, len(distinct)
