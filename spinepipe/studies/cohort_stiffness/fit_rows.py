"""Rows of the tables ``stiffness`` and ``fits``, whatever the fit.

Two kinds of ends are there for a stiffness, both at 95 %: those of its interval, from the standard
error of the logarithm at the optimum, and those of its region, by profile likelihood. The latter
take the place of the former where they were looked for.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from spinepipe.calibration import Problem
from spinepipe.calibration.profile import RegionEnds
from spinepipe.effects.contract import Array
from spinepipe.status import NOT_FITTED
from spinepipe.studies.cohort_stiffness.stiffening import AT_BOUND, LINEAR, Growth
from spinepipe.units import COORDINATES, STIFFNESS_UNITS

Row = dict[str, Any]

LEVEL = 0.975
"""Probability below the upper end of an interval: 95 % lie between the ends."""

_OPEN = ("open_below", "open_above")
"""Whether the data allow the bound of the fit on that side; only a region tells."""


NO_ROW: Row = {
    **dict.fromkeys(("stiffness", "standard_error", "low", "high", *_OPEN, "identifiable")),
    **{"at_bound": AT_BOUND[0], **LINEAR, "status": NOT_FITTED},
    "message": "not fitted: no reading depends on it; predictions take the value fits start from",
}
"""Cells of a stiffness that was never fitted."""


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
    silent: NDArray[np.bool_] | None = None,
) -> list[Row]:
    """One row per joint and free coordinate.

    Parameters
    ----------
    joints : names, J. free : coordinates that the study fits.
    values : (J, 6) stiffness at rest, N/m and N m/rad; NaN where there is none.
    log_error : (J, 6) standard error of its natural logarithm, infinite where there is none.
    degrees_of_freedom : of Student's t for the intervals; infinite for the normal distribution, 0
        for no intervals.
    identifiable : (J, 6); None for stiffness that was not fitted here, as literature's.
    at_bound : (J, 6), -1 at the lower bound of the fit, 1 at the upper one, else 0.
    reaches : regions by profile likelihood, by joint's row and coordinate's column; not to be
        confused with the reach of `interval`.
    growth : of laws that stiffen; None for linear ones.
    silent : (J, 6) which no reading depends on. Those rows have no number, and a status of their
        own; callers add that of the fit to all others.
    """
    reach = float(stats.t.ppf(LEVEL, degrees_of_freedom)) if degrees_of_freedom > 0 else np.inf
    rows = []
    for row, joint in enumerate(joints):
        for name in free:
            at = row, COORDINATES.index(name)
            if silent is not None and silent[at]:
                place = {"joint": joint, "coordinate": name, "unit": STIFFNESS_UNITS[name]}
                rows.append(NO_ROW | place)
                continue
            told = (reaches or {}).get(at)
            # A region brings ends (low, high) and flags, and its ends replace those of the interval
            # below. Where no region was looked for the interval stands.
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
    """Value, standard error and ends of the interval, which is even about the logarithm.

    Parameters
    ----------
    value : stiffness. log_error : standard error of its natural logarithm; that of the value is
        value times as large, to first order.
    reach : standard errors of the logarithm from the value to an end: a quantile of t.
    """
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

    The scatter is the SD of a weighted residual, in the residuals' unit. It is not known
    beforehand, so in the criteria it counts as one more unknown. The likelihood is that of normal
    errors of one variance. Source: Burnham and Anderson, Model selection and multimodel inference,
    2002, sections 2.2 and 2.4. What cannot be told is None.

    Parameters
    ----------
    cost : sum of squared weighted residuals of readings; None where there is no fit.
    readings : how many residuals it sums. effective_unknowns : unknowns less what priors hold of
        them; no whole number.
    freedom : degrees of freedom of the scatter; readings less effective unknowns by default.
    cost_of_priors : sum of squared departures from priors, in their SDs. The scatter takes them for
        further readings; likelihood and criteria leave them out.
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
    """Whether the residuals of a problem are independent of each other.

    Readings that were zeroed share the error of the reading at step 0, which was subtracted from
    all. So they are dependent, unless each joint and coordinate has one reading in a cycle, or the
    fit allows for it (``correlated``).
    """
    if problem.correlated:
        return True
    # (T, J, weighted coordinates) which readings of each zeroed case there are
    read = [np.isfinite(c.measured[:, :, problem.weights > 0.0]) for c in problem.cases if c.zeroed]
    return all(bool((one.sum(axis=0) <= 1).all()) for one in read)


def no_fit(status: str, message: str) -> dict[str, Any]:
    """The row of the table ``fits`` where there is none."""
    counts = ("readings", "unknowns", "iterations", "evaluations", "n_optima")
    empty = dict.fromkeys(("effective_unknowns", "cost", "degrees_of_freedom"))
    ended = {"status": status, "message": message}
    return {**dict.fromkeys(counts, 0), **empty, **criteria(None, 0, None), **ended}
