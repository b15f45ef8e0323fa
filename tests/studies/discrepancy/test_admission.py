"""Which effects enter a search, when it ends, and what an inquiry keeps, by evidence made up."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from sweeps import sweep

from spinepipe.effects import PlaceSpread
from spinepipe.progress import Progress
from spinepipe.studies.discrepancy.search import search as searches
from spinepipe.studies.discrepancy.search import search_state as inquiries
from spinepipe.studies.discrepancy.search.gaps import Gap
from spinepipe.studies.discrepancy.search.hypothesis import ActiveTerm, CandidateForm, Variant
from spinepipe.studies.discrepancy.search.refit import Refit
from spinepipe.studies.discrepancy.search.screen import Screen, Screened
from spinepipe.studies.discrepancy.search.search_state import Rules, SearchStage, SearchState

NEEDED = 5.0
READ = ("extension", "right_bending")
EXCESS = 1000.0
"""Chi2 above the noise in extension; none in bending."""

BASE_AT = {"extension": Gap(EXCESS + 50.0, 50.0, 50), "right_bending": Gap(50.0, 50.0, 50)}


@dataclass(frozen=True)
class At:
    """Grounds by the names of the effects that stand there."""

    names: tuple[str, ...]

    @property
    def fit(self) -> Any:
        supposed = [SimpleNamespace(form=form(name)) for name in self.names]
        return SimpleNamespace(hypothesis=SimpleNamespace(supposed=supposed), names=self.names)

    def at(self, fit: Any) -> "At":
        return At(fit.names)


def form(name: str, coordinate: str = "extension") -> CandidateForm:
    return CandidateForm(Variant(name, (("coordinate", coordinate),)), PlaceSpread.SHARED)


def refitted(name: str, log_evidence: float, gain: float, coordinate: str = "extension") -> Refit:
    return Refit(form(name, coordinate), SimpleNamespace(), log_evidence, gain)  # type: ignore[arg-type]


def rules(most_effects: int = 3) -> Rules:
    return Rules((), READ, 0.02, 50, 3.0, most_effects, 4)


def admitted(there: Sequence[str], *tried: Refit, most_effects: int = 3) -> str | None:
    stage = SearchStage("1", Screen((), NEEDED, 50), tried, False)
    inquiry: Any = SimpleNamespace(rules=rules(most_effects))
    current: Any = At(tuple(there))
    found = searches._admitted(current, stage, inquiry, BASE_AT)
    return found and found.name


# What enters


def test_an_effect_enters_where_its_evidence_is_above_the_threshold() -> None:
    assert admitted([], refitted("a", NEEDED + 0.01, 0.0)) == "a"
    assert admitted([], refitted("a", NEEDED, 900.0)) is None
    assert admitted([], refitted("a", np.nan, 900.0)) is None
    assert admitted([], refitted("a", 4.0, 1.0), refitted("b", 6.0, 1.0)) == "b"
    assert admitted([], refitted("a", 7.0, 1.0), refitted("b", 6.0, 1.0)) == "a"


def test_a_further_effect_must_close_a_hundredth_of_what_the_base_misses_there() -> None:
    share = 0.01 * EXCESS
    assert admitted(["a"], refitted("b", 9.0, share)) == "b"
    assert admitted(["a"], refitted("b", 9.0, share - 0.01)) is None
    assert admitted([], refitted("b", 9.0, share - 0.01)) == "b"  # the first need not
    assert admitted(["a"], refitted("b", 9.0, 0.0, "right_bending")) == "b"  # nothing to close


def test_no_more_effects_enter_than_are_allowed_but_more_forms_of_one_do() -> None:
    one = refitted("c", 9.0, 500.0)
    assert admitted(["a", "b"], one, most_effects=3) == "c"
    assert admitted(["a", "b"], one, most_effects=2) is None
    assert admitted(["a", "c"], one, most_effects=2) == "c"


# When it is hopeless


@sweep("number, times", [(0, 4.0), (1, 2.5), (2, 1.5), (3, 1.5), (9, 1.5)])
def test_a_search_is_hopeless_where_the_generic_basis_has_that_many_times_the_evidence(
    number: int, times: float
) -> None:
    """On the coordinates that the effect loads; over all, where it loads all."""
    for share, hopeless in ((0.999, False), (1.001, True)):
        evidence = share * times * 10.0
        at = {name: SimpleNamespace(log_evidence=0.0) for name in READ}
        at["extension"] = SimpleNamespace(log_evidence=evidence)
        own: Any = SimpleNamespace(log_evidence=900.0, at=at)
        best = refitted("a", 10.0, 0.0)
        assert searches._outside_library(best, number, own, rules()) is hopeless
        everywhere = replace(
            best, form=CandidateForm(Variant("load_offset", ()), PlaceSpread.SHARED)
        )
        whole: Any = SimpleNamespace(log_evidence=evidence, at=dict.fromkeys((), at["extension"]))
        assert searches._outside_library(everywhere, number, whole, rules()) is hopeless


class Enters:
    """An inquiry in which the named effects would enter one after the other."""

    def __init__(self, *names: str, lack: float = 0.0) -> None:
        self.names, self.rules, self.looked = list(names), rules(9), list[tuple[str, ...]]()
        self.of_lack = lack

    def stage(self, current: At) -> SearchStage:
        self.looked.append(current.names)
        tried = ()
        if self.names:
            one = refitted(self.names.pop(0), 10.0, EXCESS)
            fit: Any = SimpleNamespace(names=(*current.names, one.name))
            tried = (replace(one, fit=fit),)
        return SearchStage("", Screen((), NEEDED, 1), tried, False)

    def lack(self, current: At) -> Any:
        one = SimpleNamespace(log_evidence=self.of_lack)
        return SimpleNamespace(log_evidence=0.0, at=dict.fromkeys(READ, one))


def forward(inquiry: Enters, *there: str) -> tuple[str, ...]:
    ended: Any = searches._forward(At(there), inquiry, BASE_AT)  # type: ignore[arg-type]
    found: tuple[str, ...] = ended.names
    return found


def test_effects_enter_until_none_does_or_four_forms_stand() -> None:
    assert forward(Enters("a", "b")) == ("a", "b")
    inquiry = Enters(*"abcdef")
    assert forward(inquiry) == tuple("abcd")
    assert inquiry.looked == [(), ("a",), ("a", "b"), ("a", "b", "c")]
    assert forward(Enters("b"), *"wxyz") == tuple("wxyz")


def test_none_enters_any_more_where_it_is_hopeless() -> None:
    """Evidence of 30: less than four times ten, more than two and a half times."""
    assert forward(Enters("a", "b", lack=30.0)) == ("a",)
    assert forward(Enters("a", "b", lack=41.0)) == ()


def test_what_takes_turns_is_settled_in_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    """Six changes at most; then what stands is asked for as it is."""
    asked: list[bool] = []

    def examine(current: Any, inquiry: Any, settled: bool = False) -> Any:
        asked.append(settled)
        return At(("given way",)), ("last",) if settled else None

    monkeypatch.setattr(searches, "examine", examine)
    inquiry: Any = Enters()
    current, stood = searches._settled(At(("a",)), inquiry, BASE_AT)  # type: ignore[arg-type]
    assert asked == [False] * 6 + [True]
    assert (current, stood) == (At(("given way",)), ("last",))
    monkeypatch.setattr(searches, "examine", lambda *_: (None, ("at once",)))
    current, stood = searches._settled(At(("a",)), inquiry, BASE_AT)  # type: ignore[arg-type]
    assert (current, stood) == (At(("a",)), ("at once",))


# An inquiry


class Runs:
    """Keeps what is asked for; looks have the evidence that is given, beside the effects named."""

    def __init__(self, evidence: float, usable: Sequence[bool] = ()) -> None:
        self.evidence, self.asked, self.usable = evidence, list[Any](), list(usable)

    def __call__(self, function: Any, /, *args: Any) -> Any:
        self.asked.append((function.__name__, *args))
        if function is inquiries.look:
            best = Screened("a", self.evidence, np.zeros(1), ())
            return Screen((best, Screened("b", 0.0, np.zeros(1), ())), NEEDED, 50)
        if function is inquiries.joint_fit:
            return SimpleNamespace(usable=self.usable.pop(0), asked=args)
        return SimpleNamespace(of=args)


def inquiry(runs: Runs, monkeypatch: pytest.MonkeyPatch) -> SearchState:
    monkeypatch.setattr(inquiries, "refits", lambda *_: ("refitted",))
    base: Any = At(())
    return SearchState(base, rules(), runs, Progress())


@pytest.mark.parametrize(
    ("evidence", "tried"), [(NEEDED, ()), (NEEDED + 0.1, ("refitted",)), (np.nan, ("refitted",))]
)
def test_what_leads_is_refitted_where_it_is_evident(
    evidence: float, tried: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = inquiry(Runs(evidence), monkeypatch)
    stage = asked.stage(asked.base)
    assert (stage.name, stage.refits, stage.in_place, stage.beside) == ("1", tried, False, ())


def test_in_the_place_of_an_effect_all_are_refitted(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = inquiry(Runs(0.0), monkeypatch)
    asked.stage(asked.base)
    at: Any = At(("x", "y"))
    stage = asked.stage(at, "z")
    assert (stage.name, stage.refits) == ("in place of z (1)", ("refitted",))
    assert (stage.in_place, stage.beside) == (True, ("x", "y"))


def test_stages_are_counted_by_kind_and_the_null_is_drawn_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """In place of an effect beside none, it is the first look over again."""
    runs = Runs(9.0)
    asked = inquiry(runs, monkeypatch)
    at: Any = At(("x",))
    names = [asked.stage(*one).name for one in ((asked.base,), (at,), (at, "x"), (at,), (at, "y"))]
    assert names == ["1", "2", "in place of x (1)", "3", "in place of y (2)"]
    looks = [one for one in runs.asked if one[0] == "look"]
    assert [one[3:] for one in looks] == [
        (50, 0.02, 4, None),
        *[(50, 0.02, 4, NEEDED)] * 4,
    ]
    again = asked.stage(asked.base, "x")
    assert len(runs.asked) == len(looks)  # not looked again
    assert again.screen is asked.first.screen
    assert again.refits is asked.first.refits
    assert (again.name, asked.stages[-1]) == ("in place of x (3)", again)


def test_the_generic_basis_beside_the_base_is_asked_for_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    runs = Runs(9.0)
    asked = inquiry(runs, monkeypatch)
    assert asked.lack(asked.base) is asked.lack(asked.base)
    at: Any = At(("x",))
    assert asked.lack(at) is not asked.lack(at)
    assert [one[0] for one in runs.asked] == ["lack_of_fit"] * 3
    assert runs.asked[0][2:] == (READ, 50, 4)


@pytest.mark.parametrize("failures", range(6))
def test_effects_alone_are_looked_for_ever_further_from_where_all_stand(
    failures: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Near all, from the neutral pose, then beside the base alone, ever closer to off."""
    runs = Runs(0.0, [False] * failures + [True] * (failures < 5))
    asked = inquiry(runs, monkeypatch)
    ratio = Variant("level_dependence", (("coordinate", "extension"),))
    one = ActiveTerm(CandidateForm(ratio, PlaceSpread.SHARED), np.array([16.0]))

    def suppose(self: Any, supposed: tuple[ActiveTerm, ...]) -> Any:
        (only,) = supposed
        return self.where, float(only.start[0])

    base: Any = SimpleNamespace(where="base", setting="setting", at=lambda fit: fit)
    base.suppose = lambda supposed: suppose(base, supposed)
    current: Any = SimpleNamespace(where="all", fit=SimpleNamespace(poses="near"))
    current.suppose = lambda supposed: suppose(current, supposed)
    asked.base = base
    found = asked.beside(current, (one,))
    starts = [
        (("all", 16.0), "setting", "near"),
        (("all", 16.0), "setting", None),
        (("base", 16.0), "setting", None),
        (("base", 4.0), "setting", None),
        (("base", pytest.approx(16.0**0.2)), "setting", None),
    ]
    assert [one[1:] for one in runs.asked] == starts[: failures + 1]
    assert (found is None) is (failures == 5)
    assert asked.beside(current, ()) is base
