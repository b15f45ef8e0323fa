"""The pieces of the search against dense linear algebra, scipy's densities and closed forms."""

from dataclasses import replace
from typing import cast

import numpy as np
import pytest
import spring_chain_cases as chains
from numpy.typing import NDArray
from scipy.integrate import quad
from scipy.linalg import block_diag
from scipy.special import logsumexp
from scipy.stats import multivariate_normal, ncx2, norm
from spring_chain_cases import SD, readings
from sweeps import sweep

from spinepipe.effects import PlaceSpread, registered
from spinepipe.model import SpineModel
from spinepipe.studies.discrepancy.search.baseline import BaselineFit, fit_baseline
from spinepipe.studies.discrepancy.search.gaps import Gap
from spinepipe.studies.discrepancy.search.hypothesis import (
    CandidateForm,
    Hypothesis,
    HypothesisMember,
    Trials,
    Unknown,
    Variant,
    shape_grid,
    trials,
)
from spinepipe.studies.discrepancy.search.joint_fit import JointFit
from spinepipe.studies.discrepancy.search.noise import Noise
from spinepipe.studies.discrepancy.search.nuisance import NuisancePriors
from spinepipe.studies.discrepancy.search.projected import (
    EVERY_TEST,
    Linearised,
    VariantColumn,
    columns_of,
    linearised,
    products,
    taken_out,
)
from spinepipe.studies.discrepancy.search.screen import (
    SIZES,
    EffectColumns,
    Group,
    IndistinctVariants,
    Screen,
    screened,
)
from spinepipe.studies.discrepancy.search.search_state import look
from spinepipe.studies.discrepancy.store import at_once
from spinepipe.units import ROTATIONS

pytestmark = pytest.mark.numeric

Array = NDArray[np.float64]

NO_NUISANCE = NuisancePriors(*[0.0] * 8)


def log_normal(residual: Array, covariance: Array) -> float:
    return float(multivariate_normal.logpdf(residual, cov=covariance))


# Evidence of a group -------------------------------------------------------------------------


@sweep("count", [1, 3])
def test_evidence_is_the_ratio_of_marginal_likelihoods(count: int) -> None:
    rng = np.random.default_rng(1)
    f, r = rng.normal(size=(25, count)), 2.0 * rng.normal(size=(25, 4))  # of four residuals
    group = Group.of(f.T @ f, np.zeros(count))
    expected = []
    for residual in r.T:
        nothing = log_normal(residual, np.eye(25))
        logs = [log_normal(residual, np.eye(25) + t**2 * f @ f.T) - nothing for t in SIZES]
        expected.append(logsumexp(logs) - np.log(len(SIZES)))
    np.testing.assert_allclose(group.log_evidence(r.T @ f), expected, rtol=1e-9)


def test_strengths_without_a_signature_change_no_evidence() -> None:
    f = np.random.default_rng(2).normal(size=(25, 2))
    r = np.ones(25)
    only = Group.of(f.T @ f, np.zeros(2)).log_evidence(f.T @ r)
    padded = np.column_stack([f, np.zeros(25)])
    same = Group.of(padded.T @ padded, np.zeros(3)).log_evidence(padded.T @ r)
    np.testing.assert_allclose(same, only)


@sweep("side", [1.0, -1.0])
@sweep("size", [0.7, -0.7])
def test_one_sided_evidence_is_the_integral_over_half_a_normal(side: float, size: float) -> None:
    rng = np.random.default_rng(3)
    f = 0.6 * rng.normal(size=(20, 1))
    r = size * f[:, 0] + rng.normal(size=20)
    group = Group.of(f.T @ f, np.array([side]))

    def likelihood(b: float) -> float:
        return float(np.exp(b * f[:, 0] @ r - 0.5 * b**2 * f[:, 0] @ f[:, 0]))

    ratios = [
        quad(lambda b, t=t: 2.0 * norm.pdf(b, 0.0, t) * likelihood(side * b), 0.0, 12.0 * t)[0]
        for t in SIZES
    ]
    found = float(group.log_evidence(f.T @ r))
    assert found == pytest.approx(np.log(np.mean(ratios)), rel=1e-6)


# The linearised problem ----------------------------------------------------------------------

LAXITY = Variant("local_laxity", ())
COUPLING = Variant("bending_rotation_coupling", ())


def unknown(number: int | None, sd: float, is_strength: bool = False) -> Unknown:
    return Unknown("", number, 0, (), is_strength, -100.0, 100.0, 0.0, sd)


def made_up_fit(jacobians: dict[str, Array], members: dict[str, tuple[int, ...]]) -> JointFit:
    """A fit with given whitened Jacobians; ``members`` number their columns."""
    rng = np.random.default_rng(11)
    count = 1 + max(max(numbers) for numbers in members.values())
    nothing = cast(SpineModel, None)
    hypothesis = Hypothesis(
        {name: HypothesisMember(nothing, (), numbers) for name, numbers in members.items()},
        tuple(unknown(None, 3.0) for _ in range(count)),
        (),
    )
    residuals = {name: rng.normal(size=len(j)) for name, j in jacobians.items()}
    x = np.zeros(count)
    bound = np.zeros(count, dtype=bool)
    return JointFit(hypothesis, x, {}, 1.0, residuals, jacobians, {}, {}, bound, "")


def problem_of(fit: JointFit, signatures: dict[str, Array]) -> Linearised:
    """Everything that one effect's evidence is made of."""
    taken = taken_out(fit)
    raw = {name: np.sum(f**2, axis=0) for name, f in signatures.items()}
    return linearised({name: products(taken[name], signatures[name], raw[name]) for name in taken})


def left_of(columns: Array, taken: Array) -> Array:
    """Columns without what least squares explains of them."""
    return columns - taken @ np.linalg.lstsq(taken, columns)[0]


def alone(
    index: EffectColumns,
    problem: Linearised,
    form: CandidateForm,
    sds: tuple[float, ...],
    specimens: tuple[str, ...],
) -> tuple[IndistinctVariants, Array, Array]:
    """A form at one shape, and Gram matrix (k, k) and moments (k,) of its strengths."""
    (one,) = index.batches([(form, sds)], specimens, ())
    (gram,), (moments,) = one.summed(problem)
    return one, gram, moments


@sweep("spread", [PlaceSpread.SHARED, PlaceSpread.BY_JOINT, PlaceSpread.EACH])
@sweep("shared", [0, 1, 2])
def test_products_are_those_of_dense_projections(spread: PlaceSpread, shared: int) -> None:
    """Two specimens with two unknowns of their own and some that they share; three joints."""
    rng = np.random.default_rng(4)
    common = tuple(range(4, 4 + shared))
    members = {"a": (0, 1, *common), "b": (*common, 2, 3)}
    jacobians = {name: rng.normal(size=(30, 2 + shared)) for name in members}
    fit = made_up_fit(jacobians, members)
    signatures = {name: rng.normal(size=(30, 3)) for name in members}
    problem = problem_of(fit, signatures)
    columns = [VariantColumn(LAXITY, (), 0, joint, EVERY_TEST, 1.0) for joint in range(3)]
    form = CandidateForm(LAXITY, spread)
    _, gram, moments = alone(EffectColumns(columns), problem, form, (), tuple(members))

    a, b = jacobians["a"], jacobians["b"]
    own = block_diag(a[:, :2], b[:, shared:])
    taken = np.column_stack([own, np.vstack([a[:, 2:], b[:, :shared]])])
    stacked = np.vstack([signatures["a"], signatures["b"]])
    dense = {
        PlaceSpread.SHARED: stacked.sum(axis=1, keepdims=True),
        PlaceSpread.BY_JOINT: stacked,
        PlaceSpread.EACH: block_diag(signatures["a"], signatures["b"]),
    }[spread]
    left = left_of(dense, taken)
    residual = -np.concatenate([fit.residuals["a"], fit.residuals["b"]])
    np.testing.assert_allclose(gram, left.T @ left, atol=1e-9)
    np.testing.assert_allclose(moments, left.T @ residual, atol=1e-9)


def test_evidence_of_many_forms_at_once_is_that_of_each() -> None:
    """Forms of all ways to differ, some of one place; shapes and signs as the effects have them."""
    rng = np.random.default_rng(6)
    members = {"a": (0, 1, 4), "b": (4, 2, 3)}
    fit = made_up_fit({name: rng.normal(size=(60, 3)) for name in members}, members)
    variants = [
        Variant(name, tuple(options.items()))
        for name in ("local_laxity", "neutral_zone")
        for options in registered()[name].trial.variants[:2]  # type: ignore[attr-defined]
    ]
    places = [(None, None), (0, None), (1, "a"), (0, "b")]
    forms = tuple(
        CandidateForm(variant, spread, joint, specimen)
        for variant in variants
        for spread in (PlaceSpread.SHARED, PlaceSpread.BY_JOINT, PlaceSpread.EACH)
        for joint, specimen in places
    )
    trials = Trials("made up", tuple(variants), forms)
    index = EffectColumns(columns_of(trials, 2, ()))
    signatures = {name: rng.normal(size=(60, len(index.columns))) for name in members}
    problem = problem_of(fit, signatures)
    whole = screened(trials, index, problem, tuple(members), ())
    shares = []
    for form in forms:
        grid = shape_grid(form.variant)
        every = [alone(index, problem, form, sds, tuple(members)) for sds in grid]
        logs = [Group.of(gram, one.signs).log_evidence(moments) for one, gram, moments in every]
        tried = next(one for one in whole.forms if one.form == form)
        best = int(np.argmax(logs))
        one, gram, moments = every[best]
        assert (tried.sds, tried.strengths) == (grid[best], one.strengths)
        share = -np.log(len(variants) * 3 * len(places))
        assert tried.log_evidence == pytest.approx(max(logs) + share, rel=1e-9)
        b = Group.of(gram, one.signs).estimate(moments)
        np.testing.assert_allclose(tried.estimate, b, atol=1e-12)
        assert tried.explained == pytest.approx(2.0 * b @ moments - b @ gram @ b)
        shares.append(logsumexp(logs) - np.log(len(grid)) + share)
    assert whole.log_evidence == pytest.approx(logsumexp(shares), rel=1e-9)


def test_what_the_base_explains_is_no_signature() -> None:
    rng = np.random.default_rng(6)
    jacobian = rng.normal(size=(40, 3))
    fit = made_up_fit({"a": jacobian}, {"a": (0, 1, 2)})
    f = np.column_stack([jacobian @ [1.0, 2.0, 3.0], rng.normal(size=40)])
    found = problem_of(fit, {"a": f}).of["a"]
    np.testing.assert_array_equal(found.gram[0], 0.0)
    assert found.moments[0] == 0.0
    assert found.gram[1, 1] > 1.0


# Fits, screens and gaps of chains in closed form -----------------------------------------------


def noise() -> Noise:
    sd = np.array([np.nan] * 3 + [SD] * 3)
    return Noise(sd, 0.0, "repeats", np.zeros(6, dtype=np.int64), 0, False)


def grounds_of(given: list, priors: NuisancePriors) -> BaselineFit:  # type: ignore[type-arg]
    return fit_baseline(given, noise(), priors, chains.start(given), at_once)


def test_a_fit_of_linear_springs_is_that_of_least_squares() -> None:
    """Angles are moment times compliance: compliance by lstsq over joints, steps and cycles."""
    given = readings(5)
    fit = grounds_of(given, NO_NUISANCE).fit
    levels = np.array(chains.SWEEP)
    chi2 = 0.0
    for one in given:
        stiffness = []
        for test in one.tests:
            driven = chains.AXES[test.case.test][1]
            mean = test.cycles[..., 3:].mean(axis=0)
            angles = mean[:, :, driven - 3]
            design = np.repeat(levels, angles.shape[1])[:, None]
            compliance = np.linalg.lstsq(design, angles.ravel())[0][0]
            stiffness.append(1.0 / compliance)
            mean[:, :, driven - 3] -= compliance * levels[:, None]
            chi2 += 3.0 * np.sum(mean**2) / SD**2
        values = fit.models[one.specimen].effects[0].values
        np.testing.assert_allclose(values[:, 3:], np.tile(stiffness, (6, 1)), rtol=1e-6)
    assert fit.chi2 == pytest.approx(chi2, rel=1e-6)
    assert fit.status == ""


def shown(screen: Screen) -> dict[str, float]:
    return {one.effect: one.log_evidence for one in screen.effects}


EFFECTS = (
    "neutral_zone",
    "flexion_extension_asymmetry",
    "level_dependence",
    "load_offset",
    "marker_bias",
)


def stiffer_one_way(joint: int, moments: Array, k: float) -> Array:
    return moments / np.where(moments > 0.0, k, 1.15 * k)


def test_the_screen_favours_no_effect_and_no_specimen_by_its_place() -> None:
    given = readings(6, stiffer_one_way)
    names = [one.specimen for one in given]
    tried = trials(EFFECTS, ROTATIONS, names, 6)
    one_way = look(grounds_of(given, NO_NUISANCE), tried)
    backwards = trials(EFFECTS, ROTATIONS, names[::-1], 6)[::-1]
    other_way = look(grounds_of(given[::-1], NO_NUISANCE), backwards)
    assert shown(one_way)["flexion_extension_asymmetry"] > 3.0
    assert [e.effect for e in one_way.effects] == [e.effect for e in other_way.effects]
    for name, found in shown(one_way).items():
        assert shown(other_way)[name] == pytest.approx(found, rel=1e-4, abs=1e-3)


def test_the_screen_favours_no_joint_by_its_place() -> None:
    """The laxity of one joint is as evident at whichever joint it is (upright, weightless)."""
    found = []
    for place in (0, 2, 5):

        def lax(joint: int, moments: Array, k: float, place: int = place) -> Array:
            return moments / (0.8 * k if joint == place else k)

        given = readings(7, lax, specimens=("a", "b"), sd=0.0)
        tried = trials(["local_laxity"], ROTATIONS, ["a", "b"], 6)
        (best,) = look(grounds_of(given, NO_NUISANCE), tried).effects
        of_place = [t.log_evidence for t in best.forms if t.form.joint == place]
        assert best.forms[0].form.joint == place
        found.append([best.log_evidence, *of_place])
    np.testing.assert_allclose(found[1], found[0], rtol=1e-6)
    np.testing.assert_allclose(found[2], found[0], rtol=1e-6)


@sweep("gap", [0.0, 0.2, 1.0])
def test_the_interval_of_a_gap_covers_as_often_as_it_says(gap: float) -> None:
    dof, draws = 400.0, 200
    rng = np.random.default_rng(9)
    shares = (np.arange(draws) + rng.random(draws)) / draws
    drawn = ncx2.ppf(shares, dof, max(gap**2 * dof, 1e-9))
    covered = []
    for chi2 in drawn:
        low, high = Gap(float(chi2), dof, 400).interval
        covered.append(low <= gap <= high)
    assert 0.93 <= np.mean(covered) <= (0.98 if gap == 0.0 else 0.97)


def test_figures_of_a_gap() -> None:
    gap = Gap(500.0, 400.0, 420)
    assert (gap.rms, gap.gap, gap.excess) == pytest.approx((np.sqrt(1.25), 0.5, 100.0))
    assert replace(gap, chi2=300.0).gap == 0.0
    low, high = gap.interval
    assert ncx2.cdf(500.0, 400.0, 400.0 * low**2) == pytest.approx(0.975, abs=1e-4)
    assert ncx2.cdf(500.0, 400.0, 400.0 * high**2) == pytest.approx(0.025, abs=1e-4)
