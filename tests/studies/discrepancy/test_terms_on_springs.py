"""Terms of a law where a chain of springs stands: rates, ways, drifts, sizes and what they move."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import spring_chain_cases as chains
from sweeps import sweep

from spinepipe.effects.contract import Array
from spinepipe.model import LoadCase, LoadStep
from spinepipe.studies.discrepancy.search import law_terms
from spinepipe.studies.discrepancy.search.law_terms import (
    READING,
    LawTerm,
    TermColumns,
    term_columns,
)
from spinepipe.units import ROTATIONS

JOINTS, EXTENSION = 2, 3
LEVELS = (0.0, 3.0, 6.0, 2.0)
K = float(chains.STIFFNESS[0])
FLEXION, BENDING, _ = chains.cases(LEVELS, JOINTS)


def states(q: Array, times: list[float] | None = None) -> Any:
    """Of one test with one joint's motion (T,) in extension."""
    whole = np.zeros((len(q), 1, 6))
    whole[:, 0, EXTENSION] = q
    steps = tuple(LoadStep(n, (), times and times[n]) for n in range(len(q)))
    case = LoadCase("flexion", 1, steps)
    solved: Any = SimpleNamespace(poses=[whole], held=[2.0 * whole], cases=[case])
    (found,) = law_terms._states(solved, times is not None)
    return found


def test_rates_are_of_each_step_by_its_time_from_the_second_on() -> None:
    found = states(np.array([1.0, 3.0, 2.0]), [10.0, 14.0, 15.0])
    assert found.rate[:, 0, EXTENSION].tolist() == [0.0, 0.5, -1.0]
    assert states(np.array([1.0, 3.0, 2.0])).rate is None
    assert found.load[:, 0, EXTENSION].tolist() == [2.0, 6.0, 4.0]


def test_a_joint_goes_neither_way_in_steps_below_a_hundredth_of_the_largest() -> None:
    q = np.cumsum([5.0, 1.0, 0.0101, 0.0099, -0.0099, -0.0101, -0.3])
    assert states(q).way[:, 0, EXTENSION].tolist() == [0.0, 1.0, 1.0, 0.0, 0.0, -1.0, -1.0]


def test_a_drift_goes_from_nought_to_one_at_the_last_step() -> None:
    found = law_terms._drift((5, 2, 6), EXTENSION)
    for joint in range(2):
        expected = np.zeros((5, 2, 6))
        expected[:, joint, EXTENSION] = [0.0, 0.25, 0.5, 0.75, 1.0]
        assert (found[..., joint] == expected).all()
    assert law_terms._drift((1, 2, 6), EXTENSION).tolist() == np.zeros((1, 2, 6, 2)).tolist()
    assert law_terms._drift((2, 1, 6), EXTENSION)[:, 0, EXTENSION, 0].tolist() == [0.0, 1.0]


def columns(zeroed: bool = False, cases: list[LoadCase] | None = None) -> TermColumns:
    model = chains.model("a", chains.STIFFNESS, JOINTS)
    stiffness = model.effects[0].values
    return term_columns(model, cases or [FLEXION, BENDING], zeroed, ROTATIONS, False, stiffness)


def place(of: TermColumns, words: str, coordinate: str = "extension") -> int:
    (found,) = [n for n, t in enumerate(of.terms) if (t.words, t.coordinate) == (words, coordinate)]
    return found


def test_a_term_loads_a_joint_wholly_by_a_coefficient_of_its_size() -> None:
    """Springs hold k q; a square c q^2 is as large at the largest motion for c = k / q."""
    made = columns()
    largest = 6.0 / K
    for words, size in (
        ("extension", K),
        ("extension^2", K / largest),
        ("extension^3", K / largest**2),
        ("extension |extension|", K / largest),
        ("way of extension (+1, 0, -1)", K * largest),
    ):
        assert made.sizes[place(made, words)] == pytest.approx([size] * JOINTS, rel=1e-6)
    drift = place(made, "step / last step")
    assert made.terms[drift].acts == READING
    assert made.sizes[drift] == pytest.approx([largest] * JOINTS, rel=1e-6)
    assert made.sizes[place(made, "extension of the joint above"), 1] == 0.0  # there is none


def test_a_square_turns_its_own_joint_by_what_its_spring_yields() -> None:
    made = columns()
    at = place(made, "extension^2") * JOINTS
    turned = np.array(LEVELS) / K
    for joint in range(JOINTS):
        flexion, bending = (test[..., at + joint] for test in made.moved)
        expected = np.zeros((len(LEVELS), JOINTS))
        expected[:, joint] = -(turned**2) / K
        np.testing.assert_allclose(flexion[..., EXTENSION], expected, rtol=1e-6, atol=1e-12)
        np.testing.assert_allclose(bending, 0.0, atol=1e-12)


def test_zeroed_columns_begin_with_nought() -> None:
    back = chains.cases((6.0, 2.0, -3.0), JOINTS)[:1]
    (plain,), (zeroed,) = columns(False, back).moved, columns(True, back).moved
    assert np.abs(plain[0]).max() > 0.0
    np.testing.assert_allclose(zeroed, plain - plain[:1], atol=1e-12)


@sweep(
    "coordinate, unit, border",
    [("anterior", "mm per test", 1e3), ("extension", "deg per test", 180.0 / np.pi)],
)
def test_a_drift_is_told_over_a_whole_test(coordinate: str, unit: str, border: float) -> None:
    term = LawTerm(coordinate, READING, "", (0, 0, 0, 0))
    assert (term.unit, term.display_per_si) == (unit, pytest.approx(border))
    assert term.variant is None


@sweep(
    "coordinate, powers, unit, border",
    [
        ("extension", (0, 0, 0, 0), "N m", 1.0),
        ("anterior", (0, 0, 0, 0), "N", 1.0),
        ("anterior", (1, 0, -1, 0), "N s/mm", 1e-3),
        ("extension", (0, 1, 0, 1), "N m/(rad N)", 1.0),
        ("extension", (2, 1, 0, 0), "N m/(mm^2 rad)", 1e-6),
        ("extension", (0, 2, 0, 0), "N m/rad^2", 1.0),
        ("anterior", (2, 0, 0, 0), "N/mm^2", 1e-6),
        ("superior", (1, 0, 0, 1), "N/(mm N)", 1e-3),
    ],
)
def test_units_name_each_power_once(
    coordinate: str, powers: tuple[int, int, int, int], unit: str, border: float
) -> None:
    term = LawTerm(coordinate, "load", "", powers)
    assert (term.unit, term.display_per_si) == (unit, pytest.approx(border))
