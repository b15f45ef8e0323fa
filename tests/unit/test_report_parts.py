"""Parts of reports that kinds share: numbers and rows as printed, views in space, tables.

Catches rows that are pooled without need, a number rounded wrongly, text that ends a script early.
"""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pose_tables
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from page_rules import faults_of_chart
from spinepipe.report.page.scene import CORNERS, LONE_DISC_MM, MOST_POSES, as_script, scenes, solids
from study_cases import STUDY, Size, project, results
from sweeps import sweep

from spinepipe.frames import Pose
from spinepipe.report.forms.chart import Panel
from spinepipe.report.forms.chart import saying as saying_chart
from spinepipe.report.forms.look import look
from spinepipe.report.forms.rows import Rows
from spinepipe.report.glyphs import quartiles
from spinepipe.report.page.tables import sortable
from spinepipe.report.panels import MOST_ROWS, across_of, log_ticks, rows_of, sections
from spinepipe.report.specimen import view_of
from spinepipe.report.style import save, saying, style
from spinepipe.report.words import fixed, number, percent, tick
from spinepipe.schema import Column
from spinepipe.studies.joint_pose_sensitivity.inputs import study_and_cohort
from spinepipe.tables import read_frame


def test_specimens_are_pooled_only_when_there_is_no_room() -> None:
    specimens, joints = tuple("abcdef"), tuple(f"J{n}" for n in range(20))
    frame = pd.DataFrame([(s, j) for s in specimens for j in joints], columns=["specimen", "joint"])
    few = rows_of(frame, specimens[:2], joints)
    assert len(few) == 40 <= MOST_ROWS
    assert not few.note
    assert few.labels[:2] == ("b  J0", "a  J0"), "from below, the first specimen above the second"
    many = rows_of(frame, specimens, joints)
    assert many.labels == joints
    assert many.note == "6 specimens pooled"
    assert all(len(part) == 6 for part in many.frames)


def test_quartiles_of_a_known_sample() -> None:
    found = quartiles(np.arange(1.0, 6.0))
    assert (found.low, found.median, found.high, found.n) == (2.0, 3.0, 4.0, 5)
    assert found.iqr == 2.0


@sweep(
    "value, text",
    [
        (20640.0, "20\u2009600"),
        (0.01344, "0.0134"),
        (-1.4, "\u22121.40"),
        (2.46e7, "2.46e7"),
        (0.0, "0"),
        (999.6, "1\u2009000"),
        (float("nan"), "none"),
    ],
)
def test_numbers_as_printed(value: float, text: str) -> None:
    assert number(value) == text


def test_other_numbers_as_printed() -> None:
    assert fixed(-0.001) == "0.00"
    assert fixed(-1.234) == "\u22121.23"
    assert (tick(20.0), tick(300000.0), tick(1e7), tick(0.5)) == (
        "20",
        "300\u2009000",
        "1e7",
        "0.5",
    )
    assert (percent(0, 5), percent(1, 500), percent(499, 500)) == ("0 %", "<1 %", ">99 %")
    assert percent(0, 0) == "none"


def test_sections_wrap_after_three_panels() -> None:
    (upper, lower), figure = sections([(5, 20.0), (1, 30.0)], 10.0)
    assert [len(upper), len(lower)] == [5, 1]
    shown = [axis for axis in figure.axes if axis.get_visible()]
    assert shown == [*upper, *lower]
    assert len(figure.axes) == 9, "two lines of three, and one of three"


def test_a_picture_is_written_whole_or_not_at_all(tmp_path: Path) -> None:
    with style():
        figure = saying("nothing")
        with pytest.raises(ValueError, match=r"picture\.bmp: a picture is"):
            save(figure, tmp_path / "picture.bmp")
        (tmp_path / "picture.png").mkdir()
        with pytest.raises(OSError, match=r"picture\.png"):
            save(figure, tmp_path / "picture.png")
    assert [path.name for path in tmp_path.iterdir()] == ["picture.png"]


def test_ticks_of_logarithmic_axes_are_few() -> None:
    axis = Figure().subplots()
    axis.set_xscale("log")
    for low, high in ((1.4e4, 9e5), (9.0, 250.0), (30.0, 40.0), (1.0, 1e12)):
        axis.set_xlim(low, high)
        log_ticks(axis.xaxis, low, high, 3)
        shown = [x for x in axis.get_xticks() if low <= x <= high]
        assert 1 <= len(shown) <= 4, (low, high, shown)


def test_four_panels_are_two_and_two() -> None:
    assert [across_of(n) for n in (1, 2, 3, 4, 5, 6, 7)] == [1, 2, 3, 2, 3, 3, 3]
    assert across_of(4, most=4) == 4


def test_legend_of_the_scene_names_each_load_once(tmp_path: Path) -> None:
    study, cohort = study_and_cohort(str(project(tmp_path, Size(("a",), 2, 4))), STUDY)
    poses = pose_tables.frame("poses", pose_tables.poses(4))
    assert cohort.loads is not None
    twice = pd.concat([cohort.loads.assign(cycle=cycle) for cycle in (1, 2)], ignore_index=True)
    again = replace(cohort, loads=twice)
    drawn = scenes([view_of(again, "a", study.tests)], again, poses)["a"]["data"]
    loads = [trace for trace in drawn if trace["meta"] == "loads"]
    assert len(loads) == 8, "line and head of a force and of a moment, in two cycles"
    named = sorted(t["name"] for t in loads if t["showlegend"])
    assert named == ["flexion: 1 N m", "flexion: 20 N"]


def test_script_data_survives_what_html_would_read() -> None:
    scene = {"</script><b>&": [1.5, None]}
    text = as_script(scene)
    assert json.loads(text) == scene
    assert not set("<>&") & set(text)


def test_scene_shows_frames_of_both_kinds(tmp_path: Path) -> None:
    size = Size(("a", "b"), 2, 250)
    folder = results(project(tmp_path, size), size)
    study, cohort = study_and_cohort(str(tmp_path), STUDY)
    views = [view_of(cohort, name, study.tests) for name in cohort.specimen_names]
    drawn = scenes(views, cohort, read_frame(folder / "poses.parquet"))
    assert list(drawn) == ["a", "b"]
    traces = {trace["name"]: trace for trace in drawn["a"]["data"]}
    own = traces["superior axis, own"]
    assert own["x"] == [0.0, 0.0, None] * 2
    assert own["y"][:2] == [5.0, 16.0], "from the joint's origin 11 mm upwards"
    lines = len(traces["superior axis, sampled"]["x"]) // 3
    assert lines == 2 * 84, "of 250 poses every third, two joints each"
    assert lines <= 2 * MOST_POSES
    assert traces["flexion: 20 N"]["y"][0] == 36.0 * 2 + 13.0, "ends where the load acts"
    titles = [drawn["a"]["layout"]["scene"][f"{x}axis"]["title"]["text"] for x in "xyz"]
    assert titles == ["anterior (mm)", "superior (mm)", "right (mm)"]


def test_solids_of_vertebrae_with_two_endplates_one_or_none() -> None:
    centre = {"inferior_endplate_centre": np.zeros(3)}
    both = {**centre, "superior_endplate_centre": np.array([0.0, 0.03, 0.0])}
    both |= {
        f"{side}_pedicle_base": np.array([0.0, 0.02, z])
        for side, z in (("left", -0.01), ("right", 0.01))
    }
    frames = dict.fromkeys(("A", "B", "C"), Pose(np.eye(3), np.zeros(3)))
    found = solids({"A": both, "B": centre, "C": {}}, frames, 1000.0)
    assert set(found) == {"A", "B"}
    points = found["A"].points
    assert points.shape == (2 * CORNERS + 2, 3)
    np.testing.assert_allclose(np.hypot(points[:-2, 0], points[:-2, 2]), 10.0)
    np.testing.assert_allclose(points[CORNERS : 2 * CORNERS, 1], 30.0)
    np.testing.assert_allclose(found["B"].points[-1], [0.0, LONE_DISC_MM, 0.0])
    assert found["A"].triangles.shape == (4 * CORNERS, 3)
    assert found["A"].triangles.max() == 2 * CORNERS + 1


def test_columns_that_say_nothing_are_left_out_and_units_stand_in_the_heading() -> None:
    columns = [
        Column("specimen", "text", "name"),
        Column("sd_mm", "number", "spread", "mm", nullable=True, empty="none"),
        Column("message", "text", "words"),
        Column("kept", "flag", "whether"),
    ]
    frame = pd.DataFrame(
        {"specimen": "a", "sd_mm": [0.1234, np.nan], "message": "", "kept": [True, False]}
    )
    found = sortable("t", "T", "about", frame, columns)
    assert [(head.name, head.unit) for head in found.heads] == [("sd", "mm"), ("kept", "")]
    assert found.heads[0].meaning == "spread; empty: none"
    assert [[cell.text for cell in row] for row in found.rows] == [["0.123", "yes"], ["", "no"]]
    assert found.rows[0][0].value == 0.1234
    assert found.rows[1][0].value is None
    long = sortable("t", "T", "about", pd.DataFrame({"specimen": list("ab") * 400}), columns)
    assert len(long.rows) == 200
    assert long.note == "The first 200 of 800 rows; all of them are in t.parquet."


def drawn(panel: Panel) -> Axes:
    """A panel of a chart on axes of its own."""
    with look():
        axes = Figure().subplots()
        panel.draw(axes)
    return axes


def test_series_that_a_row_alone_has_stand_in_its_middle() -> None:
    """Row one has both series, row two the second alone."""
    rows = [("one", "a", 1.0), ("one", "b", 2.0), ("two", "b", 3.0)]
    frame = pd.DataFrame(rows, columns=["row", "series", "value"])
    heights = [line.get_ydata() for line in drawn(Rows(frame=frame)).lines]
    found = {round(float(y), 3) for of in heights for y in np.atleast_1d(of)}
    assert found == {-0.155, 0.155, 1.0}


@sweep("low, high", [(119.0, 477.0), (1.0, 40.0), (0.2, 0.5), (160.0, 480.0), (30.0, 40.0)])
def test_numbers_of_a_logarithmic_axis_are_apart_and_plain(low: float, high: float) -> None:
    frame = pd.DataFrame({"row": ["one"], "value": [low], "low": [low], "high": [high]})
    axis = drawn(Rows(frame=frame, log=True, x_limits=(low, high))).xaxis
    shown = [x for x in axis.get_majorticklocs() if low <= x <= high]
    assert 2 <= len(shown) <= 6
    steps = np.diff(np.log10(shown)) / np.log10(high / low)
    assert steps.min() > 0.12
    assert not any("$" in axis.get_major_formatter()(x, None) for x in shown)


def test_a_figure_without_results_says_why_however_long_that_is() -> None:
    short = saying_chart(
        "Nothing", "No fit of any specimen that was tried ended with a stiffness; " * 3 + "so."
    )
    assert list(faults_of_chart(short)) == []
    assert short.panels[0].height > saying_chart("Nothing", "No.").panels[0].height
