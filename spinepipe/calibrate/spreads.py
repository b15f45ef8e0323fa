"""Spreads of a hierarchy by the largest marginal likelihood, kept off zero by a weak prior."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from spinepipe.calibrate.hierarchy import Hierarchy, LinearReadings, Spreads
from spinepipe.effects.contract import Array, Indices

PRIOR_RATE = 2.0
"""Of the Gamma(2, rate) prior on an SD, which keeps estimates from few groups off zero.

Chung et al. 2013, doi:10.1007/s11336-013-9328-2. Most likely is 1 / rate: logarithms of stiffness
that spread by 0.5, a factor of 1.6. The rate keeps an SD of which little tells from running away.
"""

START = 0.5
SMALLEST, LARGEST = 1e-3, 3.0
SMALLEST_SCATTER, LARGEST_SCATTER = 1e-6, 1e6

SEEN = 1e-8
"""An unknown with less of the largest information in the cohort than this counts as not read."""


STEEP = 1e-2
"""Slope of the log density, by the logarithm of a spread, that speaks against a mode."""


@dataclass(frozen=True)
class Estimate:
    """Spreads, and why they are not the mode that was asked for; empty where they are."""

    spreads: Spreads
    trouble: str


def estimated(
    readings: LinearReadings, dof: Indices, scatter: float | None, start: Spreads | None = None
) -> Estimate:
    """Spreads at the mode of marginal likelihood and prior; what cannot be told apart is dropped.

    Levels are told from the rest by two specimens, specimens by two levels. With less than that
    their spread is zero and the rest stands for both.

    Parameters
    ----------
    scatter : SD of a reading; None estimates it along.
    """
    told = tellable(readings, dof)
    size = np.full(dof.max() + 1, START)
    first = start or Spreads(size, size, size, _first_scatter(readings))

    def objective(theta: Array) -> tuple[float, Array]:
        spreads = _unpacked(theta, told, scatter)
        hierarchy = Hierarchy(readings, dof, spreads)
        slopes = _packed(hierarchy.slopes(), told, scatter)
        sizes = np.exp(theta[: told.sum()])
        prior = float(np.sum(theta[: told.sum()] - PRIOR_RATE * sizes))
        slopes[: told.sum()] += 1.0 - PRIOR_RATE * sizes
        return -(hierarchy.log_likelihood + prior), -slopes

    bounds = [(np.log(SMALLEST), np.log(LARGEST))] * int(told.sum())
    if scatter is None:
        bounds += [(np.log(SMALLEST_SCATTER), np.log(LARGEST_SCATTER))]
    sizes = _packed(first, told, scatter)  # zero for what could not be told apart before
    at = np.clip(np.log(np.where(sizes > 0.0, sizes, START)), *np.transpose(bounds))
    found = minimize(objective, at, jac=True, method="L-BFGS-B", bounds=bounds,
                     options={"ftol": 1e-12, "gtol": 1e-5, "maxiter": 500})  # fmt: skip
    uphill = np.clip(found.x - found.jac, *np.transpose(bounds)) - found.x
    # a line search that rounding ends is no trouble at the top
    lost = not found.success and bool(np.abs(uphill).max() > STEEP)
    trouble = f"the search for the most likely spreads ended early ({found.message})"
    return Estimate(_unpacked(found.x, told, scatter), trouble if lost else "")


def tellable(readings: LinearReadings, dof: Indices) -> NDArray[np.bool_]:
    """(3, D) which spreads, of level, specimen and rest, the readings can tell apart."""
    information = np.sum(readings.design**2, axis=1)
    seen = information > SEEN * information.max(initial=0.0)
    told = np.ones((3, dof.max() + 1), dtype=bool)
    for d in range(dof.max() + 1):
        grid = seen[:, dof == d]
        told[0, d] = (grid.sum(axis=0) >= 2).sum() >= 2
        told[1, d] = (grid.sum(axis=1) >= 2).sum() >= 2
    return told


def between(one: Spreads, other: Spreads, share: float) -> Spreads:
    """Spreads a share of the way from one to the other, in logarithms; dropped ones stay so."""
    first, second = _stacked(one), _stacked(other)
    both = (first > 0.0) & (second > 0.0)
    moved = second.copy()
    moved[both] = first[both] ** (1.0 - share) * second[both] ** share
    level, specimen, rest, scatter = moved
    return Spreads(level, specimen, rest, float(scatter[0]))


def change(one: Spreads, other: Spreads) -> float:
    """Largest difference of logarithms of spreads that both have."""
    first, second = _stacked(one), _stacked(other)
    both = (first > 0.0) & (second > 0.0)
    return float(np.abs(np.log(first[both] / second[both])).max())


def _stacked(spreads: Spreads) -> Array:
    """(4, D) level, specimen, rest and scatter."""
    scatter = np.full_like(spreads.rest, spreads.scatter)
    return np.stack([spreads.level, spreads.specimen, spreads.rest, scatter])


def _first_scatter(readings: LinearReadings) -> float:
    """What no unknowns explain, per reading; any size will do to start from."""
    unknowns = int(np.count_nonzero(np.any(readings.design != 0.0, axis=1)))
    guess = np.sqrt(readings.left_over / max(readings.count - unknowns, 1))
    return float(max(guess, SMALLEST_SCATTER))


def _packed(spreads: Spreads, told: NDArray[np.bool_], scatter: float | None) -> Array:
    sizes = np.stack([spreads.level, spreads.specimen, spreads.rest])[told]
    return sizes if scatter is not None else np.append(sizes, spreads.scatter)


def _unpacked(theta: Array, told: NDArray[np.bool_], scatter: float | None) -> Spreads:
    sizes = np.zeros(told.shape)
    sizes[told] = np.exp(theta[: told.sum()])
    level, specimen, rest = sizes
    found = float(np.exp(theta[-1])) if scatter is None else scatter
    return Spreads(level, specimen, rest, found)
