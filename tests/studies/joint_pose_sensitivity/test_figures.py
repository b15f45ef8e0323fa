"""Figures: there for every kind of result, the same bytes twice, words true to the tables.

Would catch figures that fail at some size of cohort or hang on the computer, numbers in words that
the tables do not have, and a paper's numbers where they do not belong.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from identification_cases import identification, write_table
from matplotlib.figure import Figure
from PIL import Image
from study_cases import FIGURES, STUDY, Size, drawing, drawn, project, results
from sweeps import sweep

from spinepipe.report.glyphs import quartiles
from spinepipe.report.panels import MOST_ROWS, rows_of, sections
from spinepipe.report.style import DPI, WIDTH_MM, save, saying, style
from spinepipe.report.words import fixed, number, percent, tick
from spinepipe.studies import joint_pose_sensitivity
from spinepipe.studies.joint_pose_sensitivity.figures.bootstrap import bootstrap_rows, draw_paper
from spinepipe.studies.joint_pose_sensitivity.figures.landmark_precision import (
    landmark_precision_figure,
)
from spinepipe.studies.joint_pose_sensitivity.figures.pose_against_stiffness import (
    importance_by_factor,
)
from spinepipe.studies.joint_pose_sensitivity.figures.stiffness import stiffness_figure
from spinepipe.studies.joint_pose_sensitivity.inputs import study_and_cohort
from spinepipe.studies.joint_pose_sensitivity.kind import KIND
from spinepipe.units import COORDINATES

OF_POSES = ("stiffness", "errors", "joint_pose")
OF_PARTS = (
    *("bootstrap", "success_by_method", "agreement"),
    *("pose_against_stiffness", "landmark_precision"),
)
DRAWN = (*OF_POSES, *OF_PARTS)
"""All but the figures of the posterior and of the load point, which have tests of their own."""

ONE = Size(("a",), 2, 12)
SIZES = [
    (Size(("a",), 1, 12, ("extension",)), DRAWN),
    (Size(), OF_POSES),
    (Size(("a",), 2, 3), OF_POSES),
    (Size(("a", "b"), 3, 12, grouping="per_joint"), OF_POSES),
    (Size(("a", "b", "c"), 20, 4, COORDINATES, "per_joint"), OF_POSES),
    (Size(tuple(f"s{n:02d}" for n in range(12)), 4, 4, COORDINATES, "per_joint"), OF_PARTS),
]


def tables(root: Path, size: Size) -> Path:
    """Made-up results; returns their folder."""
    folder = results(project(root, size), size)
    identification(folder, size)
    return folder


def all_drawn(root: Path, size: Size) -> Path:
    tables(root, size)
    for name in DRAWN:
        drawn(root, name)
    return root


def words(svg: Path) -> str:
    """Words of an SVG; matplotlib notes them beside the outlines."""
    parts = svg.read_text().split("<!--")[1:]
    return " ".join(" ".join(part.split("-->")[0].split()) for part in parts)


def svg_of(root: Path, name: str) -> Path:
    return root / "results" / STUDY / "figures" / f"{name}.svg"


def told_in(root: Path, name: str) -> str:
    return words(svg_of(root, name))


def is_drawn(svg: Path) -> None:
    with Image.open(svg.with_suffix(".png")) as picture:
        assert picture.width == int(WIDTH_MM / 25.4 * DPI), svg.stem
        assert np.asarray(picture.convert("L")).min() < 128, f"{svg.stem}: nothing is drawn"


@pytest.fixture(scope="module")
def one(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A project of one specimen with its figures, to be looked at."""
    return all_drawn(tmp_path_factory.mktemp("one"), ONE)


@pytest.fixture(scope="module")
def unsolved(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same of two specimens without a solved row."""
    return all_drawn(tmp_path_factory.mktemp("unsolved"), Size(solved=False))


def test_every_figure_can_be_drawn_and_has_a_caption() -> None:
    folder = Path(joint_pose_sensitivity.__file__).parent
    assert {path.stem for path in folder.glob("figures/*.rst")} == set(FIGURES)
    for figure in KIND.figures:
        assert callable(drawing(figure.name)), figure.name


def test_figures_of_one_specimen_and_of_none_solved(one: Path, unsolved: Path) -> None:
    for root in (one, unsolved):
        for name in DRAWN:
            is_drawn(svg_of(root, name))


@pytest.mark.full
@sweep("size, names", SIZES)
def test_figures_of_any_cohort(tmp_path: Path, size: Size, names: tuple[str, ...]) -> None:
    tables(tmp_path, size)
    for name in names:
        is_drawn(drawn(tmp_path, name))


def test_same_bytes_twice(one: Path, tmp_path: Path) -> None:
    tables(tmp_path, ONE)
    svg = drawn(tmp_path, "stiffness")
    for kind in (".svg", ".png"):
        first = svg_of(one, "stiffness").with_suffix(kind)
        assert svg.with_suffix(kind).read_bytes() == first.read_bytes()


@pytest.mark.full
def test_all_figures_have_the_same_bytes_twice(one: Path, tmp_path: Path) -> None:
    again = all_drawn(tmp_path, ONE)
    for name in DRAWN:
        assert svg_of(again, name).read_bytes() == svg_of(one, name).read_bytes(), name


def test_no_date_and_no_font_from_the_computer(one: Path) -> None:
    text = svg_of(one, "errors").read_text()
    assert "<dc:date>" not in text
    assert "<text" not in text, "letters are outlines"


@sweep(
    "name, told",
    [
        ("stiffness", "No stiffness was found for any of 24 joint poses."),
        ("errors", "none of 72 simulations"),
        ("bootstrap", "No stiffness was found in any of 150 bootstrap fits."),
        ("success_by_method", "Not compared: no &lt;joint&gt; frame &amp; no fit."),
        ("agreement", "none of 8 rows has two different readings"),
        ("pose_against_stiffness", "no error varies over the grid"),
        ("landmark_precision", "no sampled pose has a result at any landmark SD"),
    ],
)
def test_what_has_no_result_is_said(unsolved: Path, name: str, told: str) -> None:
    assert told in told_in(unsolved, name)


def test_shares_and_medians_are_written_in_the_panels(tmp_path: Path) -> None:
    size = Size(("a",), 2, 40)
    written = words(drawn(tables(tmp_path, size).parents[1], "stiffness"))
    frame = pd.read_parquet(tmp_path / "results" / STUDY / "calibrations.parquet")
    lost = int((frame["extension_identifiable"] == False).sum())  # noqa: E712
    at_bound = int((frame["extension_nm_per_rad"] > 36_999).sum())
    assert at_bound > 0
    told = f"at a bound {percent(at_bound, 40)}, not identifiable {percent(lost, 40)}, n = 40"
    assert told in written
    assert f"median {number(frame['extension_nm_per_rad'].median())} (IQR" in written


def test_no_median_is_told_of_what_most_fits_do_not_hold(tmp_path: Path) -> None:
    """Made by hand: 21 of 40 fits do not hold extension; lower ends 1 to 5, quartiles 2 and 4."""
    size = Size(("a",), 2, 40)
    study, cohort = study_and_cohort(str(project(tmp_path, size)), STUDY)
    results(tmp_path, size)
    frame = pd.read_parquet(tmp_path / "results" / STUDY / "calibrations.parquet")
    frame["extension_low_nm_per_rad"] = np.resize([1.0, 2.0, 3.0, 4.0, 5.0], len(frame))
    said = []
    for lost in (20, 21):
        frame["extension_identifiable"] = np.arange(len(frame)) >= lost
        figure = stiffness_figure(study, cohort, {"calibrations": frame})
        said.append(" ".join(text.get_text() for axis in figure.axes for text in axis.texts))
    median = f"median {number(frame['extension_nm_per_rad'].median())} (IQR"
    assert median in said[0]
    assert "not held" not in said[0]
    assert median not in said[1]
    assert "not held; above 2.00–4.00 (IQR)" in said[1]


def test_share_without_equilibrium_counts_runs_not_rows(tmp_path: Path) -> None:
    size = Size(("a",), 2, 12)
    written = words(drawn(tables(tmp_path, size).parents[1], "errors"))
    frame = pd.read_parquet(tmp_path / "results" / STUDY / "simulations.parquet")
    best = frame[frame["stiffness"] == "best01"]
    failed = int((best.groupby("pose")["status"].first() != "converged").sum())
    assert 0 < failed < 12
    assert percent(failed, 12) in written


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


@sweep("name", OF_PARTS)
def test_tables_without_rows_are_told_not_drawn(tmp_path: Path, name: str) -> None:
    folder = tables(tmp_path, ONE)
    for table in set(FIGURES[name]) - {"simulations"}:
        write_table(folder, table, [])
    svg = drawn(tmp_path, name)
    told = {
        "bootstrap": "any of 0 bootstrap fits",
        "success_by_method": "No fit was done in several ways",
        "agreement": "none of 0 rows",
        "pose_against_stiffness": "cannot be compared",
        "landmark_precision": "No error can be shown",
    }
    assert told[name] in words(svg)


def test_bootstrap_tells_median_range_and_n_of_each_row(one: Path) -> None:
    told = told_in(one, "bootstrap")
    frame = pd.read_parquet(one / "results" / STUDY / "bootstrap.parquet")
    row = frame[(frame["bootstrap"] == "damping") & (frame["loading"] == "dynamic")]
    upper = row[row["joint"] == "V1V2"]
    for column in ("extension_nm_per_rad", "extension_error_deg"):
        values = upper[column]
        width = number(values.max() - values.min(), 2)
        assert f"{number(values.median())}, range {width}, n = 5" in told
    assert "75 fits of 75 with a stiffness" in told, "(20 + 5) sets under three loadings"
    assert "Gould" not in told, "the cohort was not rebuilt from a paper"


def test_pooled_bootstrap_is_relative_to_each_own_median() -> None:
    """Two specimens of 2 and 200 N/m: pooled they would seem to spread, though neither does."""
    rows = [
        {
            "specimen": f"s{n:02d}",
            "bootstrap": "start",
            "loading": "dynamic",
            "set": k,
            "joint": "J",
            "superior_n_per_m": (2.0 if n % 2 else 200.0) * (1.0 + 0.1 * k),
            "superior_error_mm": n + 0.5 * k,
        }
        for n in range(50)
        for k in (-1, 0, 1)
    ]
    columns = ["superior_n_per_m", "superior_error_mm"]
    names = [f"s{n:02d}" for n in range(50)]
    pooled, relative = bootstrap_rows(pd.DataFrame(rows), columns, names, ["J"])
    assert relative
    assert pooled.labels == ("start, dynamic",)
    (frame,) = pooled.frames
    assert sorted(set(frame["superior_n_per_m"].round(12))) == [0.9, 1.0, 1.1]
    assert sorted(set(frame["superior_error_mm"])) == [-0.5, 0.0, 0.5]
    few, relative = bootstrap_rows(pd.DataFrame(rows), columns, names[:40], ["J"])
    assert not relative
    assert len(few) == 40
    assert few.labels[-1] == "start, dynamic, s00", "the first specimen on top"


@sweep(
    "sampled, loading, joint, name, ends, median",
    [  # Gould et al. 2024a, Tables 2 and 3
        ("damping", "quasi_static", "L2L3", "anterior", (0.415, 0.425), 0.42),
        ("damping", "quasi_static", "L2L3", "superior", (0.0, 0.35), 0.0005),
        ("start", "dynamic", "L3L4", "anterior", (0.14, 0.48), 0.31),
    ],
)
def test_published_median_and_range_are_drawn(
    sampled: str, loading: str, joint: str, name: str, ends: tuple[float, float], median: float
) -> None:
    axis = Figure().subplots()
    row = pd.DataFrame([{"bootstrap": sampled, "loading": loading, "joint": joint}])
    draw_paper(axis, "palanca_l1l4", name, row, 0.0)
    line, tick, diamond = axis.lines
    np.testing.assert_allclose(line.get_xdata(), ends, atol=1e-12)
    assert float(tick.get_xdata()[0]) == float(diamond.get_xdata()[0]) == median
    other = Figure().subplots()
    draw_paper(other, "straight", name, row, 0.0)
    draw_paper(other, "palanca_l1l4", name, row.assign(loading="equilibrium"), 0.0)
    assert not other.lines, "no paper, or a loading that the paper does not have"


def test_success_tells_counts_of_each_method(one: Path) -> None:
    told = told_in(one, "success_by_method")
    for share in ("6 of 6 (100 %)", "1 of 6 (17 %)", "5 of 6 (83 %)", "least cost: 1 of 6"):
        assert share in told
    assert "all free stiffnesses within 1 % of the start" in told


def test_agreement_tells_bias_and_limits(one: Path) -> None:
    told = told_in(one, "agreement")
    assert told.count("bias 0.01 (\u22120.19 to 0.21), n = 12") == 4, "2 joints x 2 coordinates"


@pytest.mark.full
def test_many_panels_of_agreement_are_rows(tmp_path: Path) -> None:
    many = Size(("a", "b"), 4, 4)
    rows = words(drawn(tables(tmp_path, many).parents[1], "agreement"))
    assert "bias with 95 % interval" in rows, "16 panels do not fit on a page: rows"


def test_only_reduced_poses_are_readings_of_agreement(tmp_path: Path) -> None:
    folder = tables(tmp_path, ONE)
    success = pd.read_parquet(folder / "success.parquet")
    success["reduced"] = success["pose"] < 3
    write_table(folder, "success", success.to_dict("records"))
    few = drawn(tmp_path, "agreement").read_text().count("<use ")
    success["reduced"] = True
    write_table(folder, "success", success.to_dict("records"))
    all_ = drawn(tmp_path, "agreement").read_text().count("<use ")
    assert all_ > few


def test_shares_and_trees_are_told(one: Path) -> None:
    told = told_in(one, "pose_against_stiffness")
    for share in ("70 %", "20 %", "10 %"):
        assert told.count(share) == 8, "of errors and of their sizes"
    assert told.count("pose 80 %; 5 leaves, r² 0.60") == 4
    assert "Grid of 12 joint poses times 2 stiffness sets" in told


def test_importance_is_summed_over_the_predictors_of_a_factor() -> None:
    tree = {"specimen": "a", "joint": "J", "coordinate": "extension", "r2": 0.5, "leaves": 3}
    rows = [
        {
            **tree,
            "n": 9,
            "predictor": name,
            "factor": name[0],
            "importance": share,
            "status": "done",
        }
        for name, share in (("p1", 0.5), ("p2", 0.25), ("s1", 0.25))
    ]
    rows.append({**rows[0], "joint": "K", "status": "constant"})
    found = importance_by_factor(pd.DataFrame(rows))
    assert list(found["factor"]) == ["p", "s"], "trees that are not there have no row"
    assert list(found["importance"]) == [0.75, 0.25]
    assert list(found["predictors"]) == [2, 1]


def test_required_precision_is_told_or_why_not(one: Path) -> None:
    told = told_in(one, "landmark_precision")
    assert "1.25 mm (1.00–1.50)" in told
    assert "too many poses are above the limit even at 0.5 mm" in told
    assert "95 % asked for" in told


def test_the_papers_landmarks_stand_where_their_sd_per_axis_is(tmp_path: Path) -> None:
    """2.9 mm is the resultant of three axes: 1.67 mm on each, and not 2.9 on an axis per axis."""
    folder = tables(tmp_path, ONE)
    study, cohort = study_and_cohort(str(tmp_path), STUDY)
    rebuilt = replace(cohort, name="palanca_l1l4")
    names = FIGURES["landmark_precision"]
    read = {name: pd.read_parquet(folder / f"{name}.parquet") for name in names}
    figure = landmark_precision_figure(study, rebuilt, read)
    lines = [line for axis in figure.axes for line in axis.lines]
    ends = [list(map(float, line.get_xdata())) for line in lines]
    upright = [first for first, *others in ends if others and set(others) == {first}]
    assert upright == pytest.approx([1.674] * 4, abs=1e-3)
    told = " ".join(text.get_text() for axis in figure.axes for text in axis.texts)
    assert "1.67 mm per axis\n(2.9 mm resultant)" in told


def test_precision_of_the_one_kind_of_motion_that_was_measured(tmp_path: Path) -> None:
    folder = tables(tmp_path, ONE)
    for name in FIGURES["landmark_precision"]:
        rows = pd.read_parquet(folder / f"{name}.parquet").query("motion == 'rotation'")
        write_table(folder, name, rows.to_dict("records"))
    told = words(drawn(tmp_path, "landmark_precision"))
    assert "Largest rotation error" in told
    assert "translation" not in told


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
