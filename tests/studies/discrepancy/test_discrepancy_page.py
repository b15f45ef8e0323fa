"""Figures, headline and page of a search for missing effects, from made-up results.

Catches a figure or page that fails for one of the verdicts, hides what matters, or says what the
verdict does not.
"""

import json
import re
from collections.abc import Mapping
from functools import cache
from importlib import import_module
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from discrepancy_cases import (
    EFFECTS,
    HIDDEN,
    STUDY,
    VERDICTS,
    frames,
    project,
    tables,
)
from matplotlib.figure import Figure
from spinepipe.report.page.document import Picture, ResultTables
from sweeps import sweep

from spinepipe.report.style import picture, style
from spinepipe.studies.discrepancy.figures.load_displacement import worst_places
from spinepipe.studies.discrepancy.findings import (
    findings,
    headline,
    how_sure,
    share_closed_by_kind,
    warnings,
)
from spinepipe.studies.discrepancy.kind import KIND
from spinepipe.studies.discrepancy.page import document, left_out, page_tables
from spinepipe.studies.discrepancy.settings import Discrepancy
from spinepipe.studies.discrepancy.verdict import Conclusion, Verdict, plain_data, verdict_of
from spinepipe.studies.discrepancy.verdict_unnamed import Reason
from spinepipe.studies.discrepancy.words import general
from spinepipe.studies.read import check
from spinepipe.tables import StudyTables

ROOT = Path(__file__).resolve().parents[3]
NOWHERE = pd.DataFrame()
FIGURES = [figure.name for figure in KIND.figures]


@cache
def study_of(root: Path) -> Any:
    return check(root, STUDY)


def rows_of(made: Mapping[str, pd.DataFrame]) -> ResultTables:
    """Results of these tables alone."""
    return ResultTables(StudyTables(made), {}, {})


def drawn(name: str, root: Path, answer: str, **changed: pd.DataFrame) -> Figure:
    """A figure of a made-up outcome, some of its tables changed."""
    return drawn_of(name, root, VERDICTS[answer], frames(answer) | changed)


def drawn_of(
    name: str, root: Path, verdict: Mapping[str, Any], made: Mapping[str, pd.DataFrame]
) -> Figure:
    """A figure of these tables and this verdict."""
    study, cohort = study_of(root)
    module, _, function = KIND.figure(name).at.partition(":")
    figure_of = getattr(import_module(f"spinepipe.studies.discrepancy.{module}"), function)
    with style():
        figure: Figure = figure_of(study, cohort, tables(verdict, made, root))
    return figure


def said(figure: Figure) -> str:
    """All text of a figure in one line."""
    texts = [*figure.texts]
    for legend in figure.legends:
        texts += [legend.get_title(), *legend.get_texts()]
    for axis in figure.axes:
        texts += [*axis.texts, axis.title, axis._left_title]  # type: ignore[attr-defined]
        texts += [axis.xaxis.label, *axis.get_yticklabels(), *axis.get_xticklabels()]
    return " ".join(" ".join(text.get_text() for text in texts).split())


@sweep("answer, name", list(product(VERDICTS, FIGURES)))
def test_every_figure_is_drawn_whatever_the_verdict(answer: str, name: str, root: Path) -> None:
    figure = drawn(name, root, answer)
    assert len(said(figure)) > 40
    if answer == "NAMED":  # the others have no mark that this one has not
        with style():
            assert picture(figure, "svg")


def test_the_map_shows_each_test_before_and_after(root: Path) -> None:
    figure = drawn("gap_map", root, "NAMED")
    titles = [axis.get_title("left").strip() for axis in figure.axes]
    assert titles.count("base") == titles.count("with effects") == 3
    assert "9.3" in said(figure)
    alone = [axis.get_title("left").strip() for axis in drawn("gap_map", root, "NULL").axes]
    assert (alone.count("base"), alone.count("with effects")) == (3, 0)


def test_the_map_takes_six_coordinates(root: Path) -> None:
    one = frames("NAMED")["where"]
    one = one[one["by"] == "joint x coordinate x test"]
    every = [one.assign(coordinate=name) for name in ("anterior", "superior", "right")]
    figure = drawn("gap_map", root, "NAMED", where=pd.concat([one, *every]))
    assert "ant." in said(figure)


def test_places_of_the_largest_gap_come_first_and_once() -> None:
    gap = frames("NAMED")["gap"]
    _, *place = worst_places(gap)[0]
    assert place == ["flexion", "L4L5", "extension"]
    assert len(worst_places(gap)) == 3  # one is off, and two more for comparison
    hidden = gap.assign(base=np.nan)
    assert worst_places(hidden) == []
    off = gap.assign(base=gap["measured"] + 10.0 * gap["noise_sd"])
    found = worst_places(off)
    assert len(found) == 6
    assert len({tuple(place[1:]) for place in found}) == 6


def test_a_model_without_poses_is_said_to_have_none(root: Path) -> None:
    made = frames("NAMED")
    gap = made["gap"].assign(base=np.nan, with_effects=np.nan)
    assert "no pose" in said(drawn("gap_by_step", root, "NAMED", gap=gap))
    where = made["where"].assign(gap=np.nan)
    assert "no model has a pose" in said(drawn("gap_map", root, "NAMED", where=where))
    nothing = made["held_out"].iloc[:0]
    assert "nothing was left out" in said(
        drawn("held_out_by_test", root, "NAMED", held_out=nothing)
    )
    empty = {name: made[name].iloc[:0] for name in ("candidates", "confusions")}
    assert "no effect was tried" in said(drawn("evidence_by_round", root, "NULL", **empty))


def test_what_cannot_be_tested_stands_beside_what_can(root: Path) -> None:
    words = said(drawn("effect_confusions", root, "NULL"))
    assert words.count("not testable here") == len(HIDDEN) + 1  # and in the key
    assert all(general(name) in words for name in [*EFFECTS, *HIDDEN])


HEADLINES = {
    "NAMED": "The model lacks a neutral zone at L4L5, in flexion–extension.",
    "NULL": "Nothing is missing above the noise. An effect would have been found from a gap of "
    "0.19 noise SD (the easiest to see) to 0.35 (the hardest).",
    "SET": "One of these is missing, and these tests cannot tell which: a neutral zone or "
    "nonlinear stiffening.",
    "UNKNOWN": "Something is missing that is none of the known effects. It shows most at L4L5, "
    "flexion–extension, test flexion.",
    "PART": "The model lacks a neutral zone at L4L5, in flexion–extension. That is a part of what "
    "is missing: more stays, a gap of 1.20 noise SD, most at L3L4, axial rotation, test left axial "
    "rotation.",
}


@sweep("answer, words", HEADLINES.items())
def test_the_verdict_is_one_sentence(answer: str, words: str) -> None:
    assert headline(verdict_of(VERDICTS[answer]), frames(answer)["where"]) == words


def test_how_sure_a_name_is() -> None:
    assert how_sure(verdict_of(VERDICTS["NAMED"])) == (
        "Neutral zone: log evidence 88.0, 6.2 is needed; next best nonlinear stiffening, 17 "
        "behind. Residuals of 4.10 noise SD become 1.02 (1 is noise). On motion held out of the "
        "fits the gap falls from 4.18 to 0.35, by 83 %."
    )
    apart = VERDICTS["NAMED"] | {
        "left_out": [
            {"kind": "test", "folds": 2, "base": 3.54, "with_effects": 2.69}
            | {"excess_closed": 0.42, "gap_closed": 0.24},
            {"kind": "specimen", "folds": 2, "base": 4.9, "with_effects": 2.8}
            | {"excess_closed": 0.67, "gap_closed": 0.43},
        ]
    }
    assert share_closed_by_kind(verdict_of(apart)) == (
        "Held out, the gap falls by 24 % in tests left out, with fits to the other tests of the "
        "same specimens (42 % of the excess misfit); by 43 % in specimens left out, with their own "
        "stiffness and sizes fitted to half of their load steps (67 % of the excess misfit). The "
        "excess misfit (chi squared) is the square of the gap."
    )
    assert share_closed_by_kind(verdict_of(VERDICTS["NAMED"])) == ""
    assert "Its shape: one side only" in how_sure(verdict_of(VERDICTS["UNKNOWN"]))


def test_two_effects_and_a_set_beside_a_name() -> None:
    (first,) = VERDICTS["NAMED"]["effects"]
    scope = {"joints": ["*"], "specimens": ["a", "b"]}
    second = first | {"name": "hysteresis", "scope": scope}
    both = VERDICTS["NAMED"] | {"effects": [first, second]}
    told = headline(verdict_of(both), NOWHERE)
    assert told.endswith("; and hysteresis at all joints, in specimens a and b.")
    beside = VERDICTS["SET"] | {"effects": [second], "candidates_in_set": ["creep", "marker_bias"]}
    assert headline(verdict_of(beside), NOWHERE) == (
        "The model lacks hysteresis at all joints, in specimens a and b. Besides, one of these is "
        "missing, and these tests cannot tell which: creep or a marker bias."
    )


def test_keys_that_are_not_there_are_not_needed() -> None:
    for answer in Conclusion:
        bare = verdict_of({"cohort": "c", "verdict": answer.value})
        assert headline(bare, NOWHERE)
        assert how_sure(bare) == ""
        assert findings(bare, rows_of({})) == []
        assert page_tables(bare, rows_of({})) == []
    with pytest.raises(ValueError, match="PERHAPS"):
        verdict_of({"cohort": "c", "verdict": "PERHAPS"})


def test_errors_of_the_data_come_first() -> None:
    (told,) = warnings(verdict_of(VERDICTS["SET"]))
    assert told == (
        "Look at the data first: specimen b, flexion, cycle 2, L3L4: sign flipped (slope on the "
        "other cycles is -0.98)."
    )


def told(answer: str, **changes: Any) -> str:
    data: Mapping[str, Any] = VERDICTS[answer] | changes
    return " ".join(findings(verdict_of(data), rows_of(frames(answer))))


def test_findings_have_sizes_places_and_noise() -> None:
    words = told("NAMED").replace("\u00a0", " ")
    assert "half width 1.55° (95 % interval 1.42 to 1.69)" in words
    assert "L4L5 in flexion–extension, test flexion: 9.3 (7.4 to 11.3)" in words
    assert "above the noise at 1 of 27 places" in words
    assert "1.10 (0.88 to 1.42) with the base, 0.00 (0.00 to 0.10) with the effects" in words
    assert (
        "SD of one reading 0.10°, from repeated cycles, correlation from step to step 0.30" in words
    )
    assert "What would show them: joint centre offset: measured translations" in words
    assert "agree within the noise" in told("NULL")
    assert "contact (stop) 0.20" in told("NULL")  # 0.15 + 0.3 * 0.18, rounded
    declared = told("NULL", noise={"source": "declared", "rotation_sd_deg": 0.2})
    assert "no cycle was repeated, so all hangs on that number" in declared


OPEN_WIDTH = {
    "name": "half_width",
    "value": 1.55,
    "unit": "deg",
    "ci95": [1.42, None],
    "open_above": True,
    "identifiable": False,
}


def test_a_value_that_is_open_to_one_side_is_told_by_its_other_end() -> None:
    (named,) = VERDICTS["NAMED"]["effects"]
    changed = {"effects": [named | {"parameters": [OPEN_WIDTH]}]}
    words = told("NAMED", **changed).replace("\u00a0", " ")
    assert "half width: at least 1.42° (95 %, no upper end)" in words
    assert "1.55" not in words
    verdict = verdict_of(VERDICTS["NAMED"] | changed)
    text = json.dumps(plain_data(verdict), allow_nan=False)
    assert '"ci95": [1.42, null]' in text
    assert verdict_of(json.loads(text)) == verdict
    shown = page_tables(verdict, rows_of(frames("NAMED")))
    (row,) = next(one for one in shown if one.title.startswith("What is missing")).rows
    assert "at least 1.42, no upper end" in str(row)
    assert "1.55" not in str(row)


@sweep("answer", VERDICTS)
def test_the_page_opens_with_the_verdict(answer: str, root: Path) -> None:
    study, cohort = study_of(root)
    svg = "<svg xmlns='http://www.w3.org/2000/svg'/>"
    pictures = {one.name: Picture.of(one.name, one.title, svg, "Words.") for one in KIND.figures}
    found = ResultTables(tables(VERDICTS[answer], frames(answer), root), {}, pictures)
    page = document(study, cohort, found).html(study, cohort)
    assert page == document(study, cohort, found).html(study, cohort)
    assert f'<p class="headline">{HEADLINES[answer]}</p>' in page
    places = [page.index(f'<section id="{name}"') for name in ("findings", "figures", "segment")]
    assert places == sorted(places)
    assert page.index('class="headline"') < page.index("<li>")
    if answer == "SET":
        assert page.index('class="warning"') < page.index('class="headline"')
    ids = re.findall(r'id="([^"]+)"', page[: page.index("<script")])
    assert len(set(ids)) == len(ids)


def test_tables_of_the_page_hold_the_verdict() -> None:
    found = rows_of(frames("NAMED"))
    titles = [table.title for table in page_tables(verdict_of(VERDICTS["NAMED"]), found)]
    assert titles[:4] == [
        "What is missing, and how large it is",
        "What a tester reads off the curves",
        "Next best names",
        "What these tests cannot show",
    ]
    assert "One of these is missing" not in titles
    in_set = page_tables(verdict_of(VERDICTS["SET"]), found)
    assert [table.title for table in in_set][:2] == [
        "Suspected errors of the data",
        "One of these is missing",
    ]


def test_the_nearest_effect_of_something_unknown_is_told_but_not_named() -> None:
    unknown = VERDICTS["UNKNOWN"]["unknown"]
    assert "Nearest known effect: neutral zone, log evidence 88.0." in told("UNKNOWN")
    for reason in set(Reason) - {Reason.NO_KNOWN_EFFECT}:
        assert "Nearest" not in told("UNKNOWN", unknown=unknown | {"reason": reason.value})


def test_what_is_unknown_shows_most_where_the_gap_is_largest() -> None:
    where = frames("UNKNOWN")["where"]
    moved = {"L4L5": "L5S1", "extension": "right_bending", "flexion": "flexion_extension"}
    told = headline(verdict_of(VERDICTS["UNKNOWN"]), where.replace(moved))
    assert told.endswith("at L5S1, lateral bending, test flexion–extension.")
    within = where.assign(gap_low=0.0)
    assert "most" not in headline(verdict_of(VERDICTS["UNKNOWN"]), within)


def test_a_base_without_a_fit_is_all_that_is_told(root: Path) -> None:
    why = "the base model cannot be fitted: no start has a pose"
    data = {
        "cohort": "c",
        "verdict": "UNKNOWN",
        "why": why,
        "unknown": {"where": "no start has a pose", "shape": "not known", "reason": "no_base"},
    }
    verdict = verdict_of(data)
    assert headline(verdict, NOWHERE).startswith("Nothing can be said of what is missing")
    assert why in how_sure(verdict)
    empty = {name: rows.iloc[:0] for name, rows in frames("NULL").items()}
    assert findings(verdict, rows_of(empty)) == []
    for name in FIGURES:
        assert re.search("No|not", said(drawn_of(name, root, data, empty)))


def test_no_name_is_not_always_an_unknown_effect() -> None:
    def of(reason: str, **more: Any) -> Verdict:
        unknown = {"where": "anywhere", "shape": "load over bending", "reason": reason}
        return verdict_of(VERDICTS["UNKNOWN"] | {"unknown": unknown} | more)

    why = "level_dependence is no more: try base per_joint"
    stiffness = of("stiffness_of_each_joint", why=why)
    assert headline(stiffness, NOWHERE) == "Something is missing, but no name is believed."
    assert "Why no name: level dependence is no more: try base per_joint." in how_sure(stiffness)
    assert "load over bending" not in how_sure(stiffness)
    errors = [{"where": "L4L5", "what": "a sign", "evidence": ""}]
    why = "the data look wrong, so nothing is named: a sign (L4L5)"
    suspected = of("data_errors", why=why, suspected_data_errors=errors)
    assert headline(suspected, NOWHERE) == (
        "The data look wrong, so nothing is named: a sign (L4L5)."
    )
    assert "load over bending" not in how_sure(suspected)
    for reason in ("a_part_stays", "most_stays"):
        stays = of(reason, why="much stays")
        assert headline(stays, NOWHERE).endswith("none of the known effects.")
        assert "Why no name: much stays. Its shape: load over bending." in how_sure(stays)


@sweep("answer", VERDICTS)
def test_what_is_written_is_read(answer: str) -> None:
    verdict = verdict_of(VERDICTS[answer])
    assert verdict_of(json.loads(json.dumps(plain_data(verdict)))) == verdict


def test_what_settings_leave_out_is_told(tmp_path: Path) -> None:
    text = (
        "base: {stiffness: per_joint}\nheld_out: {tests: false}\n"
        "nuisance: {load_gain: 0, rotation_order: 0}\n"
    )
    study, _ = check(project(tmp_path, text), STUDY)
    assert isinstance(study, Discrepancy)
    assert list(left_out(study)) == [
        "prediction of left-out tests (held_out: tests: false)",
        "nuisance load_gain (nuisance: load_gain: 0)",
        "nuisance rotation_order (nuisance: rotation_order: 0)",
    ]


def test_what_stays_beside_what_is_certain() -> None:
    part = verdict_of(VERDICTS["PART"])
    words = how_sure(part)
    assert "Why that is not all: a gap of 2.4 noise SD in axial rotation" in words
    assert "The shape of what stays: load over the joint's own axial rotation, alike in" in words
    said = told("PART").replace("\u00a0", " ")
    assert (
        "What stays with the effects (gap in noise SD, 95 % interval): L3L4 in axial rotation, "
        "test left axial rotation: 2.4 (1.9 to 3.0)." in said
    )
    assert "half width 1.55°" in said  # and how large what is certain is
    inside = frames("PART")["where"].assign(gap_low=0.0)
    assert headline(part, inside).endswith("more stays, a gap of 1.20 noise SD.")
    known = VERDICTS["PART"]["part"] | {"left_gap": None, "left_shape": None, "coordinate": None}
    bare = verdict_of(VERDICTS["PART"] | {"part": known})
    assert headline(bare, NOWHERE).endswith("That is a part of what is missing: more stays.")
    assert "shape" not in how_sure(bare)


def test_a_set_may_stand_beside_what_is_certain_and_more_stay() -> None:
    tied = ["hysteresis", "creep"]
    both = VERDICTS["PART"] | {"verdict": "SET", "candidates_in_set": tied}
    words = headline(verdict_of(both), frames("PART")["where"])
    assert words.startswith("The model lacks a neutral zone at L4L5, in flexion–extension. Besides")
    assert "hysteresis or creep" in words
    assert "more stays, a gap of 1.20 noise SD, most at L3L4, axial rotation" in words
    alone = headline(verdict_of(both | {"effects": []}), frames("PART")["where"])
    assert ". More stays, a gap of 1.20 noise SD" in alone  # a set names nothing that is a part


def test_no_sentence_describes_one_motion_and_points_to_another() -> None:
    where = frames("UNKNOWN")["where"]
    unknown = {
        "where": "L4L5, anterior (gap 9.3)",
        "shape": "readings of left rotation that drift over the steps of a test, shared",
        "reason": "no_known_effect",
        "coordinate": "left_rotation",
    }
    drifting = verdict_of(VERDICTS["UNKNOWN"] | {"unknown": unknown})
    apart = " ".join(findings(drifting, rows_of(frames("UNKNOWN"))))
    assert headline(drifting, where).endswith("at L4L5, flexion–extension, test flexion.")
    assert "one of axial rotation, though the largest gap is in flexion–extension" in apart
    small = (where["joint"] == "L3L4") & (where["coordinate"] == "left_rotation")
    both = where.assign(
        gap=where["gap"].where(~small, 1.5), gap_low=where["gap_low"].where(~small, 1.0)
    )
    assert "at L3L4, axial rotation" in headline(drifting, both)  # where the shape is, if it shows
    same = verdict_of(
        VERDICTS["UNKNOWN"] | {"unknown": unknown | {"coordinate": "extension", "shape": "own"}}
    )
    assert "though the largest gap" not in " ".join(findings(same, rows_of(frames("UNKNOWN"))))


def test_no_advice_is_given_where_none_helps() -> None:
    none = {
        "name": "facet_contact",
        "why": "no trace; no single addition",
        "test_that_would_tell": "",
    }
    some = VERDICTS["NULL"]["not_testable"]
    words = told("NULL", not_testable=[*some, none])
    assert "No single addition that was tried shows contact (stop)." in words
    assert "contact (stop): " not in words
    only = told("NULL", not_testable=[none])
    assert "What would show them" not in only


def test_a_formula_describes_and_names_nothing() -> None:
    term = {
        "specimen": "*",
        "joint": "L4L5",
        "coordinate": "right_bending",
        "acts": "load",
        "term": "bending x extension",
        "coefficient": 2.0,
        "sd": 0.1,
        "unit": "N m",
        "explained": 0.8,
    }
    formula = {
        "terms": [term],
        "text": "moment in right bending at L4L5 = +2 (SD 0.1) N m * bending x extension",
        "explained": 0.83,
        "held_out_closed": 0.7,
        "threshold": 20.0,
    }
    unknown = VERDICTS["UNKNOWN"]["unknown"] | {"formula": formula}
    table = {"place": "load in right_bending at L4L5", "gap": 0.3, "held_out_closed": None}
    words = told("UNKNOWN", unknown=unknown, tabulated=table).replace("\u00a0", " ")
    assert "A formula that describes it, and is no name: moment in lateral bending at L4L5" in words
    assert (
        "explains 83 % of the excess misfit (chi squared) and 70 % of that of readings left out"
        in words
    )
    assert "leaves a gap of 0.30 noise SD." in words
