"""Findings of small and odd studies: what so few fits cannot tell is said, not told as a number."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from spinepipe.report.page.document import ResultTables
from study_cases import STUDY, Size, project
from sweeps import sweep

from spinepipe.studies.joint_pose_sensitivity.findings import findings
from spinepipe.studies.joint_pose_sensitivity.inputs import study_and_cohort
from spinepipe.studies.joint_pose_sensitivity.page import left_out, shown_tables
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.studies.joint_pose_sensitivity.tables import LOWER_ENDS
from spinepipe.tables import StudyTables

NAN = float("nan")


@pytest.fixture
def study(tmp_path: Path) -> JointPoseSensitivity:
    """The study of the made-up project; superior and extension are free."""
    return study_and_cohort(str(project(tmp_path, Size())), STUDY)[0]


def told(study: JointPoseSensitivity, tables: Mapping[str, list[dict[str, Any]]]) -> str:
    """All findings as one text, with plain spaces."""
    frames = StudyTables({name: pd.DataFrame(rows) for name, rows in tables.items()})
    return " ".join(findings(study, ResultTables(frames, {}, {}))).replace("\u00a0", " ")


def summary(n: int, iqr: float, part: str, loading: str, **more: Any) -> dict[str, Any]:
    """Stiffness in extension; its median is 10."""
    row = {"specimen": "a", "part": part, "loading": loading, "quantity": "stiffness", "joint": "*"}
    row |= {"dataset": "reduced" if part == "poses" else "all", "coordinate": "extension"}
    numbers = {"median": 10.0, "low_quartile": 9.0, "high_quartile": 11.0, "iqr": iqr, "n": n}
    held = {"open_share": 0.0, **dict(zip(LOWER_ENDS, (6.0, 7.0, 8.0), strict=True))}
    return {**row, **numbers, **held, "unit": "N m/rad", **more}


def counts(part: str, loading: str, fits: int, solved: int) -> dict[str, Any]:
    """Fits of a bootstrap."""
    return {"part": part, "loading": loading, "fits": fits, "solved": solved}


def test_one_fit_has_no_spread_and_lost_fits_are_counted(study: JointPoseSensitivity) -> None:
    rows = [
        summary(1, 0.0, "start_bootstrap", "dynamic"),
        summary(3, 2.0, "start_bootstrap", "equilibrium"),
        summary(2, 0.0, "damping_bootstrap", "dynamic"),
    ]
    fits = [
        counts("start_bootstrap", "dynamic", 2, 1),
        counts("start_bootstrap", "equilibrium", 3, 3),
        counts("damping_bootstrap", "dynamic", 2, 2),
    ]
    words = told(study, {"summary": rows, "counts": fits})
    assert "over start values fewer than 3 fits dynamic, 20 % at rest" in words
    assert "over damping not told, with fewer than 3 fits of a kind" in words
    assert "below 0.01 %" not in words
    assert "over start values 1 of 5 (dynamic 1 of 2); over damping 0 of 2." in words


def test_methods_that_were_refused_are_not_unsuccessful(study: JointPoseSensitivity) -> None:
    shares = [
        {"method": name, "successful": 0, "fits": 1, "arrived": 0} for name in ("exact", "forward")
    ]
    fits = [
        {"method": row["method"], "status": "refused", "message": "one stiffness only"}
        for row in shares
    ]
    words = told(study, {"success_by_method": shares, "method_fits": fits})
    assert words == "Methods of fitting were not compared: one stiffness only."
    fits[0] |= {"status": "converged", "message": ""}
    words = told(study, {"success_by_method": shares, "method_fits": fits})
    assert "exact 0 of 1 (least cost reached: 0); forward not compared (one stiffness" in words


def calibrations(identifiable: list[bool], freedom: list[int]) -> list[dict[str, Any]]:
    """Solved fits, one per pose."""
    same = {"specimen": "a", "joint": "*", "status": "converged"}
    return [
        {**same, "pose": pose, "extension_identifiable": flag, "degrees_of_freedom": n}
        for pose, (flag, n) in enumerate(zip(identifiable, freedom, strict=True))
    ]


def test_stiffness_that_data_do_not_hold_has_a_warning(study: JointPoseSensitivity) -> None:
    rows = [summary(4, 2.0, "poses", "equilibrium")]
    fits = calibrations([True, False, True, False], [1, 1, 1, 1])
    reduced = [{"specimen": "a", "pose": pose, "reduced": pose < 3} for pose in range(4)]
    words = told(study, {"summary": rows, "calibrations": fits, "success": reduced})
    assert "(IQR 9.00 to 11.0), but not identifiable in 1 of 3 fitted (33 %)." in words
    sound = {"summary": rows, "calibrations": calibrations([True] * 2, [2, 1])}
    assert "identifiable" not in told(study, sound)
    assert "readings" not in told(study, sound)


def test_a_start_value_is_no_median(study: JointPoseSensitivity) -> None:
    """Extension starts at the study's value; three of four fits, and no region, left it there."""
    start = study.stiffness.extension_nm_per_rad
    fits = calibrations([False] * 4, [1] * 4)
    for fit, value in zip(fits, (start, start, 1.001 * start, 2.0 * start), strict=True):
        fit["extension_nm_per_rad"] = value
    words = told(
        study, {"summary": [summary(4, 0.0, "poses", "equilibrium")], "calibrations": fits}
    )
    assert "Nothing is known of flexion–extension: 3 of 4 fits left it at its start." in words
    assert "Median stiffness" not in words
    held = [{**fit, "extension_identifiable": True} for fit in fits]
    words = told(
        study, {"summary": [summary(4, 0.0, "poses", "equilibrium")], "calibrations": held}
    )
    assert "Median stiffness over the reduced poses: flexion–extension 10" in words


def test_a_median_that_most_fits_do_not_hold_is_not_told(study: JointPoseSensitivity) -> None:
    """Nine of ten regions are open: what is known is above what the stiffness lies."""
    most = {"open_share": 0.9}
    words = told(study, {"summary": [summary(10, 2.0, "poses", "equilibrium", **most)]})
    assert (
        "Not held by the data: flexion–extension, whose region is open in 90 % of fits; lower ends "
        "6.00 to 8.00 N m/rad (IQR)."
    ) in words
    assert "Median stiffness" not in words
    nowhere = most | dict.fromkeys(LOWER_ENDS)
    words = told(study, {"summary": [summary(10, 2.0, "poses", "equilibrium", **nowhere)]})
    assert "Not held by the data: flexion–extension, whose region is open in 90 % of fits." in words


def test_specimens_whose_medians_are_not_held_are_counted(study: JointPoseSensitivity) -> None:
    rows = [
        summary(10, 2.0, "poses", "equilibrium", specimen=name, open_share=share)
        for name, share in (("a", 0.2), ("b", 0.6), ("c", 1.0))
    ]
    words = told(study, {"summary": rows})
    assert "over the reduced poses: flexion–extension 10.0 N m/rad (a, IQR 9.00 to 11.0)." in words
    assert "Not held by the data: flexion–extension in 2 of 3 specimens." in words


@sweep(
    "freedom, words",
    [
        ([0, 0], "All fits are exact: as many readings as unknowns"),
        ([-1, 0], "All 2 fits have no more readings than unknowns"),
        ([1, 0], "1 of 2 fits have no more readings than unknowns"),
    ],
)
def test_fits_of_few_readings_are_called_exact(
    study: JointPoseSensitivity, freedom: list[int], words: str
) -> None:
    rows = [summary(2, 2.0, "poses", "equilibrium")]
    fits = calibrations([False, False], freedom)
    assert words in told(study, {"summary": rows, "calibrations": fits})


def test_lowest_and_highest_median_say_whose_they_are(study: JointPoseSensitivity) -> None:
    rows = [
        summary(4, 2.0, "poses", "equilibrium", specimen=name, median=median, joint=joint)
        for name, median, joint in (("a", 20.0, "J1"), ("a", 5.0, "J2"), ("b", 7.0, "J1"))
    ]
    words = told(study, {"summary": rows})
    assert "5.00 (a J2) to 20.0 N m/rad (a J1), medians of 3 joints of 2 specimens" in words
    assert "5.00 (J2) to 20.0 N m/rad (J1), medians of 2 joints." in told(
        study, {"summary": rows[:2]}
    )
    alone = [row | {"joint": "*"} for row in rows[1:]]
    assert "5.00 (a) to 7.00 N m/rad (b), medians of 2 specimens." in told(
        study, {"summary": alone}
    )


def test_motion_that_was_not_at_rest_is_told(study: JointPoseSensitivity) -> None:
    settling = study.model_copy(update={"loading": "settle", "settle_time_s": 0.3})
    assert "0.3 s after loading, while stiffness was fitted at rest" in told(settling, {})
    assert told(study, {}) == ""


def required(sd: float, low: float, high: float, **more: Any) -> dict[str, Any]:
    """A row of the required precision, below both limits."""
    row = {"specimen": "a", "stiffness": "nominal", "motion": "both", "n": 6, "message": ""}
    return row | {"sd_mm": sd, "sd_low_mm": low, "sd_high_mm": high, **more}


def precise(study: JointPoseSensitivity, *rows: dict[str, Any]) -> str:
    """The finding about landmarks; SDs of 0.5 to 4 mm were sampled."""
    asked = study.landmark_precision.model_copy(update={"sd_mm": (0.5, 2.0, 4.0)})
    sampled = study.model_copy(update={"landmark_precision": asked})
    return told(sampled, {"required_precision": list(rows)})


def test_open_ends_and_few_poses_of_landmark_precision_are_told(
    study: JointPoseSensitivity,
) -> None:
    words = precise(study, required(0.95, 0.65, NAN))
    assert "0.95 mm (0.65 to above 4 mm) (6 poses per SD)." in words
    # Wilson's lower end of 6 of 6: n / (n + z^2) = 6 / (6 + 3.84) = 61 %
    assert "6 poses cannot show 95 %: even with all of them below" in words
    assert "begins at 61 %" in words
    assert "0.95 mm (below 0.5 to 1.20 mm)" in precise(study, required(0.95, NAN, 1.2))
    assert "cannot show" not in precise(study, required(0.95, 0.65, 1.2, n=74))
    assert "cannot show" in precise(study, required(0.95, 0.65, 1.2, n=72)), "72 / 75.84 < 0.95"


def test_precision_is_told_of_the_one_kind_of_motion_that_was_measured(
    study: JointPoseSensitivity,
) -> None:
    words = precise(study, required(1.25, 1.0, 1.5, motion="rotation", stiffness="calibrated"))
    assert "to stay below 1°, the SD" in words
    assert "stiffness fitted to each pose 1.25 mm (1.00–1.50)" in words


def test_specimens_are_not_an_interval(study: JointPoseSensitivity) -> None:
    rows = [required(0.95, 0.6, 1.2), required(2.6, 2.2, NAN, specimen="b")]
    assert "0.95 mm (smallest of 2 specimens, a) (6 poses" in precise(study, *rows)
    above = required(NAN, NAN, NAN, specimen="c", message="too many above")
    words = precise(study, *rows, above)
    assert "0.95 mm (smallest of 2 specimens, a), but too many above in c (6 poses" in words
    assert "at most: with stiffness of the cohort's own pose too many above in c" in precise(
        study, above, above | {"specimen": "d"}
    )


def shares(joint: str, *ends: float) -> list[dict[str, Any]]:
    """Intervals of the pose, then of the stiffness, of errors with their sign; the rest is 4 %.

    Of sizes the interval of the pose is narrow, and the rest is 55 %.
    """
    cell = {"specimen": "a", "joint": joint, "coordinate": "extension", "status": "done"}
    parts = (("pose", *ends[:2]), ("stiffness", *ends[2:]), ("interaction", 0.02, 0.06))
    rows = []
    for factor, low, high in parts:
        signed = {"signed_share": 0.5 * (low + high)}
        signed |= {"signed_share_low": low, "signed_share_high": high}
        size = 0.55 if factor == "interaction" else 0.2
        ends_of_size = {"share_low": size, "share_high": size}
        rows.append({**cell, "factor": factor, **signed, "share": size, **ends_of_size})
    return rows


def test_shares_with_common_ground_are_not_ranked(study: JointPoseSensitivity) -> None:
    rows = [
        *shares("J1", 0.5, 0.9, 0.1, 0.4),
        *shares("J2", 0.0, 0.2, 0.3, 0.8),
        *shares("J3", 0.3, 0.9, 0.1, 0.4),
    ]
    words = told(study, {"variance_shares": rows})
    assert words.startswith("Of 3 errors (one per joint and direction), joint pose takes more")
    assert "than stiffness in 1 and stiffness more in 1. In the other 1 they cannot be" in words
    assert "In none of 1 error" in told(study, {"variance_shares": rows[6:]})
    assert "told apart" not in told(study, {"variance_shares": rows[:6]})


def test_folding_is_told_where_sizes_have_more_interaction(study: JointPoseSensitivity) -> None:
    rows = shares("J1", 0.5, 0.9, 0.1, 0.4)
    words = told(study, {"variance_shares": rows})
    assert "takes 4 % of the variance of an error (median), and 55 % of that of its size: " in words
    assert "sizes fold errors at zero" in words
    alike = [row | {"share": row["signed_share"]} for row in rows]
    assert "fold" not in told(study, {"variance_shares": alike})


def test_parts_that_were_left_out_are_named(study: JointPoseSensitivity) -> None:
    settings = study.model_dump()
    parts = {
        "start_bootstrap": "sets",
        "damping_bootstrap": "sets",
        "methods": "poses",
        "landmark_precision": "poses",
        "posterior": "draws",
    }
    for part, name in parts.items():
        settings[part][name] = 3
    settings["load_point"]["superior_mm"] = (0.0, 3.0)
    assert left_out(JointPoseSensitivity.model_validate(settings)) == ()
    settings["start_bootstrap"]["sets"] = settings["methods"]["poses"] = 0
    settings["load_point"]["superior_mm"] = (0.0,)
    assert left_out(JointPoseSensitivity.model_validate(settings)) == (
        "bootstrap over start values (start_bootstrap: sets: 0)",
        "comparison of ways of fitting (methods: poses: 0)",
        "stiffness over load points (load_point: one point and no SD)",
    )


def test_trees_that_could_not_be_grown_have_a_row_that_says_why(
    study: JointPoseSensitivity,
) -> None:
    cell = {"specimen": "a", "joint": "J", "coordinate": "extension", "n": 18}
    cell |= dict.fromkeys(("importance", "leaves", "r2"), NAN)
    cell |= {"factor": "pose", "status": "too_few", "message": "18 rows; at least 20"}
    rows = [{**cell, "predictor": name} for name in ("p1", "p2")]
    frames = StudyTables({"importance": pd.DataFrame(rows)})
    (table,) = shown_tables(study, ResultTables(frames, {}, {}))
    (row,) = table.rows
    assert [head.name for head in table.heads] == ["joint", "coordinate", "n", "message"]
    assert row[-1].text == "18 rows; at least 20"
