"""Sentences of the report: each turns out otherwise when the numbers do, at a limit and beside it.

Would catch a sentence that stays when its table says otherwise, or counts wrongly, and a comparison
that includes its limit where it should not.
"""

from typing import Any

import pandas as pd
from scoliosis_cases import ERRORS, Size, paired_test, study_of, tables_of
from spinepipe.report.page.document import Headline, ResultTables
from sweeps import sweep

from spinepipe.studies.scoliosis.films import LEFT, RIGHT
from spinepipe.studies.scoliosis.findings import both_ways, findings
from spinepipe.studies.scoliosis.headline import (
    ModelRanking,
    _answer,
    _compared,
    above_noise,
    headline,
    p_of,
)

PAIR = ("tangent_fitted", "tangent")


def results(size: Size, **changed: pd.DataFrame) -> ResultTables:
    """Made-up results; accuracy follows what is changed."""
    return ResultTables(tables_of(size, **changed), {}, {})


def answer(size: Size, **changed: pd.DataFrame) -> Headline:
    """The headline of made-up results."""
    return headline(results(size, **changed))


def told(size: Size, **changed: pd.DataFrame) -> str:
    """All findings, plain spaces before percent signs."""
    return "\n".join(findings(study_of(size), results(size, **changed))).replace("\u00a0", " ")


def pairs_tested(*rows: dict[str, Any]) -> pd.DataFrame:
    """Tests of pairs of models, as far as sentences read them."""
    return pd.DataFrame(rows)


def test_ratios_that_films_leave_open_are_no_findings_about_a_patient() -> None:
    """Three patients of 14 segments: of ten films tell both ends, of two one, of two neither."""
    words = told(Size())
    assert "a patient's own films tell both ends of 30 of 42 ratios (71 %)" in words
    assert "one end of 6 and neither of 6" in words
    assert "films tell both ends in fewer than half of the patients" in words
    laws = tables_of(Size())["laws"]
    fitted = laws["model"] == "tangent_fitted"
    laws.loc[fitted, ["open_below", "open_above"]] = False
    laws.loc[fitted, "identifiable"] = True
    closed = told(Size(), laws=laws)
    assert "both ends of 42 of 42 ratios (100 %), one end of 0 and neither of 0" in closed
    assert "fewer than half" not in closed
    laws[["open_below", "open_above", "identifiable"]] = None
    assert "both ends" not in told(Size(), laws=laws)


def test_the_best_model_is_that_of_the_least_error_on_held_out_films() -> None:
    found = answer(Size()).words
    # three patients: 0.3 deg times the root mean square of 1, 1.1 and 1.2
    assert found.startswith(
        "The fitted tangent model has the least error of rotations on positions"
    )
    assert "off by 0.331° (root mean square)" in found
    assert "25 % less than the next, the published tangent model (0.441°)" in found
    assert "50 % less than the model that is linear by region (0.662°)" in found
    other = answer(Size(errors=ERRORS | {"linear_regions": 0.1})).words
    assert other.startswith("The model that is linear by region has the least error")
    assert "67 % less than the next, the fitted tangent model" in other
    assert "linear by region (" not in other


def test_when_nothing_personal_helps_that_is_said() -> None:
    helped = "Nothing that the others take from the bending films makes them better"
    assert helped not in answer(Size()).words
    assert helped in answer(Size(errors=ERRORS | {"uniform": 0.1})).words


def test_best_is_said_only_where_the_difference_is_significant() -> None:
    size = Size()
    assert "is not known: there is no test of it" in answer(size).how_sure
    sure = answer(size, statistics=pairs_tested(paired_test("held_out", "rotation", PAIR, 0.002)))
    assert "reproduces rotations of segments best on positions that it has not seen" in sure.words
    assert "The difference over 3 patients, by paired Wilcoxon tests" in sure.how_sure
    assert "from the next it is significant (p 0.0020), from the model that is" in sure.how_sure
    assert "linear by region it is not tested." in sure.how_sure
    other = pairs_tested(paired_test("held_out", "rotation", PAIR[::-1], 0.3))
    unsure = answer(size, statistics=other)
    assert "has the least error" in unsure.words
    assert unsure.words.endswith("From the next it cannot be told apart.")
    assert "from the next it is not significant (p 0.30)" in unsure.how_sure
    reference = paired_test("held_out", "rotation", ("tangent_fitted", "linear_regions"), 0.04)
    both = answer(size, statistics=pd.concat([other, pairs_tested(reference)])).how_sure
    assert "from the model that is linear by region it is significant (p 0.040)." in both


@sweep(
    "row",
    [
        paired_test("fitted", "rotation", PAIR, 0.001),
        paired_test("held_out", "place", PAIR, 0.001),
        paired_test("held_out", "rotation", ("tangent", "linear_regions"), 0.001),
        paired_test("held_out", "rotation", PAIR, None),
    ],
)
def test_a_test_of_something_else_says_nothing_of_the_answer(row: dict[str, Any]) -> None:
    assert "is not known" in answer(Size(), statistics=pairs_tested(row)).how_sure


def test_errors_are_held_against_what_reading_makes() -> None:
    # a rotation is made of four readings: 2 x 0.7 deg
    assert "makes 1.4°; no model is above that" in answer(Size()).how_sure
    assert "How exactly the films are read is not known" in answer(Size(noise_deg=None)).how_sure


def test_nothing_held_out_is_the_answer() -> None:
    found = answer(Size(positions=(RIGHT, LEFT)))
    assert found.words.startswith("Nothing is held out: no patient has a film besides erect")
    assert "the fitted tangent model has the least error of rotations, 0.165°" in found.how_sure
    assert "with 43 parameters taken from these films" in found.how_sure
    assert "Held-out films" not in told(Size(positions=(RIGHT, LEFT)))


def test_lost_poses_are_told_first_and_by_name() -> None:
    assert answer(Size()).warnings == ()
    assert "All 60 poses converged." in told(Size())
    found = answer(Size(lost=1))
    assert "1 of 60 poses was not found, in 1 patient" in found.warnings[0]
    assert "unlike patients: some have all poses of 2, others of 3" in found.warnings[1]
    first = told(Size(lost=1)).splitlines()[0]
    assert first == (
        "1 of 60 poses ended unstable: p01, traction, tangent, as published (it <buckles>)."
    )
    alone = Size(errors={"tangent": 0.4}, lost=3)
    assert answer(alone).words == "No model has a pose on all held-out films of any patient."


def test_a_film_that_cannot_be_reached_is_told_with_what_is_missed() -> None:
    rows = tables_of(Size(1))["positions"]
    one = rows.index[rows["position"] == "traction"][0]
    rows.loc[one, ["status", "missed_mm", "missed_deg"]] = ["unreachable", 3.25, 0.5]
    found = told(Size(1), positions=rows)
    assert "1 of 20 poses ended unreachable: p01, traction" in found
    assert "(misses its place by 3.2 mm, 0.50°)" in found
    assert answer(Size(1), positions=rows).warnings == (), "it has a pose"


def test_models_are_told_in_the_order_of_their_errors() -> None:
    size = Size()
    assert "tangent, fitted (0.331°); tangent, as published (0.441°); linear by seg" in told(size)
    same = pairs_tested(
        paired_test("held_out", "rotation", PAIR, 0.4),
        paired_test("held_out", "cobb", ("tangent_fitted", "uniform"), 0.2),
    )
    found = told(size, statistics=same)
    assert "tangent, as published (0.441°, not told apart from the first)" in found
    assert "tangent, fitted (0.331°, not told apart from uniform) in Cobb angles" in found
    turned = told(Size(errors=ERRORS | {"uniform": 0.2}))
    assert "least error first: uniform (0.221°)" in turned


def test_segments_against_a_bend_and_held_stiffness_are_counted() -> None:
    found = told(Size())
    assert (
        "On the films 3 of 42 segments (7 %) turn against a bend, or not at all: T2T3 in" in found
    )
    assert "the published tangent model in 3 of 42 segments (T2T3 in 3 patients)" in found
    rows = tables_of(Size())["laws"].assign(opposite=False, constrained=False)
    found = told(Size(), laws=rows)
    assert "All 42 segments turn with both bends." in found
    assert "No stiffness had to be held at a bound." in found


def test_films_tell_ratios_and_the_scale_is_named() -> None:
    found = told(Size())
    assert "comes from the apical moment of 63.0 N m that the study states" in found
    assert "0.100 to 10.0 times that of the study moves no rotation by more than 0.25°" in found
    rows = tables_of(Size())["positions"].assign(scale_from="mean_stiffness")
    found = told(Size(), positions=rows, variation=pd.DataFrame())
    assert "comes from the mean stiffness of 68.8 N m/rad that the study states" in found
    assert "times that of the study" not in found


def test_the_enlargement_of_least_error_is_told_for_each_group_of_films() -> None:
    found = told(Size())
    assert "30.0 % on fitted films (0.500°) and 10.0 % on held-out films (0.500°)" in found
    assert "the study has 20.0 %" in found


def test_parameters_are_counted_and_those_that_films_decide() -> None:
    assert "tangent, as published 43; tangent, fitted 43; linear by region 2" in told(Size())
    rows = tables_of(Size())["positions"]
    rows.loc[rows["model"] == "tangent_fitted", "decided_parameters"] = 12.5
    rows.loc[rows["specimen"] == "p02", "free_parameters"] += (
        rows["model"] == "linear_regions"
    ) * 1
    found = told(Size(), positions=rows)
    assert "tangent, fitted 43, of which the films decide 12.5 on average" in found
    assert "linear by region 2 to 3" in found


def test_rotations_beyond_the_ends_are_counted_on_held_out_films() -> None:
    # shares 0.1 + 0.08 k: those of the 13th and 14th segment are above 1, on two films
    found = told(Size())
    assert "12 of 84 held-out rotations (14 %) lie beyond an end" in found
    assert "published law: T3T4 in 3 patients; T2T3 in 3 patients." in found


def test_whether_films_were_brought_to_one_size_is_told() -> None:
    assert "No film was brought to the size of the erect one" in told(Size())
    rows = tables_of(Size())["positions"]
    rows.loc[rows["position"] == "traction", ["film_scale", "chord_ratio"]] = [1.25, 1.1]
    found = told(Size(), positions=rows)
    assert "3 of 12 films were brought to the size of the erect one, times 1.25 to 1.25" in found
    assert "1.00 to 1.10 times as long as erect" in found


def test_published_quantities_are_told_once_they_are_judged() -> None:
    assert "published quantities" not in told(Size())
    judged = pd.DataFrame({"verdict": ["inside", "outside", "outside"], "limit": "wide"})
    judged["evidence"] = ["independent", "independent", "circular"]
    assert "Of 2 published quantities" in told(Size(), against_jalalian_2017=judged)


def test_fits_at_a_bound_lost_or_of_several_optima_are_told() -> None:
    size = Size()
    laws = tables_of(size)["laws"]
    usual = told(size)
    assert "optima" not in usual
    assert "did not settle" not in usual
    assert answer(size).warnings == ()
    regions, fitted = laws["model"] == "linear_regions", laws["model"] == "tangent_fitted"
    first = laws["specimen"] == "p01"
    laws.loc[regions & first, "fit_status"] = "converged_at_bound"
    laws.loc[fitted & first, "fit_status"] = "not_converged"
    laws.loc[fitted & ~first, "n_optima"] = 3
    said = told(size, laws=laws)
    assert "1 of 6 fits to films did not settle: p01, tangent, fitted." in said
    assert "2 of 6 fits to films found several optima" in said
    (doubt,) = answer(size, laws=laws).warnings
    assert doubt.startswith("In 1 of 3 patients the model that is linear by region ends at the")


def test_a_population_that_still_moves_casts_doubt() -> None:
    moving = pd.DataFrame({"status": ["not_converged"]})
    (doubt,) = answer(Size(), population=moving).warnings
    assert "did not stand still" in doubt


def of_pair(p: float, measure: str = "rotation") -> pd.DataFrame:
    return pd.DataFrame([paired_test("held_out", measure, PAIR, p)])


@sweep("p, significant", [(0.0499, True), (0.05, False), (0.0501, False)])
def test_five_per_cent_is_not_significant(p: float, significant: bool) -> None:
    found = answer(Size(), statistics=of_pair(p))
    assert ("reproduces rotations of segments best" in found.words) is significant
    assert ("cannot be told apart" in found.words) is not significant
    assert ("it is significant" in found.how_sure) is significant
    same = "not told apart from the first"
    assert (same in told(Size(), statistics=of_pair(p))) is not significant
    alike = "not told apart from tangent, as published"
    assert (alike in told(Size(), statistics=of_pair(p, "place"))) is not significant


def standing(errors: dict[str, float], noise: float | None) -> ModelRanking:
    rows = pd.DataFrame({"model": list(errors), "rmse": list(errors.values())})
    known = {"films": "held_out", "measure": "rotation", "unit": "deg", "n_patients": 3}
    return ModelRanking.of(rows.assign(**known, reading_noise=noise), "held_out", "rotation")


@sweep(
    "errors, words",
    [
        ((1.01, 2.0), "the error is above that"),
        ((1.0, 2.0), "1 model is not above that"),
        ((0.5, 1.0), "no model is above that"),
        ((0.5, 1.01), "1 model is not above that"),
        ((0.5, 0.9, 2.0), "2 models are not above that"),
    ],
)
def test_an_error_as_large_as_reading_makes_is_not_above_it(
    errors: tuple[float, ...], words: str
) -> None:
    assert words in above_noise(standing({f"m{n}": one for n, one in enumerate(errors)}, 1.0))


def test_models_are_ordered_by_error_and_held_against_one_another() -> None:
    found = standing({"a": 3.0, "b": 1.0, "c": 2.0}, None)
    assert found.models == ["b", "c", "a"]
    assert found.noise is None
    assert (found.error("c"), found.sized("c")) == (2.0, "2.00°")
    assert found.less("b", "c") == 0.5
    assert ModelRanking.of(pd.DataFrame(), "held_out", "rotation").models == []
    assert ModelRanking.of(pd.DataFrame(), "held_out", "rotation").noise is None


def compared(**errors: float) -> str:
    held_out = standing(errors, None)
    return _answer(held_out, dict.fromkeys(_compared(held_out)))


def test_the_reference_is_named_once_where_it_is_the_next() -> None:
    """And where it is later, beside the next; other models are not."""
    words = compared(tangent=0.3, linear_regions=0.35, uniform=0.8, linear_per_segment=0.9)
    assert words.count("% less than") == 1
    assert "the next, the model that is linear by region" in words
    later = compared(tangent=0.3, uniform=0.35, linear_per_segment=0.4, linear_regions=0.6)
    assert later.count("% less than") == 2
    assert "50 % less than the model that is linear by region (0.600°)." in later


@sweep("other, words", [(0.3, "as much as the next"), (0.4, "25 % less than")])
def test_models_with_one_error_are_as_good(other: float, words: str) -> None:
    assert words in compared(tangent=0.3, linear_regions=other)


def test_a_model_alone_is_compared_with_none() -> None:
    assert compared(tangent=0.4).endswith("There is no other model to compare it with.")


def test_p_is_that_of_the_pair_whichever_is_named_first() -> None:
    rows = pd.DataFrame(
        [
            paired_test("held_out", "rotation", ("a", "c"), 0.9),
            paired_test("held_out", "rotation", ("b", "a"), 0.2),
            paired_test("held_out", "place", ("a", "b"), 0.3),
            paired_test("fitted", "rotation", ("a", "b"), 0.4),
        ]
    )
    for pair in (("a", "b"), ("b", "a")):
        assert p_of(rows, "held_out", "rotation", *pair) == 0.2
    assert p_of(rows, "held_out", "rotation", "b", "c") is None
    assert p_of(rows.iloc[:0], "held_out", "rotation", "a", "b") is None


def lost(*places: int) -> pd.DataFrame:
    rows = tables_of(Size())["positions"]
    chosen = rows.index[list(places)]
    rows.loc[chosen, ["status", "message"]] = ["unstable", "x"]
    return rows


@sweep("count, more", [(6, ""), (7, "; and 1 more"), (9, "; and 3 more")])
def test_six_places_are_named_and_more_are_counted(count: int, more: str) -> None:
    first = told(Size(), positions=lost(*range(count))).splitlines()[0]
    assert first.startswith(f"{count} of 60 poses ended unstable: p01, right")
    assert first.count("(x)") == 6
    assert first.endswith(f"(x){more}.")


@sweep(
    "status, words",
    [("unstable", 1), ("not_converged", 1), ("unreachable", 0), ("converged", 0)],
)
def test_poses_that_were_not_found_are_warned_of(status: str, words: int) -> None:
    rows = tables_of(Size())["positions"]
    rows.loc[rows.index[:2], "status"] = status
    warnings = answer(Size(), positions=rows).warnings
    assert sum("2 of 60 poses were not found, in 1 patient;" in one for one in warnings) == words


def identifiable(patients: int) -> pd.DataFrame:
    """Of four patients so many whose films tell both ends of the ratio of one joint."""
    rows = [
        {
            "specimen": f"p{n}",
            "joint": joint,
            "identifiable": joint == "a" or n < patients,
            "open_below": not (joint == "a" or n < patients),
            "open_above": n == 3 and joint == "b",
        }
        for n in range(4)
        for joint in "ab"
    ]
    usual = {"model": "tangent_fitted", "opposite": False, "constrained": False}
    return pd.DataFrame(rows).assign(**usual, fit_status=None, n_optima=None)


@sweep("patients, few", [(1, True), (2, False), (3, False)])
def test_half_of_the_patients_are_not_fewer_than_half(patients: int, few: bool) -> None:
    words = told(Size(), laws=identifiable(patients))
    assert ("At b films tell both ends in fewer than half" in words) is few
    ends = f"{4 + patients} of 8 ratios"
    assert ends in words
    assert f"one end of {3 - patients} and neither of 1" in words


@sweep("decided, told_of", [(40.8, True), (40.9, False), (43.0, False)])
def test_parameters_that_films_decide_are_told_where_they_are_fewer(
    decided: float, told_of: bool
) -> None:
    """Than 95 % of 43: 40.85."""
    rows = tables_of(Size())["positions"]
    rows.loc[rows["model"] == "tangent_fitted", "decided_parameters"] = decided
    assert ("of which the films decide" in told(Size(), positions=rows)) is told_of


@sweep("share, count", [(1.0, 0), (1.0001, 84)])
def test_a_rotation_at_its_end_is_not_beyond(share: float, count: int) -> None:
    rows = tables_of(Size())["displacements"].assign(share_of_range=share)
    assert f"{count} of 84 held-out rotations" in told(Size(), displacements=rows)


@sweep("scale, films", [(1.0 + 2e-9, 3), (1.0 - 2e-9, 3), (1.0 + 5e-10, 0)])
def test_a_film_is_brought_to_size_by_more_than_rounding(scale: float, films: int) -> None:
    rows = tables_of(Size())["positions"]
    rows.loc[rows["position"] == "traction", "film_scale"] = scale
    assert (f"{films} of 12 films were brought" in told(Size(), positions=rows)) is bool(films)


@sweep("error, words", [(0.6, "as much on fitted films"), (0.59, "less on"), (0.61, "more on")])
def test_the_tangent_beside_linear_regions_as_good_better_and_worse(
    error: float, words: str
) -> None:
    held_out = standing({"tangent": error, "linear_regions": 0.6}, None).rows
    rows = held_out.assign(films="fitted")
    (sentence,) = both_ways(study_of(Size()), ResultTables({}, {}, {}), rows)
    assert words in sentence
    assert "Beside the model" not in told(Size(errors={"tangent": error}))


def test_held_out_errors_come_before_those_of_fitted_films() -> None:
    lines = [line for line in told(Size()).splitlines() if "least error first" in line]
    assert [line.split()[0] for line in lines] == ["Held-out", "Fitted"]


def test_without_tables_nothing_is_said() -> None:
    empty: Any = ResultTables({}, {}, {})
    assert findings(study_of(Size()), empty) == []
