"""All indices of a design's outputs."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spinepipe.effects.contract import Array
from spinepipe.sensitivity.global_indices.design import Design, Method
from spinepipe.sensitivity.global_indices.estimated import NOTHING, Estimated
from spinepipe.sensitivity.global_indices.fast import fast_indices
from spinepipe.sensitivity.global_indices.given_data import given_data_indices
from spinepipe.sensitivity.global_indices.index import Index, Known
from spinepipe.sensitivity.global_indices.kept import BLOCKS, Kept, kept, without_lost
from spinepipe.sensitivity.global_indices.morris import morris_indices
from spinepipe.sensitivity.global_indices.report import Report, names_of
from spinepipe.sensitivity.global_indices.settings import Settings
from spinepipe.sensitivity.global_indices.sobol import sobol_indices

FEWEST = {Method.SOBOL: 8, Method.LATIN_HYPERCUBE: 50, Method.MORRIS: 4, Method.FAST: 0}
"""Whole base samples, points or trajectories below which no index is given."""

ROUNDING = 1e-12
"""An output that varies by less than this part of its size is constant but for rounding."""


def indices(
    design: Design,
    outputs: ArrayLike,
    ok: ArrayLike | None = None,
    settings: Settings | None = None,
    resolution: ArrayLike = 0.0,
) -> tuple[Index, ...]:
    """Indices of K outputs with intervals.

    Parameters
    ----------
    outputs : (n, K), finite where a run succeeded.
    ok : (n,) bool, which runs succeeded; None for all.
    resolution : (K,) or one, in the outputs' units: an output whose values lie closer together is
        taken for constant (a solver's tolerance).

    A failed run takes out its base sample (Sobol), trajectory (Morris), point (Latin hypercube) or
    the indices of its curve's factor (FAST); with more than `Settings.most_failed` of these lost
    (of FAST: with any) the status is ``too_many_failed``. A constant output has no indices. No
    estimate is ever NaN.

    Raises
    ------
    ValueError
        For outputs of another shape than the design's, or not finite where a run succeeded.
    """
    settings = settings or Settings()
    values, good = _checked(design, outputs, ok)
    left = kept(design, good)
    status, why = _for_all(design, left, settings)
    varies = _varies(values[left.rows], resolution) & (status is Known.DONE)
    found = _found(design, values[:, varies], left, settings) if varies.any() else NOTHING
    report = Report(design, left, found, varies, status, why)
    return tuple(report.index(name) for name in names_of(design) if settings.asks(name[0]))


def _checked(
    design: Design, outputs: ArrayLike, ok: ArrayLike | None
) -> tuple[Array, NDArray[np.bool_]]:
    values: Array = np.asarray(outputs, dtype=np.float64)
    good = np.ones(design.n, dtype=bool) if ok is None else np.asarray(ok, dtype=bool)
    if values.ndim != 2 or len(values) != design.n or good.shape != (design.n,):
        raise ValueError(
            f"{design.n} runs need outputs ({design.n}, K) and ok ({design.n},), "
            f"found {values.shape} and {good.shape}"
        )
    if not np.isfinite(values[good]).all():
        raise ValueError("outputs must be finite where a run succeeded")
    return values, good


def _for_all(design: Design, left: Kept, settings: Settings) -> tuple[Known, str]:
    """Status and message for all outputs alike; ``done`` where nothing stands against indices."""
    whole = int(left.blocks.sum())
    if design.method is Method.FAST:
        return (Known.DONE, "") if whole else (Known.TOO_MANY_FAILED, left.message)
    if left.lost > settings.most_failed:
        allowed = f"; at most {settings.most_failed:.0%} may be lost"
        return Known.TOO_MANY_FAILED, left.message + allowed
    if whole < FEWEST[design.method]:
        what = f"{whole} {BLOCKS[design.method]}; at least {FEWEST[design.method]} are needed"
        return Known.TOO_FEW, what
    return Known.DONE, ""


def _varies(values: Array, resolution: ArrayLike) -> NDArray[np.bool_]:
    """(K,) whether an output varies by more than rounding and its resolution."""
    if not len(values):
        return np.zeros(values.shape[1], dtype=bool)
    size = ROUNDING * np.abs(values).max(axis=0)
    return np.ptp(values, axis=0) > np.maximum(size, resolution)


def _found(design: Design, values: Array, left: Kept, settings: Settings) -> Estimated:
    if design.method is Method.FAST:
        return fast_indices(design, values, left.blocks)
    analyse = {
        Method.SOBOL: sobol_indices,
        Method.MORRIS: morris_indices,
        Method.LATIN_HYPERCUBE: given_data_indices,
    }[design.method]
    return analyse(without_lost(design, left), values[left.rows], settings)
