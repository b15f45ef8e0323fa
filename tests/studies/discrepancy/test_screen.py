"""The screen: which columns a form sums, and how large strengths may be."""

import numpy as np
import pytest
from sweeps import sweep

from spinepipe.effects import PlaceSpread
from spinepipe.studies.discrepancy.search.hypothesis import CandidateForm, Trials, Variant
from spinepipe.studies.discrepancy.search.projected import columns_of
from spinepipe.studies.discrepancy.search.screen import (
    EffectColumns,
    Group,
    sides,
)

TESTS = ("flexion", "bending")
OFFSET = Variant("load_offset", ())
LAXITY = Variant("local_laxity", (("coordinate", "extension"),))


def strengths(*forms: CandidateForm) -> list[set[tuple[str, int | None, str, int]]]:
    """Of each strength of the first form, all it sums: specimen, joint, test, column of values."""
    form = forms[0]
    index = EffectColumns(columns_of(Trials("", (form.variant,), forms), 2, TESTS))
    places, values = index.places(form, (), ("a", "b"), TESTS)
    found: list[set[tuple[str, int | None, str, int]]] = [set() for _ in values]
    for specimen, columns, owners in places:
        for column, owner in zip(columns.tolist(), owners.tolist(), strict=True):
            one = index.columns[column]
            assert one.strength == values[owner]
            found[owner].add((specimen, one.joint, one.test, one.strength))
    return found


def test_what_differs_by_test_has_strengths_of_each_test_for_all_specimens() -> None:
    found = strengths(
        CandidateForm(OFFSET, PlaceSpread.BY_TEST), CandidateForm(OFFSET, PlaceSpread.SHARED)
    )
    expected = [
        {("a", None, test, axis), ("b", None, test, axis)} for axis in range(3) for test in TESTS
    ]
    assert len(found) == 6
    assert all(one in found for one in expected)


def test_what_is_shared_has_one_strength_of_all_tests() -> None:
    found = strengths(
        CandidateForm(OFFSET, PlaceSpread.SHARED), CandidateForm(OFFSET, PlaceSpread.BY_TEST)
    )
    assert found == [{("a", None, "*", axis), ("b", None, "*", axis)} for axis in range(3)]


@sweep(
    "form, expected",
    [
        (CandidateForm(LAXITY, PlaceSpread.SHARED), [["a0", "a1", "b0", "b1"]]),
        (CandidateForm(LAXITY, PlaceSpread.BY_JOINT), [["a0", "b0"], ["a1", "b1"]]),
        (CandidateForm(LAXITY, PlaceSpread.BY_SPECIMEN), [["a0", "a1"], ["b0", "b1"]]),
        (CandidateForm(LAXITY, PlaceSpread.EACH), [["a0"], ["a1"], ["b0"], ["b1"]]),
        (CandidateForm(LAXITY, PlaceSpread.ONE_JOINT, 1), [["a1", "b1"]]),
        (CandidateForm(LAXITY, PlaceSpread.ONE, 0, "b"), [["b0"]]),
    ],
)
def test_each_way_to_differ_sums_its_places(form: CandidateForm, expected: list[list[str]]) -> None:
    found = [sorted(f"{s}{joint}" for s, joint, _, _ in one) for one in strengths(form)]
    assert found == expected


def test_columns_by_test_are_made_only_where_a_form_asks() -> None:
    shared, by_test = (
        CandidateForm(OFFSET, spread) for spread in (PlaceSpread.SHARED, PlaceSpread.BY_TEST)
    )
    assert len(columns_of(Trials("", (OFFSET,), (shared,)), 2, TESTS)) == 3
    assert len(columns_of(Trials("", (OFFSET,), (shared, by_test)), 2, TESTS)) == 3 * 3


def test_a_column_is_scaled_by_the_prior_sd_of_its_strength() -> None:
    column, _ = columns_of(Trials("", (LAXITY,), ()), 2, TESTS)
    assert (column.scale, column.joint, column.test) == (0.3, 0, "*")


def test_bounds_tell_the_side_of_a_strength() -> None:
    """A fraction is lost from nothing on, a softer zone goes up to one, a ratio goes both ways."""
    stiffer = Variant("level_dependence", (("coordinate", "extension"),))
    zone = Variant("neutral_zone", (("coordinate", "extension"),))
    found = [
        sides(CandidateForm(v, PlaceSpread.SHARED), v.strengths).tolist()
        for v in (LAXITY, zone, stiffer)
    ]
    assert found == [[1.0], [-1.0], [0.0]]


@sweep("curvature, moment", [(1.0, 0.0), (4.0, 6.0)])
def test_strengths_are_from_a_tenth_to_three_prior_sds(curvature: float, moment: float) -> None:
    """Marginal over N(0, t^2): exp(b^2 t^2 / 2 (1 + t^2 l)) / sqrt(1 + t^2 l), a mean of four."""
    group = Group.of(np.array([[curvature]]), np.zeros(1))
    t = np.array([0.1, 0.3, 1.0, 3.0])
    spread = 1.0 + t**2 * curvature
    expected = np.log(np.mean(np.exp(0.5 * moment**2 * t**2 / spread) / np.sqrt(spread)))
    assert float(group.log_evidence(np.array([moment]))) == pytest.approx(expected)
