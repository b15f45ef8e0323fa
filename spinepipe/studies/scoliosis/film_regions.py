"""How far a segment's ratio may be from where the fit has it before both films speak against it.

A population draws every number of a patient to itself, so an interval made with it is narrow where
the films say nothing. Here one ratio at a time is rid of the population and moved, all else is
fitted anew and keeps its population: a profile likelihood (`calibrate.profile`). Where films allow
all that is tried, the ratio is the population's and no finding about the patient.
"""

from functools import partial

import numpy as np

from spinepipe.calibration.descent import DescentTolerances, Point, descend, once
from spinepipe.calibration.lockstep import in_lockstep
from spinepipe.calibration.profile import Best, RegionEnds, profile_in_turn
from spinepipe.effects.contract import Array
from spinepipe.statics.prescribed import alone, answered
from spinepipe.statics.prescribed_chain import Ask
from spinepipe.studies.scoliosis.film_fit import FARTHEST, FilmFit, FilmFitResult, prior
from spinepipe.studies.scoliosis.population import Population

SETTLED = DescentTolerances(cost=1e-3, step=1e-3, slope=1e-6, evaluations=30)
"""Of a cost of some fifty, a thousandth is a hundredth of what the noise allows."""

ENOUGH = DescentTolerances(cost=1e-2, step=1e-2, slope=1e-4, evaluations=6)
"""With one ratio held, which is done often: ends move by less than a hundredth."""

OPEN = RegionEnds(None, None, True, True)
"""Of a segment of which films tell nothing."""


def regions(fit: FilmFit, population: Population, fitted: FilmFitResult) -> tuple[RegionEnds, ...]:
    """(S,) 95 % region of each segment's ratio; ends that the films leave open are none."""
    searches = [partial(region, fit, population, fitted, one) for one in range(fit.segments)]
    return tuple(in_lockstep(searches, answered))


def region(
    fit: FilmFit, population: Population, fitted: FilmFitResult, segment: int, ask: Ask = alone
) -> RegionEnds:
    """95 % region of one segment's ratio."""
    fit = FilmFit(fit.patient, fit.sd, ask)
    fit.near = dict(fitted.poses)
    numbers = by_ratio(fit.segments, len(fitted.unknowns), segment)
    point = once(_of_films(fit, population, segment, numbers))
    usual, scale, _ = prior(population)
    middle = np.asarray(np.linalg.solve(numbers, usual), dtype=np.float64)
    lower, upper = middle - FARTHEST * scale, middle + FARTHEST * scale
    begin = np.clip(np.linalg.solve(numbers, fitted.unknowns), lower + 1e-9, upper - 1e-9)
    first = point(begin)
    if first is None:
        return OPEN
    ended = descend(point, begin, (lower, upper), scale, len(first[0]), SETTLED)
    found = point(ended.x)
    if found is None or not ended.arrived:
        return OPEN
    # only the ratio is profiled; it is the one unknown that no prior holds
    bent = np.arange(len(begin)) == segment
    best = Best(ended.x, *found, lower, upper, scale, bent, ENOUGH)
    seen = profile_in_turn(best, point, [segment])
    # a lower cost beside the fit: this was no optimum, and its region would be none
    if seen.lower_cost:
        return OPEN
    below, above = bool(seen.open_below[segment]), bool(seen.open_above[segment])
    low, high = float(np.exp(seen.low[segment])), float(np.exp(seen.high[segment]))
    return RegionEnds(None if below else low, None if above else high, below, above)


def by_ratio(segments: int, unknowns: int, segment: int) -> Array:
    """(n, n) that makes a fit's unknowns of the same with one number replaced by the ratio.

    The ratio's logarithm is the number less the mean of all segments' numbers.
    """
    made = np.eye(unknowns)
    made[segment, :segments] = 1.0 / (segments - 1)
    made[segment, segment] = segments / (segments - 1)
    return made


def _of_films(fit: FilmFit, population: Population, segment: int, numbers: Array) -> Point:
    """Errors of the films and of all but one number of the population, in their SD."""
    middle, _, root = prior(population)
    root = np.delete(root, segment, axis=0)  # a ratio is drawn apart from all other numbers

    def point(moved: Array) -> tuple[Array, Array] | None:
        unknowns = numbers @ moved
        found = fit.missed(unknowns)
        if found is None:
            return None
        errors = np.append(found[0], root @ (unknowns - middle))
        return errors, np.vstack([found[1], root]) @ numbers

    return point
