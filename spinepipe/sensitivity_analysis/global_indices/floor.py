"""The noise floor: what an index says of a factor that changes nothing, as an interval.

One dummy gives one number, which may be 0 or below. A factor without effect can be had many times
over without a further run, and each time its index is another one:

- Latin hypercube: new columns, drawn as those of factors are, beside the outputs that there are.
- Sobol and Morris: the runs that a dummy changes are repetitions, and equal but for what a solver
  leaves open. Repetitions are drawn anew that are off by so much. Of S2, which these designs
  estimate with more noise than that, it is the intervals of all the dummy's pairs.
- FAST: on the dummy's own curve nothing moves at the dummy's frequency, nor at those below it that
  the harmonics of the other factors do not reach; each of these is a dummy.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from SALib.analyze import fast

from spinepipe.effects.contract import Array
from spinepipe.sensitivity_analysis.global_indices.design import DUMMY, Design, Method
from spinepipe.sensitivity_analysis.global_indices.estimates import (
    INDICES,
    IndexStatus,
    Masked,
    SensitivityIndex,
    Settings,
    masked,
    normal_interval,
    percentile_interval,
)
from spinepipe.sensitivity_analysis.global_indices.given_data import (
    delta_indices,
    pawn,
    rbd_fast_resampled,
    regional,
    tail_of,
)
from spinepipe.sensitivity_analysis.global_indices.indices import (
    ROUNDING,
    complete_blocks,
    without_lost,
)

REPLICATES = 100
"""Factors without effect."""

SLOW_REPLICATES = 20
"""The same of delta, of which one takes as long as hundreds of the others: too few for percentiles,
so that the ends of their interval are those of a normal distribution."""

LOWEST_FREQUENCY = 0.75
"""Part of the dummy's frequency down to which others on its curve are taken: total indices count
what is above half of it, and below this harmonics of other factors would come in."""


NEGLIGIBLE = 0.01
"""Share of the variance below which a factor may be fixed anywhere."""


@dataclass(frozen=True, eq=False)
class Floor:
    """Interval of an index over factors that change nothing, of K outputs.

    Attributes
    ----------
    low, high : (K,) ends, masked where the output has no index.
    replicates : how many such factors there were.
    """

    low: Masked
    high: Masked
    replicates: int


def noise_floor(
    design: Design,
    outputs: ArrayLike,
    found: Sequence[SensitivityIndex],
    ok: ArrayLike | None = None,
    settings: Settings | None = None,
    resolution: float = 0.0,
) -> dict[str, Floor]:
    """Floor of each index that was found, by its name; empty without a dummy.

    Parameters
    ----------
    outputs, ok, settings, resolution : as for `indices`.
    found : what `indices` made of them.

    Of mu, which may be negative, it is the floor of its size.
    """
    settings = settings or Settings()
    names = [name for name in INDICES[design.method] if any(name == i.index for i in found)]
    if DUMMY not in design.factors or not names:
        return {}
    of_dummy = {i.index: i for i in found if DUMMY in (i.factor, i.other)}
    values: Array = np.asarray(outputs, dtype=np.float64)
    left = complete_blocks(
        design, np.ones(design.n, dtype=bool) if ok is None else np.asarray(ok, dtype=bool)
    )
    floors = {}
    for name in names:
        if name == "S2":  # from the lowest to the highest end of the dummy's pairs
            pairs = [i for i in found if i.index == "S2" and DUMMY in (i.factor, i.other)]
            low = np.ma.stack([pair.low for pair in pairs]).min(axis=0)
            high = np.ma.stack([pair.high for pair in pairs]).max(axis=0)
            floors[name] = Floor(low, high, len(pairs))
            continue
        known = np.array([status is IndexStatus.DONE for status in of_dummy[name].status])
        drawn = np.empty((0, 0))
        if known.any():
            part = design if design.method is Method.FAST else without_lost(design, left)
            rows = slice(None) if design.method is Method.FAST else left.rows
            drawn = _replicates(name, part, values[rows][:, known], settings, resolution)
        floors[name] = _floor(name, drawn, known, settings.confidence)
    return floors


def above_floor(index: SensitivityIndex, floors: dict[str, Floor]) -> tuple[bool | None, ...]:
    """(K,) whether the whole interval lies above the floor; None where one of both is missing.

    An index without an interval (FAST) is held against it itself.
    """
    if index.index not in floors:
        return (None,) * len(index.status)
    low, high = index.low, index.high
    if np.ma.getmaskarray(low).all():
        low = high = index.estimate
    nearest = np.ma.maximum(low, -high) if index.index == "mu" else low
    return tuple((nearest > floors[index.index].high).tolist())


def negligible(index: SensitivityIndex) -> tuple[bool | None, ...]:
    """(K,) whether all of the interval of a total index lies below `NEGLIGIBLE`.

    None for other indices, which do not tell what may be fixed, and without an interval: a small
    estimate alone may be chance.
    """
    if index.index != "ST":
        return (None,) * len(index.status)
    return tuple((index.high < NEGLIGIBLE).tolist())


def _floor(name: str, drawn: Array, known: NDArray[np.bool_], confidence: float) -> Floor:
    """From replicates (R, K known)."""
    ends = np.zeros((2, len(known)))
    if known.any():
        sizes = np.abs(drawn) if name == "mu" else drawn
        ends[:, known] = (
            normal_interval(sizes.mean(axis=0), sizes, confidence)
            if name == "delta"
            else percentile_interval(sizes, confidence)
        )
    return Floor(masked(ends[0], ~known), masked(ends[1], ~known), len(drawn))


def _replicates(
    name: str, design: Design, outputs: Array, settings: Settings, resolution: float
) -> Array:
    """(R, K) index of factors without effect."""
    rng = np.random.default_rng([settings.seed, len(outputs), REPLICATES])
    if design.method is Method.FAST:
        curve = outputs.reshape(len(design.factors), design.samples, -1)
        return _on_curve(name, curve[design.factors.index(DUMMY)], design.harmonics)
    if design.method is Method.LATIN_HYPERCUBE:
        return _given_data(name, outputs, settings, rng)
    open_to = np.maximum(resolution, ROUNDING * np.abs(outputs).max(axis=0))
    of_method = _of_sobol if design.method is Method.SOBOL else _of_morris
    return of_method(name, design, outputs, open_to, rng)


def _of_sobol(
    name: str, design: Design, outputs: Array, open_to: Array, rng: np.random.Generator
) -> Array:
    """(R, K) S1 or ST as `sobol_indices` has it, of runs that repeat A but for (K,) ``open_to``."""
    # a run in which the dummy alone is exchanged repeats A: it is off by no more than the solver is
    blocks = outputs.reshape(-1, design.block, outputs.shape[1])
    a, b = blocks[:, 0], blocks[:, -1]
    variance = np.concatenate([a, b]).var(axis=0)
    centred = b - outputs.mean(axis=0)
    drawn = np.empty((REPLICATES, outputs.shape[1]))
    for row in drawn:
        off = rng.uniform(-open_to, open_to, size=a.shape)
        row[:] = (centred * off).mean(axis=0) if name == "S1" else 0.5 * (off**2).mean(axis=0)
    return np.divide(drawn, variance, out=np.zeros_like(drawn), where=variance > 0.0)


def _of_morris(
    name: str, design: Design, outputs: Array, open_to: Array, rng: np.random.Generator
) -> Array:
    """(R, K) of effects that are what the solver leaves open over the step of a level."""
    # a step of Morris goes over half of the levels
    step = design.levels / (2.0 * (design.levels - 1.0))
    shape = (REPLICATES, len(outputs) // design.block, outputs.shape[1])
    effects = rng.uniform(-open_to, open_to, size=shape) / step
    if name == "sigma":
        return np.asarray(effects.std(axis=1, ddof=1))
    return np.asarray((np.abs(effects) if name == "mu_star" else effects).mean(axis=1))


def _given_data(name: str, outputs: Array, settings: Settings, rng: np.random.Generator) -> Array:
    """(R, K) of columns of a Latin hypercube, drawn anew."""
    n, count = len(outputs), SLOW_REPLICATES if name == "delta" else REPLICATES
    # columns of a Latin hypercube: a permutation of the cells, a uniform draw inside each
    cells = rng.permuted(np.tile(np.arange(n), (count, 1)), axis=1).T
    unit = (cells + rng.random(cells.shape)) / n
    once = np.ones((1, n))
    if name == "S1_RBD":
        return rbd_fast_resampled(unit, outputs, once)[0]
    if name == "PAWN":
        every = [pawn(unit, output, once, settings.slices)[0] for output in outputs.T]
        return np.stack(every, axis=-1)
    if name == "delta":
        drawn = rng.integers(n, size=(settings.delta_bootstraps, n))
        weights = np.array([np.bincount(rows, minlength=n) for rows in drawn], dtype=float)
        every = [delta_indices(unit, output, weights)[0] for output in outputs.T]
        return np.stack(every, axis=-1)
    region = tail_of(outputs, settings.tail, highest=name == "KS_high")
    return regional(unit, region, once)[0]


def _on_curve(name: str, curve: Array, harmonics: int) -> Array:
    """(R, K) S1 or ST at frequencies of the dummy's curve (N, K) at which nothing is moved."""
    # frequencies of FAST at which the dummy's curve has nothing but the solver's noise
    own = (len(curve) - 1) // (2 * harmonics)
    lowest = int(np.ceil(LOWEST_FREQUENCY * own))
    drawn = [
        [
            fast.compute_orders(output, len(output), harmonics, frequency)[name == "ST"]
            for output in curve.T
        ]
        for frequency in range(lowest, own + 1)
    ]
    return np.nan_to_num(np.array(drawn, dtype=float))
