"""Information criteria of a least-squares fit whose scatter is estimated."""

import numpy as np


def criteria(
    cost: float | None, readings: int, effective_unknowns: float | None
) -> dict[str, float | None]:
    """Scatter, log-likelihood, corrected Akaike and Schwarz criterion.

    The scatter counts as one more unknown. Source: Burnham and Anderson, Model selection and
    multimodel inference, 2002, sections 2.2 and 2.4.

    Parameters
    ----------
    cost : sum of squared residuals; None where there is no fit.
    """
    empty: dict[str, float | None] = dict.fromkeys(("scatter", "log_likelihood", "aicc", "bic"))
    if cost is None or effective_unknowns is None:
        return empty
    freedom = readings - effective_unknowns
    if freedom > 0.0:
        empty["scatter"] = float(np.sqrt(cost / freedom))
    unknowns = effective_unknowns + 1.0
    if cost <= 0.0 or readings - unknowns - 1.0 <= 0.0:
        return empty
    log_likelihood = -0.5 * readings * (np.log(2.0 * np.pi * cost / readings) + 1.0)
    correction = 2.0 * unknowns * (unknowns + 1.0) / (readings - unknowns - 1.0)
    return empty | {
        "log_likelihood": float(log_likelihood),
        "aicc": float(-2.0 * log_likelihood + 2.0 * unknowns + correction),
        "bic": float(-2.0 * log_likelihood + unknowns * np.log(readings)),
    }
