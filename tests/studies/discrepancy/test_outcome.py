"""The verdict from how a search ended: each reason for it, by itself and beside the others."""

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
from sweeps import sweep

from spinepipe.effects import PlaceSpread, Wrench
from spinepipe.effects.registry import registered
from spinepipe.model import LoadCase, LoadStep
from spinepipe.studies.discrepancy.proof.held_out import SCORED, FoldRow, HeldOut
from spinepipe.studies.discrepancy.search.baseline import BaselineFit
from spinepipe.studies.discrepancy.search.gaps import Gap
from spinepipe.studies.discrepancy.search.hypothesis import ActiveTerm, CandidateForm, Variant
from spinepipe.studies.discrepancy.search.lack_of_fit import LackOfFit, LackOfFitTest
from spinepipe.studies.discrepancy.search.outcome import Outcome, cannot_be_excluded, outcome
from spinepipe.studies.discrepancy.search.search_state import (
    Rival,
    SearchResult,
    SearchStage,
    SelectedTerm,
)
from spinepipe.studies.discrepancy.summary import nearest_candidates
from spinepipe.studies.discrepancy.verdict import Candidate, SuspectedError, VerdictKind
from spinepipe.studies.discrepancy.verdict_unnamed import Reason

MARGIN = 3.0
SHAPE = "load over the joint's own extension, shared"


def stands(
    name: str = "creep",
    rivals: Sequence[tuple[str, float]] = (("hysteresis", 20.0),),
    log_evidence: float = 40.0,
    alone: float = 40.0,
    over_stiffness: float | None = None,
    coordinate: str = "extension",
    rivals_known: bool = True,
) -> SelectedTerm:
    variant = Variant(name, (("coordinate", coordinate),))
    supposed = ActiveTerm(CandidateForm(variant, PlaceSpread.SHARED), np.zeros(1))
    behind = tuple(Rival(*one) for one in rivals)
    return SelectedTerm(
        supposed, log_evidence, alone, 100.0, behind, over_stiffness, rivals_known=rivals_known
    )


def ended(
    *standing: SelectedTerm,
    gain: float = 100.0,
    lack: float = -2.0,
    generic_threshold: float = 2.0,
    left: Gap | None = None,
    elsewhere: float = -2.0,
    neighbours: float = -2.0,
) -> SearchResult:
    """A search whose effects lower chi2 by ``gain``, with the generic basis' evidence behind.

    All of it in extension; ``elsewhere`` is the basis' evidence in right bending; ``neighbours``
    that of the neighbouring joints' motion for what the base lacks in extension.
    """

    def grounds(chi2: float) -> BaselineFit:
        return cast(BaselineFit, SimpleNamespace(fit=SimpleNamespace(chi2=chi2)))

    def of(evidence: float, coordinate: str) -> LackOfFitTest:
        beside = neighbours if coordinate == "extension" else -2.0
        shapes = {"own": evidence, "neighbour": beside, "drift": -2.0}
        return LackOfFitTest(
            evidence, np.zeros(1), "own", coordinate, PlaceSpread.SHARED, 0.0, shapes
        )

    at = {"extension": of(lack, "extension"), "right_bending": of(elsewhere, "right_bending")}
    whole = max(at.values(), key=lambda one: one.log_evidence)
    basis = LackOfFit(**vars(whole), at=at)
    gap, none = left or Gap(400.0, 400.0, 420), Gap(10.0, 10.0, 10)
    of_base = Gap(gap.chi2 + gain, gap.dof, gap.readings)
    thresholds = dict.fromkeys(at, generic_threshold)
    return SearchResult(
        base=grounds(500.0),
        final=grounds(500.0 - gain),
        standing=standing,
        stages=(first_look(standing),),
        lack=basis,
        generic_threshold=generic_threshold,
        base_gap=of_base,
        final_gap=gap,
        base_at={"extension": of_base, "right_bending": none},
        final_at={"extension": gap, "right_bending": none},
        generic_threshold_at=thresholds,
        base_lack=basis,
    )


def first_look(standing: Sequence[SelectedTerm]) -> SearchStage:
    """Each effect on the screen with what it has alone."""
    effects = [
        SimpleNamespace(
            forms=[SimpleNamespace(form=one.supposed.form, log_evidence=one.alone)],
            log_evidence=one.alone,
        )
        for one in standing
    ]
    return cast(SearchStage, SimpleNamespace(screen=SimpleNamespace(effects=effects)))


def proof(over_base: float | None) -> HeldOut:
    return HeldOut((), {}, None, None, 0.0, over_base)


def says(found: SearchResult, **more: Any) -> tuple[str, str]:
    result = outcome(found, MARGIN, **more)
    return result.verdict.value, result.why


def assert_unknown(result: Outcome, *words: str) -> None:
    assert (result.verdict, result.named, result.tied) == (VerdictKind.UNKNOWN, (), ())
    for word in words:
        assert word in result.why


ERROR = SuspectedError("specimen b, L3L4", "sign flipped", "slope -1")


@sweep("found", [ended(stands()), ended(), ended(lack=50.0)])
def test_data_that_look_wrong_come_before_everything(found: SearchResult) -> None:
    result = outcome(found, MARGIN, proof(50.0), [ERROR])
    assert_unknown(result, "sign flipped (specimen b, L3L4)", "the data look wrong")


def test_of_many_errors_three_are_told() -> None:
    errors = [SuspectedError(f"specimen {name}", "units", "") for name in "abcd"]
    why = outcome(ended(), MARGIN, None, errors).why
    assert [f"specimen {name}" in why for name in "abcd"] == [True, True, True, False]


@sweep(
    "lack, threshold, verdict",
    [
        (-2.0, 2.0, "NULL"),
        (4.9, 2.0, "NULL"),
        (5.1, 2.0, "UNKNOWN"),
        (7.9, 8.0, "NULL"),
        (8.1, 8.0, "UNKNOWN"),
    ],
)
def test_with_nothing_named_the_generic_basis_tells_nothing_from_something_unknown(
    lack: float, threshold: float, verdict: str
) -> None:
    """Its evidence must exceed the null's, and 5 (very strong) whatever the null shows."""
    found, why = says(ended(lack=lack, generic_threshold=threshold))
    assert found == verdict
    assert (SHAPE in why) == (verdict == "UNKNOWN")


def test_what_is_left_to_the_generic_basis_is_unknown() -> None:
    """Evidence 10 is a drop of chi2 of 20 or so: 20 beside a gain of 100 is a sixth."""
    assert_unknown(outcome(ended(stands(), lack=10.0), MARGIN), "creep", "17 %")


@sweep("lack, threshold", [(5.4, 2.0), (10.0, 11.0)])
def test_little_left_or_no_more_than_the_null_shows_is_no_matter(
    lack: float, threshold: float
) -> None:
    """10.8 of 110.8 is less than a tenth."""
    found = ended(stands(), lack=lack, generic_threshold=threshold)
    assert says(found)[0] == "NAMED"


def test_effects_that_only_mend_one_another_imitate_something_else() -> None:
    prop = stands("load_offset", log_evidence=40.0, alone=9.0)
    result = outcome(ended(stands(), prop), MARGIN)
    assert_unknown(result, "creep and load_offset imitate", "nothing speaks for load_offset")
    enough = stands("load_offset", log_evidence=40.0, alone=11.0)
    assert says(ended(stands(), enough))[0] == "NAMED"


def test_a_small_prop_takes_no_name_from_what_explains_nearly_all() -> None:
    """A tenth of what both explain is the limit: gains of 1000 and 100."""
    prop = stands("load_offset", log_evidence=40.0, alone=1.0)
    sure = replace(stands(), gain=1000.0)
    result = outcome(ended(sure, prop, gain=1100.0), MARGIN)
    assert (result.verdict, result.named) == (VerdictKind.PART, (sure,))
    assert_unknown(outcome(ended(replace(sure, gain=890.0), prop, gain=990.0), MARGIN), "imitate")


def test_one_effect_has_nothing_to_mend() -> None:
    assert says(ended(stands(alone=1.0)))[0] == "NAMED"


@sweep(
    "excess, dof, verdict",
    [
        (120.0, 400.0, "UNKNOWN"),
        (90.0, 400.0, "NAMED"),
        (120.0, 4000.0, "NAMED"),
        (900.0, 10000.0, "NAMED"),
    ],
)
def test_most_of_a_gap_must_close_if_more_than_a_small_one_stays(
    excess: float, dof: float, verdict: str
) -> None:
    """chi2 has an SD of sqrt(2 dof): 28, and 89 of 4000 readings, where 120 may be noise; 900 of
    10000 are none, but a gap of 0.3 of the noise at most."""
    found, why = says(ended(stands(), left=Gap(dof + excess, dof, int(dof))))
    assert found == verdict
    assert ("most of the discrepancy stays" in why) == (verdict == "UNKNOWN")


@sweep(
    "given, verdict",
    [
        (None, "NAMED"),
        (proof(None), "NAMED"),
        (proof(12.0), "NAMED"),
        (proof(-0.1), "UNKNOWN"),
        (proof(0.0), "NAMED"),
    ],
)
def test_names_must_predict_what_was_held_out(given: HeldOut | None, verdict: str) -> None:
    """Where nothing that was scored hangs on the effects, it speaks neither for nor against."""
    found, why = says(ended(stands(), stands("load_offset")), proof=given)
    assert found == verdict
    if verdict == "UNKNOWN":
        assert "creep and load_offset would explain" in why
        assert "held-out" in why


@sweep(
    "base, with_effects, verdict",
    [
        (100.0, 129.0, "PART"),
        (100.0, 131.0, "UNKNOWN"),
        (2050.0, 2149.0, "PART"),
        (2050.0, 2151.0, "UNKNOWN"),
    ],
)
def test_unseen_tests_must_not_be_predicted_worse(
    base: float, with_effects: float, verdict: str
) -> None:
    """Whatever specimens say: worse by 30, and by a twentieth of what the base misses (2000).

    Worse at all, beyond noise, is no full name either: predictions are 5 noise SD apart here.
    """

    def fold(kind: str, *sizes: float) -> FoldRow:
        before, after = (Gap(chi2, 50.0, 50) for chi2 in sizes)
        return FoldRow(kind, kind, 50, 50, before, after, None, 50.0, SCORED, "", 25.0)

    folds = (fold("test", base, with_effects), fold("specimen", 5000.0, 60.0))
    whole = replace(proof(4900.0), folds=folds)
    assert says(ended(stands()), proof=whole)[0] == verdict


def test_nothing_named_needs_no_proof() -> None:
    assert says(ended(), proof=proof(0.0))[0] == "NULL"


@sweep(
    "over, verdict",
    [(2.9, "PART"), (-4.0, "PART"), (3.0, "NAMED"), (None, "NAMED")],
)
def test_many_strengths_must_do_more_than_a_stiffness_of_each_joint(
    over: float | None, verdict: str
) -> None:
    """Alone it has no name; beside a sure effect it is what stays."""
    other = stands("load_offset", coordinate="right_bending")
    found, why = says(ended(other, stands(over_stiffness=over)))
    assert found == verdict
    assert ("creep explains no more than a stiffness" in why) == (verdict == "PART")
    alone = "UNKNOWN" if verdict == "PART" else "NAMED"
    assert says(ended(stands(over_stiffness=over)))[0] == alone


def test_what_stays_elsewhere_does_not_silence_an_effect() -> None:
    """Right bending is unexplained: the effect in extension is there, and not all."""
    found = ended(stands(), elsewhere=60.0)
    result = outcome(found, MARGIN)
    assert (result.verdict, result.named) == (VerdictKind.PART, found.standing)
    assert "right bending" in result.left[0]
    assert_unknown(outcome(ended(stands(), lack=60.0), MARGIN), "stays in extension")


def test_a_trifle_elsewhere_is_no_part() -> None:
    """Evidence 6 is a drop of chi2 of 12: a fiftieth of what the effect explains is 20."""
    assert says(ended(stands(), elsewhere=6.0, gain=1000.0))[0] == "NAMED"
    assert says(ended(stands(), elsewhere=6.0, gain=500.0))[0] == "PART"


def test_effects_on_other_coordinates_are_no_props() -> None:
    prop = stands("load_offset", log_evidence=40.0, alone=9.0, coordinate="right_bending")
    assert says(ended(stands(), prop))[0] == "NAMED"


def test_without_rivals_there_is_no_name() -> None:
    unknown = stands("load_offset", rivals=(), rivals_known=False, coordinate="right_bending")
    assert_unknown(outcome(ended(unknown), MARGIN), "its rivals are not known")
    sure = stands()
    result = outcome(ended(sure, unknown), MARGIN)
    assert (result.verdict, result.named) == (VerdictKind.PART, (sure,))


def test_what_closes_less_than_half_of_the_held_out_gap_is_a_part() -> None:
    base = Gap(500.0, 100.0, 100)
    for after, verdict in ((250.0, "NAMED"), (350.0, "PART")):
        both = replace(proof(500.0 - after), base=base, with_effects=Gap(after, 100.0, 100))
        assert says(ended(stands()), proof=replace(both, expected=100.0))[0] == verdict


def test_ties_come_after_what_is_unexplained_or_unproven() -> None:
    tie = stands(rivals=[("hysteresis", 1.0)])
    assert says(ended(tie))[0] == "SET"
    assert says(ended(tie, lack=10.0))[0] == "UNKNOWN"
    assert says(ended(tie), proof=proof(-5.0))[0] == "UNKNOWN"


def test_rivals_within_the_margin_make_a_set() -> None:
    rivals = [("hysteresis", -0.5), ("load_offset", 2.9), ("marker_bias", 3.0)]
    result = outcome(ended(stands(rivals=rivals)), MARGIN)
    assert (result.verdict, result.named) == (VerdictKind.SET, ())
    assert result.tied == ("creep", "hysteresis", "load_offset")
    assert "creep, hysteresis or load_offset" in result.why


def test_what_was_not_recorded_excludes_no_rival() -> None:
    """Without times creep is never fitted: evidence for friction is none against creep."""
    friction = stands("hysteresis", rivals=[("creep", 40.0)])
    result = outcome(ended(friction), MARGIN, not_excluded={"hysteresis": ("creep",)})
    assert (result.verdict, result.tied) == (VerdictKind.SET, ("hysteresis", "creep"))
    assert says(ended(friction))[0] == "NAMED"


def test_beside_a_tie_what_is_sure_is_named() -> None:
    sure = stands("local_laxity")
    result = outcome(ended(stands(rivals=[("hysteresis", 1.0)]), sure), MARGIN)
    assert (result.verdict, result.named) == (VerdictKind.SET, (sure,))
    assert result.tied == ("creep", "hysteresis")


def test_effects_that_stand_beside_one_another_are_no_ties() -> None:
    one = stands("creep", rivals=[("hysteresis", 1.0), ("load_offset", 9.0)])
    other = stands("hysteresis", rivals=[("creep", 0.5)])
    result = outcome(ended(one, other), MARGIN)
    assert (result.verdict, result.named, result.tied) == (VerdictKind.NAMED, (one, other), ())
    assert result.why.startswith("creep and hysteresis: ")


def test_an_effect_on_another_coordinate_is_still_a_rival_here() -> None:
    """Stiffening is sure in extension; in bending it is as likely as what stands there."""
    sure = stands("nonlinear_stiffening", rivals=[("facet_contact", 90.0)])
    here = stands(
        "facet_contact", rivals=[("nonlinear_stiffening", 0.5)], coordinate="right_bending"
    )
    result = outcome(ended(sure, here), MARGIN)
    assert (result.verdict, result.named) == (VerdictKind.SET, (sure,))
    assert result.tied == ("facet_contact", "nonlinear_stiffening")


def test_an_effect_in_two_coordinates_has_one_name() -> None:
    result = outcome(ended(stands(), stands(), stands("load_offset")), MARGIN)
    assert result.why.startswith("creep and load_offset: ")
    assert len(result.named) == 3


@sweep(
    "found, more, reason",
    [
        (ended(), {"errors": [ERROR]}, Reason.DATA_ERRORS),
        (ended(lack=50.0), {}, Reason.NO_KNOWN_EFFECT),
        (ended(stands(), lack=10.0), {}, Reason.A_PART_STAYS),
        (ended(stands(), left=Gap(1900.0, 1000.0, 1000)), {}, Reason.MOST_STAYS),
        (ended(stands(), stands("load_offset", alone=1.0)), {}, Reason.IMITATED_TOGETHER),
        (ended(stands(over_stiffness=0.0)), {}, Reason.STIFFNESS_OF_EACH_JOINT),
        (ended(stands()), {"proof": proof(-5.0)}, Reason.NOT_PROVEN),
        (ended(stands()), {}, None),
        (ended(), {}, None),
    ],
)
def test_why_there_is_no_name_is_told_to_programs_too(
    found: SearchResult, more: dict[str, Any], reason: Reason | None
) -> None:
    result = outcome(found, MARGIN, **more)
    assert result.reason is reason
    assert (result.verdict is VerdictKind.UNKNOWN) == (reason is not None)


@sweep(
    "neighbours, verdict",
    [(-2.0, "NAMED"), (42.0, "NAMED"), (44.0, "UNKNOWN"), (400.0, "UNKNOWN")],
)
def test_a_shape_that_no_known_effect_has_and_that_fits_better_leaves_no_name(
    neighbours: float, verdict: str
) -> None:
    """The effect has 40 alone; a name needs the generic shape to be no more than 3 ahead."""
    assert says(ended(stands(), neighbours=neighbours))[0] == verdict


def test_a_shape_that_all_effects_together_leave_behind_takes_no_name() -> None:
    two = (stands("level_dependence"), stands("creep"))
    assert says(ended(*two, neighbours=60.0))[0] == "NAMED"
    assert says(ended(*two, neighbours=80.0))[0] == "UNKNOWN"


def test_a_shape_on_another_coordinate_takes_no_name() -> None:
    assert says(ended(stands(coordinate="right_bending"), neighbours=400.0))[0] != "UNKNOWN"


@sweep(
    "margins, tied",
    [
        ((3.6,), ()),
        ((3.5, 3.8), ("creep", "a", "b")),
        ((3.6, 5.0), ()),
        ((3.1, 3.9, 9.0), ("creep", "a", "b")),
        ((2.9, 4.5), ("creep", "a")),
    ],
)
def test_odds_are_against_all_rivals_together(
    margins: Sequence[float], tied: tuple[str, ...]
) -> None:
    """exp(-3.5) + exp(-3.8) is more than exp(-3), exp(-3.6) + exp(-5) is not."""
    rivals = list(zip("abc", margins, strict=False))
    assert outcome(ended(stands(rivals=rivals)), MARGIN).tied == tied


def test_a_shape_that_a_load_over_the_own_motion_has_as_well_takes_no_name() -> None:
    """Coordinates that move together are shapes of each other."""
    found = ended(stands(), neighbours=400.0)
    of_own = replace(
        found.base_lack,
        at={
            name: replace(one, by_family=one.by_family | {"own": 398.0})
            for name, one in found.base_lack.at.items()
        },
    )
    assert says(replace(found, base_lack=of_own))[0] == "NAMED"


def test_a_set_is_told_where_its_names_are_near() -> None:
    """Contact stands; stiffening is near in flexion and far in shear, creep is far wherever."""
    stands = Candidate("facet_contact", ("extension",), 0.0)
    near = Candidate("nonlinear_stiffening", ("extension",), 1.0)
    far = Candidate("nonlinear_stiffening", ("anterior",), 7.9)
    least, most = Candidate("creep", ("extension",), 4.0), Candidate("creep", ("anterior",), 9.0)
    untold = Candidate("hysteresis", ("extension",), None)
    told = nearest_candidates([stands, near, far, near, most, least, untold], margin=3.0)
    assert told == (stands, near, least, untold)


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
