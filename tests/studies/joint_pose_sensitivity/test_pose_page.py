"""What the page of a joint-pose study concludes, against made-up tables whose answer is known.

Catches a claim that is made where it is false, a verdict without sentence or sentence without
verdict, numbers of another data set than the retained fits, values at a bound told as numbers.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pose_tables as made
import pytest
from page_rules import (
    all_verdicts,
    faults_of_page,
    faults_of_sentences,
    faults_of_told,
    verdicts,
)
from study_cases import STUDY, Size, project

from spinepipe.cohort import Cohort
from spinepipe.cohort.cohort import MeasurementSd
from spinepipe.report.conclusions import Value, sentences_of
from spinepipe.report.page.study_page import Page, ResultTables
from spinepipe.studies.joint_pose_sensitivity.bootstrap import NO_REST
from spinepipe.studies.joint_pose_sensitivity.inputs import study_and_cohort
from spinepipe.studies.joint_pose_sensitivity.page import folded, left_out, page
from spinepipe.studies.joint_pose_sensitivity.retained import moved_by_load
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.tables import StudyTables

PACKAGE = "spinepipe.studies.joint_pose_sensitivity"
LOADS = {"load_point": {"anterior_mm": [-2, 0, 2], "superior_mm": [-20, 0, 20]}}
PER_DEG = np.pi / 180.0
Settings = tuple[JointPoseSensitivity, Cohort]


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Settings:
    """Superior and extension are free, one stiffness for both joints of specimen a."""
    return study_and_cohort(str(project(tmp_path_factory.mktemp("one"), Size(("a",)))), STUDY)


def settings(study: JointPoseSensitivity, changes: Mapping[str, Any]) -> JointPoseSensitivity:
    """The study with other settings."""
    plain = study.model_dump()
    for name, value in changes.items():
        plain[name] = {**plain[name], **value} if isinstance(value, dict) else value
    return JointPoseSensitivity.model_validate(plain)


def page_of(
    study: Settings, tables: Mapping[str, list[made.Row]], asked: Mapping[str, Any] = LOADS
) -> Page:
    """The page of the base study with some other tables; a table without rows is not there."""
    rows = {name: one for name, one in {**made.base(), **tables}.items() if one}
    results = ResultTables(StudyTables(made.frames(rows)))
    return page(settings(study[0], asked), study[1], results)


def changed(rows: list[made.Row], n: int, **columns: Any) -> list[made.Row]:
    """The first n rows with other cells."""
    return [{**row, **columns} if at < n else row for at, row in enumerate(rows)]


def unknown(name: str, unit: str, n: int) -> list[made.Row]:
    """Fits, the first n of which leave a stiffness without an upper end."""
    open_ = {f"{name}_identifiable": False, f"{name}_open_above": True}
    return changed(made.calibrations(), n, **open_, **{f"{name}_high_{unit}": None})


BOTH_UNKNOWN = [
    {**one, **other, "extension_identifiable": False, "superior_identifiable": False}
    for one, other in zip(unknown("extension", "nm_per_rad", 150), made.calibrations(), strict=True)
]
EXACT = made.summary(0.0, 1e-15, 1e-14)


@dataclass(frozen=True)
class Case:
    """A study, and what a rule must come to."""

    rule: str
    verdict: str
    tables: Mapping[str, list[made.Row]] = field(default_factory=dict)
    asked: Mapping[str, Any] = field(default_factory=lambda: LOADS)


def load(**more: Any) -> dict[str, list[made.Row]]:
    return {"load_point_effect": made.load_point_effect(**more)}


def fits(n: int, **columns: Any) -> dict[str, list[made.Row]]:
    """The first n fits with other cells."""
    return {"calibrations": changed(made.calibrations(), n, **columns)}


def left_out_of(n: int) -> dict[str, list[made.Row]]:
    return {"success": made.success(left_out=n), "counts": made.counts(reduced=made.N - n)}


def grid(*ends: tuple[float, float, float, float]) -> dict[str, list[made.Row]]:
    return {"variance_shares": made.shares(*ends)}


def points(*how: Any, **named: Any) -> dict[str, list[made.Row]]:
    return {"stiffness_over_load_point": made.over_load_point(*how, **named)}


def sampled(**more: list[made.Row]) -> dict[str, list[made.Row]]:
    return {"posterior": made.posterior(), **more}


def precise(**more: Any) -> dict[str, list[made.Row]]:
    return {"required_precision": made.required_precision(**more)}


BOUND = {
    "calibrations": changed(
        made.calibrations(), 41, extension_nm_per_rad=0.037, superior_n_per_m=110.0
    )
}
"""A fifth of the fits at the lower bound, a thousandth of the start; all are identified."""

NO_LOAD: dict[str, list[made.Row]] = {"load_point_effect": [], "stiffness_over_load_point": []}
TWO = {"calibrations": made.calibrations() + made.calibrations("b", shift=2.0)}
CASES = (
    Case("palpation", "more"),
    Case("palpation", "less", load(per_mm_anterior=0.1, per_mm_superior=0.01)),
    Case("palpation", "alike", load(per_mm_anterior=0.741, superior_sd_mm=0.0)),
    Case("palpation", "alone", NO_LOAD, {}),
    Case("palpation", "alone", load(anterior_sd_mm=0.0, superior_sd_mm=0.0)),
    Case("palpation", "alone", load(stated_high=None)),
    Case("palpation", "open", {"calibrations": BOTH_UNKNOWN}),
    Case("palpation", "bounded", BOUND),
    Case("palpation", "few", {"success": made.success(left_out=made.N - 2)}),
    Case("palpation", "none", left_out_of(made.N)),
    Case("median", "told"),
    Case("spread", "told"),
    Case("load", "told"),
    Case("region", "told"),
    Case("landmarks", "one"),
    Case("load_place", "known", NO_LOAD, {}),
    Case("load_place", "stated"),
    Case("load_points", "none_excluded"),
    Case("load_points", "excluded", points(excluded=3)),
    Case("load_points", "too_few", points(allowed=None)),
    Case("load_points", "no_effect", points(0.05)),
    Case("readings", "wider"),
    Case(
        "readings",
        "narrower",
        fits(made.N, extension_low_nm_per_rad=9.9, extension_high_nm_per_rad=10.1),
    ),
    Case("identified", "all"),
    Case("identified", "some", {"calibrations": unknown("superior", "n_per_m", 150)}),
    Case("identified", "none", {"calibrations": BOTH_UNKNOWN}),
    Case("identified", "bounded", BOUND),
    Case("grid", "pose"),
    Case("grid", "stiffness", grid((0.1, 0.4, 0.5, 0.9))),
    Case("grid", "both", grid((0.1, 0.4, 0.5, 0.9), (0.5, 0.9, 0.1, 0.4))),
    Case("grid", "neither", grid((0.3, 0.9, 0.1, 0.4))),
    Case("agreement", "follows"),
    Case("agreement", "misses_shared", {"summary": made.summary(40.0)}),
    Case(
        "agreement",
        "misses",
        {"summary": made.summary(40.0)},
        {"calibration": {"grouping": "per_joint"}},
    ),
    Case("agreement", "exact", {"summary": EXACT}),
    Case("frames", "told"),
    Case("starts", "less"),
    Case("starts", "more", {"bootstrap": made.bootstrap(start=0.5)}),
    Case("loading", "less"),
    Case("loading", "more", {"bootstrap": made.bootstrap(dynamic=0.8)}),
    Case("damping", "less"),
    Case("damping", "more", {"bootstrap": made.bootstrap(damping=0.5)}),
    Case("posterior", "closed", sampled()),
    Case("posterior", "above", {"posterior": made.posterior(above=True)}),
    Case("posterior", "below", {"posterior": made.posterior(below=True)}),
    Case("posterior", "open", {"posterior": made.posterior(True, True)}),
    Case("precision", "known", precise()),
    Case("precision", "known", precise(sd_high_mm=None)),
    Case("precision", "enough", precise(sd=None, message="5 mm will do, the largest")),
    Case("precision", "not_enough", precise(sd=None, message="0.5 mm will not do, the smallest")),
    Case("precision", "model", precise(sd=None, nominal_share=1.4)),
    Case("precision", "few", precise(n=6)),
    Case("poses", "alike", sampled(pose_weights=made.pose_weights(*[0.1] * 10))),
    Case("poses", "preferred", sampled(pose_weights=made.pose_weights(0.91, *[0.01] * 9))),
    Case("fits", "ok"),
    Case("fits", "check", left_out_of(20)),
    Case("fits", "stop", left_out_of(150)),
    Case("kept", "stop", left_out_of(150)),
    Case("bounds", "ok"),
    Case("bounds", "check", fits(3, status="converged_at_bound")),
    Case("optima", "ok"),
    Case("optima", "check", fits(3, n_optima=2)),
    Case("freedom", "ok"),
    Case("freedom", "check", fits(3, degrees_of_freedom=0)),
    Case("freedom", "stop", fits(150, degrees_of_freedom=0)),
    Case("sample", "ok"),
    Case("sample", "check", {"success": made.success(left_out=120)}),
    Case("runs", "ok"),
    Case("runs", "check", {"simulations": made.simulations(lost=2)}),
    Case("rest", "check", asked={**LOADS, "loading": "settle"}),
    Case("boots", "ok", {"counts": made.counts() + made.counts(part="start_bootstrap")}),
    Case(
        "boots", "check", {"counts": made.counts() + made.counts(part="start_bootstrap", solved=9)}
    ),
    Case("sampler", "ok", sampled()),
    Case("sampler", "check", {"posterior": made.posterior(status="not_converged")}),
    Case("band", "ok", sampled(posterior_motion=made.posterior_motion(10))),
    Case("band", "check", sampled(posterior_motion=made.posterior_motion(5))),
    Case("methods", "fitted"),
    Case("methods_load", "fitted"),
    Case("methods_posterior", "sampled", sampled()),
)
NAMES = [f"{number} {case.rule} {case.verdict}" for number, case in enumerate(CASES)]


def test_sentences_of_the_kind() -> None:
    assert list(faults_of_sentences(PACKAGE)) == []


@pytest.mark.parametrize("case", CASES, ids=NAMES)
def test_a_rule_comes_to_its_verdict_alone(study: Settings, case: Case) -> None:
    found = page_of(study, case.tables, case.asked)
    assert {one.verdict for one in found.conclusions if one.rule == case.rule} == {case.verdict}
    assert list(faults_of_told(found.told)) == []


def test_every_verdict_has_a_study_that_comes_to_it(study: Settings, tmp_path: Path) -> None:
    reached = set().union(*(verdicts(page_of(study, c.tables, c.asked).conclusions) for c in CASES))
    reached |= verdicts(page_of(two_specimens(tmp_path), several_tables()).conclusions)
    reached |= verdicts(page_of(coarse(study), {"summary": made.summary(40.0)}).conclusions)
    assert reached == all_verdicts(sentences_of(PACKAGE))


def coarse(study: Settings) -> Settings:
    """Readings whose error is half of that of the fitted models, 0.05 degrees."""
    sd = MeasurementSd(rotation_deg=0.025, translation_mm=0.01)
    return study[0], replace(study[1], measurement_sd=sd)


def test_errors_within_reading_error_are_no_miss(study: Settings) -> None:
    """40 % of the motion, but 0.05 degrees of readings with an SD of 0.025; 0.06 is a miss."""
    for error, verdict in ((0.05, "within"), (0.06, "misses_shared")):
        found = page_of(coarse(study), {"summary": made.summary(40.0, error)})
        assert [one.verdict for one in found.told if one.rule == "agreement"] == [verdict]


def two_specimens(root: Path) -> Settings:
    """Specimens a and b; landmarks of different SDs."""
    asked, cohort = study_and_cohort(str(project(root, Size(("a", "b")))), STUDY)
    assert cohort.landmarks is not None
    sds = np.where(cohort.landmarks["specimen"] == "a", 1.0, 2.0)
    return asked, replace(cohort, landmarks=cohort.landmarks.assign(sd_mm=sds))


def several_tables() -> dict[str, list[made.Row]]:
    """Palpation moves the stiffness of b twice as far."""
    wide = [
        {**row, "specimen": "b", "extension_nm_per_rad": 2.0 * row["extension_nm_per_rad"] - 10.0}
        for row in made.calibrations()
    ]
    return {
        "calibrations": made.calibrations() + wide,
        "success": made.success() + made.success("b"),
    }


def test_of_several_specimens_the_most_moved_is_named(tmp_path: Path) -> None:
    found = page_of(two_specimens(tmp_path), several_tables())
    (answer,) = found.at("answer")
    assert answer.verdict == "several"
    assert "stiffness of b by 20" in answer.text
    assert "of 2 specimens" in answer.text


def value(found: Page, rule: str, name: str = "value") -> Value:
    (one,) = (one for one in found.conclusions if one.rule == rule)
    return one.values[name]


def test_numbers_are_those_of_the_retained_fits_in_the_fields_units(study: Settings) -> None:
    """With the upper half of the fits left out, quartiles of 9 to 10 are 9.25 and 9.75 N m/rad."""
    half = {"success": made.success(left_out=100)}
    found = page_of(study, half)
    median = value(found, "median")
    assert (median.number, median.low, median.high) == pytest.approx(
        (9.5 * PER_DEG, 9.25 * PER_DEG, 9.75 * PER_DEG)
    )
    assert (median.unit, median.n) == ("N m/deg", 101)
    share = value(found, "spread")
    assert share.number == pytest.approx(100.0 * 0.5 / 9.5)
    assert share.low is not None
    assert share.high is not None
    assert share.low < share.number < share.high
    assert value(found, "identified", "lost").n == 101
    region = value(found, "region")
    assert (region.low, region.high) == pytest.approx((8.0 * PER_DEG, 14.0 * PER_DEG))


def test_middle_half_by_the_load_is_that_of_a_normal_distribution(study: Settings) -> None:
    """1 N m/rad each way about 10; 1.34898 SDs are the middle half."""
    assert value(page_of(study, {}), "load").number == pytest.approx(
        13.4898 * np.sqrt(2.0), rel=1e-5
    )
    drawn = np.random.default_rng(3).normal(size=(200_000, 2)) @ [1.0, 1.0]
    low, high = np.percentile(drawn, [25.0, 75.0])
    row = pd.Series(made.load_point_effect()[0])
    assert moved_by_load(row) == pytest.approx(10.0 * (high - low), rel=0.01)


def test_what_is_not_identifiable_or_at_a_bound_has_no_number(study: Settings) -> None:
    """More than half without an upper end; a quartile at the upper bound; points not identified."""
    start = study[0].stiffness.extension_nm_per_rad
    bound = 1000.0 * start
    at_bound = changed(made.calibrations(), 80, extension_nm_per_rad=bound)
    for rows in (unknown("extension", "nm_per_rad", 101), at_bound):
        found = page_of(study, {"calibrations": rows})
        assert "inferior–superior" in found.at("answer")[0].text, "the other one is told"
        assert "lexion–extension" in next(
            one.text for one in found.told if one.rule == "identified"
        )
        assert not [one for one in found.told if f"{bound * PER_DEG:.0f}" in one.text]
    tried = changed(made.over_load_point(), 3, extension_identifiable=False)
    low = value(page_of(study, {"stiffness_over_load_point": tried}), "load_points", "low")
    assert low.number == pytest.approx(8.0 * PER_DEG), "7 and 6 are of points without a region"
    hidden = page_of(study, load(stated_high=None)).tables
    (effect,) = (one for one in hidden if one.name == "load_point_effect")
    assert "stated" not in [head.name for head in effect.heads]


def test_fits_at_a_bound_make_no_quartile(study: Settings) -> None:
    """Six of twenty fits with other damping stood at the lower bound, a thousandth of the start."""
    other = made.bootstrap(damping=0.5)
    damped = [
        {**row, "extension_nm_per_rad": 0.02}
        if row["bootstrap"] == "damping" and row["set"] < 6
        else row
        for row in other
    ]
    assert "damping" not in {one.rule for one in page_of(study, {"bootstrap": damped}).conclusions}
    few = made.bootstrap(n=9)
    assert not {"starts", "damping"} & {
        one.rule for one in page_of(study, {"bootstrap": few}).conclusions
    }


def told_of(found: Page, rule: str) -> tuple[str, str]:
    (one,) = (one for one in found.told if one.rule == rule)
    return one.text, one.note


def test_fits_that_leave_an_end_open_are_told_of_stiffness_with_a_number(study: Settings) -> None:
    """A quarter of the fits leaves flexion–extension open, three quarters inferior–superior."""
    open_ = {"extension_identifiable": False, "extension_open_above": True}
    rows = changed(unknown("superior", "n_per_m", 150), 50, **open_)
    found = page_of(study, {"calibrations": rows})
    assert "25\u00a0% of fits lack an end" in told_of(found, "region")[1]
    text, note = told_of(found, "identified")
    assert "75\u00a0%" in text
    assert "flexion–extension stiffness is not identified in 25\u00a0% of the fits" in note


def test_two_retained_fits_say_nothing_of_what_readings_determine(study: Settings) -> None:
    two = page_of(study, {"success": made.success(left_out=made.N - 2)})
    assert "identified" not in {one.rule for one in two.conclusions}


def test_fits_at_a_bound_are_not_called_unidentified(study: Settings) -> None:
    """Of one stiffness, of both, and of one while readings leave the other open."""
    one = [
        {**row, "superior_n_per_m": made.SPREAD["superior"][1][at]}
        for at, row in enumerate(BOUND["calibrations"])
    ]
    open_ = [{**row, "superior_identifiable": False} for row in one]
    told = "lexion–extension stiffness has no number: 20\u00a0%"
    for rows in (one, open_):
        assert told in told_of(page_of(study, {"calibrations": rows}), "identified")[0]
    (answer,) = page_of(study, {"calibrations": open_}).at("answer")
    assert answer.verdict == "bounded"
    assert "20\u00a0% for flexion–extension" in answer.text


def test_fits_at_a_bound_are_counted_before_the_filters_take_them(study: Settings) -> None:
    """The last three ended at the upper bound, so they are outliers."""
    rows = changed(made.calibrations()[::-1], 3, status="converged_at_bound")
    found = page_of(study, {"calibrations": rows, **left_out_of(3)})
    assert "3 of 201 fits ended at a bound of a stiffness, 3 of them" in told_of(found, "bounds")[0]


def test_damping_without_rest_is_no_infinite_stiffness(study: Settings) -> None:
    """Quartiles of what does come to rest are told from ten fits on; 'at most' of all loadings."""
    quasi = [
        {**row, "loading": "quasi_static"}
        for row in made.bootstrap()
        if row["bootstrap"] == "damping"
    ]
    for lost, verdicts_ in ((8, ["less"]), (11, [])):
        moving = {"extension_nm_per_rad": 0.037, "message": f"at its lower bound; {NO_REST}"}
        rows = [
            {**row, **moving} if row["bootstrap"] == "damping" and row["set"] < lost else row
            for row in made.bootstrap()
        ]
        found = page_of(study, {"bootstrap": rows + quasi})
        assert [one.verdict for one in found.told if one.rule == "damping"] == verdicts_


def test_starts_tell_what_was_left_out(study: Settings) -> None:
    """Two of twenty fits at rest at their upper bound, a thousand times the start."""
    up = {"extension_nm_per_rad": 2e4, "status": "converged_at_bound"}
    rows = changed(made.bootstrap(), 2, **up)
    text, note = told_of(page_of(study, {"bootstrap": rows}), "starts")
    assert text.startswith("Start values and the stiffness held fixed")
    assert "Of 20 fits read at rest 2 are left out; 2 ended at a bound" in note


def test_assumptions_are_told_with_their_numbers(study: Settings) -> None:
    found = page_of(study, {})
    assert "1 mm anterior and 10 mm superior" in told_of(found, "load_place")[0]
    assert "−2 to 2 mm anterior and −20 to 20 mm superior" in told_of(found, "load_points")[1]
    assert "the 10 best-fitting stiffnesses" in told_of(found, "grid")[0]


def test_a_page_of_any_study_keeps_the_rules(study: Settings, tmp_path: Path) -> None:
    several, nothing = two_specimens(tmp_path), {name: [] for name in made.base()}
    whole = {"posterior": made.posterior(), "required_precision": made.required_precision()}
    for settings_, tables in (
        (study, {}), (study, whole), (study, {"calibrations": BOTH_UNKNOWN}),
        (study, {"success": made.success(left_out=made.N)}), (study, nothing),
        (several, several_tables()),
    ):  # fmt: skip
        found = page_of(settings_, tables)
        html = found.html(*settings_, ResultTables(StudyTables({})))
        faults = [fault for fault in faults_of_page(html) if "before the first figure" not in fault]
        assert faults == []
        assert list(faults_of_told(found.told)) == []


def test_rules_of_tables_that_full_alone_makes_are_not_told_without_them(study: Settings) -> None:
    full = {"posterior", "sampler", "band", "poses", "precision", "methods_posterior"}
    assert not full & {one.rule for one in page_of(study, {}).conclusions}


def test_parts_that_were_left_out_are_named(study: Settings) -> None:
    every = {
        "start_bootstrap": {"sets": 3},
        "damping_bootstrap": {"sets": 3},
        "methods": {"poses": 3},
    }
    every |= {"landmark_precision": {"poses": 3}, "posterior": {"draws": 3}, **LOADS}
    assert left_out(settings(study[0], every)) == ()
    fewer = {**every, "methods": {"poses": 0}, "load_point": {"superior_mm": [0]}}
    assert left_out(settings(study[0], fewer)) == (
        "comparison of ways of fitting (methods: poses: 0)",
        "stiffness over load points (load_point: one point and no SD)",
    )


def test_tests_are_folded_and_counted_after_holm() -> None:
    """Two of three are significant after Holm's correction; the fourth could not be done."""
    one = {"specimen": "a", "family": "F", "test": "T", "joint": "*", "response": "r"}
    one |= {"factor": "f", "effect_name": "rho"}
    numbers = [(0.9, 0.001, 0.004), (-0.5, 0.02, 0.06), (0.8, 0.002, 0.006), (None, None, None)]
    rows = [
        {**one, "stratum": str(k), "effect": e, "p": p, "p_holm": h}
        for k, (e, p, h) in enumerate(numbers)
    ]
    (row,) = folded(pd.DataFrame(rows), 0.05).to_dict("records")
    assert (row["tests"], row["significant"]) == (4, 2)
    assert (row["effect_lowest"], row["effect_highest"]) == (0.8, 0.9)


def test_tables_of_the_page_have_the_fields_units(study: Settings) -> None:
    (effect,) = (one for one in page_of(study, {}).tables if one.name == "load_point_effect")
    cells = dict(zip([head.name for head in effect.heads], effect.rows[0], strict=True))
    assert cells["unit"].text == "N m/deg"
    assert cells["stated"].value == pytest.approx(10.0 * PER_DEG)
