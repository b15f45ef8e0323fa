"""Profile likelihood: how far an unknown may go while the others make up for it.

A standard error says how steep the cost is where it is least. A spring that nearly holds a joint
rigid has a cost that no longer rises beyond: its local error may be small and its region open. So
each unknown is moved, all others are fitted anew, and its region ends where the cost has risen by
what the noise allows (Raue 2009, doi:10.1093/bioinformatics/btp358).

The rise allowed is that at which a cost as curved as at the optimum would end, t^2 times the
variance of the unknown over its entry of (J'J)^-1: with one scatter for all readings that is the
t limit with the fit's own degrees of freedom, and residuals that share an error count as they do in
the standard error.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import islice

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm, t

from spinepipe.calibration.descent import (
    LEAST_DAMPING,
    DescentTolerances,
    Point,
    damped_step,
    descend,
    descend_along,
    once,
)
from spinepipe.calibration.lockstep import in_lockstep
from spinepipe.calibration.problem import Evaluation, Evaluator, Problem, among, lead
from spinepipe.calibration.uncertainty import UNSEEN_SHARE, uncertainty
from spinepipe.decomposition import lstsq
from spinepipe.effects.contract import Array, Indices

LEVEL = 0.95

NORMAL_95 = float(norm.ppf(0.975))

ENOUGH = DescentTolerances(cost=1e-6, step=1e-5, slope=1e-14, evaluations=30)
"""When the others have been fitted well enough for the rise to be known to a hundredth or so."""

MOST_FITS = 8
"""Of the others, per end."""

AFAR = 3
"""Looks that have not found an end; then the bound itself is looked at, as costs may level off."""

NEAR = 0.05
"""Share of the rise allowed within which an end is found."""

FURTHEST = 3.0
"""Factor by which one look goes further from the optimum than the one before, at most."""


STRAIGHT = 0.1
"""Share of the rise allowed: where one linear step of the others gains less, its cost is taken."""

EXACT = 1e-6
"""A shorter way is below what the optimum itself is known to: it is taken as it is."""

INSIDE = 1e-9
"""A descent begins so far inside its bounds."""


@dataclass(frozen=True)
class Profile:
    """Region of each unknown at a level.

    Attributes
    ----------
    low, high : (m,) ends as moves from the model's values, the bound where an end is open.
    open_below, open_above : (m,) bool; the data allow the bound and what may lie beyond.
    lower_cost : whether a fit on the way had a lower cost than the optimum: there is a better one,
        and no region around this one tells.
    """

    low: Array
    high: Array
    open_below: NDArray[np.bool_]
    open_above: NDArray[np.bool_]
    lower_cost: bool

    @property
    def closed(self) -> NDArray[np.bool_]:
        """(m,) which unknowns have both ends inside their bounds, about an optimum that is one."""
        return ~(self.open_below | self.open_above | self.lower_cost)


@dataclass(frozen=True)
class RegionEnds:
    """How far one value may be from where a fit has it: its ends, none where they are open."""

    low: float | None
    high: float | None
    open_below: bool
    open_above: bool


@dataclass(frozen=True)
class _End:
    """Where one side of a region ends, and the least rise seen on the way."""

    at: float
    is_open: bool
    least: float


@dataclass(frozen=True)
class Best:
    """Where all unknowns are fitted.

    Attributes
    ----------
    x : (m,), residual (N,), jacobian (N, m). lower, upper : (m,) bounds.
    scale : (m,) size of a typical change. bent : (m,) whether an unknown is the logarithm of a
        stiffness: what is read grows with one over it.
    enough : when the others have been fitted well enough. along_bounds : as of `Problem`.
    ahead : factor by which first looks go beyond where a straight problem would end.
    """

    x: Array
    residual: Array
    jacobian: Array
    lower: Array
    upper: Array
    scale: Array
    bent: NDArray[np.bool_]
    enough: DescentTolerances = ENOUGH
    along_bounds: bool = False
    ahead: float = 1.0

    def others(self, unknown: int) -> Indices:
        """All but one."""
        return np.flatnonzero(np.arange(len(self.x)) != unknown)

    def follow(self, unknown: int) -> Array:
        """(m,) where the others go, to first order, as the unknown goes by 1."""
        others = self.others(unknown)
        direction = np.ones(len(self.x))
        direction[others] = -_not_made(self.jacobian, unknown, others)[1]
        return direction

    def told_by(self, unknown: int) -> float:
        """One over the SD of an unknown to first order, the others free; residuals in their SDs."""
        left, _ = _not_made(self.jacobian, unknown, self.others(unknown))
        return float(np.linalg.norm(left))


@dataclass(frozen=True)
class _Rise:
    """Of the cost, that is allowed; ``way`` to it if the cost were as curved as at the optimum."""

    allowed: float
    way: float


_Search = Callable[[Point], _End]

_Side = tuple[int, int, _Search]
"""An unknown, -1 below or 1 above, and how its end is looked for."""


Asked = tuple[Evaluator, Array, Evaluation, Array]
"""An optimum: x (m,), what there is, and which unknowns are at a bound (m,), see `Optimum`."""


def profiles(
    asked: Sequence[Asked], noise: Array | None = None, level: float = LEVEL
) -> list[Profile]:
    """Region of every unknown of fits without a prior; those with one are fitted among the others.

    Parameters
    ----------
    asked : of evaluators that share a stack. noise : as in `uncertainty`.
    """
    lead([(evaluator, x) for evaluator, x, _, _ in asked])
    plans: list[tuple[Evaluator, Best, list[_Side]]] = []
    for evaluator, x, evaluation, at_bound in asked:
        problem, residual, jacobian = evaluator.problem, evaluation.residual, evaluation.jacobian
        assert residual is not None
        assert jacobian is not None
        evaluator.start_at(x)  # or regions would hang on where other starts have been
        bent = np.array([parameter.logarithmic for parameter in problem.free])
        around = (problem.lower, problem.upper, problem.scale, bent)
        best = Best(x, residual, jacobian, *around, along_bounds=problem.along_bounds)
        rises = list(_rises(problem, evaluation, at_bound, noise, level))
        plans.append((evaluator, best, _sides(best, rises)))
    searches = [(one, search) for one, _, sides in plans for _, _, search in sides]
    asking = [partial(_through, search) for _, search in searches]
    ends = iter(in_lockstep(asking, partial(among, [one for one, _ in searches])))
    return [_region(best, sides, list(islice(ends, len(sides)))) for _, best, sides in plans]


def profile_in_turn(
    best: Best, point: Point, asked: Sequence[int], limit: float = NORMAL_95
) -> Profile:
    """Region of some unknowns where residuals are in their own SDs; all else is left open.

    Parameters
    ----------
    point : residuals and Jacobian anywhere, None where there is no equilibrium.
    limit : SDs that an unknown may be off; Student's t where the SD is that of the residuals.
    """
    rises: list[_Rise | None] = [None] * len(best.x)
    for unknown in asked:
        size = best.told_by(unknown)
        if size > UNSEEN_SHARE * float(np.linalg.norm(best.jacobian[:, unknown])):
            rises[unknown] = _Rise(limit**2, limit / size)
    sides = _sides(best, rises)
    return _region(best, sides, [search(point) for _, _, search in sides])


def _sides(best: Best, rises: Sequence[_Rise | None]) -> list[_Side]:
    return [
        (unknown, side, partial(_end, best, unknown, rise, side))
        for unknown, rise in enumerate(rises)
        if rise is not None
        for side in (-1, 1)
    ]


def _region(best: Best, sides: Sequence[_Side], ends: Sequence[_End]) -> Profile:
    low, high = best.lower.copy(), best.upper.copy()
    is_open = np.ones((2, len(best.x)), dtype=bool)
    for (unknown, side, _), end in zip(sides, ends, strict=True):
        (low if side < 0 else high)[unknown] = end.at
        is_open[int(side > 0), unknown] = end.is_open
    lower = any(end.least < -NEAR for end in ends)
    return Profile(low, high, is_open[0], is_open[1], lower)


def _through(search: _Search, at: Callable[[Array], Evaluation]) -> _End:
    """The search, which asks by evaluations."""

    def point(x: Array) -> tuple[Array, Array] | None:
        found = at(x)
        if found.residual is None or found.jacobian is None:
            return None
        return found.residual, found.jacobian

    return search(point)


def _rises(
    problem: Problem, evaluation: Evaluation, at_bound: Array, noise: Array | None, level: float
) -> Iterator[_Rise | None]:
    """Of each unknown; None where the data hold nothing against any value, or it has a prior.

    What is at a bound is held there, but for an unknown's own rise.
    """
    assert evaluation.jacobian is not None
    alike = uncertainty(problem, evaluation, at_bound, np.inf, noise)
    for unknown in range(len(at_bound)):
        if problem.has_prior(unknown):
            yield None
            continue
        free, found = at_bound, alike
        if at_bound[unknown] != 0:
            free = np.where(np.arange(len(at_bound)) == unknown, 0, at_bound)
            found = uncertainty(problem, evaluation, free, np.inf, noise)
        error = float(found.standard_error[unknown])
        if not np.isfinite(error):
            yield None
            continue
        tail = 0.5 + level / 2.0
        limit = norm.ppf(tail) if noise is not None else t.ppf(tail, found.degrees_of_freedom)
        inside = np.flatnonzero(free == 0)
        left, _ = _not_made(evaluation.jacobian, unknown, inside[inside != unknown])
        way = float(limit) * error
        yield _Rise(way**2 * float(left @ left), way)


def _not_made(jacobian: Array, unknown: int, others: Indices) -> tuple[Array, Array]:
    """What of the unknown's column the others cannot make (N,), and by what they make the rest."""
    column = jacobian[:, unknown]
    if not len(others):
        return column, np.zeros(0)
    by, _ = lstsq(jacobian[:, others], column)
    return column - jacobian[:, others] @ by, by


def _end(best: Best, unknown: int, rise: _Rise, side: int, point: Point) -> _End:
    """Go from the optimum to one side until the cost has risen by what is allowed."""
    origin, bent = float(best.x[unknown]), bool(best.bent[unknown])
    bound = float((best.lower if side < 0 else best.upper)[unknown])
    cost = float(best.residual @ best.residual)
    if side * (bound - origin) <= 0.0:
        return _End(bound, True, 0.0)
    if rise.way < EXACT * best.scale[unknown]:
        return _End(_no_further(origin + side * rise.way, bound, side), False, 0.0)
    inner, outer, least = (origin, 0.0), None, 0.0
    value = _no_further(_from(origin, side * best.ahead * rise.way, bent), bound, side)
    alike = 0  # looks in a row that fell on the same side of the end, once it is between two
    direction, there = best.follow(unknown), best.x
    # a bracket of the end: inner, where the cost has risen less, and outer, where it has risen more
    for number in range(1, MOST_FITS + 1):
        start = best.x + (value - origin) * direction
        found, fitted = _refitted(best, unknown, value, (start, there), rise, point)
        share = (found - cost) / rise.allowed
        least = min(least, share)
        if share < 1.0 and value == bound:
            return _End(bound, True, least)
        if abs(share - 1.0) <= NEAR and (share >= 1.0 or outer is not None):
            return _End(value, False, least)
        between = outer is not None
        if share > 1.0:
            alike = max(alike, 0) + 1 if between else 0
            outer = (value, share)
        else:
            alike = min(alike, 0) - 1 if between else 0
            inner, there = (value, share), fitted
            direction = (fitted - best.x) / (value - origin)
        # regula falsi on the root of the rise, bisected where it stalls on one side
        far = outer is None and number >= AFAR
        value = bound if far else _next(origin, inner, outer, bound, bent, abs(alike) > 1)
    return _End(bound, True, least) if outer is None else _End(outer[0], False, least)


def _next(
    origin: float,
    inner: tuple[float, float],
    outer: tuple[float, float] | None,
    bound: float,
    bent: bool,
    halve: bool = False,
) -> float:
    """Where to look next: the root of the rise is nearly straight, see `_from`.

    Parameters
    ----------
    halve : whether it is not, as looks keep falling on one side: then half way between.
    """
    value, share = inner
    root = np.sqrt(max(share, 0.0))
    side = 1 if bound > origin else -1
    if outer is None:
        factor = float(np.clip(1.02 / max(root, 1e-6), 1.1, FURTHEST))
        return _no_further(_from(origin, factor * _way(origin, value, bent), bent), bound, side)
    if not np.isfinite(outer[1]):
        return 0.5 * (value + outer[0])
    part = float(np.clip((1.0 - root) / (np.sqrt(outer[1]) - root), 0.05, 0.95))
    part = 0.5 if halve else part
    return _from(value, part * _way(value, outer[0], bent), bent)


def _from(start: float, way: float, bent: bool) -> float:
    """Where a way leads from a start.

    Parameters
    ----------
    bent : whether the unknown is a logarithm. Under a load what is read grows with one over the
        stiffness: the way is straight in that, and beyond zero there is no stiffness.
    """
    if not bent:
        return start + way
    return start - float(np.log1p(-way)) if way < 1.0 else np.inf


def _way(start: float, end: float, bent: bool) -> float:
    """The way from a start to an end, to first order their difference."""
    return -float(np.expm1(start - end)) if bent else end - start


def _no_further(value: float, bound: float, side: int) -> float:
    return max(value, bound) if side < 0 else min(value, bound)


def _refitted(
    best: Best, unknown: int, value: float, starts: Sequence[Array], rise: _Rise, point: Point
) -> tuple[float, Array]:
    """Cost with the unknown held at a value and the others fitted; infinite where nothing stands.

    Parameters
    ----------
    starts : (m,) each, where the others may begin; the first that stands is taken.
    """
    others = best.others(unknown)
    bounds = best.lower[others], best.upper[others]

    def whole(y: Array) -> Array:
        x = np.full(len(best.x), value)
        x[others] = y
        return x

    def held(y: Array) -> tuple[Array, Array] | None:
        found = point(whole(y))
        return None if found is None else (found[0], found[1][:, others])

    for start in starts:
        begin = np.clip(start[others], bounds[0] + INSIDE, bounds[1] - INSIDE)
        found = held(begin)
        if found is None:
            continue
        size, scale = len(best.residual), best.scale[others]
        along = (bounds, scale) if best.along_bounds else None
        cost, moved = _one_step(*found, begin, along)
        if float(found[0] @ found[0]) - cost <= STRAIGHT * rise.allowed and np.all(
            (moved >= bounds[0]) & (moved <= bounds[1])
        ):
            return cost, whole(moved)
        if best.along_bounds:
            ended = descend_along(held, begin, bounds, scale, best.enough)
        else:
            ended = descend(once(held), begin, bounds, scale, size, best.enough)
        return 2.0 * ended.half_cost, whole(ended.x)
    return np.inf, best.x


def _one_step(
    residual: Array,
    jacobian: Array,
    start: Array,
    along: tuple[tuple[Array, Array], Array] | None,
) -> tuple[float, Array]:
    """Cost and place that a linear step reaches.

    Parameters
    ----------
    along : bounds that it ends at and scale of the unknowns; None for a step without bounds.
    """
    if not len(start):
        return float(residual @ residual), start
    if along is None:
        step, _ = lstsq(jacobian, -residual)
    else:
        (low, high), scale = along
        reach = np.array([low - start, high - start]) / scale
        step = scale * damped_step(residual, jacobian * scale, LEAST_DAMPING, reach)
    left = residual + jacobian @ step
    return float(left @ left), np.clip(start + step, *along[0]) if along else start + step
