"""Indices from a Latin hypercube, or what is left of it: RBD-FAST, PAWN, delta, regional.

RBD-FAST gives first-order indices from any sample. PAWN tells how far the output's distribution
moves when a factor is held in a slice of its range, delta how much of its density; regional
sensitivity asks whether runs with extreme outputs have other factor values than the rest. Delta's
estimator is SALib's.

Kolmogorov-Smirnov distances are those of weighted samples, all resamples at once: scipy's
`ks_2samp` gives the same statistic (tests), one resample at a time in 0.6 ms or more; PAWN of 24
factors and 50 outputs with 1,000 resamples asks for 12 million of them.
"""

import warnings
from collections.abc import Callable
from functools import partial
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from SALib.analyze import delta, rbd_fast
from scipy.fft import rfft

from spinepipe.effects.contract import Array
from spinepipe.sensitivity_analysis.global_indices.design import Design
from spinepipe.sensitivity_analysis.global_indices.estimates import (
    INDICES,
    IndexEstimates,
    Settings,
    normal_interval,
    resample_weights,
)


class WeightedSample:
    """Values with the weights of resamples, sorted once and then compared with parts.

    Parameters
    ----------
    values : (N,). weights : (R, N) how often each value is in each resample.
    """

    def __init__(self, values: Array, weights: Array) -> None:
        self.order = np.argsort(values, kind="stable")
        self._values = values[self.order]
        self._weights = weights[:, self.order]
        self._sums = _sums(self._weights)

    def distance(self, part: NDArray[np.bool_]) -> Array:
        """(R,) distance between a part of the values and all of them; 0 for an empty part.

        Parameters
        ----------
        part : (N,) bool.
        """
        # distributions of part and whole differ most at, or just before, a value of the part
        members = np.flatnonzero(part[self.order])
        values = self._values[members]
        sums = _sums(self._weights[:, members])
        sizes = np.maximum(sums[:, -1:], 1.0)
        farthest = np.zeros(len(sums))
        for side in ("left", "right"):  # just before and at each value of the part
            everyone = self._sums[:, np.searchsorted(self._values, values, side)]
            own = sums[:, np.searchsorted(values, values, side)]
            off = np.abs(own / sizes - everyone / self._sums[:, -1:])
            farthest = np.maximum(farthest, off.max(axis=1, initial=0.0))
        return np.where(sums[:, -1] > 0.0, farthest, 0.0)

    def share(self, part: NDArray[np.bool_]) -> Array:
        """(R,) share of the part in each resample."""
        return self._weights[:, part[self.order]].sum(axis=1) / self._sums[:, -1]


def _sums(weights: Array) -> Array:
    """(R, N + 1) running sums that start at 0."""
    return np.pad(np.cumsum(weights, axis=1), ((0, 0), (1, 0)))


HARMONICS = 10
"""SALib's default. More than 2 HARMONICS points are needed."""

LOWEST = {"S1_RBD": -np.inf}
"""Lowest value of an index where it is not 0: corrected for bias, a small S1_RBD may be below."""


def given_data_indices(design: Design, outputs: Array, settings: Settings) -> IndexEstimates:
    """Indices of each factor on its own.

    Parameters
    ----------
    design : as many points as there are outputs. outputs : (N, K), none constant.

    Intervals are the estimate -+ z bootstrap SDs: resamples hold points twice, which makes their
    distances and spectra larger than the sample's, and percentiles would follow. Distances (PAWN,
    KS) are too large in small samples anyway: their intervals speak of the scatter of estimates
    from as many points, not of endlessly many; compare with a dummy.
    """
    wanted = [name for name in INDICES[design.method] if settings.asks(name)]
    parts = [_one(name, design.unit, outputs, settings) for name in wanted]
    names = tuple((name, factor, "") for name in wanted for factor in design.factors)
    empty = np.empty((3, 0, outputs.shape[1]))
    estimate, low, high = np.concatenate([empty, *parts], axis=1)
    return IndexEstimates(names, estimate, np.stack([low, high]))


def _one(index: str, unit: Array, outputs: Array, settings: Settings) -> Array:
    """(3, D, K) estimates and ends of one index."""
    if index == "delta":
        drawings = resample_weights(len(outputs), settings.delta_bootstraps, settings.seed)
        weights = np.concatenate(list(drawings))
        found = [delta_indices(unit, output, weights) for output in outputs.T]
        estimate, drawn = (np.stack(each, axis=-1) for each in zip(*found, strict=True))
    elif index == "S1_RBD":
        estimates = partial(rbd_fast_resampled, unit, outputs)
        estimate, drawn = rbd_fast_s1(unit, outputs), _resampled(estimates, len(unit), settings)[1]
    elif index == "PAWN":
        estimate, drawn = _resampled(
            lambda weights: np.stack(
                [pawn(unit, output, weights, settings.slices) for output in outputs.T], axis=-1
            ),
            len(unit),
            settings,
        )
    else:
        region = tail_of(outputs, settings.tail, highest=index == "KS_high")
        estimate, drawn = _resampled(partial(regional, unit, region), len(unit), settings)
    ends = normal_interval(estimate, drawn, settings.confidence, LOWEST.get(index, 0.0))
    return np.concatenate([estimate[None], ends])


def _resampled(
    estimates: Callable[[Array], Array], n: int, settings: Settings
) -> tuple[Array, Array]:
    """Estimates of the sample (...) and of its resamples (R, ...), from estimates of weights."""
    blocks = resample_weights(n, settings.bootstraps, settings.seed)
    drawn = np.concatenate([estimates(weights) for weights in blocks])
    return estimates(np.ones((1, n)))[0], drawn


def rbd_fast_s1(unit: Array, outputs: Array) -> Array:
    """(D, K) first-order indices of outputs (N, K) by SALib, its correction of the bias included.

    Parameters
    ----------
    unit : (N, D) factors.
    """
    found = np.empty((unit.shape[1], outputs.shape[1]))
    for column, k in np.ndindex(found.shape):
        permuted = rbd_fast.permute_outputs(unit[:, column], outputs[:, k])
        raw = rbd_fast.compute_first_order(permuted, HARMONICS)
        found[column, k] = rbd_fast.unskew_S1(raw, HARMONICS, len(outputs))
    return found


def rbd_fast_resampled(unit: Array, outputs: Array, weights: Array) -> Array:
    """(R, D, K) the same of resamples with whole weights (R, N) that sum to N.

    SALib takes 0.4 ms for each resample of 1,024 points, one transform for all 0.012 ms.
    """
    r, n = weights.shape
    found = np.empty((r, unit.shape[1], outputs.shape[1]))
    for column, values in enumerate(unit.T):
        # rows (R, N) of each resample, up through every other one by value and down the rest: along
        # them the factor goes up and down once, as on a curve of FAST of frequency 1
        order = np.argsort(values, kind="stable")
        counts = weights[:, order].astype(int).ravel()
        rows = np.repeat(np.tile(order, r), counts).reshape(r, n)
        rows = np.hstack([rows[:, ::2], rows[:, 1::2][:, ::-1]])
        for k in range(outputs.shape[1]):
            # share of the first harmonics in the variance of each row; 0 without any variance
            curve = outputs[rows, k]
            power = np.abs(rfft(curve - curve.mean(axis=1, keepdims=True), axis=1)) ** 2
            # both sides of the spectrum, but for the middle line of an even number of points
            power[:, 1 : (n + 1) // 2] *= 2.0
            whole = power[:, 1:].sum(axis=1)
            first = power[:, 1 : HARMONICS + 1].sum(axis=1)
            raw = np.divide(first, whole, out=np.zeros_like(whole), where=whole > 0.0)
            found[:, column, k] = rbd_fast.unskew_S1(raw, HARMONICS, len(outputs))
    return found


def pawn(unit: Array, output: Array, weights: Array, slices: int) -> Array:
    """(R, D) median over slices of the distance between the slice's outputs and all outputs.

    Parameters
    ----------
    unit : (N, D) factors. output : (N,). weights : (R, N) of resamples.
    slices : number of slices of equal counts; slices stay the same in all resamples.

    Pianosi & Wagener 2018, doi:10.1016/j.envsoft.2018.07.019, slices as in SALib. It is never 0:
    a factor that does nothing has the distance of a small sample (compare with a dummy).
    """
    outputs = WeightedSample(output, weights)
    found = np.empty((len(weights), unit.shape[1]))
    for column, values in enumerate(unit.T):
        # slices are closed below and open above; the largest value is in none
        edges = np.quantile(values, np.linspace(0.0, 1.0, slices + 1))
        parts = [(values >= low) & (values < high) for low, high in pairwise(edges)]
        found[:, column] = np.median([outputs.distance(part) for part in parts], axis=0)
    return found


def delta_indices(unit: Array, output: Array, weights: Array) -> tuple[Array, Array]:
    """(D,) delta with its bias taken out, and (R, D) the same of resamples.

    Parameters
    ----------
    unit : (N, D) factors. output : (N,). weights : (R, N) whole, sum N.

    Plischke et al. 2013, doi:10.1016/j.ejor.2012.11.047, equations 26 and 30: twice the estimate
    less the resamples' mean. SALib's `analyze` is not called: it starts from a resample instead of
    the sample, which leaves the bias in, and changes the process's filters of warnings. 1.6 ms for
    256 points, 3.6 ms for 1,024, per factor and resample. Smoothing leaves large deltas low (0.26
    for 0.31 at 1,024 points).
    """
    n = len(output)
    resamples = np.array([np.repeat(np.arange(n), row.astype(int)) for row in weights])
    # delta is of ranks: repeated rows of a resample are equal, and come in an order of chance
    mixed = np.random.default_rng(n).permuted(resamples, axis=1)
    rows = [np.arange(n), *mixed]
    found = np.array([[_delta_of(output[at], values[at]) for values in unit.T] for at in rows])
    reduced = 2.0 * found[0] - found[1:]  # bootstrap correction of the bias
    return reduced.mean(axis=0), reduced


def _delta_of(output: Array, factor: Array) -> float:
    """Delta with its bias; 0 where the output does not vary, whose density has no width."""
    if np.ptp(output) == 0.0:
        return 0.0
    grid = np.linspace(output.min(), output.max(), 100)
    # number of classes of a factor's values, as in SALib's `analyze`
    power = 2.0 / (7.0 + np.tanh((1500.0 - len(output)) / 500.0))
    classes = min(int(np.ceil(len(output) ** power)), 48)
    edges = np.linspace(0, len(output), classes + 1)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # of classes whose outputs are all the same
        return float(delta.calc_delta(output, grid, factor, edges))


def tail_of(outputs: Array, share: float, highest: bool) -> NDArray[np.bool_]:
    """(N, K) which runs are among the lowest or highest share of each output."""
    if highest:
        return outputs >= np.quantile(outputs, 1.0 - share, axis=0)
    return outputs <= np.quantile(outputs, share, axis=0)


def regional(unit: Array, region: NDArray[np.bool_], weights: Array) -> Array:
    """(R, D, K) distances between factors' values in the region and outside.

    Parameters
    ----------
    unit : (N, D) factors. region : (N, K). weights : (R, N) of resamples.

    The two-sample Kolmogorov-Smirnov distance (Hornberger & Spear 1981; Saltelli et al. 2008,
    Global Sensitivity Analysis: The Primer, doi:10.1002/9780470725184, on Monte Carlo filtering).
    """
    found = np.empty((len(weights), unit.shape[1], region.shape[1]))
    for column, values in enumerate(unit.T):
        factor = WeightedSample(values, weights)
        for k in range(region.shape[1]):
            # with the region's share p in all, F_region - F_all = (1 - p) (F_region - F_rest);
            # 0 for a resample that lies all in one of them
            outside = 1.0 - factor.share(region[:, k])
            split, apart = outside > 0.0, factor.distance(region[:, k])
            found[:, column, k] = np.where(split, apart / np.where(split, outside, 1.0), 0.0)
    return found
