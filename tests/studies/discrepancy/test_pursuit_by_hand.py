"""One step of a pursuit: its candidates, what they keep beside the rest, and who leads."""

from dataclasses import replace

import numpy as np
import pytest
from sweeps import sweep
from test_formula import ALL, ONE, made_up

from spinepipe.studies.discrepancy.search import formula
from spinepipe.studies.discrepancy.search.formula import EVERYWHERE, PursuitProblem
from spinepipe.studies.discrepancy.search.law_terms import LawTerm, TermColumns

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
    part = formula._WhitenedColumns(column, np.ones(1))
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
    assert formula._with_sums(one, 1)[0] is moved
    each = np.arange(4.0).reshape(1, 1, 1, 4) * np.ones((2, 2, 6, 1))
    both = TermColumns((SQUARE,) * 2, (each,), np.ones((2, 2)))
    found = formula._with_sums(both, 2)[0]
    assert found[0, 0, 0].tolist() == [1.0, 0.0, 1.0, 5.0, 2.0, 3.0]


def test_what_columns_span_is_as_wide_as_they_are_apart() -> None:
    """Columns of other units, one of nothing, one that the others make."""
    columns_of = np.array([[1e-6, 0.0, 2.0, 1.0], [0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 0.0, 0.0]])
    basis = formula._orthonormal(columns_of)
    assert basis.shape == (3, 2)
    np.testing.assert_allclose(basis @ basis.T, np.diag([1.0, 1.0, 0.0]), atol=1e-12)
    assert formula._orthonormal(np.zeros((3, 0))).shape == (3, 0)
