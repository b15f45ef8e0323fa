"""Noise of the readings, from what repeats of a test do not share: SD, correlation, outliers.

A reading's error has one SD for all readings of a coordinate and the correlation rho^|t - u|
between load steps t and u of a cycle. Zeroing subtracts the error of step 0 from the whole cycle.
Repeats do not tell what all cycles of a test share: the instrument's accuracy is an error of its
own, which drifts smoothly over a test and is no smaller in the mean of the cycles.
Where the loads of cycles were meant to be equal and are not quite, the base's prediction takes the
difference out; what it misses is common to the cycles of a test, so that differences of their
residuals are noise.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import helmert

from spinepipe.effects.contract import Array
from spinepipe.studies.discrepancy.search.readings import Repeats, SpecimenReadings
from spinepipe.studies.discrepancy.verdict import DECLARED, REPEATS
from spinepipe.units import subtract_baseline

FAR, FAR_CYCLE = 4.0, 5.0
"""Deviations from the median of the cycles beyond this many SDs are outliers.

So are whole cycles, by their mean deviation: zeroing hands an outlier of step 0 to all the others.
"""

FEWEST_AGREEING = 3
"""Cycles that outvote an outlier; where fewer agree, two outliers may outvote the one that is not.
"""

MAD_PER_SD = 0.67449
"""Median absolute deviation of a normal distribution: its third quartile."""

CORRELATIONS = np.round(np.arange(-0.3, 0.96, 0.02), 2)
"""Among which the most likely is taken."""

FEWEST = 30
"""Independent differences between cycles from which an SD is taken for known."""

DECLARED_DOUBT = 1.2
"""Without repeats readings count as this much noisier than declared: a doubt kept on purpose."""

USUAL_ACCURACY = np.array([5e-5] * 3 + [np.deg2rad(0.1)] * 3)
"""m and rad, SD; where nothing tells the accuracy: that of usual optical tracking of a joint."""

DRIFT_LENGTH = 0.3
"""Share of a test over which the error that its cycles share changes."""

Predicted = Mapping[str, Sequence[Array]]


@dataclass(frozen=True)
class Noise:
    """Errors of single readings.

    Attributes
    ----------
    sd : (6,) m and rad, before zeroing; NaN for coordinates that were not read.
    correlation : of neighbouring steps. source : ``repeats`` or ``declared``.
    differences : independent differences between cycles behind it, per coordinate (6,).
    outliers : readings left out.
    accuracy : (6,) m and rad, SD of what all cycles of a test share. assumed : whether any of it
        is `USUAL_ACCURACY`.
    """

    sd: Array
    correlation: float
    source: str
    differences: NDArray[np.int64]
    outliers: int
    zeroed: bool
    accuracy: Array = field(default_factory=lambda: np.zeros(6))
    assumed: bool = False

    def correlations(self, steps: int) -> Array:
        """(T, T) covariance of the readings of one cycle in units of SD squared, zeroed or not."""
        lag = np.abs(np.subtract.outer(np.arange(steps), np.arange(steps)))
        serial: Array = self.correlation**lag
        return self._counted(serial)

    def drift(self, steps: int) -> Array:
        """(T, T) covariance of what the cycles of a test share, in units of accuracy squared."""
        length = DRIFT_LENGTH * max(steps - 1, 1)
        lag = np.subtract.outer(np.arange(steps), np.arange(steps)) / length
        return self._counted(np.exp(-0.5 * lag**2))

    def _counted(self, covariance: Array) -> Array:
        """Counted from step 0, where readings are."""
        left = subtract_baseline(np.eye(len(covariance)), self.zeroed)
        result: Array = left @ covariance @ left.T
        return result


def estimated_noise(
    specimens: Sequence[SpecimenReadings],
    declared: Array | None,
    zeroed: bool,
    outliers: int,
    accuracy: Array | None = None,
) -> Noise | None:
    """Noise from the repeats; where these are too few, as ``declared`` (6,) and doubted.

    None when neither is there. ``accuracy`` (6,) NaN where it is not told: then it is the usual.
    Of ``declared`` NaN where the accuracy alone is told: it then is all that a reading is off by.
    """
    told = np.full(6, np.nan) if accuracy is None else accuracy
    contrasts = _contrasts(specimens)
    counts = np.array([sum(len(c) * c.shape[1] for c in contrasts[k]) for k in range(6)])
    tests = [test for one in specimens for test in one.tests]
    read = np.array([any(test.count[..., k].any() for test in tests) for k in range(6)])
    assumed = bool(np.isnan(told[read]).any())
    shared = np.where(np.isnan(told), USUAL_ACCURACY, told)
    if np.all(counts[read] >= FEWEST):
        sd, correlation = _most_likely(contrasts, zeroed)
        sd = np.where(read, sd, np.nan)
        return Noise(sd, correlation, REPEATS, counts, outliers, zeroed, shared, assumed)
    if declared is None:
        return None
    # nobody knows how much of it a test shares: half of the variance, so that it counts once
    alone, half = np.isnan(declared), np.sqrt(0.5) * shared
    declared, shared = np.where(alone, half, declared), np.where(alone, half, shared)
    sd = np.where(read, DECLARED_DOUBT * declared, np.nan)
    return Noise(sd, 0.0, DECLARED, counts, outliers, zeroed, shared, assumed)


def _contrasts(specimens: Sequence[SpecimenReadings]) -> list[list[Array]]:
    """Per coordinate a list of (K, T) orthonormal differences between complete cycles.

    Helmert's contrasts: independent where cycles are, and free of what cycles have in common.
    """
    found: list[list[Array]] = [[] for _ in range(6)]
    for test in (test for one in specimens for test in one.tests):
        used = test.count.any(axis=(1, 2))  # steps that were read
        for joint, coordinate in np.argwhere(test.count.any(axis=0)):
            cycles = test.cycles[:, used, joint, coordinate]
            whole = cycles[np.isfinite(cycles).all(axis=1)]
            if len(whole) >= 2:
                found[coordinate].append(helmert(len(whole)) @ whole)
    return found


def _most_likely(contrasts: Sequence[Sequence[Array]], zeroed: bool) -> tuple[Array, float]:
    """SDs (6,) and the correlation of largest likelihood; SDs are fitted at each correlation."""
    by_steps: list[dict[int, Array]] = []
    for of_coordinate in contrasts:
        lengths = {rows.shape[1] for rows in of_coordinate}
        by_steps.append(
            {n: np.concatenate([r for r in of_coordinate if r.shape[1] == n]) for n in lengths}
        )
    best, sd, correlation = -np.inf, np.full(6, np.nan), 0.0
    for rho in CORRELATIONS:
        total, sizes = 0.0, np.full(6, np.nan)
        for coordinate, groups in enumerate(by_steps):
            if groups:
                likelihood, sizes[coordinate] = _profile(groups, float(rho), zeroed)
                total += likelihood
        if total > best:
            best, sd, correlation = total, sizes, float(rho)
    return sd, correlation


def _profile(groups: dict[int, Array], rho: float, zeroed: bool) -> tuple[float, float]:
    """Log likelihood and SD of one coordinate at a correlation."""
    squares, count, logdet = 0.0, 0, 0.0
    for steps, rows in groups.items():
        noise = Noise(np.ones(6), rho, "", np.zeros(6, dtype=np.int64), 0, zeroed)
        # step 0 of a zeroed cycle was not read, but its error is in all others
        full = noise.correlations(steps + 1)[1:, 1:] if zeroed else noise.correlations(steps)
        factor = np.linalg.cholesky(full)
        squares += float(np.sum(np.linalg.solve(factor, rows.T) ** 2))
        logdet += len(rows) * 2.0 * float(np.log(np.diagonal(factor)).sum())
        count += rows.size
    # the likelihood at its best variance, mean square of the whitened contrasts
    variance = max(squares / count, np.finfo(float).tiny)
    return -0.5 * (count * np.log(variance) + logdet), float(np.sqrt(variance))


def noise_of_residuals(
    readings: Mapping[str, SpecimenReadings], predicted: Predicted, noise: Noise
) -> tuple[dict[str, SpecimenReadings], Noise]:
    """Readings without outliers, and their noise; as it was where there are too few cycles.

    Parameters
    ----------
    predicted : by specimen, per load history (T, J, 6). noise : as declared.
    """
    residuals = [_residuals(one, predicted[name]) for name, one in readings.items()]
    kept, outliers = without_outliers(residuals)
    told = np.full(6, np.nan) if noise.assumed else noise.accuracy
    found = estimated_noise(kept, None, noise.zeroed, noise.outliers + outliers, told)
    if found is None or found.source != REPEATS:
        return dict(readings), noise
    names = readings.items()
    clean = {name: _without(one, left) for (name, one), left in zip(names, kept, strict=True)}
    return clean, found


def _residuals(one: SpecimenReadings, predicted: Sequence[Array]) -> SpecimenReadings:
    """Residuals in the place of readings, cycles of a test together."""
    tests = []
    for numbers in _histories(one):
        cycles = np.concatenate([one.tests[n].cycles - predicted[n] for n in numbers])
        tests.append(Repeats(one.tests[numbers[0]].case, cycles))
    return replace(one, tests=tuple(tests))


def _histories(one: SpecimenReadings) -> list[list[int]]:
    """Numbers of the load histories that are cycles of one test: same name, same steps."""
    groups: dict[tuple[object, ...], list[int]] = {}
    for number, test in enumerate(one.tests):
        steps = tuple(step.step for step in test.case.steps)
        groups.setdefault((test.case.test, steps), []).append(number)
    return list(groups.values())


def _without(one: SpecimenReadings, kept: SpecimenReadings) -> SpecimenReadings:
    """The readings less those whose residual was dropped."""
    tests = list(one.tests)
    for numbers, group in zip(_histories(one), kept.tests, strict=True):
        at = 0
        for n in numbers:
            cycles = tests[n].cycles
            there = np.isfinite(group.cycles[at : at + len(cycles)])
            at += len(cycles)
            tests[n] = replace(tests[n], cycles=np.where(there, cycles, np.nan))
    return replace(one, tests=tuple(tests))


def without_outliers(
    specimens: Sequence[SpecimenReadings],
) -> tuple[tuple[SpecimenReadings, ...], int]:
    """The readings without those far from what the other cycles say, and how many were dropped."""
    single = _typical(_deviations(test) for one in specimens for test in one.tests)
    whole = _typical(_mean_deviations(test) for one in specimens for test in one.tests)
    dropped, kept = 0, []
    for specimen in specimens:
        tests = []
        for test in specimen.tests:
            shifted = np.abs(_mean_deviations(test)) > FAR_CYCLE * whole
            far = (np.abs(_deviations(test)) > FAR * single) | shifted[:, None]
            there = np.isfinite(test.cycles)
            far &= there
            # readings of which too few cycles agree to say which one is wrong
            few = (there & ~far).sum(axis=0) < FEWEST_AGREEING
            far |= there & few & far.any(axis=0)
            dropped += int(far.sum())
            tests.append(replace(test, cycles=np.where(far, np.nan, test.cycles)))
        kept.append(replace(specimen, tests=tuple(tests)))
    return tuple(kept), dropped


def _typical(deviations: Iterable[Array]) -> Array:
    """(6,) robust SD of deviations (..., 6) from the median of the cycles."""
    stacked = np.concatenate([np.zeros((0, 6)), *(one.reshape(-1, 6) for one in deviations)])
    sizes = np.full(6, np.inf)
    for coordinate in range(6):
        values = stacked[np.isfinite(stacked[:, coordinate]), coordinate]
        values = values[values != 0.0]  # the median itself
        if len(values) >= FEWEST:
            sizes[coordinate] = np.median(np.abs(values)) / MAD_PER_SD
    return np.where(sizes > 0.0, sizes, np.inf)


def _deviations(test: Repeats) -> Array:
    """(C, T, J, 6) deviations from the median of the cycles, NaN with fewer than three."""
    enough = test.count >= 3
    cycles = np.where(enough, test.cycles, 0.0)
    return np.where(enough, cycles - np.nanmedian(cycles, axis=0), np.nan)


def _mean_deviations(test: Repeats) -> Array:
    """(C, J, 6) mean over the steps of the deviations, less the median of the cycles."""
    deviations = _deviations(test)
    count = np.isfinite(deviations).sum(axis=1)
    mean = np.nansum(deviations, axis=1) / np.maximum(count, 1)
    result: Array = np.where(count > 0, mean - np.median(mean, axis=0), np.nan)
    return result
