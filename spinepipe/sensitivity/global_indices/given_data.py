"""Indices from a Latin hypercube, or what is left of it: RBD-FAST, PAWN, delta, regional."""

from collections.abc import Callable
from functools import partial

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.sensitivity.global_indices.delta import delta_indices
from spinepipe.sensitivity.global_indices.design import Design
from spinepipe.sensitivity.global_indices.estimated import Estimated
from spinepipe.sensitivity.global_indices.intervals import normal_interval, resample_weights
from spinepipe.sensitivity.global_indices.pawn import pawn
from spinepipe.sensitivity.global_indices.rbd_fast import rbd_fast_resampled, rbd_fast_s1
from spinepipe.sensitivity.global_indices.regional import regional, tail_of
from spinepipe.sensitivity.global_indices.settings import INDICES, Settings

LOWEST = {"S1_RBD": -np.inf}
"""Lowest value of an index where it is not 0: corrected for bias, a small S1_RBD may be below."""


def given_data_indices(design: Design, outputs: Array, settings: Settings) -> Estimated:
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
    return Estimated(names, estimate, np.stack([low, high]))


def _one(index: str, unit: Array, outputs: Array, settings: Settings) -> Array:
    """(3, D, K) estimates and ends of one index."""
    find = {"delta": _delta, "S1_RBD": _first_order, "PAWN": _pawn}.get(index)
    if find is None:
        region = tail_of(outputs, settings.tail, highest=index == "KS_high")
        estimate, drawn = _resampled(partial(regional, unit, region), len(unit), settings)
    else:
        estimate, drawn = find(unit, outputs, settings)
    ends = normal_interval(estimate, drawn, settings.confidence, LOWEST.get(index, 0.0))
    return np.concatenate([estimate[None], ends])


def _resampled(
    estimates: Callable[[Array], Array], n: int, settings: Settings
) -> tuple[Array, Array]:
    """Estimates of the sample (...) and of its resamples (R, ...), from estimates of weights."""
    blocks = resample_weights(n, settings.bootstraps, settings.seed)
    drawn = np.concatenate([estimates(weights) for weights in blocks])
    return estimates(np.ones((1, n)))[0], drawn


def _pawn(unit: Array, outputs: Array, settings: Settings) -> tuple[Array, Array]:
    """(D, K) and (R, D, K)."""

    def estimates(weights: Array) -> Array:
        every = [pawn(unit, output, weights, settings.slices) for output in outputs.T]
        return np.stack(every, axis=-1)

    return _resampled(estimates, len(unit), settings)


def _first_order(unit: Array, outputs: Array, settings: Settings) -> tuple[Array, Array]:
    """(D, K) and (R, D, K)."""
    drawn = _resampled(partial(rbd_fast_resampled, unit, outputs), len(unit), settings)[1]
    return rbd_fast_s1(unit, outputs), drawn


def _delta(unit: Array, outputs: Array, settings: Settings) -> tuple[Array, Array]:
    """(D, K) and (R, D, K)."""
    drawn = resample_weights(len(outputs), settings.delta_bootstraps, settings.seed)
    weights = np.concatenate(list(drawn))
    every = [delta_indices(unit, output, weights) for output in outputs.T]
    estimates, resampled = zip(*every, strict=True)
    return np.stack(estimates, axis=-1), np.stack(resampled, axis=-1)
