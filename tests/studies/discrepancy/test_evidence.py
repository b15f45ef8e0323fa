"""Evidence of all effects of a fit, by quadrature; of what formulas are off by, by dense numpy."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any, cast

import held_out_cases as cases
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import quad, simpson
from scipy.linalg import block_diag, null_space
from scipy.optimize import lsq_linear
from scipy.special import logsumexp
from scipy.stats import multivariate_normal, norm
from sweeps import sweep

from spinepipe.model import SpineModel
from spinepipe.studies.discrepancy.search import evidence
from spinepipe.studies.discrepancy.search.baseline import BaselineFit
from spinepipe.studies.discrepancy.search.evidence import formula_error, joint_log_evidence
from spinepipe.studies.discrepancy.search.hypothesis import (
    STRENGTH_SDS,
    ActiveTerm,
    Hypothesis,
    HypothesisMember,
    Unknown,
)
from spinepipe.studies.discrepancy.search.joint_fit import JointFit
from spinepipe.studies.discrepancy.search.readings import Repeats
from spinepipe.studies.discrepancy.search.screen import SIZES

pytestmark = pytest.mark.numeric

Array = NDArray[np.float64]

# Evidence of all effects -------------------------------------------------------------------------

READINGS, WIDE = 60, 6.0
"""Number of readings, and how far from off the quadrature goes, where no bound is nearer."""


@dataclass(frozen=True)
class Own:
    """A parameter of an effect (its number): declared prior SD, and bounds as moves from off."""

    of: int = 0
    sd: float = 1.0
    low: float = -np.inf
    high: float = np.inf
    shape: bool = False

    @property
    def in_a_fit(self) -> float:
        """SD of its prior there: fits hold strengths less tightly."""
        return self.sd if self.shape else STRENGTH_SDS * self.sd


@dataclass(frozen=True)
class Linear:
    """Readings y = B b + F d + noise of SD one; d is of effects, off at 0, b is of the base."""

    base: Array
    columns: Array
    y: Array
    own: Sequence[Own]

    def fits(self, start: float = 0.3) -> tuple[JointFit, JointFit]:
        """The base alone and all, by scipy's bounded least squares; moves are from ``start``."""
        free = len(self.base.T)
        sds = np.array([3.0] * free + [one.in_a_fit for one in self.own])
        low = np.array([-np.inf] * free + [one.low for one in self.own])
        high = np.array([np.inf] * free + [one.high for one in self.own])
        whole = np.column_stack([self.base, self.columns])

        def ended(number: int) -> tuple[Array, Array]:
            rows = np.vstack([whole[:, :number], np.diag(1.0 / sds[:number])])
            target = np.concatenate([self.y, np.zeros(number)])
            bounds = low[:number], high[:number]
            found = lsq_linear(rows, target, bounds, tol=1e-14).x
            return found, whole[:, :number] @ found - self.y

        (_, off), (x, on) = ended(free), ended(len(sds))
        unknowns = [_unknown(None, -100.0, 100.0, 0.0, 3.0) for _ in range(free)]
        for one in self.own:
            strength = not one.shape
            bounds = one.low - start, one.high - start
            unknowns.append(_unknown(one.of, *bounds, -start, one.in_a_fit, strength))
        at_bound = (x - low < 1e-6) | (high - x < 1e-6)
        moves = x - np.r_[np.zeros(free), np.full(len(self.own), start)]
        numbers = tuple(range(len(sds)))
        member = HypothesisMember(cast(SpineModel, None), (), numbers)
        supposed = tuple(cast(ActiveTerm, None) for _ in {one.of for one in self.own})
        hypothesis = Hypothesis({"a": member}, tuple(unknowns), supposed)
        fit = JointFit(
            hypothesis, moves, {}, on @ on, {"a": on}, {"a": whole}, {}, {}, at_bound, ""
        )
        return cast(JointFit, SimpleNamespace(chi2=off @ off)), fit

    def log_evidence(self) -> float:
        """By Simpson's rule, sizes of strengths averaged over; the base integrated out exactly."""
        covariance = np.eye(READINGS) + 9.0 * self.base @ self.base.T
        slope = self.columns.T @ np.linalg.solve(covariance, self.y)
        bend = self.columns.T @ np.linalg.solve(covariance, self.columns)
        grids = [np.linspace(max(o.low, -WIDE), min(o.high, WIDE), 1501) for o in self.own]
        mesh = np.stack(np.meshgrid(*grids, indexing="ij"), axis=-1)
        log_ratio = mesh @ slope - 0.5 * np.einsum("...i,ij,...j", mesh, bend, mesh)
        most = float(log_ratio.max())
        ratios = np.exp(log_ratio - most)
        found = []
        effects = sorted({one.of for one in self.own})
        for sizes in np.stack(np.meshgrid(*[SIZES] * len(effects)), axis=-1).reshape(
            -1, len(effects)
        ):
            left = ratios
            for one, grid in reversed(list(zip(self.own, grids, strict=True))):
                sd = one.sd if one.shape else one.sd * sizes[effects.index(one.of)]
                prior = norm.pdf(grid, 0.0, sd)
                if not one.shape:
                    prior /= norm.cdf(one.high, 0.0, sd) - norm.cdf(one.low, 0.0, sd)
                left = simpson(left * prior, x=grid)
            found.append(np.log(left) + most)
        return float(logsumexp(found) - np.log(len(found)))


def _unknown(
    of: int | None, low: float, high: float, mean: float, sd: float, strength: bool = False
) -> Unknown:
    return Unknown("", of, 0, (), strength, low, high, mean, sd)


def linear(
    truth: Sequence[float],
    own: Sequence[Own],
    alike: float = 0.0,
    size: float = 4.0,
    seed: int = 7,
) -> Linear:
    """Columns (60, k) of length ``size`` whose cosines are ``alike``, beside two of the base."""
    rng = np.random.default_rng(seed)
    basis, _ = np.linalg.qr(rng.normal(size=(READINGS, 2 + len(own))))
    base = 100.0 * basis[:, :2]
    cosines = np.full((len(own),) * 2, alike) + (1.0 - alike) * np.eye(len(own))
    columns = size * basis[:, 2:] @ np.linalg.cholesky(cosines).T
    columns += basis[:, :2] @ rng.normal(size=(2, len(own)))  # the base explains some of it
    y = base @ [0.1, -0.2] + columns @ np.array(truth) + rng.normal(size=READINGS)
    return Linear(base, columns, y, own)


def assert_exact(problem: Linear, within: float = 2e-3) -> None:
    assert joint_log_evidence(*problem.fits()) == pytest.approx(problem.log_evidence(), abs=within)


POSITIVE = Own(low=0.0)
SHAPE = Own(sd=0.6, shape=True)


@sweep("truth", [0.0, 0.3, -2.0])
@sweep("sd", [1.0, 0.4])
def test_one_strength(truth: float, sd: float) -> None:
    assert_exact(linear([truth], [Own(sd=sd)]))


@sweep("truth", [0.0, 0.1, 0.4, 2.0, -0.3, -1.5])
def test_a_strength_of_one_side(truth: float) -> None:
    """Where it would go to the other side, the fit ends at its bound, with a slope."""
    problem = linear([truth], [POSITIVE])
    _, fit = problem.fits()
    assert fit.at_bound[-1] or truth >= 0.0
    assert_exact(problem)


@sweep("truth", [0.2, 0.9, 3.0])
def test_a_strength_between_two_bounds(truth: float) -> None:
    """A fraction that is lost, up to its bound and pushed against it."""
    assert_exact(linear([truth], [Own(low=0.0, high=0.8)]), within=0.01)


@sweep("second", [0, 1])
@sweep("alike", [0.0, 0.8])
def test_two_strengths_of_one_effect_or_of_two(second: int, alike: float) -> None:
    """Those of one effect have the same size. Of two each has its own, averaged where the other's
    is best: where columns are alike, a little is missed by that.
    """
    problem = linear([0.8, -0.4], [Own(), Own(of=second, sd=0.5)], alike)
    assert_exact(problem, within=0.1 if second and alike else 2e-3)


@sweep("truth", [(0.5, 0.7), (0.6, -0.8), (-0.5, -0.5)])
def test_two_strengths_of_one_side_each(truth: tuple[float, float]) -> None:
    """Exact where columns have nothing in common. Where they are alike, marginals say too much of
    strengths that would go to the other side, never as much as would speak for them.
    """
    own = [POSITIVE, Own(of=1, low=0.0)]
    assert_exact(linear(truth, own), within=0.01)
    alike = linear(truth, own, alike=0.5)
    found, exact = joint_log_evidence(*alike.fits()), alike.log_evidence()
    if min(truth) > 0.0:
        assert found == pytest.approx(exact, abs=0.1)
    else:
        assert exact < found < -1.0


@sweep("truth, size", [((0.7, 0.5), 6.0), ((0.7, 2.5), 2.0), ((0.7, -4.0), 1.0)])
def test_a_shape_keeps_to_its_prior(truth: tuple[float, float], size: float) -> None:
    """The fit ends where readings and prior are in balance: chi2 has a slope there."""
    assert_exact(linear(truth, [Own(), SHAPE], size=size))


@sweep("own", [[Own()], [POSITIVE], [Own(low=-0.2, high=0.3)], [Own(), SHAPE]])
def test_what_no_reading_tells_has_no_evidence(own: list[Own]) -> None:
    problem = linear([0.0] * len(own), own)
    blind = replace(problem, columns=np.zeros((READINGS, len(own))))
    assert joint_log_evidence(*blind.fits()) == pytest.approx(0.0, abs=1e-9)


def test_exactly_off_only_the_price_is_paid() -> None:
    """Readings at right angles to the column: -log(1 + t^2 l) / 2, a mean over sizes."""
    problem = linear([0.0], [Own()])
    column = (
        problem.columns[:, 0]
        - problem.base @ np.linalg.lstsq(problem.base, problem.columns[:, 0])[0]
    )
    y = problem.y - column * (column @ problem.y) / (column @ column)
    y = y - problem.base @ np.linalg.lstsq(problem.base, y)[0]
    price = np.log(np.mean(1.0 / np.sqrt(1.0 + SIZES**2 * (column @ column))))
    found = joint_log_evidence(*replace(problem, columns=column[:, None], y=y).fits(start=0.0))
    assert found == pytest.approx(price, rel=1e-6)


def test_the_base_alone_has_no_evidence_over_itself() -> None:
    fit: Any = SimpleNamespace(hypothesis=SimpleNamespace(unknowns=(_unknown(None, 0, 1, 0, 1),)))
    assert joint_log_evidence(fit, fit) == 0.0


def log_mass(a: float, b: float) -> float:
    """Of a standard normal between a and b on one side of zero, by quadrature from its top."""
    top = min(abs(a), abs(b))
    nearest, furthest = top, min(max(abs(a), abs(b)), top + 12.0)
    area, _ = quad(lambda x: np.exp(0.5 * (top**2 - x**2)), nearest, furthest, epsabs=0.0)
    return float(np.log(area) - 0.5 * top**2 - 0.5 * np.log(2.0 * np.pi))


@sweep(
    "low, high",
    [(0.0, np.inf), (0.5, 0.6), (5.0, 6.0), (38.0, np.inf), (400.0, np.inf), (40.0, 40.001)],
)
def test_mass_between_two_ends_far_out_on_both_sides(low: float, high: float) -> None:
    expected = log_mass(low, high)
    for ends in ((low, high), (-high, -low)):
        found = evidence._log_mass(3.0 + 2.0 * np.array([ends]), np.array([3.0]), np.array([2.0]))
        assert found == pytest.approx(expected, rel=1e-9)


def test_mass_between_two_ends_about_the_middle() -> None:
    ends = np.array([(-np.inf, np.inf), (-1.0, 2.0), (-300.0, 2.0), (-2.0, 300.0)])
    found = evidence._log_mass(ends, np.zeros(4), np.ones(4))
    expected = np.log(norm.cdf(ends[:, 1]) - norm.cdf(ends[:, 0]))
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-11)


# What formulas are off by ------------------------------------------------------------------------

TESTS = ("flexion", "extension", "bending")


def zone(seed: int, off_by: float, unread: str = "") -> BaselineFit:
    """A neutral zone fitted to two chains whose zone does by up to a share more or less.

    ``unread``: of this chain extension is not read.
    """
    stiffness = {"a": 50.0, "b": 65.0}
    exact, none = (cases.read(stiffness, TESTS, there, seed) for there in (True, False))
    given = []
    for one, without in zip(exact, none, strict=True):
        tests = []
        for test, plain in zip(one.tests, without.tests, strict=True):
            gone = np.linspace(0.0, 1.0, len(cases.MOMENTS_NM))[:, None, None]
            wave = off_by * np.sin(2.0 * np.pi * gone)
            # both have the same noise, so that it falls out of the difference
            cycles = test.cycles + wave * (test.cycles - plain.cycles)
            cycles[..., 3] = np.nan if one.specimen == unread else cycles[..., 3]
            tests.append(Repeats(test.case, cycles))
        given.append(replace(one, tests=tuple(tests)))
    return cases.found(cases.grounds(given), True).final


def dense(at: BaselineFit) -> float:
    """Evidence of the process over none, in readings that no unknown of the fit explains."""
    fit = at.fit
    knots = np.array([(m, t) for m in np.linspace(-1.0, 1.0, 5) for t in (0.0, 0.5, 1.0)])

    def alike(one: Array, other: Array) -> Array:
        apart = (one[:, None] - other[None]) / np.array([0.4, 0.3])
        return np.asarray(np.exp(-0.5 * (apart**2).sum(axis=-1)))

    points, sizes, apart_of, errors, there = [], [], [], [], []
    for name, one in at.readings.items():
        for number, test in enumerate(one.tests):
            predicted = fit.predicted[name][number]
            k = fit.models[name].effects[0].values[:, 3:]
            axis, sign = cases.AXES[test.case.test]
            driven = {2: 0, 0: 1}[axis]  # extension about z, bending about x
            load = np.zeros((len(predicted), cases.JOINTS, 3))
            load[..., driven] = sign * cases.MOMENTS_NM[:, None]
            done = predicted[..., 3:] - load / k
            furthest = np.abs(predicted[..., 3:]).max(axis=0)
            share = predicted[..., 3:] / np.where(furthest > 1e-9, furthest, 1.0)
            gone = np.broadcast_to(np.linspace(0, 1, len(predicted))[:, None, None], done.shape)
            points.append(np.stack([share.ravel(), gone.ravel()], axis=1))
            sizes.append(np.where(furthest > 1e-9, done, 0.0).ravel())
            of_specimen = 3 * list(at.readings).index(name)
            apart_of.append(np.broadcast_to(of_specimen + np.arange(3), done.shape).ravel())
            errors.append(np.nan_to_num(test.mean - predicted)[..., 3:].ravel())
            there.append((test.count[..., 3:] > 0).ravel())
    where, effect, own = (np.concatenate(rows) for rows in (points, sizes, apart_of))
    # the process is free at the knots; between, it is what these say of it
    cross = alike(where, knots)
    smooth = cross @ np.linalg.solve(alike(knots, knots), cross.T)
    moved = np.outer(effect, effect) * smooth * (own[:, None] == own)
    steps, apart = len(cases.MOMENTS_NM), 3 * cases.JOINTS
    root = np.linalg.cholesky(cases.serial(steps) * cases.SD**2 / cases.CYCLES)
    white = block_diag(*[np.kron(np.linalg.inv(root), np.eye(apart))] * len(errors))
    white = white[np.concatenate(there)]
    # unknowns that hardly move a reading (1e-5 of the most) explain none: their priors hold them
    left = null_space(fit.whole_jacobian().T, rcond=1e-5)
    residual = left.T @ white @ np.concatenate(errors)
    covariance = left.T @ white @ moved @ white.T @ left
    none = np.eye(len(residual))
    logs = [
        multivariate_normal.logpdf(residual, cov=none + share**2 * covariance)
        for share in evidence.FORMULA_SDS
    ]
    return float(
        logsumexp(logs) - np.log(len(logs)) - multivariate_normal.logpdf(residual, cov=none)
    )


@sweep("seed, off_by", [(1, 0.0), (2, 0.1), (3, -0.2)])
def test_what_a_formula_is_off_by_is_a_gaussian_process(seed: int, off_by: float) -> None:
    at = zone(seed, off_by)
    assert formula_error(at) == pytest.approx(dense(at), abs=0.02)


def test_a_coordinate_that_is_not_read_of_all_has_its_own_process() -> None:
    at = zone(5, 0.1, unread="b")
    assert formula_error(at) == pytest.approx(dense(at), abs=0.02)


def test_a_formula_off_by_a_tenth_is_forgiven() -> None:
    """Of the evidence that a misfit costs, half its chi2, more than a third comes back; a formula
    that is exact pays little for that it might have been off.
    """
    exact, off = zone(4, 0.0), zone(4, 0.1)
    assert -np.log(4.0) <= formula_error(exact) < 0.0
    excess = off.fit.chi2 - exact.fit.chi2
    assert excess > 20.0
    assert formula_error(off) - formula_error(exact) > 0.5 * excess / 3.0


def test_a_base_has_no_formula_to_be_off() -> None:
    readings = cases.read({"a": 50.0}, TESTS, False)
    assert formula_error(cases.grounds(readings)) == 0.0
