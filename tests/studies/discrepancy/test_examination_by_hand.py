"""The rules of an examination one by one: better forms, two for one, rivals, plain stiffness."""

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from sweeps import sweep

from spinepipe.effects import PlaceSpread
from spinepipe.studies.discrepancy.search import search as examination
from spinepipe.studies.discrepancy.search.hypothesis import CandidateForm, Trials, Variant
from spinepipe.studies.discrepancy.search.screen import Screen, Screened, ScreenedVariant
from spinepipe.studies.discrepancy.search.search_state import Rival, SearchStage

MARGIN, NEEDED = 3.0, 5.0


def form(
    name: str, spread: PlaceSpread = PlaceSpread.SHARED, coordinate: str = "extension"
) -> CandidateForm:
    return CandidateForm(Variant(name, (("coordinate", coordinate),)), spread)


def refitted(
    name: str, log_evidence: float, unknowns: int = 1, spread: PlaceSpread = PlaceSpread.SHARED
) -> Any:
    return SimpleNamespace(
        name=name,
        form=form(name, spread),
        log_evidence=log_evidence,
        unknowns=unknowns,
        fit=(name, spread),
    )


# Who takes a place

OWN = form("a")


@sweep("lead, gives_way", [(2.99, False), (3.01, True)])
def test_a_form_gives_way_to_a_clearly_better_one_of_its_effect(
    lead: float, gives_way: bool
) -> None:
    """By three, whatever the margin between effects is."""
    own, other = refitted("a", 40.0), refitted("a", 40.0 + lead, 3, PlaceSpread.EACH)
    for margin in (0.5, 9.0):
        found = examination._better(OWN, own, [own, other], margin)
        assert found is (other if gives_way else None)


@sweep("lead, gives_way", [(5.99, False), (6.01, True)])
def test_another_effect_must_be_ahead_of_the_best_form(lead: float, gives_way: bool) -> None:
    """The plainest form stands, three behind the best of its effect; the margin comes on top."""
    own, best = refitted("a", 40.0), refitted("a", 43.0, 3, PlaceSpread.EACH)
    other = refitted("b", 40.0 + lead)
    assert examination._better(OWN, own, [own, best, other], MARGIN) is (
        other if gives_way else None
    )


def test_the_best_form_counts_for_three_more_than_the_plainest_at_most() -> None:
    own = refitted("a", 40.0)
    for best, counted in ((39.0, 40.0), (42.0, 42.0), (50.0, 43.0)):
        tried = [refitted("a", best, 3, PlaceSpread.EACH), refitted("b", 90.0)]
        assert examination._of_effect(own, tried) == counted


def test_with_nothing_tried_nothing_gives_way() -> None:
    assert examination._better(OWN, refitted("a", 40.0), [], MARGIN) is None


# Rivals


def test_a_rival_is_kept_once_by_its_smallest_margin_nearest_first() -> None:
    rivals = (Rival("b", 2.0), Rival("c", 5.0))
    assert examination._nearest(rivals, Rival("d", 1.0)) == (
        Rival("d", 1.0),
        Rival("b", 2.0),
        Rival("c", 5.0),
    )
    assert examination._nearest(rivals, Rival("c", 1.0)) == (Rival("c", 1.0), Rival("b", 2.0))
    assert examination._nearest(rivals, Rival("b", 9.0)) == rivals
    assert examination._nearest((), Rival("b", 9.0)) == (Rival("b", 9.0),)


def test_rivals_have_the_evidence_of_their_best_refit_or_of_the_screen() -> None:
    own = refitted("a", 40.0)
    tried = [
        own,
        refitted("b", 30.0),
        refitted("b", 35.0, 3, PlaceSpread.EACH),
        refitted("c", -np.inf),
    ]
    effects = [
        Screened(
            name,
            evidence,
            np.zeros(1),
            (ScreenedVariant(form(name), (), (), 0.0, np.zeros(0), 0.0),),
        )
        for name, evidence in (("a", 44.0), ("b", 99.0), ("c", 20.0), ("d", 12.0))
    ]
    found = examination._rivals(own, tried, Screen(tuple(effects), NEEDED, 1))
    assert found == (Rival("b", 5.0, ("extension",)), Rival("d", 28.0, ("extension",)))


# Two for one


class Asked:
    """An inquiry whose next look has these refits."""

    def __init__(self, *tried: Any, names: Sequence[str] = ("level_dependence",)) -> None:
        self.tried, self.places = tried, list[tuple[Any, str]]()
        self.rules = SimpleNamespace(margin=MARGIN, trials=[Trials(name, (), ()) for name in names])

    def stage(self, grounds: Any, in_place_of: str) -> SearchStage:
        self.places.append((grounds.there, in_place_of))
        return SearchStage("", Screen((), NEEDED, 1), self.tried, True)


def grounds(there: Any = None) -> Any:
    return SimpleNamespace(there=there, at=grounds)


def two(inquiry: Asked, own: Any, *tried: Any) -> Any:
    return examination._two_simpler(grounds(), own, tried, inquiry)  # type: ignore[arg-type]


MANY = refitted("a", 40.0, 6, PlaceSpread.EACH)


def test_two_plain_effects_stand_for_one_of_many_unknowns() -> None:
    inquiry = Asked(refitted("c", 12.0), refitted("d", 15.0), MANY)
    found = two(inquiry, MANY, MANY, refitted("b", 30.0), refitted("e", 29.0))
    assert inquiry.places == [(("b", PlaceSpread.SHARED), "a, beside b")]
    assert found.forms == (form("b"), form("d"))
    assert found.baseline.there == ("d", PlaceSpread.SHARED)
    assert found.lead == pytest.approx(5.0)


@sweep("evidence, tried", [(12.1, True), (11.9, False)])
def test_the_first_has_three_tenths_of_the_evidence(evidence: float, tried: bool) -> None:
    inquiry = Asked(refitted("c", 39.0))
    found = two(inquiry, MANY, refitted("b", evidence))
    assert (found is not None) is tried is bool(inquiry.places)


def test_the_first_has_fewer_unknowns_and_both_no_more_than_the_one() -> None:
    for unknowns, tried in ((5, True), (6, False)):
        inquiry = Asked(refitted("c", 39.0))
        assert (two(inquiry, MANY, refitted("b", 30.0, unknowns)) is not None) is tried
    for unknowns, found in ((2, True), (3, False)):
        inquiry = Asked(refitted("c", 39.0, unknowns))
        assert (two(inquiry, MANY, refitted("b", 30.0, 4)) is not None) is found


@sweep("second, found", [(NEEDED + 0.1, True), (NEEDED, False)])
def test_the_second_is_evident_beside_the_first(second: float, found: bool) -> None:
    assert (two(Asked(refitted("c", second)), MANY, refitted("b", 39.0)) is not None) is found
    assert two(Asked(), MANY, refitted("b", 39.0)) is None


@sweep("second, found", [(7.01, True), (6.99, False)])
def test_together_they_are_no_more_than_the_margin_behind(second: float, found: bool) -> None:
    assert (two(Asked(refitted("c", second)), MANY, refitted("b", 30.0)) is not None) is found


# Plain stiffness


def over(
    spread: PlaceSpread,
    name: str = "a",
    coordinate: str = "extension",
    plain: float = 30.0,
    **more: Any,
) -> tuple[float | None, list[Any]]:
    inquiry: Any = Asked(**more)
    asked: list[Any] = []

    def refit(without: Any, one: Any) -> Any:
        asked.append(one)
        return refitted("level_dependence", plain)

    inquiry.refit = refit
    own = refitted(name, 40.0, 6, spread)
    own.form = form(name, spread, coordinate)
    return examination._over_stiffness(grounds(), own, inquiry), asked


@sweep("spread", [PlaceSpread.BY_JOINT, PlaceSpread.EACH])
def test_many_strengths_are_held_against_a_stiffness_of_each_joint(spread: PlaceSpread) -> None:
    """That starts a hundredth above off."""
    ahead, (one,) = over(spread)
    assert ahead == 10.0
    assert (one.form.name, one.form.spread) == ("level_dependence", PlaceSpread.EACH)
    assert one.form.variant.acts_on == ("extension",)
    assert one.start == pytest.approx([np.exp(0.01)])


def test_few_strengths_and_stiffness_itself_are_held_against_nothing() -> None:
    assert over(PlaceSpread.SHARED) == (None, [])
    assert over(PlaceSpread.BY_SPECIMEN) == (None, [])
    assert over(PlaceSpread.EACH, "level_dependence") == (None, [])
    assert over(PlaceSpread.EACH, names=("b",)) == (None, [])
    assert over(PlaceSpread.EACH, coordinate="all") == (None, [])
    assert over(PlaceSpread.EACH, plain=-np.inf)[0] is None
