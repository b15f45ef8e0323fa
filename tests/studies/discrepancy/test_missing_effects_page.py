"""What a search for missing effects says on its page, from made-up verdicts and tables.

Catches a sentence that a verdict or its numbers do not bear out, one that says nothing of what was
left out, a figure or page that fails for one of the verdicts, and one that reads badly.
"""

import json
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from importlib import import_module
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from discrepancy_cases import SD_DEG, SPECIMENS, STUDY, TESTS, VERDICTS, frames, project, tables
from page_rules import (
    FORBIDDEN,
    all_verdicts,
    faults_of_chart,
    faults_of_page,
    faults_of_sentences,
    faults_of_told,
    verdicts,
)
from sweeps import sweep

from spinepipe.api.missing_effects import _result
from spinepipe.model.file import ModelFile
from spinepipe.report.conclusions import Sentence, Told, sentences_of
from spinepipe.report.forms.chart import Chart, Drawing
from spinepipe.report.page.study_page import Page, ResultTables
from spinepipe.studies.discrepancy.alternatives import UNNAMED
from spinepipe.studies.discrepancy.design import advice
from spinepipe.studies.discrepancy.job import DiscrepancyResults
from spinepipe.studies.discrepancy.kind import KIND
from spinepipe.studies.discrepancy.page import left_out, page
from spinepipe.studies.discrepancy.settings import Discrepancy, DiscrepancyBase
from spinepipe.studies.discrepancy.verdict import plain_data, verdict_of
from spinepipe.studies.discrepancy.verdict_unnamed import Reason
from spinepipe.studies.read import check

PACKAGE = "spinepipe.studies.discrepancy"

Change = Callable[[dict[str, pd.DataFrame]], Mapping[str, pd.DataFrame]]


@cache
def study_of(root: Path) -> Any:
    return check(root, STUDY)


def at(where: pd.DataFrame, by: str, model: str, **gap: float) -> pd.DataFrame:
    """The rows of one way to pool and one model with other misfits."""
    chosen = (where["by"] == by) & (where["model"] == model)
    return where.assign(**{name: where[name].mask(chosen, size) for name, size in gap.items()})


def after(gap: float, low: float, high: float) -> Change:
    """Misfit over all readings with the effects."""
    sizes = {"gap": gap, "gap_low": low, "gap_high": high}
    return lambda made: {"where": at(made["where"], "all", "with_effects", **sizes)}


def whole(gap: float, low: float) -> Change:
    """Misfit over all readings of both models, and in each test."""

    def change(made: dict[str, pd.DataFrame]) -> dict[str, pd.DataFrame]:
        where = made["where"]
        for by, model in product(("all", "test"), ("base", "with_effects")):
            where = at(where, by, model, gap=gap, gap_low=low, gap_high=gap + 0.1)
        return {"where": where}

    return change


def by_test(**misfits: tuple[float, float]) -> Change:
    """Misfits of tests before and after, each with an interval of 0.2 to either side."""

    def change(made: dict[str, pd.DataFrame]) -> dict[str, pd.DataFrame]:
        where = made["where"][made["where"]["by"] != "test"]
        rows = [
            {**where.iloc[0].to_dict(), "by": "test", "test": test, "model": model, "gap": gap}
            | {"gap_low": gap - 0.2, "gap_high": gap + 0.2}
            for test, both in misfits.items()
            for model, gap in zip(("base", "with_effects"), both, strict=True)
        ]
        return {"where": pd.concat([where, pd.DataFrame(rows)], ignore_index=True)}

    return change


def slopes(rest: float, loaded: float) -> Change:
    """Stiffness of L4L5 at rest and under load, each ±0.05."""

    def change(made: dict[str, pd.DataFrame]) -> dict[str, pd.DataFrame]:
        numbers = made["field_numbers"]
        size = np.where(numbers["number"] == "stiffness_at_zero", rest, loaded)
        ours = numbers["number"].str.startswith("stiffness") & (numbers["model"] != "base")
        ends = {"value": size, "low": size - 0.05, "high": size + 0.05}
        return {
            "field_numbers": numbers.assign(
                **{name: numbers[name].mask(ours, to) for name, to in ends.items()}
            )
        }

    return change


def folds(two: bool = False, **kinds: tuple[float, float, bool]) -> Change:
    """Left-out tests, specimens or load steps: misfits, and whether it is worse."""

    specimens = SPECIMENS[:2] if two else SPECIMENS
    names = {"test": TESTS, "specimen": specimens, "steps": ("every second load step",)}

    def change(made: dict[str, pd.DataFrame]) -> dict[str, pd.DataFrame]:
        rows = [
            {**made["held_out"].iloc[0].to_dict(), "fold": name, "kind": kind}
            | {"readings": 72, "gap_base": base, "gap_with_effects": then, "worse": worse}
            | {"gap_base_low": base - 0.3, "gap_base_high": base + 0.3}
            for kind, (base, then, worse) in kinds.items()
            for name in names[kind]
        ]
        return {"held_out": pd.DataFrame(rows)}

    return change


def not_where_it_matters(made: dict[str, pd.DataFrame]) -> dict[str, pd.DataFrame]:
    """Of left-out tests the one that the effect explains in the fit is predicted no better."""
    folds = made["held_out"]
    misfit = folds["gap_with_effects"].mask(folds["fold"] == "flexion", folds["gap_base"])
    return {"held_out": folds.assign(gap_with_effects=misfit)}


def left(**closed: float) -> dict[str, Any]:
    """What the verdict says of folds of each kind: share of the misfit that goes."""
    return {
        "left_out": [
            {"kind": kind, "folds": 3, "base": 2.0, "with_effects": 2.0 * (1.0 - share)}
            | {"excess_closed": 1.0 - (1.0 - share) ** 2, "gap_closed": share}
            for kind, share in closed.items()
        ]
    }


def without(*names: str) -> Change:
    return lambda made: {name: made[name].iloc[:0] for name in names}


def advised(subject: str, test: str, status: str = "advised") -> Change:
    row = {"effect_or_pair": subject, "test": test, "cycles": 3, "gain_in_log_evidence": 6.0}
    row |= {"gain_per_cycle": 2.0, "status": status, "message": "expected, to first order"}
    return lambda made: {"next_tests": pd.DataFrame([row])}


def set_up(size: float, common: bool = False) -> Change:
    """One error of the set-up so many times its tolerance, all others at a tenth of theirs."""

    def change(made: dict[str, pd.DataFrame]) -> dict[str, pd.DataFrame]:
        rows = made["imperfections"]
        rows = rows[rows["places"] == 1].assign(in_prior_sds=0.1, common=False)
        first = rows[rows["model"] == "with_effects"].index[0]
        rows.loc[first, ["in_prior_sds", "value"]] = size, 2.0 * size
        mean = rows.loc[[first]].assign(specimen="*", joint="*", places=9, common=True)
        return {"imperfections": pd.concat([rows, mean]) if common else rows}

    return change


EFFECT = VERDICTS["NAMED"]["effects"][0]
SECOND = EFFECT | {"name": "hysteresis", "variant": {}, "scope": {"joints": ["*"]}, "rivals": []}
KNOWN = {"name": "half_width", "value": 1.55, "unit": "deg", "ci95": [1.42, 1.69]}
OPEN = KNOWN | {"ci95": [1.42, None], "open_above": True, "identifiable": False}
TABLE = {"place": "right bending over extension at L4L5", "gap": 0.3}
PART, UNKNOWN = VERDICTS["PART"]["part"], VERDICTS["UNKNOWN"]["unknown"]
TIED = [{"name": name, "coordinates": ["extension"]} for name in ("neutral_zone", "creep")]
TIED = [one | {"behind": 2.0 * n} for n, one in enumerate(TIED)]


def doubling(rise: float) -> dict[str, Any]:
    """A stiffening effect whose stiffness doubles at 33° over the root of this many 1/rad²."""
    growth = {"name": "growth", "value": rise, "unit": "1/rad^2", "ci95": [0.9 * rise, 1.1 * rise]}
    return EFFECT | {
        "name": "nonlinear_stiffening",
        "variant": {"shape": "cubic"},
        "parameters": [growth],
    }


def reason(which: Reason, **more: Any) -> dict[str, Any]:
    return {"unknown": UNKNOWN | {"reason": which.value}, "suspected_data_errors": [], **more}


def taken(without: float | None) -> dict[str, Any]:
    return {"imperfections": VERDICTS["NULL"]["imperfections"] | {"gap_without": without}}


@dataclass(frozen=True)
class Case:
    """A made-up study, and rules with the verdicts that it must come to.

    Attributes
    ----------
    answer : of `VERDICTS`. changed : keys of its verdict. tables : what differs in its tables.
    settings : what differs in the study. specimens : of the cohort.
    """

    answer: str
    says: str
    tables: Change | None = None
    changed: Mapping[str, Any] = field(default_factory=dict)
    settings: Mapping[str, Any] = field(default_factory=dict)
    specimens: int = 3

    @property
    def expected(self) -> set[tuple[str, ...]]:
        return {tuple(one.split()) for one in self.says.split("; ")}


NOISE = VERDICTS["NAMED"]["noise"]
ASSUMED = {"source": "declared", "rotation_sd_deg": 0.2, "translation_sd_mm": 0.1}
WRONG = VERDICTS["SET"]["suspected_data_errors"]
NO_BASE = reason(Reason.NO_BASE, noise={"source": ""}, imperfections=None)
NEXT = (f"{UNNAMED}: own, shared", "load_offset")
FAR = {"fits": 10, "open": 0.31}
FAR |= {"not_fitted": [["creep", "neutral_zone"], ["level_dependence", "something_else"]]}
# fmt: off
CASES: tuple[Case, ...] = (
    Case("NAMED", "verdict named; misfit_after named; misfit_base told; errors ok; sample ok; "
         "noise ok_repeats; by_test single; alternatives ahead; stiffness rises; remainder ok; "
         "methods searched; method_left_out both; predicted ok; carries both; "
         "left_out test; left_out specimen; tests check; set_up check", None,
         left(test=0.4, specimen=0.8)),
    Case("NAMED", "verdict large; certain stop; remainder stop", after(3.4, 3.1, 3.7)),
    Case("PART", "verdict part; remainder check; remains place; shape seen", after(1.2, 0.9, 1.5),
         {"effects": [EFFECT, SECOND]}),
    Case("NAMED", "verdict part; remainder check", after(1.7, 1.6, 1.8)),
    Case("PART", "verdict part_open; shape unseen", None, {"part": PART | {"left_shape": None}}),
    Case("SET", "verdict set_one", None, {"candidates_in_set": ["level_dependence"],
         "probabilities": {"level_dependence": 0.92, "something_else": 0.08}}),
    Case("SET", "verdict set_beside_one", None, {"effects": [SECOND], "candidates": TIED[:1],
         "probabilities": {"hysteresis": 0.97, "neutral_zone": 0.7}}),
    Case("SET", "verdict set; misfit_after likeliest; alternatives set_silent; next separate"),
    Case("SET", "verdict set_beside; alternatives set; alternatives alone", None,
         {"effects": [SECOND], "candidates": TIED}),
    Case("SET", "verdict set_many", None, {"candidates_in_set": [f"e_{n}" for n in range(15)]}),
    Case("NULL", "verdict null; power some; power hardest; power easiest; by_test within",
         whole(0.2, 0.0)),
    Case("NULL", "verdict null", whole(0.2, 0.0), {
        "smallest_detectable": VERDICTS["NULL"]["smallest_detectable"][:1]}),
    Case("NULL", "verdict null_open", whole(0.2, 0.0), {
        "probabilities": {"nothing": 0.06, "neutral_zone": 0.9}}),
    Case("NULL", "verdict null_misfit; power all; tests ok; by_test base", whole(1.0, 0.8),
         {"not_testable": []}),
    Case("NULL", "verdict null_blind; power stop_blind; tests stop", None,
         {"smallest_detectable": []}),
    Case("UNKNOWN", "verdict unknown_shape; unexplained place; alternatives nearest; shape seen"),
    Case("UNKNOWN", "verdict unknown_shape", None, reason(Reason.IMITATED_TOGETHER)),
    Case("UNKNOWN", "verdict unknown_part; alternatives nearest", None, {
        **reason(Reason.A_PART_STAYS),
        "probabilities": {"something_else": 1.0, "nonlinear_stiffening": 0.99}}),
    Case("UNKNOWN", "verdict unknown_much", None, {
        "unknown": UNKNOWN | {"reason": "most_stays", "stays": 4.2}}),
    # how far the search came
    Case("NAMED", "ended ok", None, {"search": {"ended": "done", "fits": 3, "open": 0.01}}),
    Case("NAMED", "ended check_fits", None, {"search": FAR | {"ended": "fits"}}),
    Case("NAMED", "ended check_minutes", None, {"search": FAR | {"ended": "minutes"}}),
    Case("NAMED", "accuracy check", None, {"noise": NOISE | {
        "accuracy_assumed": True, "accuracy_rotation_deg": 0.1}}),
    Case("UNKNOWN", "verdict unknown_left_out", None, reason(Reason.NOT_PROVEN)),
    Case("UNKNOWN", "verdict unknown_data; errors stop", None,
         reason(Reason.DATA_ERRORS, suspected_data_errors=WRONG)),
    Case("UNKNOWN", "verdict unknown_no_base; values stop_no_base; noise stop_none",
         without(*frames("NULL")), NO_BASE),
    # misfit by test
    Case("NAMED", "by_test one", by_test(flexion=(3.0, 0.5))),
    Case("NAMED", "by_test all", by_test(a=(3.0, 0.5), b=(2.0, 1.0))),
    Case("NAMED", "by_test some", by_test(a=(3.0, 0.5), b=(2.0, 1.0), c=(2.0, 1.9))),
    Case("NAMED", "by_test worse", by_test(a=(3.0, 0.5), b=(2.0, 2.9))),
    Case("NAMED", "by_test none", by_test(a=(3.0, 2.9), b=(2.0, 2.1))),
    # stiffness
    Case("NAMED", "stiffness falls", slopes(1.0, 0.5)),
    Case("NAMED", "stiffness alike", slopes(1.0, 1.05)),
    # left-out tests, specimens and load steps: misfits of both models, and whether it is worse
    Case("NAMED", "carries test", folds(test=(2.0, 1.0, False), specimen=(2.0, 1.8, False)),
         left(test=0.5, specimen=0.1)),
    Case("NAMED", "carries specimen", folds(test=(2.0, 2.2, False), specimen=(2.0, 1.0, False)),
         left(test=-0.1, specimen=0.5)),
    Case("NAMED", "carries specimen", not_where_it_matters, left(test=0.4, specimen=0.8)),
    Case("NAMED", "carries steps; left_out steps; predicted ok_halves",
         folds(steps=(2.0, 1.0, False)), left(steps=0.5)),
    Case("NAMED", "carries worse", folds(test=(2.0, 1.0, False), specimen=(2.0, 3.0, True)),
         left(test=0.5, specimen=-0.5)),
    Case("NAMED", "carries nowhere; predicted check_few", folds(test=(2.0, 1.8, False)),
         left(test=0.1)),
    Case("NAMED", "carries unsure", not_where_it_matters, left(test=0.4)),
    Case("NAMED", "carries test",
         folds(test=(2.0, 1.0, False), specimen=(2.0, 1.0, False), two=True),
         left(test=0.5, specimen=0.5), specimens=2),
    Case("NAMED", "method_left_out tests", specimens=1),
    Case("NAMED", "method_left_out specimens", settings={"tests": ("flexion",)}),
    Case("NAMED", "method_left_out steps", settings={"tests": ("flexion",)}, specimens=1),
    Case("NAMED", "carries untold; predicted check_none", without("held_out")),
    Case("NAMED", "predicted check_some",
         folds(test=(2.0, 1.0, False), specimen=(np.nan, np.nan, False))),
    # what has no name, and what to do
    Case("PART", "curve left_out", None, {"tabulated": TABLE | {"held_out_closed": -0.2}}),
    Case("UNKNOWN", "curve fit", None, {
        "unknown": UNKNOWN | {"formula": {"terms": []}},  # of a file of versions before
        "tabulated": TABLE | {"held_out_closed": None}}),
    Case("PART", "next unnamed", advised(NEXT[0], "flexion: once more")),
    Case("NULL", "next none", advised(NEXT[1], "flexion: once more", "tells_nothing")),
    # can it be trusted?
    Case("NAMED", "noise check_assumed", None, {"noise": ASSUMED}),
    Case("NAMED", "outliers check", None, {"noise": NOISE | {"outliers_left_out": 4}}),
    Case("NAMED", "set_up stop", set_up(9.0)),
    Case("NAMED", "set_up stop", set_up(-15.0)),
    Case("NAMED", "set_up check", set_up(1.0, common=True)),
    Case("NAMED", "set_up ok", set_up(1.0), taken(0.15)),
    Case("NAMED", "set_up ok_more", set_up(1.0), taken(0.9)),
    Case("NAMED", "set_up ok_alone", set_up(1.0), taken(None)),
    Case("NAMED", "values ok; size shared", None, {"effects": [EFFECT | {"parameters": [KNOWN]}]}),
    Case("NAMED", "size beyond", None, {"effects": [doubling(1.0)]}),
    Case("NAMED", "size shared", None, {"effects": [doubling(1e4)]}),
    Case("NAMED", "values check", None, {"effects": [EFFECT | {"parameters": [OPEN]}]}),
    Case("NAMED", "sample check", specimens=2),
    Case("NAMED", "verdict named", settings={"base": DiscrepancyBase(model="base.yaml")}),
)
"""What is concluded, and beside each a study in which that is false."""
# fmt: on


def made(root: Path, case: Case) -> tuple[Any, Any, ResultTables, Page]:
    """Study, cohort, results and page of a case."""
    settings, cohort = study_of(root)
    rows = frames(case.answer)
    rows |= case.tables(rows) if case.tables else {}
    key = Drawing("load_displacement", "Load over motion", "Words.", ('<svg width="1"></svg>',))
    read = tables(VERDICTS[case.answer] | case.changed, rows, root)
    results = ResultTables(read, drawings={key.name: key})
    settings = settings.model_copy(update=case.settings)
    cohort = replace(cohort, specimens=cohort.specimens.head(case.specimens))
    return settings, cohort, results, page(settings, cohort, results)


SEVERAL = ("power", "left_out", "alternatives")
"""Rules that may come to several conclusions of one study."""


@sweep("case", CASES)
def test_a_study_comes_to_its_conclusions_and_no_other(case: Case, root: Path) -> None:
    settings, cohort, results, shown = made(root, case)
    found = verdicts(shown.conclusions)
    assert case.expected <= found, found
    for rule, _ in case.expected:
        assert rule in SEVERAL or len([one for one in found if one[0] == rule]) == 1
    assert list(faults_of_told(shown.told)) == []
    words = " ".join(f"{one.text} {one.note}" for one in shown.told).lower()
    assert [word for word in FORBIDDEN if word in words] == []
    assert "_" not in words.replace("e_", "")
    html = shown.html(settings, cohort, results)
    assert list(faults_of_page(html)) == []
    assert html == page(settings, cohort, results).html(settings, cohort, results)


def test_every_sentence_belongs_to_a_study_that_was_tried() -> None:
    assert set().union(*(case.expected for case in CASES)) == all_verdicts(sentences_of(PACKAGE))
    assert list(faults_of_sentences(PACKAGE)) == []
    assert UNNAMED == advice.UNNAMED


@sweep("row", [row for row in sentences_of(PACKAGE) if "left-out" in row.text])
def test_left_out_is_always_a_test_a_specimen_or_load_steps(row: Sentence) -> None:
    assert re.search(r"left-out (tests?|specimens?|load steps|readings|\{parts\})", row.text)
    if row.rule == "carries" and row.figure and row.verdict != "steps":
        assert "predicted from the others" in row.note


def test_a_set_of_one_says_what_holds_the_rest(root: Path) -> None:
    one = {"candidates_in_set": ["level_dependence"]}
    one |= {"probabilities": {"level_dependence": 0.92, "something_else": 0.08}}
    *_, shown = made(root, Case("SET", "", None, one))
    told = "level dependence is missing, or something that is in no list (0.92; 0.080)"
    assert told in shown.at("answer")[0].text


def said(shown: Page, rule: str, place: str = "finding") -> Told:
    (one,) = [told for told in shown.at(place) if told.rule == rule]
    return one


def test_numbers_of_the_page_are_those_of_the_tables(root: Path) -> None:
    _, _, results, shown = made(root, CASES[0])
    where = results.table("where").query("by == 'all'").set_index("model")
    for rule, model in (("misfit_base", "base"), ("misfit_after", "with_effects")):
        rms = where.loc[model, "rms_residual"]  # the root of chi2 / dof
        assert said(shown, rule, "key").values["value"].number == pytest.approx((rms**2 - 1) ** 0.5)
    for one in verdict_of(VERDICTS["NAMED"] | left(test=0.4, specimen=0.8)).left_out:
        change = 100.0 * (one.with_effects / one.base - 1.0)
        assert said(shown, "carries").values[one.kind].number == pytest.approx(change)
    text = said(shown, "carries").text.replace("\u00a0", " ")
    assert "changes by −40 % in left-out tests and by −80 % in left-out specimens" in text
    assert "at rest to 1.000 N m/° at 5 N m" in said(shown, "stiffness").text.replace("\u00a0", " ")
    assert "0.97" in said(shown, "alternatives").text
    assert "0.02" in said(shown, "alternatives").text
    assert "joint centre" in said(shown, "set_up", "light").text
    assert "L4–L5" in shown.at("answer")[0].text


def test_what_the_numbers_are_is_told(root: Path) -> None:
    """SDs of the mean of cycles, a threshold with a floor, readings of tests that are predicted."""
    _, _, _, shown = made(root, CASES[0])
    assert "the mean of cycles" in said(shown, "noise", "key").note
    methods = said(shown, "methods", "methods").text
    assert "a name is said from 0.95 on" in methods
    assert "SDs of the noise of the mean of cycles" in methods
    assert "readings of tests" in said(shown, "predicted", "light").text


def test_a_large_remainder_makes_no_name_certain(root: Path) -> None:
    """However well its evidence beats that of others."""
    for case, words in ((CASES[0], "Explained"), (CASES[1], "Partly explained at best")):
        _, _, _, shown = made(root, case)
        assert shown.at("answer")[0].text.startswith(words)
        stops = [one.rule for one in shown.at("depends") if one.level == "stop"]
        assert stops == (["certain"] if case is CASES[1] else [])


def test_a_notebook_says_what_the_page_says(root: Path) -> None:
    model = ModelFile.model_validate(
        {"model": "m", "cohort": "c", "effects": [{"effect": "linear_bushing"}]}
    )
    for case in (*CASES[:12], Case("NAMED", "", None, {"search": FAR | {"ended": "minutes"}})):
        if case.tables is None:
            verdict = verdict_of(VERDICTS[case.answer] | case.changed)
            rows = {name: rows.to_dict("records") for name, rows in frames(case.answer).items()}
            settings, cohort, _, shown = made(root, case)
            found = _result(settings, cohort, DiscrepancyResults(verdict, rows, model, model))
            assert found.headline == shown.at("answer")[0].text
            of_search = [one.text for one in shown.at("light") if one.rule == "ended"]
            assert [found.search] == (of_search or [""])


def chart(name: str, root: Path, case: Case) -> Chart:
    settings, cohort, results, _ = made(root, case)
    module, _, function = KIND.figure(name).at.partition(":")
    drawn: Chart = getattr(import_module(f"{PACKAGE}.{module}"), function)(
        settings, cohort, results.tables
    )
    return drawn


LONG = {"effects": [EFFECT | {"name": "flexion_extension_asymmetry_of_some_kind"}, SECOND]}
NOTHING = Case("UNKNOWN", "", without(*frames("NULL")), NO_BASE)
DRAWN = {"evidence": [CASES[7], Case("SET", "")], "next_tests": [Case("SET", "")]}
"""Cases in which a figure shows something else."""


@pytest.mark.parametrize("name", [figure.name for figure in KIND.figures])
def test_every_figure_can_be_read_whatever_the_verdict(name: str, root: Path) -> None:
    """Also of long names, and where there is nothing to be drawn."""
    for case in (CASES[0], Case("PART", "", None, LONG), NOTHING, *DRAWN.get(name, [])):
        assert list(faults_of_chart(chart(name, root, case))) == []


def test_the_key_figure_shows_where_a_load_drives_what_it_should_not(root: Path) -> None:
    """A misfit aside of the load: that motion over the load of the test, not over its own."""

    def bent(rows: dict[str, pd.DataFrame]) -> dict[str, pd.DataFrame]:
        gap = rows["gap"]
        aside = (gap["test"] == "flexion") & (gap["coordinate"] == "right_bending")
        return {"gap": gap.assign(measured=gap["measured"].mask(aside, gap["measured"] + 1.0))}

    panels = chart("load_displacement", root, Case("NULL", "", bent)).panels
    first, *_ = panels
    assert first.x_label.startswith("lateral bending")
    assert first.y_label == "flexion–extension moment (N m)"
    plain = chart("load_displacement", root, CASES[0]).panels
    first = plain[0].frame
    bars = first[first["series"] == "measured"]
    assert (bars["x_high"] - bars["x_low"]).to_numpy() == pytest.approx(4.0 * SD_DEG)


def test_files_of_tables_are_there(root: Path) -> None:
    for answer in VERDICTS:
        _, _, _, shown = made(root, Case(answer, ""))
        names = [f"{table.name}.parquet" for table in KIND.tables]
        known = {f"{KIND.files.subfolder}{name}" for name in (*names, "verdict.json")}
        assert {table.file for table in shown.tables} <= known
        assert len({table.name for table in shown.tables}) == len(shown.tables)


@sweep("answer", VERDICTS)
def test_a_verdict_is_read_as_it_was_written(answer: str) -> None:
    verdict = verdict_of(VERDICTS[answer])
    assert verdict_of(json.loads(json.dumps(plain_data(verdict)))) == verdict


def test_what_settings_leave_out_is_told(tmp_path: Path) -> None:
    text = "base: {stiffness: per_joint}\nnuisance: {load_gain: 0}\n"
    study, _ = check(project(tmp_path, text), STUDY)
    assert isinstance(study, Discrepancy)
    assert list(left_out(study)) == [
        "errors of the set-up: size of the load (nuisance: load_gain: 0)",
    ]
