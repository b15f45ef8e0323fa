"""Indices of structured designs: Sobol, FAST and Morris, by estimators as SALib's.

Resamples of Sobol indices are matrix products: SALib gathers every column anew for each resample
and pair; sums over a resample are a product of weights and columns, for all indices of an output at
once. With 24 factors and a dummy, 1,024 base samples, pairs and 1,000 resamples that is 0.03 s per
output instead of 10.6 s (one core).
"""

from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from SALib.analyze import fast

from spinepipe.effects.contract import Array
from spinepipe.sensitivity_analysis.global_indices.design import Design
from spinepipe.sensitivity_analysis.global_indices.estimates import (
    IndexEstimates,
    Settings,
    percentile_interval,
    resample_weights,
)

NO_INTERVAL = "FAST has no interval: its one curve per factor cannot be resampled"


def fast_indices(design: Design, outputs: Array, whole: NDArray[np.bool_]) -> IndexEstimates:
    """S1 and ST of each factor whose curve is whole.

    Parameters
    ----------
    outputs : (n, K), read only on whole curves. whole : (D,) bool.

    A curve that does not vary has indices of 0. There are no intervals: errors of FAST are
    bias (few harmonics, interference) more than scatter. SALib's own, of which it warns, held 60
    to 100 % of known indices where 95 % were asked (tests/validation/results/index_coverage.md),
    and Student's t over eight curves of other phases fewer.
    """
    curves = outputs.reshape(len(design.factors), design.samples, -1)
    kept = [at for at in range(len(design.factors)) if whole[at]]
    found = np.array(
        [[_of_curve(curve, design.harmonics) for curve in curves[at].T] for at in kept]
    )
    estimate = np.moveaxis(found.reshape(len(kept), -1, 2), 2, 0)
    names = tuple((index, design.factors[at], "") for index in ("S1", "ST") for at in kept)
    return IndexEstimates(names, estimate.reshape(len(names), -1), None, NO_INTERVAL)


def _of_curve(curve: Array, harmonics: int) -> tuple[float, float]:
    """S1 and ST of one curve.

    SALib's `analyze` is not called: it always resamples, which seeds numpy for the whole process
    and divides 0 by 0 where half a curve does not vary.
    """
    if np.ptp(curve) == 0.0:
        return 0.0, 0.0
    own = (len(curve) - 1) // (2 * harmonics)  # frequency of the curve's factor
    with np.errstate(invalid="ignore"):
        found = fast.compute_orders(curve, len(curve), harmonics, own)
    first, total = (float(value) if np.isfinite(value) else 0.0 for value in found)
    return first, total


ALONE = ("mu", "mu_star", "sigma")


def morris_indices(design: Design, outputs: Array, settings: Settings) -> IndexEstimates:
    """mu, mu_star and sigma of each factor, mu_star alone of a group of several.

    Parameters
    ----------
    design : as many trajectories as there are in the outputs.
    outputs : (n, K) of whole trajectories.

    Indices are in the output's unit per whole range of the factor (0 to 1 of its share). Factors
    of a group move together, each up or down by chance, so that their effect has a size but no
    sign (Campolongo et al. 2007, doi:10.1016/j.envsoft.2006.10.004). Intervals are percentiles
    over resampled trajectories; those of sigma are narrow below 20 trajectories (88-95 % held).
    """
    effects = elementary_effects(design, outputs)
    kinds = [
        (index, g)
        for g, name in enumerate(design.inputs)
        for index in (("mu_star",) if design.groups.count(name) > 1 else ALONE)
    ]
    pick = np.array([3 * g + ALONE.index(index) for index, g in kinds])
    r = len(effects)
    resamples = _resamples(r, settings)
    found = []
    for k in range(outputs.shape[1]):
        own = effects[:, :, k]
        whole = _indices(np.full((1, r), 1.0 / r), own)
        drawn = np.concatenate([_indices(some / r, own) for some in resamples])
        ends = percentile_interval(drawn, settings.confidence)
        found.append(np.vstack([whole, ends])[:, pick])
    estimate, low, high = np.stack(found, axis=-1)
    names = tuple((index, design.inputs[g], "") for index, g in kinds)
    return IndexEstimates(names, estimate, np.stack([low, high]))


def elementary_effects(design: Design, outputs: Array) -> Array:
    """(r, G, K) change of output per unit step; of a group of several its size."""
    inputs = design.inputs
    steps = np.diff(design.unit.reshape(-1, design.block, len(design.factors)), axis=1)
    changes = np.diff(outputs.reshape(-1, design.block, outputs.shape[1]), axis=1)
    found = np.empty((len(steps), len(inputs), outputs.shape[1]))
    for g, name in enumerate(inputs):
        columns = [at for at, group in enumerate(design.groups) if group == name]
        # each trajectory moves a group in one of its steps only
        moved = steps[:, :, columns[0]]
        when = np.abs(moved).argmax(axis=1)[:, None]
        effect = np.take_along_axis(changes, when[:, :, None], axis=1)[:, 0]
        effect = effect / np.take_along_axis(moved, when, axis=1)
        found[:, g] = effect if len(columns) == 1 else np.abs(effect)
    return found


Counts = NDArray[np.uint8]


def _resamples(n: int, settings: Settings) -> list[Counts]:
    """Blocks (r, n) of how often each row is in each resample, which all outputs share.

    A row is in one resample more than 255 times only where n is; then it is at most n times there.
    """
    drawn = resample_weights(n, settings.bootstraps, settings.seed)
    return [weights.astype(np.uint8) for weights in drawn]


def _indices(weights: Array, effects: Array) -> Array:
    """(R, 3 G) mu, mu_star, sigma of each factor, for weights (R, r) that sum to 1."""
    # weighted moments about the mean of all, for all resamples in one product
    r, centre = len(effects), effects.mean(axis=0)
    off = effects - centre  # sums of squares of small numbers
    mean, size = weights @ off, weights @ np.abs(effects)
    square = np.maximum(weights @ off**2 - mean**2, 0.0)
    sigma = np.sqrt(square * r / (r - 1))
    return np.stack([mean + centre, size, sigma], axis=-1).reshape(len(weights), -1)


def sobol_indices(design: Design, outputs: Array, settings: Settings) -> IndexEstimates:
    """First-order, total and second-order indices with percentile intervals.

    Parameters
    ----------
    outputs : (n, K) of whole base samples, none constant.

    S1 after Saltelli et al. 2010, doi:10.1016/j.cpc.2009.09.018 (table 2, b), ST after Jansen (f
    there), S2 after Saltelli 2002, doi:10.1016/S0010-4655(02)00280-1, of centred outputs, as in
    SALib. Base samples are resampled as if drawn one by one: those of a scrambled Sobol sequence
    lie better than that, so intervals are rather wide than narrow
    (tests/validation/results/index_coverage.md).
    """
    inputs = design.inputs
    paired = len(inputs) if design.second_order and settings.asks("S2") else 0
    pairs = np.array(list(combinations(range(paired), 2)), dtype=int).reshape(-1, 2)
    blocks = outputs.reshape(-1, design.block, outputs.shape[1])
    resamples = _resamples(len(blocks), settings)
    found = []
    for k in range(outputs.shape[1]):
        own = blocks[:, :, k]
        columns = _columns((own - own.mean()) / own.std(), len(inputs), pairs)
        whole = _from_means(columns.mean(axis=0)[None], len(inputs), pairs)
        means = (some.astype(float) @ columns / len(own) for some in resamples)
        drawn = np.vstack([_from_means(some, len(inputs), pairs) for some in means])
        found.append(np.vstack([whole, percentile_interval(drawn, settings.confidence)]))
    estimate, low, high = np.stack(found, axis=-1)
    names = [(index, name, "") for index in ("S1", "ST") for name in inputs]
    names += [("S2", inputs[j], inputs[k]) for j, k in pairs]
    return IndexEstimates(tuple(names), estimate, np.stack([low, high]))


def _columns(blocks: Array, inputs: int, pairs: Array) -> Array:
    """(N, C + 2) what is averaged: numerators of all indices, then A + B and A² + B²."""
    a, b = blocks[:, :1], blocks[:, -1:]
    ab = blocks[:, 1 : 1 + inputs]
    ba = blocks[:, 1 + inputs : -1]  # empty without second order, and so are then the pairs
    crossed = ba[:, pairs[:, 0]] * ab[:, pairs[:, 1]] - a * b
    # numerators of S1 (Saltelli 2010), ST (Jansen) and of closed S2 (Saltelli 2002)
    return np.hstack([b * (ab - a), 0.5 * (a - ab) ** 2, crossed, a + b, a**2 + b**2])


def _from_means(means: Array, inputs: int, pairs: Array) -> Array:
    """(R, C) indices from means (R, C + 2); 0 where A and B do not vary, as in SALib."""
    variance = means[:, -1:] / 2.0 - (means[:, -2:-1] / 2.0) ** 2
    varies = variance > np.finfo(float).eps  # outputs are scaled to an SD of 1
    found = np.zeros_like(means[:, :-2])
    np.divide(means[:, :-2], variance, out=found, where=varies)
    # a pair's closed index holds both first orders
    found[:, 2 * inputs :] -= found[:, pairs[:, 0]] + found[:, pairs[:, 1]]
    return found
