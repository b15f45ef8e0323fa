"""The verdict read off the probabilities of a search: each verdict, each reason, each limit."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from sweeps import sweep

from spinepipe.effects import PlaceSpread, Wrench
from spinepipe.effects.registry import registered
from spinepipe.model import LoadCase, LoadStep
from spinepipe.studies.discrepancy.proof.held_out import TEST, FoldRow, HeldOut
from spinepipe.studies.discrepancy.search import outcome as outcomes
from spinepipe.studies.discrepancy.search.baseline import BaselineFit
from spinepipe.studies.discrepancy.search.gaps import Gap
from spinepipe.studies.discrepancy.search.hypothesis import ActiveTerm, CandidateForm, Variant
from spinepipe.studies.discrepancy.search.lack_of_fit import LackOfFit
from spinepipe.studies.discrepancy.search.outcome import Outcome, cannot_be_excluded, outcome
from spinepipe.studies.discrepancy.search.search_state import Rival, SearchResult, SelectedTerm
from spinepipe.studies.discrepancy.summary import _in_set
from spinepipe.studies.discrepancy.verdict import Candidate, SuspectedError, VerdictKind
from spinepipe.studies.discrepancy.verdict_unnamed import Reason

SHAPE = "load over the joint's own extension, shared"
PLACES = {
    "creep": "extension",
    "hysteresis": "extension",
    "neutral_zone": "right_bending",
    "load_offset": None,
    "bending_rotation_coupling": ("right_bending", "left_rotation"),
}
"""What each effect of these tests loads; None where it names no coordinate."""

Sets = Mapping[tuple[str, ...], float]


def form(name: str, on: str | tuple[str, ...] | None) -> CandidateForm:
    options = (("coordinate" if isinstance(on, str) else "pair", on),) if on else ()
    return CandidateForm(Variant(name, options), PlaceSpread.SHARED)


@pytest.fixture(autouse=True)
def gap_of_tables(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(outcomes, "whole_gap", lambda at, fit: Gap(400.0 * at.rms**2, 400.0, 400))


def ended(
    sets: Sets,
    beside_else: Sets | None = None,
    lack: str = "extension",
    tables: Sequence[str] = (),
    rms: float = 1.0,
    rms_of_tables: float = 1.0,
    alone: float = 0.5,
    unfitted: float = 0.0,
) -> SearchResult:
    """A search that gives these sets of names these probabilities, without and with else.

    What stands are the names of the likeliest set. Something else is looked at in the coordinate
    ``lack``, and fitted as ``tables`` on theirs; ``rms`` noise SD stay without and with these, and
    names explain a share ``alone`` of what they do together.
    """
    every = [(frozenset(names), False, p) for names, p in sets.items()]
    every += [(frozenset(names), True, p) for names, p in (beside_else or {}).items()]
    assert sum(p for *_, p in every) == pytest.approx(1.0)
    every.sort(key=lambda one: -one[2])
    of = {name: sum(p for names, _, p in every if name in names) for name in PLACES}
    of["something_else"] = sum(p for _, other, p in every if other)
    of["nothing"] = sum(p for names, other, p in every if not names and not other)
    standing = tuple(
        SelectedTerm(ActiveTerm(form(name, PLACES[name]), np.zeros(1)), of[name], 40.0, 90.0, ())
        for name in sorted(every[0][0])
    )
    tabled = [SimpleNamespace(form=form("tabulated_law", place)) for place in tables]
    tabled += [one.supposed for one in standing]
    fit = SimpleNamespace(hypothesis=SimpleNamespace(supposed=tabled), chi2=0.0)
    with_tables = SimpleNamespace(fit=fit, rms=rms_of_tables)
    base, final = (SimpleNamespace(fit=SimpleNamespace(chi2=c)) for c in (1e3, 1e3 * (1.0 - alone)))
    gap = Gap(400.0 * rms**2, 400.0, 400)
    return SearchResult(
        base=cast(BaselineFit, base),
        final=cast(BaselineFit, final),
        standing=standing,
        stages=(),
        probabilities=of,
        sets=tuple(every),
        with_tables=cast(BaselineFit, with_tables) if tables else None,
        lack=cast(LackOfFit, SimpleNamespace(shape=SHAPE, coordinate=lack)),
        unfitted=unfitted,
        base_gap=gap,
        final_gap=gap,
        base_at={},
        final_at={},
    )


SURE = ended({("creep",): 0.97, ("hysteresis",): 0.03})
NULL: Sets = {(): 0.9, ("creep",): 0.1}
ERROR = SuspectedError("specimen b, L3L4", "sign flipped", "slope -1")


def proof(over_base: float | None) -> HeldOut:
    if over_base is None:
        return HeldOut((FoldRow("a", TEST, 10, None, None),))
    return HeldOut((FoldRow("a", TEST, 10, Gap(50.0, 10.0, 10), Gap(50.0 - over_base, 10.0, 10)),))


def names(result: Outcome) -> list[str]:
    return [one.name for one in result.named]


def assert_unknown(result: Outcome, reason: Reason, *words: str) -> None:
    assert (result.verdict, result.reason) == (VerdictKind.UNKNOWN, reason)
    assert (result.named, result.tied, result.left) == ((), (), ())
    for word in words:
        assert word in result.why


# Data errors, nothing, and a model of another shape


@sweep("found", [SURE, ended(NULL), ended({(): 0.04}, {(): 0.96}, rms=9.0)])
def test_data_that_look_wrong_come_before_everything(found: SearchResult) -> None:
    result = outcome(found, proof(-50.0), [ERROR])
    assert_unknown(result, Reason.DATA_ERRORS, "sign flipped (specimen b, L3L4)", "look wrong")


def test_of_many_errors_three_are_told() -> None:
    errors = [SuspectedError(f"specimen {name}", "units", "") for name in "abcd"]
    why = outcome(ended(NULL), None, errors).why
    assert [f"specimen {name}" in why for name in "abcd"] == [True, True, True, False]


@sweep("nothing, verdict", [(0.06, "NULL"), (0.04, "NAMED")])
def test_nothing_is_missing_unless_that_is_hardly_probable(nothing: float, verdict: str) -> None:
    """As sure as a name must be; what stands then is no matter, nor what it leaves."""
    result = outcome(ended({(): nothing, ("creep",): 1.0 - nothing}))
    assert (result.verdict.value, result.reason) == (verdict, None)
    if verdict == "NULL":
        assert (result.named, result.tied) == ((), ())
        assert f"{nothing:.2f}" in result.why


@sweep("rms, unknown", [(2.9, False), (3.1, True)])
def test_where_much_stays_nothing_is_certain(rms: float, unknown: bool) -> None:
    result = outcome(ended({("creep",): 1.0}, rms=rms))
    if unknown:
        assert_unknown(result, Reason.MOST_STAYS, "3.1 noise SD stay")
    else:
        assert names(result) == ["creep"]


@sweep("other, stays", [(0.4, True), (0.6, False)])
def test_what_something_else_explains_does_not_stay(other: float, stays: bool) -> None:
    """If it is likelier there than not: else the model stands without it."""
    sets: Sets = {("neutral_zone",): 1.0 - other}
    tables = ["extension"]
    found = ended(sets, {("neutral_zone",): other}, tables=tables, rms=9.0, rms_of_tables=1.1)
    result = outcome(found)
    if stays:
        assert_unknown(result, Reason.MOST_STAYS, "9.0 noise SD")
    else:
        assert result.verdict is VerdictKind.PART
    worse = ended({(): 0.02}, {(): 0.98}, tables=tables, rms=9.0, rms_of_tables=3.1)
    assert_unknown(outcome(worse), Reason.MOST_STAYS, "3.1 noise SD")


@sweep("unfitted, verdict", [(0.45, "NAMED"), (0.55, "SET")])
def test_while_much_rests_on_looks_alone_nothing_is_sure(unfitted: float, verdict: str) -> None:
    """There may yet be a rival among what was not fitted."""
    result = outcome(ended({("creep",): 0.97, ("hysteresis",): 0.03}, unfitted=unfitted))
    assert result.verdict.value == verdict
    assert names(result) == (["creep"] if verdict == "NAMED" else [])


# Something else


@sweep("found", [ended({(): 0.04, ("creep",): 0.2}, {(): 0.76}), ended({(): 0.03}, {(): 0.97})])
def test_something_else_has_no_name(found: SearchResult) -> None:
    assert_unknown(outcome(found), Reason.NO_KNOWN_EFFECT, SHAPE, "something else, with prob")


@sweep("other, verdict", [(0.49, "NAMED"), (0.51, "UNKNOWN")])
def test_something_else_on_the_same_coordinate_silences_a_name(other: float, verdict: str) -> None:
    """It may only mend what something else gets wrong."""
    found = ended({("creep",): 1.0 - other}, {("creep",): other})
    result = outcome(found)
    assert result.verdict.value == verdict
    if verdict == "UNKNOWN":
        assert_unknown(result, Reason.A_PART_STAYS, "creep would explain a part", f"{other:.2f}")


def test_something_else_on_another_coordinate_leaves_a_part() -> None:
    result = outcome(ended({("neutral_zone",): 0.3}, {("neutral_zone",): 0.7}))
    assert (result.verdict, names(result)) == (VerdictKind.PART, ["neutral_zone"])
    assert (result.reason, result.tied) == (None, ())
    (left,) = result.left
    assert SHAPE in left
    assert "neutral_zone (1.00); but more stays" in result.why


def test_of_two_names_the_one_apart_from_something_else_is_told() -> None:
    both = ("creep", "neutral_zone")
    result = outcome(ended({both: 0.3}, {both: 0.7}))
    assert (result.verdict, names(result)) == (VerdictKind.PART, ["neutral_zone"])


def test_where_something_else_was_fitted_its_tables_say_where() -> None:
    """The look sees it in extension, the fit in bending."""
    found = ended({("neutral_zone",): 0.3}, {("neutral_zone",): 0.7}, tables=["right_bending"])
    assert_unknown(outcome(found), Reason.A_PART_STAYS)
    both = ended({("creep",): 0.3}, {("creep",): 0.7}, tables=["right_bending", "anterior"])
    assert names(outcome(both)) == ["creep"]
    too = ended({("creep",): 0.3}, {("creep",): 0.7}, tables=["right_bending", "extension"])
    assert_unknown(outcome(too), Reason.A_PART_STAYS)


@sweep("alone, told", [(0.81, True), (0.79, False)])
def test_what_explains_most_by_itself_is_told_beside_something_else(
    alone: float, told: bool
) -> None:
    """Then its formula is not that of nature; a look alone does not say how much it explains."""
    sets, beside = {("creep",): 0.3}, {("creep",): 0.7}
    result = outcome(ended(sets, beside, tables=["extension"], alone=alone))
    assert result.verdict is (VerdictKind.PART if told else VerdictKind.UNKNOWN)
    assert_unknown(outcome(ended(sets, beside, alone=alone)), Reason.A_PART_STAYS)


def test_what_acts_on_no_coordinate_of_its_own_is_nowhere_apart() -> None:
    found = ended({("load_offset",): 0.3}, {("load_offset",): 0.7})
    assert_unknown(outcome(found), Reason.A_PART_STAYS)


def test_an_effect_on_two_coordinates_is_apart_where_else_is_on_one() -> None:
    pair = ("bending_rotation_coupling",)
    assert names(outcome(ended({pair: 0.3}, {pair: 0.7}, lack="right_bending"))) == list(pair)
    both = ["left_rotation", "right_bending"]
    assert_unknown(outcome(ended({pair: 0.3}, {pair: 0.7}, tables=both)), Reason.A_PART_STAYS)


def test_without_any_name_that_is_likely_there_is_no_known_effect() -> None:
    """Nothing is hardly probable, else not even; names share the rest, none of it most."""
    found = ended({(): 0.04, ("creep",): 0.25, ("hysteresis",): 0.22}, {(): 0.49})
    assert_unknown(outcome(found), Reason.NO_KNOWN_EFFECT)


# Names and sets


def test_a_sure_name_is_told_with_its_probability() -> None:
    result = outcome(SURE)
    assert (result.verdict, names(result)) == (VerdictKind.NAMED, ["creep"])
    assert (result.reason, result.tied, result.left) == (None, (), ())
    assert result.why == "creep (0.97)"
    two = outcome(ended({("creep", "neutral_zone"): 0.98, ("creep",): 0.02}))
    assert two.why == "creep (1.00) and neutral_zone (0.98)"


@sweep("p, verdict", [(0.949, "SET"), (0.951, "NAMED")])
def test_a_name_is_sure_from_nineteen_in_twenty(p: float, verdict: str) -> None:
    result = outcome(ended({("creep",): p, ("hysteresis",): 1.0 - p}))
    assert result.verdict.value == verdict
    if verdict == "SET":
        assert (names(result), result.tied) == ([], ("creep", "hysteresis"))
        assert result.why.endswith("cannot tell which: creep or hysteresis")


def test_a_set_of_one_name_tells_what_holds_the_rest() -> None:
    result = outcome(ended({("creep",): 0.92}, {(): 0.08}))
    assert (result.verdict, result.tied) == (VerdictKind.SET, ("creep",))
    assert result.why == "creep or something that is in no list (0.92; 0.08)"
    untried = outcome(ended({("creep",): 0.97, ("hysteresis",): 0.03}, unfitted=0.6))
    assert "what was not fitted holds 0.60" in untried.why


@sweep("least, told", [(0.021, True), (0.019, False)])
def test_a_set_lists_no_name_that_is_hardly_probable(least: float, told: bool) -> None:
    sets = {(): 0.04, ("hysteresis",): 0.86, ("creep",): 0.03, ("load_offset",): least}
    rare = {("neutral_zone",): 0.018, ("load_offset", "neutral_zone"): 0.017}
    result = outcome(ended(sets | rare | {("creep", "neutral_zone"): 0.035 - least}))
    expected = ("hysteresis", "creep", *(["load_offset"] if told else []))
    assert (result.verdict, result.tied) == (VerdictKind.SET, expected)


def test_a_set_ends_where_its_names_hold_nearly_all() -> None:
    """Of 0.97 that some name is missing the first two have 0.93: more than 19 in 20."""
    sets = {("creep",): 0.60, ("hysteresis",): 0.33, ("load_offset",): 0.04, (): 0.03}
    assert outcome(ended(sets)).tied == ("creep", "hysteresis")


def test_beside_a_tie_what_is_sure_is_named() -> None:
    """In every set, the zone is; with which of two, nobody can tell."""
    sets = {("creep", "neutral_zone"): 0.5, ("hysteresis", "neutral_zone"): 0.4}
    result = outcome(ended(sets | {("neutral_zone",): 0.1}))
    assert (result.verdict, names(result)) == (VerdictKind.SET, ["neutral_zone"])
    assert result.tied == ("creep", "hysteresis")


@sweep("alone, verdict", [(0.51, "NAMED"), (0.49, "SET")])
def test_further_names_are_told_where_it_is_likelier_that_there_is_one(
    alone: float, verdict: str
) -> None:
    """Spread over several, each less than sure."""
    more = {("creep", "neutral_zone"): 0.3, ("creep", "load_offset"): 0.7 - alone}
    found = ended({("creep",): alone} | more)
    result = outcome(found)
    assert (result.verdict.value, names(result)) == (verdict, ["creep"])


def test_two_that_are_missing_together_are_both_in_the_set() -> None:
    sets = {("creep", "neutral_zone"): 0.6, ("hysteresis",): 0.4}
    result = outcome(ended(sets))
    assert (names(result), result.tied) == ([], ("creep", "neutral_zone", "hysteresis"))


def test_what_was_not_recorded_excludes_no_rival() -> None:
    """Without times creep is never fitted: evidence for friction is none against creep."""
    friction = ended({("hysteresis", "neutral_zone"): 1.0})
    result = outcome(friction, not_excluded={"hysteresis": ("creep",), "neutral_zone": ()})
    assert (result.verdict, names(result)) == (VerdictKind.SET, ["neutral_zone"])
    assert result.tied == ("hysteresis", "creep")
    beside = ended({("creep", "hysteresis"): 1.0})
    named = outcome(beside, not_excluded={"hysteresis": ("creep",)})
    assert names(named) == ["creep", "hysteresis"]  # it is there as well


@sweep("over_base, verdict", [(None, "NAMED"), (12.0, "NAMED"), (0.0, "NAMED"), (-0.1, "UNKNOWN")])
def test_names_must_predict_what_was_held_out(over_base: float | None, verdict: str) -> None:
    """Where nothing that was scored hangs on the effects, it speaks neither for nor against."""
    result = outcome(SURE, proof(over_base))
    assert result.verdict.value == verdict
    if verdict == "UNKNOWN":
        assert_unknown(result, Reason.NOT_PROVEN, "creep would explain", "held-out")


def test_a_set_and_nothing_need_no_proof() -> None:
    assert outcome(ended(NULL), proof(-9.0)).verdict is VerdictKind.NULL
    tie = ended({("creep",): 0.6, ("hysteresis",): 0.4})
    assert outcome(tie, proof(-9.0)).verdict is VerdictKind.SET


# Where the names of a set act


def test_names_of_a_set_act_where_they_stand_or_are_nearest() -> None:
    """Creep is named beside; of what nothing recorded tells it is not known how far it is."""
    rivals = [("load_offset", 4.0, ()), ("neutral_zone", 7.9, ("anterior",))]
    rivals += [("neutral_zone", 1.0, ("extension",)), ("facet_contact", 2.0, ("extension",))]
    found = ended({("hysteresis", "creep"): 1.0})
    creep, loop = found.standing
    loop = replace(loop, rivals=tuple(Rival(*one) for one in rivals))
    tied = ("hysteresis", "neutral_zone", "load_offset", "preload_stiffening")
    told = Outcome(VerdictKind.SET, "", (creep,), tied)
    assert list(_in_set(replace(found, standing=(creep, loop)), told)) == [
        Candidate("hysteresis", ("extension",), 0.0),
        Candidate("neutral_zone", ("extension",), 1.0),
        Candidate("load_offset", ("*",), 4.0),
        Candidate("preload_stiffening", ("extension",), None),
    ]


# Names that what was recorded cannot exclude: without times, and without a second preload

LEVELS = (0.0, 4.0, 8.0, 4.0, 0.0)
TIMES = (0.0, 30.0, 60.0, 90.0, 120.0)
NONE = (None,) * 5


def case(times: Sequence[float | None] = TIMES, forces: Sequence[float] = (0.0,) * 5) -> LoadCase:
    steps = tuple(
        LoadStep(
            number,
            (Wrench(0, np.zeros(3), np.array([0.0, -force, 0.0]), np.array([0.0, 0.0, moment])),),
            time,
        )
        for number, (moment, time, force) in enumerate(zip(LEVELS, times, forces, strict=True))
    )
    return LoadCase("flexion", 1, steps)


def excluded(name: str, *cases: LoadCase) -> tuple[str, ...]:
    return cannot_be_excluded(name, {"a": cases, "b": cases[:1]})


@sweep("name", ["hysteresis", "neutral_pose_drift"])
def test_without_time_a_loop_may_be_creep(name: str) -> None:
    assert excluded(name, case()) == ()
    assert excluded(name, case(NONE)) == ("creep",)
    assert excluded(name, case((5.0,) * 5)) == ("creep",)  # a clock that stands
    assert excluded(name, case((0.0, 30.0, 30.0, 30.0, 30.0))) == ()  # it went, if only once
    assert excluded(name, case((0.0, 0.0, 0.0, 0.0, 30.0))) == ()
    assert excluded(name, case((120.0, 90.0, 60.0, 30.0, 0.0))) == ("creep",)  # it goes back
    assert excluded(name, case(), case(NONE)) == ("creep",)  # time is known of a part only
    assert excluded(name, case((0.0, 30.0, None, 90.0, 120.0))) == ("creep",)


def test_a_test_of_one_step_neither_takes_time_nor_needs_any() -> None:
    single = LoadCase("flexion", 1, case().steps[:1])
    assert excluded("hysteresis", case(), single) == ()
    assert excluded("hysteresis", single) == ("creep",)


@sweep("lighter, alike", [(95.0, True), (94.9, False)])
def test_forces_are_alike_within_a_twentieth_of_the_largest(lighter: float, alike: bool) -> None:
    two = case(forces=(100.0,) * 5), case(forces=(lighter,) * 5)
    assert excluded("level_dependence", *two) == (("preload_stiffening",) if alike else ())
    changing = case(forces=(100.0, 100.0, lighter, 100.0, 100.0))
    for cases in (two, [changing]):
        expected = ("level_dependence",) if alike else ()
        assert excluded("preload_stiffening", *cases) == expected


def test_without_any_test_nothing_is_recorded() -> None:
    assert cannot_be_excluded("hysteresis", {}) == ("creep",)
    assert cannot_be_excluded("level_dependence", {}) == ()
    assert cannot_be_excluded("preload_stiffening", {}) == ("level_dependence",)


def test_one_compression_does_not_tell_levels_from_preload() -> None:
    bare, pressed, harder = case(), case(forces=(300.0,) * 5), case(forces=(500.0,) * 5)
    assert excluded("level_dependence", pressed) == ("preload_stiffening",)
    assert excluded("level_dependence", case(forces=(0.5,) * 5)) == ("preload_stiffening",)
    assert excluded("level_dependence", bare) == ()  # nothing listed compresses
    for two in ((bare, pressed), (pressed, harder)):
        assert excluded("level_dependence", *two) == ()
        assert excluded("preload_stiffening", *two) == ()
    assert excluded("preload_stiffening", pressed) == ("level_dependence",)
    growing = case(forces=(0.0, 200.0, 400.0, 200.0, 0.0))
    assert excluded("preload_stiffening", growing) == ()
    assert excluded("level_dependence", growing) == ()


def test_other_effects_need_nothing_that_is_not_there() -> None:
    told = {"hysteresis", "neutral_pose_drift", "level_dependence", "preload_stiffening"}
    assert told <= set(registered())
    for name in set(registered()) - told:
        assert excluded(name, case(NONE)) == ()
