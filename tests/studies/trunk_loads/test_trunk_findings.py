"""Sentences of the report: each turns out otherwise when the numbers do."""

import numpy as np
import pandas as pd
import pytest
from trunk_table_cases import BEYOND, LOST, Size, cohort_of, study_of, tables_of

from spinepipe.report.page.document import Headline, ResultTables
from spinepipe.studies.trunk_loads.findings import findings
from spinepipe.studies.trunk_loads.headline import headline

ONE = Size(1)
ALL = tuple(dict.fromkeys(tables_of(ONE)["tasks"]["task"]))


def answer(size: Size, **changed: pd.DataFrame) -> Headline:
    """The headline of made-up results."""
    return headline(
        study_of(size), cohort_of(size), ResultTables(tables_of(size, **changed), {}, {})
    )


def told(size: Size, **changed: pd.DataFrame) -> str:
    """All findings, plain spaces before percent signs and between thousands."""
    found = findings(
        study_of(size), cohort_of(size), ResultTables(tables_of(size, **changed), {}, {})
    )
    return "\n".join(found).replace("\u00a0", " ").replace("\u2009", " ")


def words(found: Headline) -> str:
    return found.words.replace("\u2009", " ")


def test_the_answer_is_the_load_that_is_held_beside_standing() -> None:
    found = words(answer(ONE))
    # 600 + 19.8 (30 + 0.1 x 404) N, a tenth less to a fifth more, over 1500 mm2 x 0.77
    assert found == (
        "Task load away (19.8 kg in the hands) presses L4L5 of volunteer with 1 990 N (1 790 N to "
        "2 390 N), 3.3 times relaxed standing; the pressure in the disc is 1.73 MPa (1.55 to 2.07 "
        "MPa); most of that spread comes of how far ahead the hands are."
    )
    rows = tables_of(ONE)["tasks"]
    rows.loc[rows["task"] == "load_away", "l4l5_compression_n"] = 1200.0
    rows.loc[rows["task"] == "load_away", "l4l5_pressure_mpa"] = 0.5
    changed = words(answer(ONE, tasks=rows))
    assert "with 1 200 N (1 790 N to 2 390 N), 2.0 times relaxed standing" in changed
    assert "pressure in the disc is 0.50 MPa" in changed


def test_without_samples_the_heaviest_load_is_told_without_an_interval() -> None:
    found = answer(Size(1, samples=False))
    assert words(found).startswith("Task flexion 70 with load (19.8 kg in the hands) presses")
    assert "spread" not in found.words
    assert "(1 " not in words(found)
    assert "not known: the task was not sampled" in found.how_sure


def test_without_any_load_the_most_loaded_task_is_told() -> None:
    found = words(answer(Size(1, ("standing", "flexion_50", "side_20"), samples=False)))
    assert found.startswith("Task flexion 50 presses L4L5 of volunteer with")
    alone = words(answer(Size(1, ("standing",), volunteer=False, samples=False)))
    assert alone.startswith("Task standing presses L4L5 of volunteer with 600 N; the pressure")
    assert "times relaxed standing" not in alone


def test_a_task_that_is_not_sound_is_never_the_answer() -> None:
    ended = Size(1, failing=(("load_away", "two_answers", ""), LOST, BEYOND))
    assert "Task load away" not in answer(ended).words
    assert "1 two answers (load away)" in answer(ended).warnings[0]
    lost = Size(1, failing=tuple((task, "not_converged", "") for task in ALL))
    found = answer(lost)
    assert found.words.startswith("No load can be told")
    assert f"{len(ALL)} of {len(ALL)} tasks of all persons did not settle" in found.warnings[0]


def test_most_of_a_spread_is_said_only_of_more_than_half() -> None:
    rows = tables_of(ONE)["drivers"]
    columns = ["total", "total_low", "total_high"]
    rows[columns] *= 0.8
    assert "the largest part of that spread comes of how far" in answer(ONE, drivers=rows).words
    rows.loc[rows["factor"] == "pcsa", columns] = [0.7, 0.6, 0.8]
    assert "most of that spread comes of cross-section" in answer(ONE, drivers=rows).words
    rows.loc[rows["factor"] == "pcsa", "total_low"] = 0.1
    assert "that spread comes of most, the samples do not tell" in answer(ONE, drivers=rows).words
    rows["total"] = np.nan
    assert "spread" not in answer(ONE, drivers=rows).words


def test_what_is_not_to_be_trusted_stands_first() -> None:
    found = answer(ONE).warnings
    assert found == (
        "Look at this first: 2 of 25 tasks of all persons did not settle or cannot be held: "
        "1 beyond strength (exertion extension); 1 out of reach (exertion flexion).",
    )
    sound = Size(1, failing=())
    assert answer(sound).warnings == ()
    rows = tables_of(sound)["tasks"]
    rows.loc[rows["task"] == "load_away", "inside_eq_6"] = False
    outside = answer(sound, tasks=rows).warnings
    assert outside == (
        "The pressure of task load away lies outside the range in which its formula was fitted.",
    )


def test_goals_that_are_missed_are_told_with_how_much() -> None:
    rows = tables_of(ONE)["agreement"]
    rows.loc[rows["tier"] == "tuned", ["rmse_mpa", "reached"]] = [0.2, False]
    found = answer(ONE, agreement=rows).warnings[-1]
    assert found == (
        "Agreement with measured pressures is not what was asked for: tuned 0.20 MPa off, 0.14 MPa "
        "asked for, 0.060 MPa too much."
    )
    sentences = told(ONE, agreement=rows)
    assert "The goal is not reached: 0.20 MPa off, 0.14 MPa asked for, 0.060 MPa too" in sentences
    assert "The goal of 0.35 MPa is reached." in sentences


def test_a_goal_is_not_reached_by_forces_that_hold_nothing() -> None:
    rows = tables_of(ONE)["agreement"]
    rows.loc[rows["tier"] == "untuned", ["n_not_held", "reached"]] = [2, False]
    sentences = told(ONE, agreement=rows)
    assert "and 2 counted tasks are not held by any muscle forces." in sentences
    assert (
        "untuned 0.30 MPa off, 0.35 MPa asked for, and 2"
        in answer(ONE, agreement=rows).warnings[-1]
    )
    assert "The goal of 0.35 MPa" not in sentences


def test_agreement_is_told_with_the_interval_of_r() -> None:
    found = told(ONE)
    assert "Untuned (nothing fitted): over 6 tasks computed pressures are off" in found
    assert "by 0.30 MPa (root mean square), r 0.95 (95 % interval 0.70 to 0.99)." in found
    few = told(Size(1, ("standing", "load_away")))
    assert "over 2 tasks" in few
    assert "too few for a correlation" in few
    assert "r 0.95" not in few
    assert "no computed pressure can be held" in told(Size(1, ("standing_stable", "forward_10")))
    assert "Untuned" not in told(Size(1, volunteer=False))


def test_pressures_that_do_not_count_and_unsettled_ones_are_told() -> None:
    assert "one handed 1.30 (measured 1.00)" in told(ONE)
    assert "Tasks with a measured pressure that" not in told(ONE)
    failing = (("load_close", "cycling", ""), ("flexion_50", "out_of_reach", ""))
    found = told(Size(1, failing=failing))
    assert "left out of the agreement: untuned flexion 50;" in found
    assert "do not hold them: untuned load close;" in found
    loose = "0.10 MPa off, 0.14 MPa asked for, and 1 counted task is not held by any muscle forces"
    assert loose in found


def test_fitted_numbers_and_their_bounds_are_told() -> None:
    found = told(ONE)
    assert "area of the disc 2.00 instead of 1.00 (1.4 or more), at the end of its range." in found
    assert "is no finding" in found
    rows = tables_of(ONE)["tuning"].assign(at_bound=False)
    assert "end of its range" not in told(ONE, tuning=rows)


def test_fitted_numbers_that_pressures_leave_open_are_nothing_known() -> None:
    found = told(ONE)
    assert "0.700 instead of 1.00 (0.40 to 1.1)" in found
    assert "Measured pressures do not tell area of the disc: its region is open" in found
    rows = tables_of(ONE)["tuning"]
    tuned = rows["tier"] == "tuned"
    shut = rows.assign(open_above=False, identifiable=True)
    assert "Measured pressures do not tell" not in told(ONE, tuning=shut)
    rows.loc[tuned, ["open_below", "open_above"]] = True
    rows.loc[tuned, "identifiable"] = False
    both = told(ONE, tuning=rows)
    assert "(open on both sides)" in both
    assert "pressures tell neither " in both
    assert "nothing known of the volunteer" in both


def test_tasks_are_told_by_how_they_ended() -> None:
    found = told(Size(2))
    assert (
        "2 of 50 tasks of all persons ended beyond the strength of the muscles (exertion extension "
        "of 2 persons). One message: 21 N m are left."
    ) in found
    assert "All 3 tasks of all persons settled, and are held." in told(
        Size(1, ("standing", "side_20", "load_away"))
    )


def test_pressures_outside_the_fitted_range_are_counted() -> None:
    assert "All pressures lie where" in told(Size(1, ("standing", "side_20")))
    # 0.11 x 107.3 deg is above 10 deg; leaning back is below 0
    found = told(Size(1, ("standing", "load_close", "full_flexion")))
    assert "of flexion): 2 of 3 pressures (67 %), load close; full flexion." in found


def test_flexion_relaxation_is_what_is_left_of_the_peak() -> None:
    assert "leaves: volunteer 5.3 % at 107° (peak at 60.0°)." in told(ONE)
    rows = tables_of(ONE)["muscles"]
    rows.loc[rows["task"] == "full_flexion", "force_n"] *= 10.0
    assert "volunteer 100 % at 107° (peak at 107°)" in told(ONE, muscles=rows)
    assert "Flexion relaxation" not in told(Size(1, ("standing", "flexion_50")))


def test_levels_and_muscles_are_those_of_the_answer() -> None:
    found = told(ONE)
    assert "In task load away, L5S1 is pressed most" in found
    assert "most is pulled by multifidus" in found
    rows = tables_of(ONE)["levels"]
    rows.loc[rows["level"] == "L2L3", "compression_n"] *= 3.0
    assert "In task load away, L2L3 is pressed most" in told(ONE, levels=rows)


def test_persons_are_compared_where_there_are_two() -> None:
    assert "Persons differ" not in told(ONE)
    # 73 over 60 kg
    assert "L4L5 of ng_2002 is pressed 22 % more than that of woman" in told(Size())


def test_drivers_and_lost_samples_are_told_for_every_sampled_task() -> None:
    found = told(ONE)
    assert "flexion 50: how far ahead the hands are 0.60 (0.55 to 0.66) and body mass" in found
    assert "12 of 672 samples (2 %) did not hold and are left out." in found
    assert "samples" not in told(Size(1, samples=False))


def test_strength_and_stability_are_told_where_asked_for() -> None:
    found = told(ONE)
    assert "more than 80 % is taken by 0 of 23 tasks." in found
    rows = tables_of(ONE)["tasks"]
    rows.loc[rows["task"] == "load_away", "strength_used"] = 0.95
    rows["stable"] = None
    changed = told(ONE, tasks=rows)
    assert "load away of volunteer takes most of the strength, 95 % of it; more than" in changed
    assert "would stand" not in changed
    rows["strength_used"] = np.nan
    assert "of the strength" not in told(ONE, tasks=rows)


def test_simplifications_are_told_by_their_largest_cost() -> None:
    found = told(ONE)
    assert "forces do not move the spine: −5.0 %" in found
    assert "muscles run straight: +20 %" in found
    rows = tables_of(ONE)["simplified"]
    one = (rows["task"] == "side_20") & (rows["simplification"] == "no_wrapping")
    rows.loc[one, "l4l5_compression_n"] *= 2.0
    assert "muscles run straight: +140 % (side 20 of volunteer)" in told(ONE, simplified=rows)
    assert "simplifications" not in told(Size(1, simplified=False))


def test_upright_moments_add_up() -> None:
    assert "add up to 7.00 N m, before bodies turned to 21.0 N m; 0 of 8 rotations" in told(ONE)


def test_published_quantities_are_told_once_they_are_judged() -> None:
    assert "published quantities" not in told(ONE)
    judged = pd.DataFrame({"verdict": ["inside", "outside", "outside"], "limit": "wide"})
    judged["evidence"] = ["independent", "independent", "circular"]
    assert "Of 2 published quantities" in told(ONE, against_ghezelbash_2016=judged)


@pytest.mark.parametrize("gone", sorted(tables_of(ONE)))
def test_no_table_is_needed_and_none_needs_rows(gone: str) -> None:
    tables = tables_of(ONE)
    empty = told(ONE, **{gone: tables[gone].iloc[:0]})
    without = ResultTables({name: rows for name, rows in tables.items() if name != gone}, {}, {})
    found = findings(study_of(ONE), cohort_of(ONE), without)
    absent = "\n".join(found).replace("\u00a0", " ").replace("\u2009", " ")
    assert empty == absent
    assert "nan" not in absent.lower().split()
    assert "nan" not in headline(study_of(ONE), cohort_of(ONE), without).words


def test_a_posture_that_no_tone_makes_stable_has_no_least_tone() -> None:
    rows = tables_of(ONE)["tasks"]
    rows = rows[rows["tone"] != "stable"].copy()
    at = rows["task"] == "standing"
    rows.loc[at, ["tone", "tone_share", "stable", "status"]] = ["stable", 0.0, False, "converged"]
    sentences = told(ONE, tasks=rows)
    assert "No tone that can be held makes these postures stable: standing" in sentences
    assert "Least activation" not in sentences
    rows.loc[at, ["tone_share", "stable"]] = [0.012, True]
    sentences = told(ONE, tasks=rows)
    assert "makes a posture stable: standing of volunteer 1.2 %" in sentences
    assert "No tone" not in sentences


def test_a_share_above_the_whole_is_no_number() -> None:
    rows = tables_of(ONE)["drivers"]
    largest = rows["total"].idxmax()
    rows.loc[largest, "total"] = 2.8
    assert "too few samples for a number" in told(ONE, drivers=rows)
    assert "too few samples for a number" not in told(ONE)
