"""Rows of the tables ``stiffness`` and ``fits``, whatever the fit."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from spinepipe.calibration import Problem
from spinepipe.calibration.profile import RegionEnds
from spinepipe.effects.contract import Array
from spinepipe.studies.cohort_stiffness.stiffening import AT_BOUND, LINEAR, Growth
from spinepipe.units import COORDINATES, STIFFNESS_UNITS

Row = dict[str, Any]

LEVEL = 0.975
"""Upper end of the intervals: 95 % lie between the ends."""

_OPEN = ("open_below", "open_above")


def stiffness_rows(
    joints: Sequence[str],
    free: Sequence[str],
    values: Array,
    log_error: Array,
    degrees_of_freedom: float,
    identifiable: NDArray[np.bool_] | None,
    at_bound: NDArray[np.int64],
    reaches: Mapping[tuple[int, int], RegionEnds] | None = None,
    growth: Growth | None = None,
) -> list[Row]:
    """One row per joint and free coordinate.

    Parameters
    ----------
    values : (J, 6) stiffness, SI. log_error : (J, 6) standard error of its logarithm, infinite
        where there is none. identifiable, at_bound : (J, 6); identifiable None for literature.
    degrees_of_freedom : of Student's t for the intervals; infinite for the normal distribution.
    reaches : of the stiffness at a joint and coordinate, by profile likelihood; it takes the place
        of the interval.
    growth : of laws that stiffen.
    """
    reach = float(stats.t.ppf(LEVEL, degrees_of_freedom)) if degrees_of_freedom > 0 else np.inf
    rows = []
    for row, joint in enumerate(joints):
        for name in free:
            at = row, COORDINATES.index(name)
            told = (reaches or {}).get(at)
            # Where no region was looked for the interval stands.
            ends = dict.fromkeys(_OPEN) if told is None else asdict(told)
            rows.append(
                {
                    "joint": joint,
                    "coordinate": name,
                    "unit": STIFFNESS_UNITS[name],
                    **interval(values[at], log_error[at], reach),
                    **ends,
                    "identifiable": None if identifiable is None else bool(identifiable[at]),
                    "at_bound": AT_BOUND[int(at_bound[at])],
                    **(LINEAR if growth is None else growth.row(at)),
                }
            )
    return rows


def interval(value: float, log_error: float, reach: float) -> Row:
    """Value, standard error and ends of the interval, normal in the logarithm."""
    empty: Row = {"standard_error": None, "low": None, "high": None}
    if not np.isfinite(value):
        return {"stiffness": None, **empty}
    # Student's t on the logarithm, so that both ends are positive.
    with np.errstate(over="ignore"):  # an end beyond all numbers is none
        low, high = value * np.exp([-reach * log_error, reach * log_error])
    if not np.isfinite(log_error) or not np.isfinite(high):
        return {"stiffness": float(value), **empty}
    return {
        "stiffness": float(value),
        "standard_error": float(value * log_error),
        "low": float(low),
        "high": float(high),
    }


def criteria(
    cost: float | None,
    readings: int,
    effective_unknowns: float | None,
    freedom: float | None = None,
    independent: bool = True,
    cost_of_priors: float = 0.0,
) -> dict[str, float | None]:
    """Scatter, log-likelihood, corrected Akaike and Schwarz criterion.

    The scatter counts as one more unknown. Source: Burnham and Anderson, Model selection and
    multimodel inference, 2002, sections 2.2 and 2.4.

    Parameters
    ----------
    cost : sum of squared residuals; None where there is no fit.
    freedom : degrees of freedom of the scatter; readings less effective unknowns by default.
    cost_of_priors : squares of priors, which are readings to the scatter, and to nothing else here.
    independent : False where residuals are correlated and ``cost`` is told nothing of it: then it
        is no likelihood.
    """
    empty: dict[str, float | None] = dict.fromkeys(("scatter", "log_likelihood", "aicc", "bic"))
    if cost is None or effective_unknowns is None:
        return empty
    freedom = readings - effective_unknowns if freedom is None else freedom
    if freedom > 0.0:
        empty["scatter"] = float(np.sqrt((cost + cost_of_priors) / freedom))
    unknowns = effective_unknowns + 1.0
    if not independent or cost <= 0.0 or readings - unknowns - 1.0 <= 0.0:
        return empty
    # Normal errors whose variance is at its own maximum of likelihood, cost / readings.
    log_likelihood = -0.5 * readings * (np.log(2.0 * np.pi * cost / readings) + 1.0)
    correction = 2.0 * unknowns * (unknowns + 1.0) / (readings - unknowns - 1.0)
    return empty | {
        "log_likelihood": float(log_likelihood),
        "aicc": float(-2.0 * log_likelihood + 2.0 * unknowns + correction),
        "bic": float(-2.0 * log_likelihood + unknowns * np.log(readings)),
    }


def independent(problem: Problem) -> bool:
    """Whether residuals are: zeroed readings are not, unless alone in a cycle or allowed for."""
    if problem.correlated:
        return True
    read = [np.isfinite(c.measured[:, :, problem.weights > 0.0]) for c in problem.cases if c.zeroed]
    return all(bool((one.sum(axis=0) <= 1).all()) for one in read)


def no_fit(status: str, message: str) -> dict[str, Any]:
    """The row of the table ``fits`` where there is none."""
    counts = ("readings", "unknowns", "iterations", "evaluations", "n_optima")
    empty = dict.fromkeys(("effective_unknowns", "cost", "degrees_of_freedom"))
    ended = {"status": status, "message": message}
    return {**dict.fromkeys(counts, 0), **empty, **criteria(None, 0, None), **ended}
