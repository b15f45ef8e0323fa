"""Steps on the way to a formula, by columns and fits that are made up."""

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from test_formula import ALL

from spinepipe.effects import PlaceSpread
from spinepipe.effects.contract import Array
from spinepipe.studies.discrepancy.search import formula as formulas
from spinepipe.studies.discrepancy.search.formula import (
    EVERYWHERE,
    Ranked,
    TermAtPlace,
    _FormulaState,
    _Term,
)
from spinepipe.studies.discrepancy.search.law_terms import LawTerm, TermColumns

TESTS, STEPS, JOINTS, TERMS = 2, 3, 2, 3
SQUARE = LawTerm("extension", "load", "extension^2", (0, 2, 0, 0), ("extension", "extension"))
RATE = LawTerm("extension", "load", "rate of extension", (0, 1, -1, 0))


def columns(seed: int) -> TermColumns:
    rng = np.random.default_rng(seed)
    moved = rng.normal(size=(TESTS, STEPS, JOINTS, 6, TERMS * JOINTS))
    return TermColumns((SQUARE,) * TERMS, tuple(moved), rng.uniform(1.0, 2.0, (TERMS, JOINTS)))


# The columns of a term, for its proof


def test_a_term_has_the_columns_of_its_places_and_the_largest_of_their_sizes() -> None:
    """Terms stand first, their joints next; as large as loads a joint wholly, where most."""
    made = {"a": columns(20021), "b": columns(20022)}
    state: Any = SimpleNamespace(columns=made)
    for term in range(TERMS):
        for joint, specimen in ((0, 0), (1, 1), (1, EVERYWHERE), (EVERYWHERE, 0), (-1, -1)):
            found = formulas._chosen(state, TermAtPlace(term, joint, specimen))
            names = "ab" if specimen == EVERYWHERE else "ab"[specimen]
            joints = range(JOINTS) if joint == EVERYWHERE else [joint]
            assert set(found.moved) == set(names)
            sizes = [made[name].sizes[term, j] for name in names for j in joints]
            assert found.sd == max(sizes)
            for name in names:
                for of_test, column in zip(made[name].moved, found.moved[name], strict=True):
                    each = of_test.reshape(STEPS, JOINTS, 6, TERMS, JOINTS)
                    expected = sum(each[..., term, j] for j in joints)
                    np.testing.assert_allclose(column, expected)


def test_a_form_is_of_the_place_of_its_candidate() -> None:
    variant = SQUARE.variant
    assert variant is not None

    def form(joint: int, specimen: int) -> tuple[PlaceSpread, int | None, str | None]:
        place = formulas._named(TermAtPlace(0, joint, specimen), ("a", "b"))
        found = formulas.CandidateForm.at(variant, *place)
        return found.spread, found.joint, found.specimen

    assert form(EVERYWHERE, EVERYWHERE) == (PlaceSpread.SHARED, None, None)
    assert form(EVERYWHERE, 1) == (PlaceSpread.SHARED, None, "b")
    assert form(0, EVERYWHERE) == (PlaceSpread.ONE_JOINT, 0, None)
    assert form(1, 0) == (PlaceSpread.ONE, 1, "a")


# Which law of those that lead is taken


def ranked(drops: Sequence[float], values: Sequence[float] | None = None) -> Ranked:
    """Terms 0, 1 ... in the order in which they lead."""
    best = tuple(TermAtPlace(term, EVERYWHERE, EVERYWHERE) for term in range(len(drops)))
    return Ranked(best, tuple(drops), tuple(values or [1.0] * len(drops)), 0.0)


def at_work(terms: Sequence[LawTerm], chi2: float = 100.0) -> Any:
    fit = SimpleNamespace(chi2=chi2, poses=None, hypothesis=SimpleNamespace(supposed=()))
    grounds = SimpleNamespace(readings={"a": None}, fit=fit, setting=None)
    problem = SimpleNamespace(terms=tuple(terms))
    return SimpleNamespace(baseline=grounds, problem=problem, terms=())


class Fits:
    """Fits of laws: chi2 by the number of the fit, None where there is no fit."""

    def __init__(self, *chi2: float | None) -> None:
        self.chi2, self.starts = list(chi2), list[Array]()

    def __call__(self, grounds: Any, one: Any) -> Any:
        self.starts.append(one.start)
        chi2 = self.chi2[len(self.starts) - 1]
        if chi2 is None:
            return None
        hypothesis = SimpleNamespace(supposed=(1, 2, 3))
        return SimpleNamespace(fit=SimpleNamespace(chi2=chi2, hypothesis=hypothesis))


def best(monkeypatch: pytest.MonkeyPatch, fits: Fits, here: Any, given: Ranked) -> Any:
    monkeypatch.setattr(formulas, "_fit_with", fits)
    return formulas._best_fit(here, given)


def test_laws_that_explain_three_quarters_of_the_best_are_fitted_too(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    fits = Fits(50.0, 40.0)
    _, place = best(monkeypatch, fits, at_work([SQUARE] * 3), ranked([80.0, 60.0, 59.9]))
    assert len(fits.starts) == 2
    assert place.term == 1


def test_three_laws_at_most_are_fitted_and_what_is_no_law_is_none_of_them(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    fits = Fits(50.0, None, 30.0, 20.0)
    here = at_work([SQUARE, RATE, SQUARE, SQUARE, SQUARE])
    _, place = best(monkeypatch, fits, here, ranked([9.0] * 5))
    assert len(fits.starts) == 3
    assert place.term == 3
    assert best(monkeypatch, Fits(None, None, None), here, ranked([9.0] * 5)) is None


def test_a_law_starts_at_its_coefficient_half_way_to_its_bounds_at_most(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert SQUARE.variant is not None
    (parameter,) = SQUARE.variant.create().parameters
    fits = Fits(50.0, 50.0, 50.0)
    values = [3.0, 9.0 * parameter.high, 9.0 * parameter.low]
    best(monkeypatch, fits, at_work([SQUARE] * 3), ranked([9.0] * 3, values))
    starts = [float(one[0]) for one in fits.starts]
    assert starts == [3.0, 0.5 * parameter.high, 0.5 * parameter.low]


# What enters


def entered(
    monkeypatch: pytest.MonkeyPatch, law: LawTerm, excess: float, *fits: float | None
) -> tuple[Any, _Term]:
    """The term that enters where the best explains 60, of a fit with chi2 100."""
    here = at_work([law])
    monkeypatch.setattr(formulas, "_fit_with", Fits(*fits))
    grounds, (term,) = formulas._with_one_more(here, ranked([60.0]), excess)
    return None if grounds is here.baseline else grounds, term


def test_a_law_enters_with_its_fit_and_its_share_of_what_is_above_the_noise(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    grounds, term = entered(monkeypatch, SQUARE, 80.0, 52.0)
    assert grounds is not None
    assert (term.law, term.number) == (SQUARE, 2)  # of the effects in its fit, the last
    assert term.explained == pytest.approx((100.0 - 52.0) / 80.0)


@pytest.mark.parametrize("law", [RATE, SQUARE])
def test_what_is_no_law_or_has_no_fit_stays_linear(
    law: LawTerm, monkeypatch: pytest.MonkeyPatch
) -> None:
    for excess, share in ((80.0, 0.75), (50.0, 1.0)):
        grounds, term = entered(monkeypatch, law, excess, None)
        assert (grounds, term.law, term.number) == (None, law, None)
        assert term.explained == pytest.approx(share)  # no more than all of it


class Ends:
    """Joint fits that end one after the other as told: usable, at a bound, chi2."""

    def __init__(self, *ended: tuple[bool, bool, float]) -> None:
        self.ended, self.starts = list(ended), list[float]()

    def __call__(self, hypothesis: Any, setting: Any, poses: Any) -> Any:
        self.starts.append(float(hypothesis[-1].start[0]))
        usable, bound, chi2 = self.ended[len(self.starts) - 1]
        return SimpleNamespace(usable=usable, at_bound=np.array([False, bound]), chi2=chi2)


@pytest.mark.parametrize(
    ("ended", "fits", "found"),
    [
        ([(True, False, 99.0)], 1, True),
        ([(False, False, 1.0), (True, True, 1.0), (True, False, 99.9)], 3, True),
        ([(True, False, 100.0), (True, False, 100.0), (True, False, 90.0)], 3, True),
        ([(False, False, 1.0), (True, True, 1.0), (True, False, 100.0)], 3, False),
    ],
)
def test_a_law_has_a_fit_that_is_better_and_ends_at_no_bound(
    ended: list[tuple[bool, bool, float]], fits: int, found: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Tried from its coefficient, from a half and from a fifth of it."""
    ends = Ends(*ended)
    monkeypatch.setattr(formulas, "joint_fit", ends)
    monkeypatch.setattr(formulas, "standing", lambda fit: ("standing",))
    variant = SQUARE.variant
    assert variant is not None
    fit = SimpleNamespace(chi2=100.0, poses=None)
    grounds: Any = SimpleNamespace(fit=fit, setting=None, suppose=lambda supposed: supposed)
    grounds.at = lambda fit: fit
    one = formulas.ActiveTerm(formulas.CandidateForm(variant, PlaceSpread.SHARED), np.array([8.0]))
    at = formulas._fit_with(grounds, one)
    assert (at is not None) is found
    assert ends.starts == pytest.approx([8.0, 4.0, 1.6][:fits])


# When it ends


def pursued(
    monkeypatch: pytest.MonkeyPatch, *drops: float, threshold: float = 20.0, excess: float = 1000.0
) -> tuple[int, float]:
    """Terms that enter where the best of each step explains that much; what the first had to."""
    steps = iter(drops)
    at: Any = SimpleNamespace(linear=[])

    def problem(*_: Any) -> Any:
        drop = next(steps)
        best_of = Ranked((ALL,), (drop,), (1.0,), threshold + 100.0 * (drop != drops[0]))
        return SimpleNamespace(excess=excess, ranked=lambda linear, share: best_of)

    monkeypatch.setattr(formulas, "terms_of", lambda *_: {})
    monkeypatch.setattr(formulas, "pursuit_problem", problem)
    monkeypatch.setattr(
        formulas,
        "_with_one_more",
        lambda here, ranked, excess: (at, (*here.terms, _Term(RATE, ALL, None, 0.0))),
    )
    states, needed = formulas._pursued(at, (), 10, 0, 0.01)
    return len(states) - 1, needed


def test_terms_enter_above_the_threshold_and_a_twentieth_of_the_excess(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert pursued(monkeypatch, 50.1, 0.0) == (1, 20.0)
    assert pursued(monkeypatch, 50.0) == (0, 20.0)  # of 1000
    assert pursued(monkeypatch, 20.1, 0.0, excess=100.0) == (1, 20.0)
    assert pursued(monkeypatch, 20.0, excess=100.0) == (0, 20.0)
    assert pursued(monkeypatch, 900.0, 800.0, 0.0) == (2, 20.0)
    assert pursued(monkeypatch, 900.0, 119.0) == (1, 20.0)  # the next has a threshold of its own


def test_four_terms_at_most_enter(monkeypatch: pytest.MonkeyPatch) -> None:
    assert pursued(monkeypatch, *(900.0 - n for n in range(6)))[0] == 4


def proven(beats: Sequence[bool], tells: bool, monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """How many terms are put to the proof one after the other; the last is what is told."""
    states = [SimpleNamespace(terms=range(n), linear=[], baseline=n) for n in range(3)]
    monkeypatch.setattr(formulas, "_pursued", lambda *_: (states, 20.0))
    answers, asked = iter(beats), list[int]()

    def proof(before: Any, after: Any, terms: Any) -> Any:
        asked.append(after)
        return SimpleNamespace(beats_base=next(answers), tells=tells, closed=0.5)

    monkeypatch.setattr(formulas, "proof_of_terms", proof)
    told = [SimpleNamespace(explained=0.8)]
    monkeypatch.setattr(formulas, "_valued_terms", lambda state: told * len(state.terms))
    monkeypatch.setattr(formulas, "text_of", lambda terms: "text")
    found = formulas.formula(None, (), 10, 0, 0.01)  # type: ignore[arg-type]
    assert (found is None) is (not any(beats) and tells)
    if found is not None:
        assert found.explained == pytest.approx(min(0.8 * asked[-1], 1.0))
        assert (found.held_out_closed, found.text) == (0.5, "text")
    return asked


def test_terms_that_do_not_predict_are_taken_back_one_by_one(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert proven([True], True, monkeypatch) == [2]
    assert proven([False, True], True, monkeypatch) == [2, 1]
    assert proven([False, False], True, monkeypatch) == [2, 1]
    assert proven([False], False, monkeypatch) == [2]  # where nothing held out tells


# What is told


def test_a_term_is_told_with_its_value_in_units_of_tables() -> None:
    """One is linear, one a law that began at 2 and moved by 3; N/mm^2 are a millionth of N/m^2."""
    law = replace(SQUARE, coordinate="anterior", powers=(2, 0, 0, 0))
    hypothesis = SimpleNamespace(
        unknowns=[SimpleNamespace(supposed=None, sd=1.0), SimpleNamespace(supposed=0, sd=2.0)],
        supposed=[SimpleNamespace(start=np.array([2.0]))],
    )
    # no readings: errors are those of the priors
    fit = SimpleNamespace(
        hypothesis=hypothesis,
        x=np.array([7.0, 3.0]),
        models={"a": SimpleNamespace(joints=("L5S1", "L4L5"))},
        whole_jacobian=lambda: np.zeros((1, 2)),
    )
    grounds: Any = SimpleNamespace(fit=fit, readings={"a": None, "b": None})
    problem: Any = SimpleNamespace(fitted=lambda linear: (np.array([4e6]), np.array([2e6])))
    terms = (
        _Term(law, TermAtPlace(0, 1, 1), None, 0.25),
        _Term(RATE, TermAtPlace(1, EVERYWHERE, EVERYWHERE), 0, 0.5),
    )
    first, second = formulas._valued_terms(_FormulaState(grounds, {}, problem, terms))
    assert (first.specimen, first.joint, first.coordinate) == ("b", "L4L5", "anterior")
    assert (first.coefficient, first.sd, first.explained) == pytest.approx((4.0, 2.0, 0.25))
    assert (second.specimen, second.joint) == ("*", "*")
    assert (second.coefficient, second.sd, second.explained) == pytest.approx((5.0, 2.0, 0.5))
