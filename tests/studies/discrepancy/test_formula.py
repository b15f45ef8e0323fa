"""Formulas of what no effect explains: the law that was put in, or nothing."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import search_cases as cases
from sklearn.linear_model import orthogonal_mp
from spring_chain_cases import Yield
from sweeps import sweep

from spinepipe.effects.contract import Array
from spinepipe.model import LoadCase, LoadStep, ScopedEffect
from spinepipe.statics import FreeParameter
from spinepipe.studies.discrepancy.search import formula as formulas
from spinepipe.studies.discrepancy.search.baseline import BaselineFit
from spinepipe.studies.discrepancy.search.formula import (
    EVERYWHERE,
    PursuitProblem,
    TermAtPlace,
    _WhitenedColumns,
    formula,
    text_of,
)
from spinepipe.studies.discrepancy.search.law_terms import (
    LawTerm,
    TermColumns,
    tell_time,
    term_columns,
)
from spinepipe.studies.discrepancy.search.prediction import SolvedSpecimen
from spinepipe.studies.discrepancy.verdict_unnamed import Formula, FormulaTerm
from spinepipe.units import ROTATIONS

DRAWS, FALSE_ALARM = 200, 0.01


def power(order: int, coefficient: float, only: int | None = None) -> Yield:
    """Rotations of ``k q + coefficient q^order`` at all joints, or at one."""

    def turned(joint: int, moments: Array, k: float) -> Array:
        if only not in (None, joint):
            return moments / k
        q = np.zeros_like(moments)
        for share in np.linspace(0.05, 1.0, 20):
            for _ in range(20):
                held = k * q + coefficient * q**order
                q = q - (held - share * moments) / (k + order * coefficient * q ** (order - 1))
        np.testing.assert_allclose(k * q + coefficient * q**order, moments, atol=1e-9)
        return q

    return turned


@cache
def grounds(
    seed: int, test: str = "", order: int = 2, size: float = 0.0, only: int = -1
) -> BaselineFit:
    laws: Mapping[str, Yield] = {}
    if test:
        laws = {test: power(order, size, None if only < 0 else only)}
    return cases.grounds_of(cases.readings(seed, laws))


def found(at: BaselineFit) -> Formula | None:
    return formula(at, ROTATIONS, DRAWS, 0, FALSE_ALARM)


@sweep("seed", range(1, 7))
def test_springs_have_no_formula(seed: int) -> None:
    assert found(grounds(seed)) is None


@sweep("seed", [1, 2])
def test_a_square_is_found_with_its_coefficient(seed: int) -> None:
    ended = found(grounds(seed, "bending", 2, 20.0))
    assert ended is not None
    (term,) = ended.terms
    assert (term.specimen, term.joint, term.coordinate) == ("*", "*", "right_bending")
    assert (term.acts, term.term, term.unit) == ("load", "right bending^2", "N m/rad^2")
    assert term.of == ("right_bending", "right_bending")
    assert abs(term.coefficient - 20.0) < 3.0 * term.sd
    assert term.sd < 2.0
    assert ended.text.startswith("moment in right bending at every joint = +")
    assert ended.explained > 0.95
    assert ended.held_out_closed is not None
    assert ended.held_out_closed > 0.9


@sweep("seed", [1, 3])
def test_a_cube_at_one_joint_is_found_there(seed: int) -> None:
    ended = found(grounds(seed, "flexion", 3, 4000.0, 1))
    assert ended is not None
    (term,) = ended.terms
    assert (term.joint, term.coordinate, term.unit) == ("L4L5", "extension", "N m/rad^3")
    assert abs(term.coefficient - 4000.0) < 3.0 * term.sd
    assert "at L4L5 = +" in ended.text
    assert ended.held_out_closed is not None
    assert ended.held_out_closed > 0.9


def test_the_terms_of_a_place_stand_together() -> None:
    one = FormulaTerm("*", "L4L5", "anterior", "load", "anterior^2", 12.34, 0.56, "N/mm^2", 0.8)
    two = FormulaTerm("*", "L4L5", "anterior", "load", "compression", -0.1, 0.02, "N/N", 0.1)
    far = FormulaTerm("s1", "*", "extension", "reading", "step / last step", 0.5, 0.1, "deg", 0.1)
    assert text_of([one, far, two]) == (
        "force in anterior at L4L5 = +12.3 (SD 0.56) N/mm^2 * anterior^2 "
        "-0.1 (SD 0.02) N/N * compression; "
        "drift of the reading in extension at every joint of s1 = "
        "+0.5 (SD 0.1) deg * step / last step"
    )


# Columns, against the sensitivities of the simulator to an effect that is off


def columns_at(seed: int) -> tuple[BaselineFit, str, Callable[[str, str, int], Array]]:
    at = grounds(seed)
    name = "a"
    model, cases_ = at.fit.models[name], at.readings[name].cases
    made = term_columns(model, cases_, False, ROTATIONS, False, np.ones((model.n_joints, 6)))

    def column(coordinate: str, words: str, joint: int) -> Array:
        (number,) = [
            n for n, t in enumerate(made.terms) if (t.coordinate, t.words) == (coordinate, words)
        ]
        return np.concatenate([m[..., number * model.n_joints + joint] for m in made.moved])

    return at, name, column


@sweep(
    "coordinate, words",
    [
        ("extension", "extension"),
        ("right_bending", "right bending |right bending|"),
        ("left_rotation", "left rotation^3"),
        ("extension", "right bending^2"),
        ("right_bending", "extension x left rotation"),
    ],
)
def test_columns_are_sensitivities_to_the_effect(coordinate: str, words: str) -> None:
    at, name, column = columns_at(2)
    model, given = at.fit.models[name], at.readings[name].cases
    made = term_columns(model, given, False, ROTATIONS, False, np.ones((model.n_joints, 6)))
    (term,) = [t for t in made.terms if (t.coordinate, t.words) == (coordinate, words)]
    assert term.variant is not None
    idle = ScopedEffect(term.variant.create(), (1,), np.zeros((1, 1)))
    full = model.with_effects((*model.effects, idle))
    free = FreeParameter("", len(model.effects), 0, (0,), False)
    expected = np.concatenate(SolvedSpecimen(model, given, False).by(full, [free]))[..., 0]
    size = np.abs(expected).max()
    np.testing.assert_allclose(column(coordinate, words, 1), expected, rtol=0, atol=1e-9 * size)


def test_the_joint_above_moves_as_its_neighbour_says() -> None:
    """Upright springs in pure moments: a load on a joint turns that joint alone, by load / k."""
    at, name, column = columns_at(2)
    model, given = at.fit.models[name], at.readings[name].cases
    poses = np.concatenate(SolvedSpecimen(model, given, False).poses)
    k = model.effects[0].values[0, 3]
    moved = column("extension", "extension of the joint above", 0)
    np.testing.assert_allclose(moved[:, 0, 3], -poses[:, 1, 3] / k, rtol=1e-6, atol=1e-12)
    assert not np.any(np.abs(column("extension", "extension of the joint above", 2)) > 0.0)


def test_time_tells_rates_where_it_goes_on() -> None:
    def case(*times: float | None) -> LoadCase:
        steps = tuple(LoadStep(n, (), time) for n, time in enumerate(times))
        return LoadCase("flexion", 1, steps)

    assert tell_time([case(0.0, 1.0, 5.0)])
    assert not tell_time([case(0.0, 1.0, 5.0), case(0.0, None)])
    assert not tell_time([case(0.0, 1.0, 1.0)])


# The pursuit, on columns of random numbers


def made_up(seed: int, weights: Mapping[TermAtPlace, float], draws: int = 300) -> PursuitProblem:
    """Two specimens, two joints, five terms; readings are candidates' columns, and noise."""
    rng = np.random.default_rng(seed)
    terms = tuple(LawTerm("extension", "load", f"t{n}", (0, n, 0, 0)) for n in range(5))
    parts = []
    for _ in range(2):
        each = rng.normal(size=(60, 5, 2))
        whole = np.concatenate([each.sum(axis=-1, keepdims=True), each], axis=-1).reshape(60, 15)
        parts.append(_WhitenedColumns(whole, np.sum(whole**2, axis=0)))
    shared = np.linalg.qr(rng.normal(size=(120, 3))).Q
    errors = rng.normal(size=(120, 1 + draws))
    bare = PursuitProblem(terms, 2, tuple(parts), (0, 60, 120), shared, errors, 117.0)
    for candidate, weight in weights.items():
        errors[:, 0] += weight * bare.column(candidate)
    errors = errors - shared @ (shared.T @ errors)
    return PursuitProblem(terms, 2, tuple(parts), (0, 60, 120), shared, errors, 117.0)


ALL, ONE = TermAtPlace(1, EVERYWHERE, EVERYWHERE), TermAtPlace(3, 1, 0)


def test_what_is_above_the_noise_is_of_the_data_alone() -> None:
    problem = made_up(1, {ALL: 1.0})
    assert problem.excess == pytest.approx(np.linalg.norm(problem.errors[:, 0]) ** 2 - 117.0)
    assert abs(made_up(2, {}).excess) < 5.0 * np.sqrt(2.0 * 117.0)  # noise: chi2, five SDs
    everywhere = 5 * (2 + 1) * (2 + 1)  # terms, each joint and all, each specimen and all
    assert len(set(problem.candidates())) == len(problem.candidates()) == everywhere


def test_drops_of_chi2_are_those_of_least_squares() -> None:
    problem = made_up(1, {ALL: 1.0, ONE: 1.0})
    ranked = problem.ranked([ALL], FALSE_ALARM)

    def chi2(*there: TermAtPlace) -> float:
        columns = np.column_stack([problem.shared, *(problem.column(one) for one in there)])
        return float(np.linalg.lstsq(columns, problem.errors[:, 0])[1][0])

    for candidate, drop in zip(ranked.best[:5], ranked.drops[:5], strict=True):
        assert drop == pytest.approx(chi2(ALL) - chi2(ALL, candidate), rel=1e-9)
    values, sds = problem.fitted([ALL, ONE])
    columns = np.column_stack([problem.shared, problem.column(ALL), problem.column(ONE)])
    solved = np.linalg.lstsq(columns, problem.errors[:, 0])[0]
    np.testing.assert_allclose(values, solved[-2:], rtol=1e-9)
    inverse = np.linalg.inv(columns.T @ columns)
    np.testing.assert_allclose(sds, np.sqrt(np.diagonal(inverse))[-2:], rtol=1e-9)


@sweep("seed", range(4))
def test_it_takes_the_terms_that_sklearn_takes(seed: int) -> None:
    problem = made_up(seed, {ALL: 1.0, ONE: 2.0})
    every = problem.candidates()
    columns = np.column_stack([problem.column(one) for one in every])
    columns = columns - problem.shared @ (problem.shared.T @ columns)
    columns = columns / np.linalg.norm(columns, axis=0)
    theirs = np.flatnonzero(orthogonal_mp(columns, problem.errors[:, 0], n_nonzero_coefs=2))
    first = problem.ranked([], FALSE_ALARM).best[0]
    second = problem.ranked([first], FALSE_ALARM).best[0]
    assert {first, second} == {every[k] for k in theirs} == {ALL, ONE}


def test_noise_alone_passes_as_seldom_as_is_allowed() -> None:
    """Of 400 draws of noise, some 4 pass at 1 %; 13 or more are one in ten thousand (binomial)."""
    passed = 0
    problem = made_up(9, {}, draws=800)
    for draw in range(1, 401):
        errors = np.column_stack([problem.errors[:, draw], problem.errors[:, 401:]])
        one = PursuitProblem(
            problem.terms, 2, problem.parts, problem.rows, problem.shared, errors, problem.freedom
        )
        ranked = one.ranked([], FALSE_ALARM)
        passed += ranked.drops[0] > ranked.threshold
    assert passed <= 12


SQUARE = LawTerm("extension", "load", "extension^2", (0, 2, 0, 0), ("extension", "extension"))


def test_twenty_candidates_are_ranked_best_first() -> None:
    found = made_up(1, {ALL: 1.0}).ranked([], 0.01)
    assert len(found.best) == len(found.drops) == len(found.values) == 20
    assert list(found.drops) == sorted(found.drops, reverse=True)


def test_without_linear_terms_there_are_no_coefficients() -> None:
    values, sds = made_up(1, {ALL: 1.0}).fitted([])
    assert (values.shape, sds.shape) == ((0,), (0,))


@sweep("left, is_term", [(1.1e-4, True), (0.9e-4, False)])
def test_a_term_that_keeps_a_ten_thousandth_beside_the_rest_is_one(
    left: float, is_term: bool
) -> None:
    """A column of length one, whose square lies so much across what is taken out."""
    column = np.array([[np.sqrt(1.0 - left)], [np.sqrt(left)]])
    part = formulas._WhitenedColumns(column, np.ones(1))
    shared, errors = np.array([[1.0], [0.0]]), np.array([[0.0, 0.0], [3.0, 1.0]])
    problem = PursuitProblem((SQUARE,), 1, (part,), (0, 2), shared, errors, 1.0)
    values, drops = problem._drops(shared, errors)
    assert drops[0] == pytest.approx([9.0, 1.0] if is_term else [0.0, 0.0])
    assert values[0] == pytest.approx(3.0 / np.sqrt(left) if is_term else 0.0)


def test_candidates_are_of_each_joint_and_specimen_and_of_all() -> None:
    problem = made_up(1, {})
    alone = replace(problem, parts=problem.parts[:1])
    assert {one.specimen for one in alone.candidates()} == {EVERYWHERE}
    assert {one.joint for one in alone.candidates()} == {EVERYWHERE, 0, 1}
    single = replace(problem, joints=1)
    assert {one.joint for one in single.candidates()} == {0}
    assert {one.specimen for one in single.candidates()} == {EVERYWHERE, 0, 1}
    assert problem.column(ONE)[60:].tolist() == [0.0] * 60
    assert problem.column(ONE)[:60].tolist() == problem.parts[0].columns[:, 3 * 3 + 2].tolist()


def test_a_joint_alone_has_a_column_for_each_term() -> None:
    moved = np.arange(2.0 * 6 * 3).reshape(2, 1, 6, 3)
    one = TermColumns((SQUARE,) * 3, (moved,), np.ones((3, 1)))
    assert formulas._with_sums(one, 1)[0] is moved
    each = np.arange(4.0).reshape(1, 1, 1, 4) * np.ones((2, 2, 6, 1))
    both = TermColumns((SQUARE,) * 2, (each,), np.ones((2, 2)))
    found = formulas._with_sums(both, 2)[0]
    assert found[0, 0, 0].tolist() == [1.0, 0.0, 1.0, 5.0, 2.0, 3.0]


def test_what_columns_span_is_as_wide_as_they_are_apart() -> None:
    """Columns of other units, one of nothing, one that the others make."""
    columns_of = np.array([[1e-6, 0.0, 2.0, 1.0], [0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 0.0, 0.0]])
    basis = formulas._orthonormal(columns_of)
    assert basis.shape == (3, 2)
    np.testing.assert_allclose(basis @ basis.T, np.diag([1.0, 1.0, 0.0]), atol=1e-12)
    assert formulas._orthonormal(np.zeros((3, 0))).shape == (3, 0)
