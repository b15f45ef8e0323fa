"""Joints whose readings scatter far more than the others': markers that hang loose, or a bad view.

With repeats the scatter is that between cycles of a test. Without, it is what a base fit leaves and
no smooth curve over the load holds, one for each way the load goes. Corners of a joint's own law (a
neutral zone, a stop) leave some too, where it is loaded: so only rotations that a test hardly loads
count then (translations where no rotation was read), and all that were read must scatter.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import f as f_distribution

from spinepipe.cohort.load_response import (
    joint_loads,
    of_specimens,
)
from spinepipe.decomposition import lstsq
from spinepipe.effects.contract import Array
from spinepipe.studies.discrepancy.search.noise import MAD_PER_SD
from spinepipe.studies.discrepancy.search.readings import Repeats, SpecimenReadings
from spinepipe.studies.discrepancy.verdict import SuspectedError

MANY_TIMES = 3.0
"""Ratio of SDs from which scatter counts as a mistake; less may be a joint that is hard to see."""

CHANCE = 1e-3
"""Of one false alarm in any place, were scatter the same everywhere."""

USUAL_QUANTILE = 0.4
"""Of the places' scatter: the usual one, even where half of the places are bad."""

HARDLY = 0.1
"""Share of a joint's squared load of a kind up to which a coordinate counts as hardly loaded."""


_SHIFTS, _TURNS = slice(0, 3), slice(3, 6)


@dataclass(frozen=True)
class MarkerScatter:
    """SD (S, J, 6) of specimens and joints, NaN where unknown, and the numbers behind (S, J, 6)."""

    sd: Array
    freedom: Array


def bad_markers(
    scatter: MarkerScatter, specimens: Sequence[str], joints: Sequence[str], *, in_every: bool
) -> list[SuspectedError]:
    """Joints of large scatter; ``in_every`` coordinate that was read, or in all together."""
    if not np.isfinite(scatter.sd).any():
        return []
    ratios = scatter.sd / _usual(scatter.sd)
    told = np.isfinite(ratios)
    freedom = np.where(told, scatter.freedom, 0.0).sum(axis=-1)
    count = np.maximum(told.sum(axis=-1), 1)
    together = np.sqrt(np.where(told, ratios, 0.0) ** 2 @ np.ones(6) / count)
    if in_every:
        least = np.where(told, ratios, np.inf).min(axis=-1)
        together = np.where(told.sum(axis=-1) >= 2, np.minimum(together, least), 0.0)
    places = int((freedom > 0.0).sum())
    bad = np.zeros(together.shape, dtype=bool)
    for place in np.argwhere(freedom > 0.0):
        # an F test of each place against all others, Bonferroni over the places
        at = tuple(place)
        limit = f_distribution.isf(CHANCE / places, freedom[at], freedom.sum() - freedom[at])
        bad[at] = together[at] > max(MANY_TIMES, float(np.sqrt(limit)))
    if bad.mean() > 0.5:
        return []
    errors = []
    for joint, joint_name in enumerate(joints):
        if not bad[:, joint].any():
            continue
        names = [name for name, is_bad in zip(specimens, bad[:, joint], strict=True) if is_bad]
        ratio = float(np.median(together[bad[:, joint], joint]))
        where = f"{of_specimens(names, specimens)}, {joint_name}"
        evidence = f"scatters {ratio:.1f} times as much as is usual in the other joints"
        errors.append(SuspectedError(where, "markers of the joint", evidence))
    return errors


def _usual(sd: Array) -> Array:
    """(6,) usual SD of a coordinate; NaN where none was read."""
    flat = sd.reshape(-1, 6)
    found = np.full(6, np.nan)
    for coordinate in range(6):
        values = flat[np.isfinite(flat[:, coordinate]), coordinate]
        if len(values) >= 3:
            usual = np.quantile(values, USUAL_QUANTILE, method="lower")
            found[coordinate] = usual if usual > 0.0 else np.nan
    return found


def between_cycles(readings: Sequence[SpecimenReadings]) -> MarkerScatter:
    """Robust SDs of cycles around their mean; all readings, outliers too.

    Readings of one cycle are not independent: a cycle counts once for each test and coordinate.
    """
    shape = (len(readings), readings[0].tests[0].cycles.shape[2], 6)
    sd, freedom = np.full(shape, np.nan), np.zeros(shape)
    for number, one in enumerate(readings):
        deviations = [_deviations(test) for test in one.tests]
        for joint, coordinate in np.ndindex(shape[1:]):
            values = [d[:, :, joint, coordinate] for d in deviations]
            there = np.concatenate([v[np.isfinite(v)] for v in values])
            if len(there):
                sd[number, joint, coordinate] = np.median(np.abs(there)) / MAD_PER_SD
                cycles = [int(np.isfinite(v).any(axis=1).sum()) - 1 for v in values]
                freedom[number, joint, coordinate] = sum(max(0, n) for n in cycles)
    return MarkerScatter(sd, freedom)


def _deviations(test: Repeats) -> Array:
    """(C, T, J, 6) from the mean of the cycles, with the SD of one reading; NaN for one alone."""
    enough = test.count >= 2
    # of n readings one is sqrt((n - 1) / n) SDs from their mean
    scale = np.sqrt(test.count / np.maximum(test.count - 1, 1))
    return np.where(enough, (test.cycles - test.mean) * scale, np.nan)


def beside_the_curve(
    readings: Sequence[SpecimenReadings], predicted: Mapping[str, Sequence[Array]]
) -> MarkerScatter:
    """SDs of what a fit leaves beside smooth curves over the load of each joint."""
    found = []
    for one in readings:
        total = np.zeros((2, one.tests[0].cycles.shape[2], 6))
        for test, seen in zip(one.tests, predicted[one.specimen], strict=True):
            total += _rough(test.mean - seen, joint_loads(one.frames, test.case))
        found.append(total)
    squares, freedom = np.stack(found, axis=1)
    sd = np.where(freedom > 0.0, np.sqrt(squares / np.maximum(freedom, 1.0)), np.nan)
    return MarkerScatter(sd, freedom)


def _rough(residual: Array, loads: Array) -> Array:
    """(2, J, 6) squares of a test's residual (T, J, 6) beside the curves, and their freedom."""
    found = np.zeros((2, *residual.shape[1:]))
    turns = bool(np.isfinite(residual[..., _TURNS]).any())
    kind = _TURNS if turns else _SHIFTS
    for joint in range(residual.shape[1]):
        own = loads[:, joint, kind]
        curves = _curves(loads[:, joint, _TURNS] if turns or not own.any() else own)
        power = np.sum((own - own.mean(axis=0)) ** 2, axis=0)
        for number in np.flatnonzero(power <= HARDLY * power.sum()):
            coordinate = kind.start + number
            there = np.isfinite(residual[:, joint, coordinate])
            values, basis = residual[there, joint, coordinate], curves[there]
            solution, rank = lstsq(basis, values)
            left = values - basis @ solution
            found[:, joint, coordinate] = left @ left, len(values) - rank
    return found


def _curves(loads: Array) -> Array:
    """(T, 6) cubic over the largest of loads (T, 3), with a line of its own where it goes back."""
    largest = int(np.argmax(np.ptp(loads, axis=0)))
    size = max(float(np.abs(loads[:, largest]).max()), np.finfo(float).tiny)
    u = loads[:, largest] / size
    back = (np.diff(u, prepend=0.0) < 0.0).astype(float)
    return np.stack([np.ones_like(u), u, u**2, u**3, back, back * u], axis=1)
