"""Readings zeroed at step 0 share its error: the fit that allows for it is generalised.

Catches readings that share an error taken for independent, and errors told too small.
"""

from dataclasses import replace

import numpy as np
import pytest
import statsmodels.api as sm
from example_effects import loaded, solved_poses, spine

from spinepipe.calibration import Evaluator, MeasuredCase, Problem, fit
from spinepipe.calibration.problem import whitened
from spinepipe.effects.contract import Array
from spinepipe.statics import free_parameters

ROTATIONS = ("extension_nm_per_rad", "right_bending_nm_per_rad", "left_rotation_nm_per_rad")
READING_SD = np.array([2e-5] * 3 + [1e-3] * 3)
"""(6,) m and rad."""

WEIGHTS = np.array([2.0, 0.0, 1.0, 0.3, 0.4, 0.0])
ANGLES = np.array([0.0, 0.0, 0.0, 1.0, 1.0, 1.0])
BORDER = np.array([1e3] * 3 + [180.0 / np.pi] * 3)
"""mm per m, degrees per radian."""


def zeroed_problem(
    rng: np.random.Generator, n_joints: int = 2, steps: int = 4, weights: Array = WEIGHTS
) -> Problem:
    """Two tests of exact stiffness, every reading in error before it was zeroed at step 0."""
    model = spine(n_joints)
    free = free_parameters(model, 0, ROTATIONS, "per_specimen")
    cases = []
    for case in (loaded(model, steps), replace(loaded(model, steps - 1), test="shorter")):
        poses = solved_poses(model, case)
        read = poses + READING_SD * rng.normal(size=poses.shape)
        cases.append(MeasuredCase(case, read - read[0], zeroed=True))
    bounds = np.full(len(free), 2.0)
    return Problem(model, tuple(cases), free, weights, -bounds, bounds, correlated=True)


def with_gaps(problem: Problem) -> Problem:
    """One step of one joint unread, and one coordinate of the shorter test altogether."""
    first, second = (case.measured.copy() for case in problem.cases)
    first[2, 0] = np.nan
    second[:, 1, 4] = np.nan
    cases = zip(problem.cases, (first, second), strict=True)
    return replace(problem, cases=tuple(replace(c, measured=m) for c, m in cases))


def covariance_of_readings(problem: Problem) -> Array:
    """Of the weighted readings that enter the cost, in its order: by case, step, joint, coordinate.

    Written down reading by reading: own variance, and the one of step 0 that a cycle shares.
    """
    labels = [
        (number, step, joint, c)
        for number, case in enumerate(problem.cases)
        for step in range(1, len(case.measured))
        for joint in range(case.measured.shape[1])
        for c in range(6)
        if WEIGHTS[c] > 0.0 and np.isfinite(case.measured[step, joint, c])
    ]
    covariance = np.zeros((len(labels), len(labels)))
    for i, (case, step, joint, c) in enumerate(labels):
        for k, (case_, step_, joint_, c_) in enumerate(labels):
            if (case, joint, c) == (case_, joint_, c_):
                variance = WEIGHTS[c] * (BORDER[c] * READING_SD[c]) ** 2
                covariance[i, k] = variance * (2.0 if step == step_ else 1.0)
    return covariance


def test_whitening_by_hand() -> None:
    """Three readings: c = (1 - 1/2) / 3 = 1/6. An unused fourth and a whole unread joint stay 0."""
    errors = np.zeros((5, 2, 6))
    errors[:, 0, 4] = [0.0, 6.0, np.nan, 12.0, -6.0]
    errors[:, 1] = np.nan
    used = np.zeros(errors.shape, dtype=bool)
    used[[1, 3, 4], 0, 4] = True
    found = whitened(errors, used)[used]
    np.testing.assert_allclose(found, [4.0, 10.0, -8.0], rtol=1e-15)


def test_whitened_errors_are_independent() -> None:
    """W (I + 1 1') W' = I, with the matrix W read off from unit errors."""
    used = np.zeros((6, 1, 6), dtype=bool)
    used[1:, 0, 2] = True
    units = np.zeros((6, 1, 6, 5))
    units[1:, 0, 2] = np.eye(5)
    matrix = whitened(units, used)[used]
    np.testing.assert_allclose(matrix @ (np.eye(5) + 1.0) @ matrix.T, np.eye(5), atol=1e-15)


@pytest.fixture(scope="module")
def gappy() -> Problem:
    return with_gaps(zeroed_problem(np.random.default_rng(3)))


def test_readings_weighed_by_their_noise_give_the_generalised_least_squares_of_statsmodels(
    gappy: Problem,
) -> None:
    """SDs are equal after weighting. At the fit its correction vanishes; its errors are ours."""
    even = np.where(WEIGHTS > 0.0, WEIGHTS, 1.0) ** -0.5 / BORDER * 0.05
    found = fit(gappy, noise=even)
    plain = Evaluator(replace(gappy, correlated=False)).at(found.x)
    assert plain.residual is not None
    covariance = covariance_of_readings(gappy)
    share = 0.05**2 * covariance / (np.diagonal(covariance) / 2.0)  # every SD is 0.05
    generalised = sm.GLS(-plain.residual, plain.jacobian, sigma=share).fit(
        cov_type="fixed scale", cov_kwds={"scale": 1.0}
    )
    np.testing.assert_allclose(generalised.params, 0.0, atol=1e-4 * generalised.bse.min())
    np.testing.assert_allclose(found.uncertainty.standard_error, generalised.bse, rtol=1e-6)
    np.testing.assert_allclose(
        found.cost, plain.residual @ np.linalg.solve(share / 0.05**2, plain.residual), rtol=1e-9
    )


def test_unequal_noise_goes_through_the_estimate(gappy: Problem) -> None:
    """Weights are not by noise: covariance of the linear estimate from explicit matrices."""
    found = fit(gappy, noise=READING_SD)
    jacobian = Evaluator(replace(gappy, correlated=False)).at(found.x).jacobian
    covariance = covariance_of_readings(gappy)
    shape = 2.0 * covariance / np.diagonal(covariance)  # as the cost takes it, whatever the SD
    by_reading = np.linalg.solve(shape, jacobian)
    gain = np.linalg.solve(jacobian.T @ by_reading, by_reading.T)
    np.testing.assert_allclose(
        found.uncertainty.covariance, gain @ covariance @ gain.T, rtol=1e-5, atol=1e-12
    )


@pytest.mark.full
def test_many_experiments_scatter_as_said() -> None:
    rng = np.random.default_rng(8)
    problems = [zeroed_problem(rng, 1, 4, ANGLES) for _ in range(120)]
    fits = [fit(problem, noise=READING_SD) for problem in problems]
    x = np.array([found.x for found in fits])
    expected = np.mean([found.uncertainty.standard_error for found in fits], axis=0)
    # an SD from 120 draws is known to 6.5 %: three of these
    np.testing.assert_allclose(x.std(axis=0), expected, rtol=0.2)
    inside = [np.abs(f.x) < 1.96 * f.uncertainty.standard_error for f in fits]
    assert 0.91 < np.mean(inside) < 0.985  # 360 of which 95 %, three SDs


def test_scatter_of_whitened_residuals_is_that_of_one_reading_before_zeroing() -> None:
    problem = zeroed_problem(np.random.default_rng(5), 3, 12, ANGLES)
    found = fit(problem)
    scatter = np.sqrt(found.cost / found.uncertainty.degrees_of_freedom)
    # 3 x 3 x (11 + 10) readings: known to 5 %; three of these
    assert scatter == pytest.approx(np.rad2deg(READING_SD[3]), rel=0.155)


def test_noise_is_refused_where_correlation_is_not_allowed_for(gappy: Problem) -> None:
    with pytest.raises(ValueError, match="zeroed readings have correlated errors"):
        fit(replace(gappy, correlated=False), noise=READING_SD)


def test_correlated_changes_nothing_where_nothing_is_zeroed(gappy: Problem) -> None:
    cases = tuple(replace(case, zeroed=False) for case in gappy.cases)
    both = [Evaluator(replace(gappy, cases=cases, correlated=c)).at(np.zeros(3)) for c in (0, 1)]
    np.testing.assert_array_equal(both[0].residual, both[1].residual)
    np.testing.assert_array_equal(both[0].jacobian, both[1].jacobian)


def test_the_whitened_jacobian_is_the_slope_of_the_whitened_residuals(gappy: Problem) -> None:
    evaluator = Evaluator(gappy)
    along = np.array([0.3, -0.5, 0.2])
    ends = [evaluator.at(step * along).residual for step in (-1e-3, 1e-3)]
    expected = (ends[1] - ends[0]) / 2e-3
    found = evaluator.at(np.zeros(3)).jacobian @ along
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-5 * np.abs(expected).max())


@pytest.mark.full
def test_plain_least_squares_says_how_sure_it_is_of_zeroed_readings() -> None:
    """Errors of the estimates spread as told, though the cost takes readings for independent."""
    errors, told = [], []
    for seed in range(150):
        rng = np.random.default_rng(seed)
        problem = replace(zeroed_problem(rng, steps=8, weights=ANGLES), correlated=False)
        found = fit(problem)
        errors.append(found.x)
        told.append(found.uncertainty.standard_error)
    spread = np.std(errors, axis=0)
    np.testing.assert_allclose(np.mean(told, axis=0), spread, rtol=0.2)


def test_scatter_and_errors_of_zeroed_readings_by_explicit_matrices() -> None:
    problem = zeroed_problem(np.random.default_rng(3), weights=ANGLES)
    problem = replace(with_gaps(problem), correlated=False)
    found = fit(problem)
    at = Evaluator(problem).at(found.x)
    shared = at.sharing[:, None] == at.sharing
    omega = np.eye(len(at.residual)) + shared
    inverse = np.linalg.inv(at.jacobian.T @ at.jacobian)
    left_over = np.eye(len(omega)) - at.jacobian @ inverse @ at.jacobian.T
    variance = at.residual @ at.residual / np.trace(left_over @ omega)
    expected = variance * inverse @ at.jacobian.T @ omega @ at.jacobian @ inverse
    np.testing.assert_allclose(found.uncertainty.covariance, expected, rtol=1e-6)
    assert shared.sum(axis=1).max() == 3
