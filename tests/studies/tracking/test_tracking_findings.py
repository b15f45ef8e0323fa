"""Sentences of the report: each turns out otherwise when the numbers do."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from tracking_table_cases import ERROR, Size, cohort_of, study_of, tables_of

from spinepipe.report.page.document import Headline, ResultTables
from spinepipe.studies.tracking.findings import findings
from spinepipe.studies.tracking.findings_of_errors import rankings
from spinepipe.studies.tracking.page import headline

THREE = Size()
LEAST = "optk_generic"


def answer(size: Size, **changed: pd.DataFrame) -> Headline:
    """The headline of made-up results."""
    results = ResultTables(tables_of(size, **changed), {}, {})
    return headline(study_of(size), cohort_of(size), results)


def told(size: Size, **changed: pd.DataFrame) -> str:
    """All findings, with plain spaces."""
    results = ResultTables(tables_of(size, **changed), {}, {})
    found = findings(study_of(size), cohort_of(size), results)
    return "\n".join(found).replace("\u00a0", " ").replace("\u2009", " ").replace("\u2212", "-")


def errors_by(size: Size, means: Mapping[str, tuple[float, ...]]) -> pd.DataFrame:
    """Errors of all levels of approaches, by person; the others as they were."""
    rows = tables_of(size)["errors"]
    for approach, values in means.items():
        for person, value in zip(cohort_of(size).specimen_names, values, strict=True):
            rows.loc[(rows["approach"] == approach) & (rows["specimen"] == person), "mean"] = value
    return rows


def test_the_answer_is_the_least_error_where_persons_tell_it() -> None:
    found = answer(THREE)
    # 5 mm of the first person, a tenth more from person to person
    assert found.words.replace("\u00a0", " ").startswith(
        "Nearest the truth is dynamics with generic passive elements: vertebral centres in motion "
        "are off by 5.50 mm (95 % interval"
    )
    assert "within 3 persons, by paired differences corrected for 6 comparisons" in found.how_sure
    others = errors_by(THREE, {"ik": (1.0, 1.1, 1.2)})
    assert "Nearest the truth is inverse kinematics" in answer(THREE, errors=others).words


def test_a_difference_that_persons_do_not_share_is_no_verdict() -> None:
    """The mean is as much smaller as before, but of one person alone."""
    unlike = errors_by(THREE, {LEAST: (1.0, 9.0, 7.0)})
    found = answer(THREE, errors=unlike)
    assert found.words.startswith("No approach is shown to be the best")
    assert "Nearest the truth" not in found.words
    assert "cannot be told from it" in found.words or "no other can be told" in found.words
    assert "It is smaller than that of all others" not in told(THREE, errors=unlike)


@pytest.mark.parametrize("persons", [1, 2])
def test_fewer_than_three_persons_have_no_verdict(persons: int) -> None:
    found = answer(Size(persons))
    assert "happens to have the least error" in found.words
    assert "Nearest the truth" not in found.words
    assert "cannot tell approaches apart: that takes 3" in found.how_sure
    sentences = told(Size(persons))
    assert "smaller than that of all others" not in sentences
    assert ", better (" not in sentences
    assert "with an interval that leaves out zero" not in sentences
    assert "too few to tell whether by chance" in found.warnings[-1]


def test_without_a_truth_nothing_is_called_right() -> None:
    found = answer(Size(3, truth=False))
    assert found.words.startswith("Which approach is right cannot be told")
    assert "does not show which posture is right" in found.how_sure
    assert "least error" not in told(Size(3, truth=False))


def test_without_a_posture_there_is_no_answer() -> None:
    lost = Size(1, failing=tuple(ERROR))
    found = answer(lost)
    assert found.words == "No motion can be told: no approach found a posture of anybody."
    assert found.warnings[0].startswith("Look at this first: 19 of 19 fits did not settle")
    assert "None of them left a posture." in told(lost)
    empty = {name: rows.iloc[:0] for name, rows in tables_of(Size(1)).items()}
    assert told(Size(1), **empty) == ""
    assert answer(Size(1), **empty).warnings == ()


def test_an_approach_that_lacks_a_motion_is_left_out_and_named() -> None:
    rows = tables_of(THREE)["errors"]
    lost = "approach == @LEAST and specimen == 's02' and trial == 'lateral_bending'"
    left = rows.drop(rows.query(lost).index)
    found = told(THREE, errors=left)
    assert "Left out, as not all motions were found: dynamics with generic" in found
    one = rankings(cohort_of(THREE), ResultTables({"errors": left}, {}, {}), "centre_mm")[0]
    assert LEAST not in one.approaches
    assert one.approaches[0] == "optk_calibrated"


def test_a_person_counts_once_whatever_was_known_of_them() -> None:
    rows = tables_of(THREE)["errors"]
    fewer = rows[(rows["specimen"] != "s01") | rows["level"].isin(["L5", "T1", "L4L5", "T7T8"])]
    for table in (rows, fewer):
        one = rankings(cohort_of(THREE), ResultTables({"errors": table}, {}, {}), "centre_mm")[0]
        assert one.words == "in motion"
        assert one.values[LEAST].to_numpy() == pytest.approx([5.0, 5.5, 6.0])


def test_dynamics_alone_are_called_better_only_where_they_are() -> None:
    sentence = "Dynamics without passive elements beside inverse kinematics, vertebral centres: "
    assert f"{sentence}in motion 8.91 mm against 8.80 mm, worse (" in told(THREE)
    better = errors_by(THREE, {"optk_zero": (5.0, 5.6, 6.1)})
    assert f"{sentence}in motion 5.57 mm against 8.80 mm, better (" in told(THREE, errors=better)
    unsure = errors_by(THREE, {"optk_zero": (2.0, 9.0, 15.0)})
    assert f"{sentence}in motion 8.67 mm against 8.80 mm, not told" in told(THREE, errors=unsure)
    same = tables_of(THREE)["errors"]
    ik = same[same["approach"] == "ik"]["mean"].to_numpy()
    same.loc[same["approach"] == "optk_zero", "mean"] = ik
    assert "against 8.80 mm, as good;" in told(THREE, errors=same)


def test_that_calibration_makes_it_worse_is_said() -> None:
    found = told(THREE)
    assert "calibrated 6.60 mm and from both 7.15 mm, against 5.50 mm with generic" in found
    assert "On average calibration makes it worse. Worse, with an interval" in found
    assert answer(THREE).warnings[-1] == (
        "Calibrating passive elements makes errors larger on average, over 3 persons: vertebral "
        "centres in motion (2 of 2 beyond chance) and sagittal angles in motion (2 of 2 beyond "
        "chance)."
    )
    both = ("optk_calibrated", "optk_from_both")
    better = errors_by(THREE, dict.fromkeys(both, (1.0, 1.1, 1.2)))
    found = told(THREE, errors=better)
    assert "On average calibration does not make it worse. Better, with an interval" in found
    assert "Calibrating passive" not in " ".join(answer(THREE, errors=better).warnings)
    mixed = errors_by(THREE, {"optk_calibrated": (1.0, 1.1, 1.2)})
    assert "On average 1 of 2 calibrations make it worse." in told(THREE, errors=mixed)


def test_worse_on_average_is_not_called_worse_beyond_chance() -> None:
    both = ("optk_calibrated", "optk_from_both")
    unlike = errors_by(THREE, dict.fromkeys(both, (1.0, 4.0, 30.0)))
    assert "none of these differences is larger than its interval" in told(THREE, errors=unlike)
    assert "(not beyond chance)" in answer(THREE, errors=unlike).warnings[-1]


def test_close_markers_are_no_proof() -> None:
    assert "How closely markers are met does not show which posture is right." in told(THREE)
    fits = tables_of(THREE)["fits"]
    fits.loc[fits["approach"] == LEAST, "marker_rmse_mm"] = 0.5
    found = told(THREE, fits=fits)
    assert "which has the least error of vertebral centres too" in found
    assert "does not show" not in found


def test_stiffness_is_told_only_by_closed_profiles() -> None:
    open_end = told(THREE)
    assert "Markers tell one end of stiffness alone, so they do not tell how stiff it" in open_end
    assert "below 0.78 times generic" in open_end
    assert "end of what was tried (" not in open_end
    assert "each is a number of the fit and no property of the spine" in open_end
    assert "Markers do not tell how stiff the spine of s01 is." in answer(THREE).words
    flat = told(Size(verdict="not_told"))
    assert "In 6 of 6 profiles markers tell nothing of stiffness" in flat
    falls = told(Size(verdict="falls"))
    assert "In 6 of 6 profiles the least cost lies at the end of what was tried (0.2" in falls
    assert "so that markers tell nothing there" in falls
    assert "Markers tell one end" not in falls
    assert "whatever was tried fits as well" not in falls
    assert "each is a number of the fit and no property of the spine" in falls
    closed = Size(verdict="told")
    found = told(closed)
    assert "Markers tell stiffness between two ends (95 %): lumbar flexion–extension" in found
    assert "no property of the spine" not in found
    assert "profiles of s01 are closed at both ends; of 2 other persons it was not asked" in found
    assert "end of what was tried (" not in found
    assert "in all regions that were asked" in answer(closed).words


def test_profiles_without_a_fit_say_nothing_of_markers() -> None:
    lost = Size(verdict="lost")
    found = told(lost)
    assert "In 6 of 6 profiles no fit settled, so what markers tell there is not known" in found
    assert "markers tell nothing" not in found
    assert "fits as well" not in found
    assert "stiff" not in answer(lost).words
    mixed = tables_of(THREE)["profiles"]
    mixed.loc[0, ["best_ratio", "verdict", "message"]] = [np.nan, "not_told", "no fit settled"]
    assert "In 1 of 6 profiles no fit settled" in told(THREE, profiles=mixed)
    assert "Markers do not tell how stiff" in answer(THREE, profiles=mixed).words


def test_some_closed_profiles_do_not_speak_for_the_others() -> None:
    rows = tables_of(THREE)["profiles"]
    sure = tables_of(Size(verdict="told"))["profiles"]
    mixed = pd.concat([sure.iloc[:2], rows.iloc[2:]], ignore_index=True)
    found = told(THREE, profiles=mixed)
    assert "2 of 6 profiles are closed at both ends: outside of these each is a number of" in found
    assert "in 2 of 6 profiles." in answer(THREE, profiles=mixed).words
    without = rows.iloc[:0]
    assert "No profile says whether markers tell stiffness" in told(THREE, profiles=without)
    assert "stiff" not in answer(THREE, profiles=without).words


def test_calibrations_that_did_not_settle_are_named() -> None:
    rows = tables_of(THREE)["stiffness"]
    rows.loc[rows["specimen"] == "s02", "status"] = "not_converged"
    assert "1 of 3 calibrations did not settle: dynamics, from both of s02." in told(
        THREE, stiffness=rows
    )
    rows["ratio_to_generic"] = np.nan
    assert "No calibration loaded a joint" in told(THREE, stiffness=rows)


def test_vibration_is_told_by_the_scale_of_the_study() -> None:
    found = told(THREE)
    assert "above 600 deg/s² (root mean square of all joints): inverse kinematics (6 of 6" in found
    assert "These vibrate from frame to frame: inverse kinematics." in answer(THREE).warnings
    fits = tables_of(THREE)["fits"]
    fits["acceleration_rms_deg_per_s2"] = fits["acceleration_rms_deg_per_s2"].clip(upper=599.0)
    assert "No motion vibrates: joints accelerate by 599 deg/s² at most" in told(THREE, fits=fits)
    assert all("vibrate" not in words for words in answer(THREE, fits=fits).warnings)


def test_markers_and_fits_that_are_off_are_named() -> None:
    assert "All 57 fits settled." in told(THREE)
    assert "No fit leaves a marker further off than the 40 mm" in told(THREE)
    fits = tables_of(THREE)["fits"]
    fits.loc[0, ["status", "largest_deviation_mm"]] = ["marker_off", 77.0]
    fits.loc[1, ["status", "message"]] = ["not_converged", "1 of 9 frames did not settle"]
    found = told(THREE, fits=fits)
    assert "1 of 57 fits leave a marker further off than the 40 mm" in found
    assert "the farthest is 77.0 mm off (stance of s01 by inverse kinematics)" in found
    assert "1 of 57 fits did not settle: stance of s01 by inverse kinematics with the" in found
    assert "1 of them left a posture" in found
    warnings = answer(THREE, fits=fits).warnings
    assert warnings[0].startswith("Look at this first: 1 of 57 fits did not settle")
    assert warnings[1].startswith("1 of 57 fits leave a marker further off")
    fits.loc[fits["approach"] == LEAST, "status"] = "not_converged"
    assert "Of the fits behind the least error 6 of 6 did not settle." in told(THREE, fits=fits)


def test_clusters_that_are_not_rigid_are_named() -> None:
    assert "All 2 clusters of markers are rigid" in told(THREE)
    rows = tables_of(THREE)["clusters"]
    rows.loc[0, ["variability_mm", "status"]] = [2.5, "not_rigid"]
    assert "1 of 2 clusters of markers (50 %) are not rigid: T1 of s01; the most, 2.5 mm" in told(
        THREE, clusters=rows
    )
    rows["status"] = "too_few"
    assert "Whether clusters are rigid is not known. 2 clusters are seen" in told(
        THREE, clusters=rows
    )


def test_who_does_most_is_said_with_who_does_not() -> None:
    found = told(THREE)
    assert "L5S1 does most of the lumbar rotation, 31 % (30 to 32 %), in each of 3 persons" in found
    rows = tables_of(THREE)["sharing"]
    own = (rows["specimen"] == "s02") & (rows["joint"] == "L3L4")
    rows.loc[own, "share"] = 0.35
    assert "but in 1 of 3 persons another joint does most" in told(THREE, sharing=rows)
    assert "in the one person there is" in told(Size(1))


def test_shares_that_are_none_are_said() -> None:
    assert "inverse kinematics 6 of 36" in told(THREE)
    rows = tables_of(THREE)["sharing"]
    rows["share"] = rows["share"].clip(lower=0.0)
    assert "No joint turns against the motion" in told(THREE, sharing=rows)
    still = told(replace(THREE, moves=False))
    assert "In 42 motions the lumbar spine turns too little to be shared out" in still
    assert "does most of" not in still


def test_likeness_that_is_not_defined_or_built_in_is_said() -> None:
    found = told(THREE)
    assert "not defined for inverse kinematics, as persons differ more than the curve" in found
    assert "With fixed ratios persons are alike because the ratios are" in found
    assert "1.00" not in next(
        line for line in found.splitlines() if line.startswith("How alike persons share flexion")
    )
    assert "of 2 persons alone" in told(Size(2))
    assert "fewer than two persons have a curve" in told(Size(1))


def test_a_weight_at_the_end_of_what_was_tried_is_said() -> None:
    found = told(THREE)
    assert "errors of centres are least, 3.00 mm (now 3.00 mm), at 1 times the study's;" in found
    assert "at 10 times the study's, an end of what was tried" in found
    assert "weight of loads" not in told(Size(3, truth=False))


def test_sizes_and_remarks_are_counted() -> None:
    found = told(THREE)
    assert "0.980 to 1.03 times as large" in found
    assert "tracked with the skeleton as it is" in found
    assert "1 remark on the input of 1 person" in found
    assert "that are evidence ours are inside the paper's range for 0" in found
    rows = tables_of(THREE)["sizes"]
    rows["factor"] = np.nan
    assert "Markers do not tell the size of any of 1 person." in told(THREE, sizes=rows)
