"""Sentences of the report: each turns out otherwise when the numbers do.

Would catch a sentence that stays when its table says otherwise, or counts wrongly.
"""

from typing import Any

import pandas as pd
from scoliosis_cases import ERRORS, Size, paired_test, study_of, tables_of
from sweeps import sweep

from spinepipe.report.page.document import Headline, ResultTables
from spinepipe.studies.scoliosis.films import LEFT, RIGHT
from spinepipe.studies.scoliosis.findings import findings
from spinepipe.studies.scoliosis.headline import headline

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


def statistics(*rows: dict[str, Any]) -> pd.DataFrame:
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
    sure = answer(size, statistics=statistics(paired_test("held_out", "rotation", PAIR, 0.002)))
    assert "reproduces rotations of segments best on positions that it has not seen" in sure.words
    assert "The difference over 3 patients, by paired Wilcoxon tests" in sure.how_sure
    assert "from the next it is significant (p 0.0020), from the model that is" in sure.how_sure
    assert "linear by region it is not tested." in sure.how_sure
    other = statistics(paired_test("held_out", "rotation", PAIR[::-1], 0.3))
    unsure = answer(size, statistics=other)
    assert "has the least error" in unsure.words
    assert unsure.words.endswith("From the next it cannot be told apart.")
    assert "from the next it is not significant (p 0.30)" in unsure.how_sure
    reference = paired_test("held_out", "rotation", ("tangent_fitted", "linear_regions"), 0.04)
    both = answer(size, statistics=pd.concat([other, statistics(reference)])).how_sure
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
    assert "is not known" in answer(Size(), statistics=statistics(row)).how_sure


def test_errors_are_held_against_what_reading_makes() -> None:
    # a rotation is made of four readings: 2 x 0.7 deg
    assert "makes 1.4°; no model is above that" in answer(Size()).how_sure
    few = answer(Size(noise_deg=0.2)).how_sure
    assert "makes 0.40°; 1 model is not above that" in few
    none = answer(Size(noise_deg=0.01)).how_sure
    assert "the error is above that, so the model itself is off" in none
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
    same = statistics(
        paired_test("held_out", "rotation", PAIR, 0.4),
        paired_test("held_out", "cobb", ("tangent_fitted", "uniform"), 0.2),
    )
    found = told(size, statistics=same)
    assert "tangent, as published (0.441°, not told apart from the first)" in found
    assert "tangent, fitted (0.331°, not told apart from uniform) in Cobb angles" in found
    turned = told(Size(errors=ERRORS | {"uniform": 0.2}))
    assert "least error first: uniform (0.221°)" in turned


@sweep("error, words", [(0.3, "50 % less"), (0.9, "50 % more")])
def test_the_tangent_is_told_beside_linear_regions(error: float, words: str) -> None:
    found = told(Size(errors={"tangent": error, "linear_regions": 0.6}))
    assert f"{words} on fitted films, {words} on held-out films" in found
    assert "Beside the model" not in told(Size(errors={"tangent": error}))


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
    rows = tables_of(Size())["displacements"].assign(share_of_range=0.5)
    assert "0 of 84 held-out rotations (0 %) lie beyond" in told(Size(), displacements=rows)


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
