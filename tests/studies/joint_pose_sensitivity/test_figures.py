"""Figures: there for every kind of result, the same bytes twice, and honest about nothing.

Would catch figures that fail at some size of cohort, hang on the computer, or write other numbers
into panels than the tables have.
"""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from PIL import Image
from study_cases import STUDY, Size, drawn, project, results
from sweeps import sweep

from spinepipe.report.glyphs import quartiles
from spinepipe.report.panels import MOST_ROWS, rows_of
from spinepipe.report.style import DPI, WIDTH_MM, save, saying, style
from spinepipe.report.words import fixed, number, percent, tick
from spinepipe.studies.joint_pose_sensitivity.figures.stiffness import stiffness_figure
from spinepipe.studies.joint_pose_sensitivity.inputs import study_and_cohort
from spinepipe.units import COORDINATES

FIRST = ("stiffness", "errors", "joint_pose")
"""Figures of the study's first part; the others: test_identification_figures."""

SIZES = {
    "one joint": Size(("a",), 1, 12, ("extension",)),
    "few poses": Size(("a",), 2, 3),
    "joint by joint": Size(("a", "b"), 3, 12, grouping="per_joint"),
    "twenty joints": Size(("a", "b", "c"), 20, 4, COORDINATES, "per_joint"),
}


def draw(root: Path, size: Size, names: tuple[str, ...] = FIRST) -> Path:
    """Figures of made-up results; returns their folder."""
    folder = results(project(root, size), size)
    for name in names:
        drawn(root, name)
    return folder / "figures"


@pytest.fixture(scope="module")
def two(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Figures of two specimens, to be looked at."""
    return draw(tmp_path_factory.mktemp("two"), Size())


@pytest.fixture(scope="module")
def unsolved(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Figures of results without a solved row, to be looked at."""
    return draw(tmp_path_factory.mktemp("unsolved"), Size(solved=False))


def is_drawn(folder: Path) -> None:
    files = {path.name for path in folder.iterdir()}
    assert files == {f"{name}.{kind}" for name in FIRST for kind in ("svg", "png")}
    for name in FIRST:
        with Image.open(folder / f"{name}.png") as picture:
            assert picture.width == int(WIDTH_MM / 25.4 * DPI)
            assert np.asarray(picture.convert("L")).min() < 128, "nothing is drawn"


def test_figures_of_two_specimens_and_of_none_solved(two: Path, unsolved: Path) -> None:
    is_drawn(two)
    is_drawn(unsolved)


@pytest.mark.full
@sweep("size", SIZES.values())
def test_figures_of_any_cohort(tmp_path: Path, size: Size) -> None:
    is_drawn(draw(tmp_path, size))


def test_same_bytes_twice(two: Path, tmp_path: Path) -> None:
    again = draw(tmp_path, Size(), ("stiffness",))
    for path in again.iterdir():
        assert path.read_bytes() == (two / path.name).read_bytes(), path.name


def test_no_date_and_no_font_from_the_computer(two: Path) -> None:
    text = (two / "errors.svg").read_text()
    assert "<dc:date>" not in text
    assert "<text" not in text, "letters are outlines"


def test_what_cannot_be_shown_is_said(unsolved: Path) -> None:
    assert "No stiffness was found for any of 24 joint poses." in comments(
        unsolved / "stiffness.svg"
    )
    assert "none of 72 simulations" in comments(unsolved / "errors.svg")


def comments(svg: Path) -> str:
    """Words of an SVG; matplotlib notes them beside the outlines."""
    text = svg.read_text()
    return " ".join(part.split("-->")[0] for part in text.split("<!--")[1:])


def test_shares_and_medians_are_written_in_the_panels(tmp_path: Path) -> None:
    size = Size(("a",), 2, 40)
    words = comments(draw(tmp_path, size, ("stiffness",)) / "stiffness.svg")
    frame = pd.read_parquet(tmp_path / "results" / STUDY / "calibrations.parquet")
    lost = int((frame["extension_identifiable"] == False).sum())  # noqa: E712
    at_bound = int((frame["extension_nm_per_rad"] > 36_999).sum())
    assert at_bound > 0
    told = f"at a bound {percent(at_bound, 40)}, not identifiable {percent(lost, 40)}, n = 40"
    assert told in words
    assert f"median {number(frame['extension_nm_per_rad'].median())} (IQR" in words


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
    words = comments(draw(tmp_path, size, ("errors",)) / "errors.svg")
    frame = pd.read_parquet(tmp_path / "results" / STUDY / "simulations.parquet")
    best = frame[frame["stiffness"] == "best01"]
    failed = int((best.groupby("pose")["status"].first() != "converged").sum())
    assert 0 < failed < 12
    assert percent(failed, 12) in words


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


def test_a_picture_is_written_whole_or_not_at_all(tmp_path: Path) -> None:
    with style():
        figure = saying("nothing")
        with pytest.raises(ValueError, match=r"picture\.bmp: a picture is"):
            save(figure, tmp_path / "picture.bmp")
        (tmp_path / "picture.png").mkdir()
        with pytest.raises(OSError, match=r"picture\.png"):
            save(figure, tmp_path / "picture.png")
    assert [path.name for path in tmp_path.iterdir()] == ["picture.png"]
