"""Levels within specimens within a cohort: prior, marginal likelihood and posterior, no mechanics.

Unknown x of specimen s at level j of degree of freedom d is mean_d + level_jd + specimen_sd +
rest_sjd, all four normal and independent; the mean's prior is as good as flat. Readings tell of x
linearly, with one scatter. Given mean and levels, specimens are independent, so all is done in
matrices of one specimen's size. Lindley & Smith 1972, doi:10.1111/j.2517-6161.1972.tb00885.x;
scatter and effective parameters: MacKay 1992, doi:10.1162/neco.1992.4.3.415.

Spreads are those of the largest marginal likelihood, kept off zero by a weak prior.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from spinepipe.decomposition import svd
from spinepipe.effects.contract import Array, Indices

MEAN_SD = 10.0
"""Prior SD of a mean of logarithms: as good as flat, yet a mean of which nothing tells is 0."""


@dataclass(frozen=True)
class LinearReadings:
    """Readings of S specimens that are linear in their m unknowns: target = design x + errors.

    Attributes
    ----------
    design : (S, m, m). target : (S, m). left_over : what no x explains, a sum of squares.
    count : readings, which the rows of the design stand for.
    """

    design: Array
    target: Array
    left_over: float
    count: int


@dataclass(frozen=True)
class Spreads:
    """SDs of the parts of an unknown by degree of freedom, each (D,), and of one reading."""

    level: Array
    specimen: Array
    rest: Array
    scatter: float


@dataclass(frozen=True)
class HierarchicalPosterior:
    """What prior and readings say together.

    Attributes
    ----------
    x : (S, m). covariance : (S, m, m) of each specimen's unknowns.
    mean, mean_sd : (D,) of each degree of freedom in the cohort.
    common, common_covariance : (m,), (m, m) mean and level together.
    newcomer_covariance : (m, m) of a specimen without readings; ``common`` is what to expect of it.
    effective_parameters : (S,) how many unknowns the readings determine, the prior the others.
    """

    x: Array
    covariance: Array
    mean: Array
    mean_sd: Array
    common: Array
    common_covariance: Array
    newcomer_covariance: Array
    effective_parameters: Array


def condense_readings(designs: Sequence[Array], targets: Sequence[Array], m: int) -> LinearReadings:
    """Readings (N_s, m) and (N_s,) of each specimen, turned into m rows that say the same."""
    rows = np.zeros((len(designs), m + 1, m + 1))
    for row, design, target in zip(rows, designs, targets, strict=True):
        # R of a QR decomposition says of x what all rows say: R x = Q' target, and what is left
        triangle = np.linalg.qr(np.column_stack([design, target]), mode="r")
        row[: len(triangle)] = triangle
    left_over = float(np.sum(rows[:, m, m] ** 2))
    return LinearReadings(rows[:, :m, :m], rows[:, :m, m], left_over, sum(map(len, targets)))


class Hierarchy:
    """The linear model at given spreads, factorised once."""

    def __init__(self, readings: LinearReadings, dof: Indices, spreads: Spreads) -> None:
        """``dof`` (m,): degree of freedom of each unknown, 0 to D - 1; each has its own level."""
        self._readings, self.spreads = readings, spreads
        self._of = np.eye(dof.max() + 1)[dof]  # (m, D)
        # (m, m) prior covariance of a specimen's unknowns about mean and levels of the cohort
        same = dof[:, None] == dof
        self.own = same * spreads.specimen[dof] ** 2 + np.diag(spreads.rest[dof] ** 2)
        self._root = np.linalg.cholesky(self.own)
        self._unroot = np.linalg.inv(self._root)
        # each specimen in directions of its own in which its readings are independent; singular
        # values keep both what is known to rounding and what is not seen at all
        design, target = readings.design / spreads.scatter, readings.target / spreads.scatter
        left, size, right = svd(design @ self._root)
        self._size = size  # (S, m) of what is seen, in SDs of what to expect
        self._towards = right @ self._unroot  # (S, m, m) directions by unknowns
        self._aim = np.einsum("skm,sk->sm", left, target)
        self._unseen = 1.0 / (1.0 + size**2)  # (S, m) 1 where only the prior tells
        self._seen = size**2 * self._unseen
        self.information = self._by_direction(self._seen)
        # mean and levels, which all specimens share
        self._factor = np.hstack([MEAN_SD * self._of, np.diag(spreads.level[dof])])
        self._share(self._factor)

    def _by_direction(self, weights: Array) -> Array:
        """(S, m, m) sum over directions of a weight (S, m) times their square."""
        towards = self._towards
        result: Array = towards.transpose(0, 2, 1) @ (weights[:, :, None] * towards)
        return result

    def _share(self, factor: Array) -> None:
        """Mean and levels: the specimens' own parts count as errors of their readings."""
        # posterior precision of mean and levels, in their prior SDs, with the specimens' own parts
        # integrated out
        told = self.information.sum(axis=0)
        gain = self._size * self._unseen
        pull = np.einsum("skm,sk->m", self._towards, gain * self._aim)
        precision = np.eye(factor.shape[1]) + factor.T @ told @ factor
        self._effects_covariance = np.linalg.inv(precision)
        self._effects = self._effects_covariance @ factor.T @ pull
        self.common = factor @ self._effects
        self.common_covariance = factor @ self._effects_covariance @ factor.T
        surprise = self._aim - self._size * (self._towards @ self.common)
        self._score = np.einsum("skm,sk->sm", self._towards, gain * surprise)
        self._misfit = float(np.sum(surprise**2 * self._unseen) + self._effects @ self._effects)
        logarithms = np.log1p(self._size**2).sum()
        self._log_determinant = float(logarithms + np.linalg.slogdet(precision)[1])
        self._squares = float(np.sum((surprise * self._unseen) ** 2))

    @property
    def log_likelihood(self) -> float:
        """Of the readings at these spreads, all unknowns integrated out."""
        scatter, count = self.spreads.scatter, self._readings.count
        constant = count * np.log(2.0 * np.pi * scatter**2) + self._readings.left_over / scatter**2
        return -0.5 * float(constant + self._log_determinant + self._misfit)

    def slopes(self) -> Spreads:
        """Derivative of the log likelihood by the logarithm of each spread."""
        told, score, of = self.information, self._score, self._of
        # by a variance (score' score - trace of the information) / 2; by the logarithm of its root
        # that is the variance times the bracket
        each = told - told @ self.common_covariance @ told  # of each specimen with itself
        total = told.sum(axis=0)
        between = total - total @ self.common_covariance @ total
        by_level = (score.sum(axis=0) ** 2 - np.diagonal(between)) @ of
        by_specimen = np.sum((score @ of) ** 2, axis=0) - np.einsum(
            "ad,sab,bd->d", of, each, of, optimize=True
        )
        by_rest = (np.sum(score**2, axis=0) - np.einsum("saa->a", each)) @ of
        # by the scatter: zero where its square is the sum of squares over readings less parameters
        spreads = self.spreads
        squares = self._squares + self._readings.left_over / spreads.scatter**2
        by_scatter = float(squares + self.effective_parameters.sum() - self._readings.count)
        return Spreads(
            spreads.level**2 * by_level,
            spreads.specimen**2 * by_specimen,
            spreads.rest**2 * by_rest,
            by_scatter,
        )

    @property
    def effective_parameters(self) -> Array:
        """(S,) trace of information times posterior covariance."""
        by_mean = self._by_direction(self._seen * self._unseen)
        shared: Array = np.einsum("sab,ba->s", by_mean, self.common_covariance)
        return self._seen.sum(axis=1) + shared

    def distance(self, x: Array) -> float:
        """How far specimens (S', m) are from what the prior expects: twice its -log density."""
        away, by_mean = x @ self._unroot.T, self._unroot @ self._factor
        pull = by_mean.T @ away.sum(axis=0)
        precision = np.eye(len(pull)) + len(x) * by_mean.T @ by_mean
        return float(np.sum(away**2) - pull @ np.linalg.solve(precision, pull))

    def posterior(self) -> HierarchicalPosterior:
        """Unknowns of every specimen, of the cohort and of a newcomer."""
        d = self._of.shape[1]
        unseen = self._by_direction(self._unseen)
        kept = self.own @ unseen
        covariance = kept @ self.own + kept @ self.common_covariance @ kept.transpose(0, 2, 1)
        return HierarchicalPosterior(
            x=self.common + self._score @ self.own,
            covariance=0.5 * (covariance + covariance.transpose(0, 2, 1)),
            mean=MEAN_SD * self._effects[:d],
            mean_sd=MEAN_SD * np.sqrt(np.diagonal(self._effects_covariance)[:d]),
            common=self.common,
            common_covariance=self.common_covariance,
            newcomer_covariance=self.common_covariance + self.own,
            effective_parameters=self.effective_parameters,
        )


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
class SpreadEstimate:
    """Spreads, and why they are not the mode that was asked for; empty where they are."""

    spreads: Spreads
    trouble: str


def estimate_spreads(
    readings: LinearReadings, dof: Indices, scatter: float | None, start: Spreads | None = None
) -> SpreadEstimate:
    """Spreads at the mode of marginal likelihood and prior; what cannot be told apart is dropped.

    Levels are told from the rest by two specimens, specimens by two levels. With less than that
    their spread is zero and the rest stands for both.

    Parameters
    ----------
    scatter : SD of a reading; None estimates it along.
    """
    told = tellable_spreads(readings, dof)
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
    found = minimize(
        objective,
        at,
        jac=True,
        method="L-BFGS-B",
        bounds=bounds,
        options={"ftol": 1e-12, "gtol": 1e-5, "maxiter": 500},
    )
    uphill = np.clip(found.x - found.jac, *np.transpose(bounds)) - found.x
    # a line search that rounding ends is no trouble at the top
    lost = not found.success and bool(np.abs(uphill).max() > STEEP)
    trouble = f"the search for the most likely spreads ended early ({found.message})"
    return SpreadEstimate(_unpacked(found.x, told, scatter), trouble if lost else "")


def tellable_spreads(readings: LinearReadings, dof: Indices) -> NDArray[np.bool_]:
    """(3, D) which spreads, of level, specimen and rest, the readings can tell apart."""
    information = np.sum(readings.design**2, axis=1)
    seen = information > SEEN * information.max(initial=0.0)
    told = np.ones((3, dof.max() + 1), dtype=bool)
    for d in range(dof.max() + 1):
        grid = seen[:, dof == d]
        told[0, d] = (grid.sum(axis=0) >= 2).sum() >= 2
        told[1, d] = (grid.sum(axis=1) >= 2).sum() >= 2
    return told


def interpolate_spreads(one: Spreads, other: Spreads, share: float) -> Spreads:
    """Spreads a share of the way from one to the other, in logarithms; dropped ones stay so."""
    first, second = _stacked(one), _stacked(other)
    both = (first > 0.0) & (second > 0.0)
    moved = second.copy()
    moved[both] = first[both] ** (1.0 - share) * second[both] ** share
    level, specimen, rest, scatter = moved
    return Spreads(level, specimen, rest, float(scatter[0]))


def largest_change(one: Spreads, other: Spreads) -> float:
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
