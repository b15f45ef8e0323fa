"""The posterior over sets of effects, on worlds whose evidence is made up.

A world says what a look shows beside a set, what a fit of a set comes to, and what stays there.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from sweeps import sweep

from spinepipe.effects import PlaceSpread
from spinepipe.progress import Progress
from spinepipe.studies.discrepancy.search import posterior as posteriors
from spinepipe.studies.discrepancy.search import search as searches
from spinepipe.studies.discrepancy.search.hypothesis import (
    ActiveTerm,
    CandidateForm,
    Trials,
    Variant,
)
from spinepipe.studies.discrepancy.search.posterior import Posterior
from spinepipe.studies.discrepancy.search.refit import Refit
from spinepipe.studies.discrepancy.search.screen import Screen, Screened, ScreenedVariant
from spinepipe.studies.discrepancy.search.search_state import ELSE, PRIOR, Rules, SearchResult
from spinepipe.units import COORDINATES

Forms = frozenset[CandidateForm]

EXTENSION, BENDING = "extension", "right_bending"


def form(name: str, on: str = EXTENSION, spread: PlaceSpread = PlaceSpread.SHARED) -> CandidateForm:
    return CandidateForm(Variant(name, (("coordinate", on),)), spread)


ZONE, STOP, LOOP, STIFF = map(
    form, ("neutral_zone", "facet_contact", "hysteresis", "nonlinear_stiffening")
)
ZONE_BENDING = form("neutral_zone", BENDING)
TABLE = CandidateForm(
    Variant("tabulated_law", (("coordinate", EXTENSION), ("over", "itself"))), PlaceSpread.SHARED
)
TABLES = tuple(
    CandidateForm(Variant("tabulated_law", (("coordinate", c),)), PlaceSpread.SHARED)
    for c in COORDINATES
)


@dataclass(frozen=True, eq=False)
class Stands:
    """A fit, or where it stands: by the forms of its effects, in their order."""

    forms: tuple[CandidateForm, ...]
    chi2: float
    usable: bool = True
    x: Any = field(default_factory=lambda: np.zeros(0))
    poses: None = None
    setting: None = None

    @property
    def fit(self) -> "Stands":
        return self

    @property
    def hypothesis(self) -> Any:
        supposed = [ActiveTerm(one, one.variant.off(_none(one))) for one in self.forms]
        return SimpleNamespace(supposed=supposed, unknowns=())

    @property
    def residuals(self) -> Mapping[str, Any]:
        return {"a": np.array([np.sqrt(self.chi2)])}

    def at(self, fit: "Stands") -> "Stands":
        return fit

    def suppose(self, supposed: Sequence[ActiveTerm]) -> tuple[CandidateForm, ...]:
        return tuple(one.form for one in supposed)


def _none(one: CandidateForm) -> tuple[float, ...]:
    return (0.0,) * len(one.variant.shapes)


@dataclass
class World:
    """What is asked of it is kept in ``asked``; it is a runner of pieces.

    Attributes
    ----------
    effects : forms by the name of their effect. fits : log evidence of a set, forms' shares not in
        it; of others minus infinity. looks : what a form shows beside a set, without its share; as
        much as its fit has over the fit of that set, where it is not said.
    stays : log evidence of the generic basis beside a set. family : what of it has most.
    """

    effects: Sequence[Sequence[CandidateForm]]
    fits: Callable[[Forms], float]
    looks: Callable[[Forms, CandidateForm], float] | None = None
    stays: Callable[[Forms], float] = lambda forms: -5.0
    family: str = "neighbour"
    asked: list[tuple[str, Forms]] = field(default_factory=list)

    @property
    def trials(self) -> tuple[Trials, ...]:
        return tuple(_trials(forms) for forms in self.effects)

    def evidence(self, forms: Forms) -> float:
        return self.fits(forms) if forms else 0.0

    def chi2(self, forms: Forms) -> float:
        most = self.evidence(forms)
        return 5000.0 - 2.0 * (most if np.isfinite(most) else 0.0)

    def __call__(self, function: Any, /, *arguments: Any) -> Any:
        return getattr(self, function.__name__)(*arguments)

    def look(self, at: Stands, trials: Sequence[Trials]) -> Screen:
        there = frozenset(at.forms)
        self.asked.append(("look", there))
        found = []
        for trial in trials:
            tried = []
            for one in trial.forms:
                shown = (
                    self.looks(there, one)
                    if self.looks
                    else self.evidence(there | {one}) - self.evidence(there)
                )
                shown = shown if np.isfinite(shown) else -5.0
                n = len(one.variant.strengths)
                share = trial.log_share(one)
                estimate, columns = np.ones(n), one.variant.strengths
                tried.append(
                    ScreenedVariant(one, _none(one), columns, shown + share, estimate, 2.0 * shown)
                )
            tried.sort(key=lambda one: -one.log_evidence)
            found.append(Screened(trial.effect, tried[0].log_evidence, tuple(tried)))
        return Screen(tuple(found))

    def refit(
        self, base: Stands, beside: Stands, one: ActiveTerm, instead: CandidateForm | None
    ) -> Refit:
        forms = (*(other for other in beside.forms if other != instead), one.form)
        self.asked.append(("refit", frozenset(forms)))
        evidence = self.evidence(frozenset(forms))
        fit: Any = Stands(forms, self.chi2(frozenset(forms)), bool(np.isfinite(evidence)))
        return Refit(one.form, fit, evidence, beside.chi2 - fit.chi2)

    def joint_fit(self, forms: tuple[CandidateForm, ...], *_: Any) -> Stands:
        self.asked.append(("joint_fit", frozenset(forms)))
        return Stands(forms, self.chi2(frozenset(forms)))

    def lack_of_fit(self, at: Stands, *_: Any) -> Any:
        stays = self.stays(frozenset(at.forms))
        return SimpleNamespace(log_evidence=stays, of=at.forms, family=self.family)

    def fitted(self) -> list[Forms]:
        return [forms for what, forms in self.asked if what == "refit"]


def _trials(forms: Sequence[CandidateForm]) -> Trials:
    variants = tuple(dict.fromkeys(one.variant for one in forms))
    return Trials(forms[0].name, variants, tuple(forms))


def rules(world: World, **more: Any) -> Rules:
    given = {"most_effects": 3} | more
    return Rules(world.trials, (EXTENSION, BENDING), **given)


@pytest.fixture(autouse=True)
def made_up(monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """No table is tried unless a test says so; evidence and gaps are those of the world."""
    monkeypatch.setattr(posteriors, "formula_error", lambda at: 0.0)
    monkeypatch.setattr(searches, "whole_gap", lambda at, fit: None)
    monkeypatch.setattr(searches, "gaps_at", lambda at, fit: {})

    def tabled(*forms: CandidateForm) -> None:
        trials = _trials(forms) if forms else Trials("tabulated_law", (), ())
        monkeypatch.setattr(posteriors, "tables", lambda *_: trials)

    monkeypatch.setattr(
        Trials, "log_share", lambda self, one: -float(np.log(len(self.variants) or 1))
    )
    tabled(TABLE)
    return tabled


def explored(world: World, **more: Any) -> Posterior:
    base: Any = Stands((), world.chi2(frozenset()))
    found = Posterior(base, rules(world, **more))
    found.explore(world, Progress())  # type: ignore[arg-type]
    return found


def searched(world: World, monkeypatch: pytest.MonkeyPatch, **more: Any) -> SearchResult:
    monkeypatch.setattr(
        posteriors, "joint_log_evidence", lambda base, fit: world.evidence(frozenset(fit.forms))
    )
    base: Any = Stands((), world.chi2(frozenset()))
    return searches.search(base, rules(world, **more), world)  # type: ignore[arg-type]


def only(**evidence: float) -> Callable[[Forms], float]:
    """Evidence of single effects by name; of more together the sum, tables have none."""
    return lambda forms: sum(evidence.get(one.name, -5.0) for one in forms)


# Probabilities ------------------------------------------------------------------------------------


def test_one_strong_effect_of_three_by_bayes_rule(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every set's evidence is known, by fits or by looks, so the sum is that over all sets."""
    evidence = {"neutral_zone": 6.0, "facet_contact": 4.0, "hysteresis": -3.0}
    world = World([[ZONE], [STOP], [LOOP]], only(**evidence), stays=lambda _: -200.0)
    found = searched(world, monkeypatch)
    weights = {}
    for count in range(4):
        sets = list(combinations(evidence, count))
        for names in sets:
            total = sum(evidence[name] for name in names)
            weights[frozenset(names)] = PRIOR[count] / len(sets) * np.exp(total)
    # with a table, evidence -5
    beside = ELSE * np.exp(-5.0) / (1.0 - ELSE)
    whole = sum(weights.values()) * (1.0 + beside)
    told = {(names, other): p for names, other, p in found.sets}
    assert told[frozenset({"neutral_zone", "facet_contact"}), False] == pytest.approx(
        weights[frozenset({"neutral_zone", "facet_contact"})] / whole, rel=0.02
    )
    for name in evidence:
        expected = sum(w for names, w in weights.items() if name in names) / sum(weights.values())
        assert found.probabilities[name] == pytest.approx(expected, rel=0.02)
    assert found.probabilities["nothing"] == pytest.approx(weights[frozenset()] / whole, rel=0.02)
    assert found.probabilities["something_else"] == pytest.approx(beside / (1 + beside), rel=0.1)


@sweep("seed", range(8))
def test_probabilities_sum_to_one_and_little_is_open_or_the_limit_reached(seed: int) -> None:
    """Any evidence; fits that come to more than looks say, or to less, or to nothing."""
    rng = np.random.default_rng(seed)
    known: dict[Forms, float] = {}

    def fits(forms: Forms) -> float:
        if forms not in known:
            size = 20.0 * rng.normal() + 10.0 * len(forms)
            known[forms] = size if rng.random() < 0.9 else -np.inf
        return known[forms]

    world = World(
        [[ZONE, ZONE_BENDING], [STOP], [LOOP], [STIFF]],
        fits,
        looks=lambda *_: float(15.0 * rng.normal()),
        stays=lambda *_: float(5.0 * rng.normal()),
    )
    most = int(rng.integers(1, 24))
    found = explored(world, most_fits=most)
    odds = np.array(list(found.log_odds.values()))
    assert np.isfinite(odds).all()
    fitted = world.fitted()
    assert len(fitted) == len(set(fitted)) <= most
    assert len(found.fitted) == len(fitted) + 1
    assert found.unfitted < 0.05 or len(fitted) == most


def test_forms_of_one_effect_add_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two variants, each with half of the effect's probability, and equal evidence of seven."""

    def fits(forms: Forms) -> float:
        return -np.inf if {ZONE, ZONE_BENDING} <= forms else only(neutral_zone=7.0)(forms)

    world = World([[ZONE, ZONE_BENDING], [STOP]], fits, stays=lambda _: -200.0)
    found = explored(world)
    assert {frozenset({ZONE}), frozenset({ZONE_BENDING})} <= set(world.fitted())
    odds = found.log_odds
    names: frozenset[str] = frozenset({"neutral_zone"})
    expected = np.log(PRIOR[1] / 2.0) + 7.0 - np.log(PRIOR[0])  # of two effects
    assert odds[names, False] - odds[frozenset(), False] == pytest.approx(expected, abs=0.01)


def test_without_evidence_nothing_is_missing_and_nothing_fitted(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    world = World([[ZONE], [STOP]], only(neutral_zone=1.9, facet_contact=-1.0))
    found = searched(world, monkeypatch)
    assert world.fitted() == []
    assert (found.standing, found.unfitted) == ((), 0.0)
    assert found.probabilities["nothing"] > 0.05
    assert found.final is found.base


def test_what_has_no_fit_has_no_probability_whatever_its_look(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def fits(forms: Forms) -> float:
        return -np.inf if ZONE in forms else only(facet_contact=20.0)(forms)

    world = World([[ZONE], [STOP]], fits, looks=lambda there, one: 60.0 if one == ZONE else 15.0)
    found = searched(world, monkeypatch)
    assert found.probabilities["neutral_zone"] == 0.0
    assert [one.name for one in found.standing] == ["facet_contact"]


@sweep("look, fit, expected", [(4.0, -3.0, 4.0), (4.0, 6.0, 6.0)])
def test_something_else_counts_by_its_table_or_by_the_look(
    look: float, fit: float, expected: float
) -> None:
    """Where the basis sees more than the table, by that; never by both."""
    found = explored(World([[ZONE]], only(tabulated_law=fit), stays=lambda _: look))
    odds = found.log_odds
    none: frozenset[str] = frozenset()
    more = odds[none, True] - odds[none, False] - np.log(ELSE / (1.0 - ELSE))
    assert more == pytest.approx(expected, abs=0.01)


@pytest.mark.parametrize(("family", "expected"), [("own", 2.0), ("neighbour", 12.0)])
def test_a_table_that_was_fitted_says_what_a_table_can(family: str, expected: float) -> None:
    """Joints with slack in two directions were called wrong in one: beside both laws the basis saw
    more of a motion's own load, and the table that was fitted there was worth nothing.
    """
    world = World(
        [[ZONE]],
        only(tabulated_law=2.0),
        looks=lambda there, one: 10.0 if one.name == TABLE.name and not there else -5.0,
        stays=lambda forms: 12.0,
        family=family,
    )
    odds = explored(world).log_odds
    none: frozenset[str] = frozenset()
    more = odds[none, True] - odds[none, False] - np.log(ELSE / (1.0 - ELSE))
    assert more == pytest.approx(expected, abs=0.1)


# Where fits go ------------------------------------------------------------------------------------


def test_fits_go_where_most_may_be_and_the_rest_is_told_as_open() -> None:
    """One is fitted, then no more may be. What is open is the second in the place of the first,
    behind by 1 and by as much as a look may be off.
    """
    names = {"neutral_zone": 20.0, "facet_contact": 19.0 - 20.0 * posteriors.SLACK}
    world = World(
        [[ZONE], [STOP], [LOOP]],
        lambda forms: max(only(**names)(frozenset({one})) for one in forms),
        looks=lambda there, one: names.get(one.name, -5.0) if not there else -5.0,
    )
    found = explored(world, most_fits=1)
    assert world.fitted() == [frozenset({ZONE})]
    assert found.open == pytest.approx(np.exp(-1.0) / (1.0 + np.exp(-1.0)), rel=0.02)
    behind = np.exp(-1.0 - 20.0 * posteriors.SLACK)  # as the look has it
    assert found.unfitted == pytest.approx(behind / (1.0 + behind), rel=0.02)
    assert explored(world).open < 0.05


@sweep("most, until, ended", [(10, None, "done"), (1, None, "fits"), (10, 0.0, "minutes")])
def test_a_search_says_what_ended_it_and_what_it_left(
    most: int, until: float | None, ended: str
) -> None:
    """The clock began long ago: nothing is fitted, and the likeliest by its look is told first."""
    world = World([[ZONE], [STOP]], only(neutral_zone=50.0, facet_contact=40.0))
    base: Any = Stands((), world.chi2(frozenset()))
    found = Posterior(base, rules(world, most_fits=most))
    found.explore(world, Progress(), until)  # type: ignore[arg-type]
    told = found.extent
    assert (told.ended, told.fits) == (ended, len(world.fitted()))
    assert told.open == found.open
    first = {"done": (), "fits": (("facet_contact", "neutral_zone"),), "minutes": ("neutral_zone",)}
    assert told.not_fitted[:1] == (first[ended] if ended != "minutes" else (first[ended],))
    assert (told.open < 0.05) is (ended == "done")


def test_the_limit_of_fits_is_kept() -> None:
    world = World([[ZONE], [STOP], [LOOP], [STIFF]], only(neutral_zone=50.0, hysteresis=40.0))
    explored(world, most_fits=0)
    assert world.fitted() == []
    explored(world, most_fits=2)
    assert len(world.fitted()) == 2


def test_a_pair_is_fitted_beside_the_first_and_both_stand(monkeypatch: pytest.MonkeyPatch) -> None:
    world = World([[ZONE], [STOP], [LOOP]], only(neutral_zone=80.0, hysteresis=30.0))
    found = searched(world, monkeypatch)
    assert {one.name for one in found.standing} == {"neutral_zone", "hysteresis"}
    assert min(found.probabilities[one.name] for one in found.standing) > 0.95
    # the loop alone was never fitted: what the zone has is over the base
    told = {one.name: (one.log_evidence, one.gain) for one in found.standing}
    assert told["hysteresis"] == pytest.approx((30.0, 60.0))
    assert told["neutral_zone"] == pytest.approx((110.0, 220.0))


def test_beside_what_is_far_behind_nothing_is_looked_for() -> None:
    """The stop is fitted too, as it may have come to more than its look says."""
    world = World(
        [[ZONE], [STOP]],
        lambda forms: 90.0 if ZONE in forms else 70.0 if STOP in forms else -5.0,
        looks=lambda there, one: -5.0 if there else {ZONE: 90.0, STOP: 85.0}.get(one, -5.0),
    )
    explored(world)
    assert world.fitted() == [frozenset({ZONE}), frozenset({STOP})]
    assert ("look", frozenset({ZONE})) in world.asked
    assert ("look", frozenset({STOP})) not in world.asked


@sweep("most", [1, 2, 3])
def test_no_more_effects_than_are_allowed(most: int) -> None:
    names = dict.fromkeys(
        ("neutral_zone", "facet_contact", "hysteresis", "nonlinear_stiffening"), 40.0
    )
    world = World([[ZONE, ZONE_BENDING], [STOP], [LOOP], [STIFF]], only(**names))
    found = explored(world, most_effects=most)
    sets = [*found.fitted, *found.seen]
    assert max(len(posteriors.names_of(forms)) for forms in sets) == most
    assert any({ZONE, ZONE_BENDING} <= forms for forms in sets)  # one effect, two coordinates


def test_no_variant_stands_twice_nor_more_tables_than_three(made_up: Callable[..., None]) -> None:
    made_up(*TABLES)
    each = replace(ZONE, spread=PlaceSpread.EACH)
    world = World([[ZONE, each]], only(tabulated_law=40.0, neutral_zone=30.0))
    found = explored(world)
    sets = [[one.variant for one in forms] for forms in (*found.fitted, *found.seen)]
    assert max(sum(one.effect == "tabulated_law" for one in of) for of in sets) == 3
    assert all(len(set(of)) == len(of) for of in sets)


def test_another_in_the_place_of_a_first_is_fitted_beside_the_rest() -> None:
    """What leads for lack of the loop is none beside it: the stop takes the zone's place there."""

    def fits(forms: Forms) -> float:
        both = {frozenset({ZONE, LOOP}): 70.0, frozenset({STOP, LOOP}): 90.0}
        return both.get(forms, 40.0 if ZONE in forms else 39.0 if STOP in forms else -5.0)

    shown = {ZONE: 40.0, STOP: 39.0, LOOP: 1.0}
    world = World(
        [[ZONE], [STOP], [LOOP]],
        fits,
        looks=lambda there, one: (
            shown.get(one, -5.0) if not there else 30.0 if (ZONE in there) and one == LOOP else -5.0
        ),
    )
    found = explored(world)
    assert frozenset({STOP, LOOP}) in world.fitted()
    likeliest = max(found.fitted.values(), key=found.log_odds_of)
    assert likeliest.forms == {STOP, LOOP}
    assert set(likeliest.entered) == {STOP, LOOP}


# What stands --------------------------------------------------------------------------------------


def test_a_table_takes_no_evidence_from_the_name_that_stands(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The table is fitted first and comes near; the name's evidence is over the base even so."""

    def fits(forms: Forms) -> float:
        return 50.0 if ZONE in forms else 49.0

    looks = {TABLE: 55.0, ZONE: 45.0}
    world = World([[ZONE]], fits, looks=lambda there, one: -5.0 if there else looks[one])
    found = searched(world, monkeypatch)
    assert frozenset({TABLE}) in world.fitted()
    (one,) = found.standing
    assert (one.log_evidence, one.gain) == pytest.approx((50.0, 100.0))


def test_a_table_that_entered_first_leaves_the_model_of_the_name(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The zone shows beside the table alone; its own model is fitted without."""
    evidence = {frozenset({TABLE}): 50.0, frozenset({TABLE, ZONE}): 100.0, frozenset({ZONE}): 45.0}
    world = World([[ZONE]], lambda forms: evidence.get(forms, -np.inf))
    world.looks = lambda there, one: (
        50.0 if (TABLE in there) != (one == TABLE) and one not in there else -5.0
    )
    found = searched(world, monkeypatch)
    assert world.asked[-1] == ("joint_fit", frozenset({ZONE}))
    assert [one.name for one in found.standing] == ["neutral_zone"]
    assert found.with_tables is not None
    assert set(found.with_tables.forms) == {TABLE, ZONE}  # type: ignore[attr-defined]
    assert found.lack.of == (ZONE,)  # type: ignore[attr-defined]


def test_names_stand_by_their_sum_with_and_without_something_else(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The stop alone is likeliest of all sets, but the zone is, with a table or without."""

    def fits(forms: Forms) -> float:
        if STOP in forms:
            return 40.0 if forms == frozenset({STOP}) else -np.inf
        if ZONE in forms:
            return 41.6 if TABLE in forms else 39.9
        return -5.0

    world = World([[ZONE], [STOP]], fits, looks=lambda there, one: 40.0 if not there else 30.0)
    found = searched(world, monkeypatch)
    best, _, _ = found.sets[0]
    assert best == {"facet_contact"}
    assert [one.name for one in found.standing] == ["neutral_zone"]


def test_rivals_are_others_in_the_place_of_a_name(monkeypatch: pytest.MonkeyPatch) -> None:
    """The zone stands beside the loop, so it is none of its rivals; the stop might stand there."""

    def fits(forms: Forms) -> float:
        both = 80.0 * (ZONE in forms) + 30.0 * (LOOP in forms) + 26.0 * (STOP in forms)
        return both - 40.0 * ({LOOP, STOP} <= forms) - 5.0 * (TABLE in forms)

    found = searched(World([[ZONE], [STOP], [LOOP]], fits), monkeypatch)
    of = {one.name: one for one in found.standing}
    assert set(of) == {"neutral_zone", "hysteresis"}
    (rival,) = of["hysteresis"].rivals
    assert (rival.name, rival.on) == ("facet_contact", (EXTENSION,))
    assert rival.margin == pytest.approx(4.0, abs=0.3)
    assert [one.name for one in of["neutral_zone"].rivals] == ["facet_contact"]


def test_the_order_of_trials_changes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Equal evidence of all, so that only an order could decide between them."""
    names = ("neutral_zone", "facet_contact", "hysteresis")
    effects = [[ZONE, ZONE_BENDING], [STOP], [LOOP]]

    def fits(forms: Forms) -> float:
        return 12.0 + 6.0 * len(forms) - 5.0 * (TABLE in forms)

    found = [searched(World(order, fits), monkeypatch) for order in (effects, effects[::-1])]
    first, other = found
    assert [one.supposed.form for one in first.standing] == [
        one.supposed.form for one in other.standing
    ]
    for name in (*names, "nothing", "something_else"):
        assert first.probabilities[name] == pytest.approx(other.probabilities[name], rel=1e-9)
    assert [one.beside for one in first.stages] == [one.beside for one in other.stages]
    assert first.unfitted == pytest.approx(other.unfitted, abs=1e-12)
