"""The page of a study of stiffness: what it says follows from its tables, of any outcome.

Seen here: a stiffness that readings do not bound told as a number, a claim of few specimens, by
an uncorrected p or of motion that was not unseen, equal descriptions compared, silent verdicts.
"""

import re
from math import nan
from typing import Any

import numpy as np
import pandas as pd
import pytest
from cohort_page_cases import (
    ALIKE,
    ALL,
    ALL_KINDS,
    BASE,
    BOTH,
    CASE,
    CASES,
    COORDINATES,
    EDGES,
    ONE,
    ONE_JOINT,
    OPEN,
    PUBLISHED,
    SPECIMEN,
    THREE,
    UNIT,
    Case,
    changed,
    claims,
    errors,
    of_all,
    own,
)  # fmt: skip
from cohort_study_cases import Size, tables_of
from page_rules import (
    all_verdicts,
    faults_of_chart,
    faults_of_page,
    faults_of_sentences,
    faults_of_told,
)

from spinepipe.report.conclusions import sentences_of

PACKAGE = "spinepipe.studies.cohort_stiffness"
UNSEEN = {"descriptions", "laws", "centres", "published"}
"""Rules about motion that no fit has seen."""

COMPARING = {*UNSEEN, "specimens", "levels", "load_cases"}
"""Rules that say something over specimens."""


@pytest.mark.parametrize(("case", "expected"), CASES.values(), ids=CASES.keys())
def test_each_outcome_has_its_verdict(case: Case, expected: str) -> None:
    wanted = {tuple(one.split()) for one in expected.split(", ")}
    assert wanted <= case.verdicts, wanted - case.verdicts


def test_every_verdict_that_has_a_sentence_is_reached() -> None:
    reached = set().union(*(case.verdicts for case in ALL.values()))
    assert reached == all_verdicts(sentences_of(PACKAGE))
    assert not list(faults_of_sentences(PACKAGE))
    faults = {name: list(faults_of_told(case.page.told)) for name, case in ALL.items()}
    assert not {name: found for name, found in faults.items() if found}


@pytest.mark.parametrize("name", [*EDGES, "whole", "nothing solved", "open above", "one joint"])
def test_pages_and_figures_keep_the_rules(name: str) -> None:
    """And nothing is fetched, nothing is NaN."""
    faults = [fault for chart in ALL[name].charts.values() for fault in faults_of_chart(chart)]
    html = ALL[name].html
    assert not [*faults, *faults_of_page(html)]
    assert "nan" not in re.sub(r"<svg.*?</svg>|<script.*?</script>", "", html, flags=re.S).split()


def of_rule(case: Case, rule: str) -> dict[str, Any]:
    """Numbers of a rule's only conclusion."""
    (one,) = (one for one in case.page.conclusions if one.rule == rule)
    return {name: (v.number, v.low, v.high, v.n) for name, v in one.values.items()}


def test_the_first_line_is_the_median_over_specimens_with_their_range() -> None:
    """Specimens count by the median of their joints: 2, 4, 6."""
    case = Case(tables=own(THREE))
    told = {name: pytest.approx(values) for name, values in {"a": (4.0, 2.0, 6.0, 3)}.items()}
    assert of_rule(case, "typical") == told
    (answer,) = case.page.at("answer")
    assert (
        answer.text.replace("\u00a0", " ")
        == "A typical joint resists with 4.0 N m/deg in flexion–extension."
    )


def test_few_specimens_are_told_with_the_typical_joint() -> None:
    """Also with three directions and stiffness at rest the answer is short enough."""
    values = {"a": (2.0, 4.0), "b": 4.0}
    for of, words in (({"a": (2.0, 4.0)}, "Joints of a typically"), (values, "2 specimens' typ")):
        case = Case(Size(tuple(of)), own(of, coordinates=COORDINATES, growth=1.0))
        (answer,) = case.page.at("answer")
        assert answer.text.replace("\u00a0", " ").startswith(words)
        assert "at rest" in answer.text
        assert not list(faults_of_told(case.page.told))


def test_a_centre_is_known_in_all_three_directions() -> None:
    """SDs of 0.6, 0.8 and 2.4 mm are one of 2.6 mm."""
    case = Case(tables=changed("helical_axes", centre_right_sd_mm=2.4))
    assert of_rule(case, "axes")["sd"][0] == pytest.approx(2.6)


def test_optima_are_counted_behind_the_stiffness_that_is_told() -> None:
    fits = tables_of(Size())["fits"]
    behind = (fits["representation"] == "per_joint") & (fits["fitted_to"] == "all")
    fits["n_optima"] = 1 + (behind | (fits["representation"] == "per_specimen"))
    told = of_rule(Case(tables={"fits": fits}), "starts")
    assert told["told"][0] == behind.sum() < told["several"][0]


def test_published_stiffness_is_compared_with_one_for_all_joints() -> None:
    """And an interval of single values that is not known is not told."""
    case = Case(tables=claims(**dict.fromkeys(PUBLISHED, "undecided")))
    (text,) = (one.text for one in case.page.told if one.rule == "published")
    assert text.startswith("Neither one stiffness for all joints of a specimen")
    rows = {**own(THREE, high=nan), **claims(**of_all(BOTH, "yes"))}
    text = " ".join(one.text for one in Case(tables=rows).page.told)
    assert "times in flexion–extension." in text
    assert "±" not in text


def test_a_single_value_has_its_own_interval_and_one_specimen_the_range_of_its_joints() -> None:
    single, joints = Case(ONE, own({"a": 2.0}, 1)), Case(ONE, own({"a": (2.0, 5.0)}))
    assert of_rule(single, "typical")["a"] == pytest.approx((2.0, 1.8, 2.4, 1))
    assert of_rule(joints, "typical")["a"] == pytest.approx((3.5, 2.0, 5.0, 2))


def test_the_finest_description_that_readings_bound_is_told() -> None:
    fine, rough = (
        own(THREE, **OPEN),
        own({"a": 7.0, "b": 8.0, "c": 9.0}, representation="per_specimen"),
    )
    both = {"stiffness": pd.concat([fine["stiffness"], rough["stiffness"]], ignore_index=True)}
    assert of_rule(Case(tables=both), "typical")["a"] == pytest.approx((8.0, 7.0, 9.0, 3))


@pytest.mark.parametrize("column", ["identifiable", "at_bound", "never fitted"])
def test_what_readings_do_not_bound_is_never_a_number(column: str) -> None:
    """Of a softest, a middle and a stiffest specimen the last one is 333.3 and not bounded."""
    found = own({"a": 2.0, "b": 4.0, "c": 333.3})
    rows = found["stiffness"]
    last = rows["specimen"] == "c"
    if column == "never fitted":  # a start value that no reading moved, beside published stiffness
        rows.loc[last, ["low", "high"]] = nan
        rows.loc[last, "identifiable"] = False
        published = rows[last].assign(representation="literature", fitted_to="nothing")
        rows = pd.concat([rows, published.assign(source="literature")], ignore_index=True)
    else:
        rows.loc[last, column] = False if column == "identifiable" else "upper"
        rows.loc[last, "high"] = nan
    case = Case(tables={"stiffness": rows})
    shown = re.sub(r"<svg.*?</svg>", "", case.html, flags=re.DOTALL)
    assert "333" not in shown
    assert "(333" not in " ".join(one.text for one in case.page.told)
    value = of_rule(case, "typical")["a"]
    if column == "never fitted":
        assert value == pytest.approx((3.0, 2.0, 4.0, 2))
    else:  # it is stiffer than the others, so the middle one is the median, and the end is open
        assert value == (pytest.approx(4.0), pytest.approx(2.0), None, 3)
        assert "above 300" in shown.replace("\u2009", "")


def test_an_open_direction_is_told_by_its_lower_end() -> None:
    """Lower ends are nine tenths of 2, 4 and 6."""
    least = of_rule(Case(tables=own(THREE, **OPEN)), "open")["least"]
    assert least == pytest.approx((3.6, 3.6, None, 6), nan_ok=True)


DECIDED = claims(**of_all(BOTH, "yes", "yes"), **dict.fromkeys(ALL_KINDS, "yes"))


def test_below_three_specimens_nothing_is_claimed_and_that_is_said_once() -> None:
    three, two = Case(tables=DECIDED), Case(Size(("a", "b")), DECIDED)
    assert {rule for rule, _ in three.verdicts} >= COMPARING
    assert not {rule for rule, _ in two.verdicts} & COMPARING
    assert sum("at least 3 are needed" in one.text for one in two.page.told) == 1
    assert "Claim per_joint" not in two.html


def test_with_a_base_model_no_motion_counts_as_unseen() -> None:
    beneath = Case(tables=DECIDED, settings=BASE)
    rules = {rule for rule, _ in beneath.verdicts}
    assert not rules & UNSEEN
    assert rules >= {"left_out", "specimens", "levels", "load_cases"}
    html, without = beneath.html, Case(tables=DECIDED).html
    for name in (f"Claim per_joint_beats_per_specimen_{CASE}.", f"Claim {PUBLISHED[1]}."):
        assert name in without
        assert name not in html
    assert "base model&#39;s effects are left out nowhere" in html


def test_a_small_p_that_the_others_take_back_decides_nothing() -> None:
    name = f"per_joint_beats_per_specimen_{CASE}"
    rows = claims(**{name: "undecided"})["findings"].assign(p=1e-9, p_holm=0.3)
    assert ("descriptions", "none_shown") in Case(tables={"findings": rows}).verdicts


def test_of_one_joint_equal_descriptions_are_one_row_and_others_are_not() -> None:
    alike = Case(ONE_JOINT, ALIKE)
    assert of_rule(alike, "descriptions")["error"] == (0.6, None, None, 3)
    (panel,) = alike.charts["held_out_error"].panels
    rows = panel.frame.groupby("series")["row"].agg(list)
    assert rows["fitted"] == rows[SPECIMEN] == ["all linear descriptions"]
    assert rows[CASE] == ["one value per specimen", "partially pooled"]
    differ = errors(fitted=(0.5, 0.6, 0.5), left_out_specimen=(0.6, 0.6, 0.6))
    assert ("descriptions", "same") not in Case(ONE_JOINT, differ).verdicts
    assert ("descriptions", "same") not in Case(tables=ALIKE).verdicts, "two joints"


def test_a_difference_is_told_from_the_side_that_wins() -> None:
    """The claim's error was 0.5 (0.3 to 0.7) larger: the other side's is smaller by that."""
    rows = claims(**{PUBLISHED[0]: ("no", -0.5)})
    assert of_rule(Case(tables=rows), "published")["less"] == pytest.approx((0.5, 0.3, 0.7, 3))


def test_specimens_and_levels_differ_by_their_medians() -> None:
    """Specimens 2, 4 and 6; levels 4 (of 1, 4, 6) and 4 (of 3, 4, 6)."""
    holds = of_all(BOTH, "yes")
    case = Case(tables={**own(THREE), **claims(**holds)})
    assert of_rule(case, "specimens")["times"][0] == pytest.approx(3.0)
    assert of_rule(case, "levels")["times"][0] == pytest.approx(1.0)


def test_residuals_are_those_of_the_description_that_is_told() -> None:
    fits = tables_of(Size())["fits"]
    told = (fits["representation"] == "per_joint") & (fits["fitted_to"] == "all")
    fits["scatter"] = [1.1 if one else 9.0 for one in told]
    assert of_rule(Case(tables={"fits": fits}), "noise")["scatter"][0] == pytest.approx(1.1)


def test_a_load_case_beside_the_others_is_a_ratio_with_an_interval() -> None:
    """Flexion alone says 6, the others 4; SDs of logarithms are 0.1 each, so 0.14 together."""
    error = 0.1 * UNIT
    alone, others, every = (
        own({"a": value}, 1, fitted_to=label, standard_error=error * value)["stiffness"]
        for label, value in (("flexion", 6.0), ("all_but_flexion", 4.0), ("all", 5.0))
    )
    tables = {"stiffness": pd.concat([alone, others, every], ignore_index=True)}
    (panel,) = Case(ONE, tables).charts["load_case_stiffness"].panels
    (row,) = panel.frame[["row", "value", "low", "high"]].to_dict("records")
    assert row["row"] == "Flexion"
    assert row["value"] == pytest.approx(1.5)
    assert row["high"] / row["value"] == pytest.approx(np.exp(1.96 * 0.1 * 2**0.5), rel=1e-3)


def test_the_figure_of_specimens_has_each_value_its_median_and_the_published_one() -> None:
    tables = own(THREE)
    first = tables["stiffness"].iloc[:1]
    published = first.assign(representation="literature", fitted_to="nothing", source="literature")
    rows = pd.concat([tables["stiffness"], published.assign(stiffness=2.5 * UNIT)])
    (panel,) = Case(tables={"stiffness": rows}).charts["stiffness_by_specimen"].panels
    values = panel.frame.groupby(["row", "series"])["value"].agg(list)
    assert values["a", "each joint"] == pytest.approx([1.0, 3.0])
    assert values["a", "median"] == pytest.approx([2.0])
    assert list(panel.marks) == pytest.approx([2.5])
