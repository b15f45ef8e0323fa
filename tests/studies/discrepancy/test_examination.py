"""What gives way, what stays and what becomes a rival, by evidence that is made up."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from sweeps import sweep

from spinepipe.effects import PlaceSpread
from spinepipe.studies.discrepancy.search.baseline import BaselineFit
from spinepipe.studies.discrepancy.search.hypothesis import (
    ActiveTerm,
    CandidateForm,
    Trials,
    Variant,
)
from spinepipe.studies.discrepancy.search.refit import Refit, rank_refits
from spinepipe.studies.discrepancy.search.screen import Screen, Screened, ScreenedVariant
from spinepipe.studies.discrepancy.search.search import examine
from spinepipe.studies.discrepancy.search.search_state import SearchStage, SearchState

MARGIN, NEEDED = 3.0, 5.0
NAMES = ("neutral_zone", "nonlinear_stiffening", "facet_contact")


def supposed(name: str) -> ActiveTerm:
    variant = Variant(name, (("coordinate", "extension"),))
    return ActiveTerm(
        CandidateForm(variant, PlaceSpread.SHARED), variant.off((0.0,) * len(variant.shapes))
    )


def on_screen(name: str, log_evidence: float) -> ScreenedVariant:
    return ScreenedVariant(supposed(name).form, (), (), log_evidence, np.zeros(0), 0.0)


@dataclass(frozen=True)
class Place:
    """Grounds by the names of the effects that stand there."""

    names: tuple[str, ...]

    @property
    def fit(self) -> Any:
        hypothesis = SimpleNamespace(supposed=tuple(map(supposed, self.names)), unknowns=())
        return SimpleNamespace(hypothesis=hypothesis, x=np.zeros(0), poses=None, names=self.names)

    def at(self, fit: Any) -> "Place":
        return Place(fit.names)


@dataclass
class Says:
    """An inquiry whose evidence is given: of each effect beside those that stand.

    ``no_fit`` : sets of effects that have no fit by themselves.
    """

    evidence: Mapping[tuple[str, ...], Mapping[str, float]]
    no_fit: Sequence[tuple[str, ...]] = ()
    asked: list[tuple[str, ...]] = field(default_factory=list)
    rules = SimpleNamespace(
        margin=MARGIN, coordinates=("extension",), trials=tuple(Trials(n, (), ()) for n in NAMES)
    )

    @property
    def first(self) -> SearchStage:
        return self.stage(Place(()))

    def beside(self, current: Place, others: tuple[ActiveTerm, ...]) -> Place | None:
        names = tuple(one.form.name for one in others)
        return None if names in self.no_fit else Place(names)

    def stage(self, place: Place, in_place_of: str = "") -> SearchStage:
        self.asked.append(place.names)
        evidence = self.evidence.get(place.names, {})
        tried = tuple(self._refit(place, name) for name in evidence)
        effects = tuple(
            Screened(n, evidence.get(n, 0.0), np.zeros(1), (on_screen(n, evidence.get(n, 0.0)),))
            for n in sorted(NAMES, key=lambda name: -evidence.get(name, 0.0))
        )
        return SearchStage("", Screen(effects, NEEDED, 100), tried, bool(in_place_of))

    def refit(self, place: Place, one: ActiveTerm) -> Refit:
        return self._refit(place, one.form.name)

    def _refit(self, place: Place, name: str) -> Refit:
        fit = Place((*place.names, name)).fit
        value = self.evidence.get(place.names, {}).get(name, 0.0)
        return Refit(supposed(name).form, fit, value, 2.0 * value)


def ended(says: Says, *names: str, settled: bool = False) -> tuple[Any, Any]:
    """What stands where it came to, and the effects with their rivals."""
    return examine(cast(BaselineFit, Place(names)), cast(SearchState, says), settled=settled)


@sweep("lead, gives_way", [(0.5, False), (2.9, False), (3.1, True)])
def test_another_takes_the_place_by_a_clear_margin_only(lead: float, gives_way: bool) -> None:
    says = Says({(): {"neutral_zone": 100.0, "nonlinear_stiffening": 100.0 + lead}})
    result = ended(says, "neutral_zone")
    if gives_way:
        assert result[1] is None
        assert result[0].names == ("nonlinear_stiffening",)
    else:
        (one,) = result[1]
        assert (one.name, one.rivals[0].name) == ("neutral_zone", "nonlinear_stiffening")
        assert one.rivals[0].margin == pytest.approx(-lead)


def test_what_is_not_evident_beside_the_others_leaves() -> None:
    beside = {("neutral_zone",): {"facet_contact": 4.9}, ("facet_contact",): {"neutral_zone": 55.0}}
    says = Says(beside | {(): {"neutral_zone": 60.0}})
    result = ended(says, "neutral_zone", "facet_contact")
    assert result[1] is None
    assert result[0].names == ("neutral_zone",)


def test_when_settled_nothing_gives_way_any_more() -> None:
    """After too many turns all that stands is kept; what is ahead is a rival."""
    says = Says(
        {
            (): {"neutral_zone": 100.0, "nonlinear_stiffening": 140.0},
            ("neutral_zone",): {"facet_contact": 4.0},
            ("facet_contact",): {"neutral_zone": 90.0, "nonlinear_stiffening": 130.0},
        }
    )
    result = ended(says, "neutral_zone", "facet_contact", settled=True)
    assert [one.name for one in result[1]] == ["neutral_zone", "facet_contact"]
    assert result[1][0].rivals[0].name == "nonlinear_stiffening"
    assert result[1][0].rivals[0].margin == pytest.approx(-40.0)


def test_a_single_one_replaces_two_by_a_clear_margin_only() -> None:
    """Beside none the third has 100, the two together 60 and 38: within the margin, a rival."""
    beside_none = {"neutral_zone": 60.0, "nonlinear_stiffening": 100.0}
    evidence = {
        (): beside_none,
        ("neutral_zone",): {"facet_contact": 38.0},
        ("facet_contact",): {"neutral_zone": 59.0, "nonlinear_stiffening": 40.0},
    }
    kept = ended(Says(evidence), "neutral_zone", "facet_contact")
    assert kept[1] is not None
    assert {one.rivals[0].name for one in kept[1]} == {"nonlinear_stiffening"}
    evidence[()] = beside_none | {"nonlinear_stiffening": 120.0}
    gone = ended(Says(evidence), "neutral_zone", "facet_contact")
    assert (gone[1], gone[0].names) == (None, ("nonlinear_stiffening",))


def test_where_the_rest_has_no_fit_rivals_are_unknown_and_the_base_stands_in_for_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Without facet contact the zone has no fit: nothing is tried in its place on the base."""
    place = "spinepipe.studies.discrepancy.search.search.in_place"
    monkeypatch.setattr(place, lambda fit, number: (80.0, 35.0))
    monkeypatch.setattr(Trials, "log_share", lambda self, form: -1.0)
    says = Says(
        {("facet_contact",): {"neutral_zone": 90.0}, (): {"nonlinear_stiffening": 500.0}},
        no_fit=[("neutral_zone",)],
    )
    result = ended(says, "neutral_zone", "facet_contact", settled=True)
    zone, contact = result[1]
    assert zone.rivals_known
    assert not contact.rivals_known
    assert (contact.log_evidence, contact.gain) == (34.0, 80.0)


def a_refit(name: str, log_evidence: float, unknowns: int) -> Refit:
    return cast(Refit, SimpleNamespace(name=name, log_evidence=log_evidence, unknowns=unknowns))


@sweep("behind, first", [(1.0, 1), (2.9, 1), (3.0, 3), (3.1, 3)])
def test_a_plain_form_hardly_behind_stands_first(behind: float, first: int) -> None:
    """Equal values predict a specimen that nobody measured; values of its own do not."""
    found = [
        a_refit("creep", 40.0, 3),
        a_refit("creep", 40.0 - behind, 1),
        a_refit("hysteresis", 39.5, 1),
    ]
    ranked = rank_refits(found)
    assert (ranked[0].name, ranked[0].unknowns) == ("creep", first)
    assert sorted(one.log_evidence for one in ranked) == sorted(o.log_evidence for o in found)
