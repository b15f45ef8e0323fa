"""Information criteria of a least-squares fit whose scatter is estimated."""

from typing import Any

import numpy as np

from spinepipe.calibrate import Problem

SHARED_ERROR = (
    "readings zeroed at step 0 share its error, which the published cost takes no account of"
)


def criteria(
    cost: float | None,
    readings: int,
    effective_unknowns: float | None,
    freedom: float | None = None,
    independent: bool = True,
) -> dict[str, float | None]:
    """Scatter, log-likelihood, corrected Akaike and Schwarz criterion.

    The scatter counts as one more unknown. Source: Burnham and Anderson, Model selection and
    multimodel inference, 2002, sections 2.2 and 2.4.

    Parameters
    ----------
    cost : sum of squared residuals; None where there is no fit.
    freedom : degrees of freedom of the scatter; readings less effective unknowns by default.
    independent : False where residuals are correlated and ``cost`` is told nothing of it: then it
        is no likelihood.
    """
    empty: dict[str, float | None] = dict.fromkeys(("scatter", "log_likelihood", "aicc", "bic"))
    if cost is None or effective_unknowns is None:
        return empty
    freedom = readings - effective_unknowns if freedom is None else freedom
    if freedom > 0.0:
        empty["scatter"] = float(np.sqrt(cost / freedom))
    unknowns = effective_unknowns + 1.0
    if not independent or cost <= 0.0 or readings - unknowns - 1.0 <= 0.0:
        return empty
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
    empty = dict.fromkeys(("effective_unknowns", "cost"))
    ended = {"status": status, "message": message}
    return {**dict.fromkeys(counts, 0), **empty, **criteria(None, 0, None), **ended}
