"""Noise and whitening against noise that scipy makes and against dense covariance matrices."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import block_diag
from scipy.signal import lfilter
from sweeps import sweep

from spinepipe.model import LoadCase
from spinepipe.studies.discrepancy.search.noise import Noise, estimated_noise, without_outliers
from spinepipe.studies.discrepancy.search.readings import Repeats, SpecimenReadings
from spinepipe.studies.discrepancy.search.whitening import Whitening, whitening, with_nuisances

pytestmark = pytest.mark.numeric

Array = NDArray[np.float64]

SD = np.array([1e-4, 3e-4, 2e-4, 2e-3, 1e-3, 4e-3])
CASE = LoadCase("flexion", 1, ())


def serial(rng: np.random.Generator, shape: tuple[int, ...], rho: float) -> Array:
    """Noise of SD one along axis 1, after a long run in."""
    white = rng.standard_normal((shape[0], shape[1] + 200, *shape[2:]))
    return lfilter([np.sqrt(1.0 - rho**2)], [1.0, -rho], white, axis=1)[:, 200:]


def measured(
    seed: int, rho: float, zeroed: bool, steps: int = 20, cycles: int = 3
) -> list[SpecimenReadings]:
    """Three specimens, three tests, six joints, with motion that the cycles share."""
    rng = np.random.default_rng(seed)
    found = []
    for name in "abc":
        tests = []
        for _ in range(3):
            truth = 0.2 * rng.standard_normal((steps, 6, 6))
            cycles_read = truth + SD * serial(rng, (cycles, steps, 6, 6), rho)
            if zeroed:
                cycles_read = cycles_read - cycles_read[:, :1]
                cycles_read[:, 0] = np.nan
            tests.append(Repeats(CASE, cycles_read))
        found.append(SpecimenReadings(name, (), tuple(tests)))
    return found


def changed(given: list[SpecimenReadings], change) -> list[SpecimenReadings]:  # type: ignore[no-untyped-def]
    return [
        replace(one, tests=tuple(replace(t, cycles=change(t.cycles)) for t in one.tests))
        for one in given
    ]


@sweep("zeroed", [False, True])
@sweep("rho", [0.0, 0.5, 0.8])
def test_sd_and_correlation_come_from_the_repeats(rho: float, zeroed: bool) -> None:
    """3 x 3 x 6 series of two differences each: 6480 values in three rotations and translations."""
    noise = estimated_noise(measured(1, rho, zeroed), None, zeroed, 0)
    assert noise is not None
    assert noise.source == "repeats"
    assert noise.correlation == pytest.approx(rho, abs=0.04)
    np.testing.assert_allclose(noise.sd, SD, rtol=0.1 if rho > 0.6 else 0.05)
    np.testing.assert_array_equal(noise.differences, 3 * 3 * 6 * 2 * (20 - zeroed))


def test_missing_readings_do_not_bias_the_noise() -> None:
    rng = np.random.default_rng(2)
    given = changed(
        measured(3, 0.5, False), lambda c: np.where(rng.random(c.shape) < 0.01, np.nan, c)
    )
    noise = estimated_noise(given, None, False, 0)
    assert noise is not None
    assert noise.correlation == pytest.approx(0.5, abs=0.04)
    np.testing.assert_allclose(noise.sd, SD, rtol=0.06)


@sweep("zeroed", [False, True])
def test_outliers_are_left_out_and_the_rest_is_kept(zeroed: bool) -> None:
    rng = np.random.default_rng(4)
    clean = measured(5, 0.3, zeroed)
    mask = [[rng.random(t.cycles.shape) < 0.005 for t in one.tests] for one in clean]
    spoiled = [
        replace(
            one,
            tests=tuple(
                replace(t, cycles=t.cycles + np.where(m, 20.0 * SD, 0.0))
                for t, m in zip(one.tests, masks, strict=True)
            ),
        )
        for one, masks in zip(clean, mask, strict=True)
    ]
    kept, dropped = without_outliers(spoiled)
    put, far = 0, 0
    for one, masks in zip(kept, mask, strict=True):
        for test, is_spoiled in zip(one.tests, masks, strict=True):
            gone = ~np.isfinite(test.cycles[:, zeroed:])
            put += int(is_spoiled[:, zeroed:].sum())
            far += int((gone & is_spoiled[:, zeroed:]).sum())
            beside = is_spoiled.any(axis=0)  # of three cycles one is wrong: which is a guess
            if zeroed:
                beside |= beside[0]
            assert (gone & ~beside[zeroed:]).mean() < 4e-3
    assert far > 0.97 * put  # two of three cycles spoiled at one place hide one another
    assert dropped >= far
    noise = estimated_noise(kept, None, zeroed, dropped)
    assert noise is not None
    assert noise.outliers == dropped
    np.testing.assert_allclose(noise.sd, SD, rtol=0.06)
    assert noise.correlation == pytest.approx(0.3, abs=0.05)


def test_without_repeats_the_declared_noise_is_doubted_and_what_was_not_read_has_none() -> None:
    def rotations(cycles: Array) -> Array:
        return np.where(np.arange(6) >= 3, cycles, np.nan)

    given = changed(measured(6, 0.0, False, cycles=1), rotations)
    noise = estimated_noise(given, SD, False, 0)
    assert noise is not None
    assert (noise.source, noise.correlation) == ("declared", 0.0)
    assert np.isnan(noise.sd[:3]).all()
    assert np.all(noise.sd[3:] >= SD[3:])
    assert np.all(noise.sd[3:] <= 1.5 * SD[3:])
    assert estimated_noise(given, None, False, 0) is None


# Whitening ---------------------------------------------------------------------------------


def noise_of(rho: float, zeroed: bool) -> Noise:
    return Noise(SD, rho, "repeats", np.zeros(6, dtype=np.int64), 0, zeroed)


def places() -> tuple[Repeats, Repeats]:
    """Two tests of two joints; series with one to three cycles, or none, or gaps in time."""
    cycles = np.zeros((3, 5, 2, 6))
    cycles[..., 0] = np.nan
    cycles[2, :, 0, 3] = np.nan
    cycles[1:, :, 1, 4] = np.nan
    cycles[:, 2, 1, 5] = np.nan
    other = np.zeros((2, 4, 2, 6))
    other[:, :, 0, 2] = np.nan
    return Repeats(CASE, cycles), Repeats(CASE, other)


def covariance(test: Repeats, rho: float, zeroed: bool) -> tuple[Array, Array]:
    """Of the means over cycles at all T x J x 6 places, and which of them were read."""
    steps, joints = test.cycles.shape[1:3]
    at = np.arange(steps)
    series = rho ** np.abs(at[:, None] - at)
    if zeroed:  # error less that of step 0
        series = series - rho ** at[:, None] - rho ** at[None] + 1.0
    there = np.isfinite(test.cycles)
    full = np.zeros((steps, joints, 6, steps, joints, 6))
    for joint in range(joints):
        for coordinate in range(6):
            cycles = there[:, :, joint, coordinate].any(axis=1).sum()
            if cycles:
                block = SD[coordinate] ** 2 * series / cycles
                full[:, joint, coordinate, :, joint, coordinate] = block
    size = steps * joints * 6
    return full.reshape(size, size), there.any(axis=0).ravel()


def dense(tests: tuple[Repeats, ...], rho: float, zeroed: bool) -> Array:
    """(N, N) covariance of what was read."""
    blocks = []
    for test in tests:
        full, there = covariance(test, rho, zeroed)
        blocks.append(full[np.ix_(there, there)])
    return block_diag(*blocks)


def without_step_0(test: Repeats) -> Repeats:
    cycles = test.cycles.copy()
    cycles[:, 0] = np.nan
    return replace(test, cycles=cycles)


def spread_out(test: Repeats, rows: Array) -> Array:
    """Rows (M,) of what was read in a test at their places (T, J, 6), 0 elsewhere."""
    there = np.isfinite(test.cycles).any(axis=0)
    found = np.zeros((*there.shape, *rows.shape[1:]))
    found[there] = rows
    return found


def per_test(tests: tuple[Repeats, ...], rows: Array) -> list[Array]:
    found, at = [], 0
    for test in tests:
        count = int(np.isfinite(test.cycles).any(axis=0).sum())
        found.append(spread_out(test, rows[at : at + count]))
        at += count
    assert at == len(rows)
    return found


def setup(rho: float, zeroed: bool) -> tuple[tuple[Repeats, ...], Array, Array, Whitening]:
    """Tests, noise covariance, nuisance directions (N, 3) and the whitening for both."""
    tests = tuple(without_step_0(t) if zeroed else t for t in places())
    noise = dense(tests, rho, zeroed)
    rng = np.random.default_rng(7)
    size = np.sqrt(np.diagonal(noise))[:, None]
    nuisances = size * rng.standard_normal((len(noise), 3)) * [0.3, 1.0, 5.0]
    plain = whitening(tests, noise_of(rho, zeroed))
    return tests, noise, nuisances, with_nuisances(plain, per_test(tests, nuisances))


@sweep("zeroed", [False, True])
def test_whitened_covariance_is_the_identity(zeroed: bool) -> None:
    """W C W' = I for the dense covariance of noise and nuisances: W is an inverse root of it."""
    tests, noise, nuisances, white = setup(0.4, zeroed)
    operator = white(per_test(tests, np.eye(len(noise))))
    assert white.count == len(noise)
    whole = noise + nuisances @ nuisances.T
    np.testing.assert_allclose(operator @ whole @ operator.T, np.eye(len(noise)), atol=1e-9)
    np.testing.assert_allclose(operator.T @ operator @ whole, np.eye(len(noise)), atol=1e-7)


def test_whitened_draws_are_independent_with_sd_one() -> None:
    """Noise by lfilter over the cycles, their mean, and nuisances: no covariance formula."""
    rng, draws, rho = np.random.default_rng(8), 6000, 0.4
    test = Repeats(CASE, np.zeros((2, 4, 1, 6)))
    errors = SD * serial(rng, (2 * draws, 4, 1, 6), rho).reshape(2, draws, 4, 1, 6)
    mean = errors.mean(axis=0).transpose(1, 2, 3, 0)
    moved = 2.0 * SD * np.ones((4, 1, 6))
    mean = mean + moved[..., None] * rng.standard_normal(draws)
    plain = whitening((test,), noise_of(rho, False))
    white = with_nuisances(plain, [moved[..., None]])([mean])
    found = white @ white.T / draws
    np.testing.assert_allclose(found, np.eye(24), atol=5.0 * np.sqrt(2.0 / draws))
