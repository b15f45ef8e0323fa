"""Where films stop being believed: each limit from both sides, on films of a few vertebrae.

Would catch a limit that has moved, or is kept on one side only.
"""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scoliosis_cases import scaled
from sweeps import sweep

from spinepipe.plausibility.score import table
from spinepipe.plausibility.warnings.columns import beyond_ranges
from spinepipe.plausibility.warnings.warning import PACKAGE
from spinepipe.studies.scoliosis import checks, plausibility
from spinepipe.studies.scoliosis.films import CENTRE, CORNERS, Film, film_of_rows

LEVELS = ("L4", "L3", "L2", "L1")
PLACE = checks._FilmPlace("ais/films.csv", "p1", "erect")
COHORT: Any = SimpleNamespace(vertebrae=LEVELS, name="ais", further={})


def leaning(*tilts: float, line: float = 0.0, apart: float = 0.03) -> Film:
    """Centres on a line that leans to the right (deg), tilts of their own (deg)."""
    along = apart * np.arange(len(tilts))
    lean = np.deg2rad(line)
    return Film(along * np.sin(lean), along * np.cos(lean), np.deg2rad(tilts))


def rows() -> pd.DataFrame:
    return pd.DataFrame({"vertebra": LEVELS}, index=[11, 12, 13, 14])


@sweep("off, told", [(24.9, []), (25.1, [13]), (-25.1, [13]), (-24.9, [])])
def test_a_tilt_is_told_from_25_degrees_off_the_line(off: float, told: list[int]) -> None:
    film = leaning(10, 10, 10 + off, 10, line=10)
    found = list(checks._tilts(PLACE, rows(), LEVELS, film))
    assert [problem.row for problem in found] == told
    assert all("L2 tilted 25 deg" in problem.found for problem in found)


def test_the_line_of_centres_goes_from_the_neighbour_below_to_the_one_above() -> None:
    """At the ends from the vertebra itself: it leans 45, 26.6, -26.6 and -45 deg here."""
    film = Film(np.array([0, 1, 1, 0.0]), np.array([0, 1, 2, 3.0]), np.deg2rad([45, 26, -26, -45]))
    assert not list(checks._tilts(PLACE, rows(), LEVELS, film))
    for at, line in enumerate((45.0, 26.565051, -26.565051, -45.0)):
        for off, told in ((24.9, 0), (25.1, 1)):
            tilts = np.rad2deg(film.tilt)
            tilts[at] = line - np.sign(line) * off
            other = Film(film.right, film.up, np.deg2rad(tilts))
            assert len(list(checks._tilts(PLACE, rows(), LEVELS, other))) == told


@sweep("line, given, told", [(6.0, 0.59, True), (6.0, 0.61, False), (4.9, 0.1, False)])
def test_tilts_below_a_tenth_of_the_line_are_radians(line: float, given: float, told: bool) -> None:
    film = leaning(*[given] * 4, line=line)
    found = [problem.remedy for problem in checks._tilts(PLACE, rows(), LEVELS, film)]
    assert found == (["radians? multiply by 57.3"] if told else [])


def bends(**films: Film) -> list[str]:
    return [str(problem) for problem in checks._bends("ais/films.csv", "p1", films)]


ERECT = leaning(0, 0, 0, 0)


def bent(deg: float) -> Film:
    """A film whose top tilts to the right (deg)."""
    return leaning(0, deg, deg, deg, line=deg)


@sweep(
    "right, left, words",
    [
        (2.1, -2.1, []),
        (1.9, -2.1, ["right_bending: the top tilts by 1.9 deg only"]),
        (2.1, -1.9, ["left_bending: the top tilts by 1.9 deg only"]),
        (-1.9, -2.1, ["right_bending: the top tilts by -1.9 deg only"]),
        (-2.1, -5.0, ["right_bending: the spine leans to the other side"]),
        (5.0, 2.1, ["left_bending: the spine leans to the other side"]),
        (-2.1, 2.1, ["both bending films lean to the other side"]),
    ],
)
def test_a_bend_tilts_the_top_by_more_than_two_degrees(
    right: float, left: float, words: list[str]
) -> None:
    found = bends(erect=ERECT, right_bending=bent(right), left_bending=bent(left))
    assert len(found) == len(words)
    assert all(word in told for word, told in zip(words, found, strict=True))


@sweep("share, told", [(0.971, 0), (0.969, 1), (1.2, 0)])
def test_traction_does_not_shorten_by_more_than_three_per_cent(share: float, told: int) -> None:
    found = bends(erect=ERECT, traction=scaled(ERECT, share))
    assert len(found) == told
    assert all("87 mm tall, 90 mm erect" in problem for problem in found)


@sweep("apart_mm, told", [(0.049, True), (0.051, False)])
def test_films_are_one_where_all_centres_agree_to_a_twentieth_mm(
    apart_mm: float, told: bool
) -> None:
    """One vertebra is elsewhere, in two directions: 3, 4, 5."""
    other = scaled(ERECT, 1.0)
    other.right[2] += 0.6e-3 * apart_mm
    other.up[2] -= 0.8e-3 * apart_mm
    found = bends(erect=bent(9), neutral=ERECT, traction=other)
    assert any("the same as film neutral" in one for one in found) is told


@sweep("stated, told", [(44.9, 0), (45.1, 1), (-5.1, 1), (-4.9, 0)])
def test_a_cobb_angle_is_told_from_25_degrees_off_the_film(stated: float, told: int) -> None:
    """The film's main curve has 20 deg."""
    film = leaning(0, 10, 20, 10)
    patients = pd.DataFrame({"specimen": ["p0", "p1"], "cobb_deg": [90.0, stated]}, index=[2, 3])
    cohort: Any = SimpleNamespace(name="ais", further={"patients": patients})
    found = list(checks._cobb(cohort, "p1", film))
    assert [problem.row for problem in found] == [3] * told


@sweep("read, told", [(1e-7, 0), (-1e-7, 0), (2e-6, 1), (-2e-6, 1)])
def test_the_lowest_vertebra_is_at_nought(read: float, told: int) -> None:
    reading = pd.DataFrame(
        {"vertebra": LEVELS[::-1], "y_mm": [0.0, 0, 0, read], "z_mm": 0.0, "orientation_deg": 0.0}
    )
    found = list(checks._lowest(COHORT, PLACE, reading))
    assert [problem.row for problem in found] == [3] * told


CERTAIN = {row["warning"]: row["certain"] == "yes" for row in table(PACKAGE, "warnings")}


def fault(found: Any) -> tuple[str, bool] | None:
    """Column, and whether certain."""
    return None if found is None else (found.column, CERTAIN[found.warning])


def seen(up: float, across: float) -> Film:
    """A spine whose top is so far up and to a side."""
    return Film(np.array([0.1, 0.1 + across]), np.array([0.3, 0.3 + up]), np.zeros(2))


@sweep(
    "up, across, column",
    [
        *((0.30, 0.29, None), (0.29, 0.30, "y"), (0.29, -0.30, "y"), (-0.29, 0.30, "y")),
        *((-0.30, 0.29, "z"), (-0.30, 0.0, "z"), (0.30, -0.29, None)),
    ],
)
def test_spines_that_lie_or_stand_on_their_heads(up: float, across: float, column: str) -> None:
    for columns, name in ((CENTRE, f"{column}_mm"), (CORNERS, f"upper_left_{column}_mm")):
        found = fault(plausibility._direction([seen(up, across)], *columns[:2]))
        assert found == (None if column is None else (name, True))


def test_most_films_decide_which_way_a_spine_stands() -> None:
    films = [seen(0.3, 0.0), seen(-0.3, 0.0), seen(0.3, 0.0)]
    assert plausibility._direction(films, *CENTRE[:2]) is None
    assert fault(plausibility._direction([seen(-0.3, 0.0), *films[1:]], *CENTRE[:2])) == (
        "z_mm",
        True,
    )


@sweep(
    "size, told",
    [
        *((1.0, None), (1.79, None), (1 / 1.79, None), (1.81, False), (1 / 1.81, False)),
        *((0.1, True), (1e-3, True), (1 / 25.4, True), (10.0, True), (0.0, False)),
    ],
)
def test_vertebrae_are_as_far_apart_as_those_of_a_spine_to_a_factor(
    size: float, told: bool | None
) -> None:
    """From centre to centre half of both spacings of the levels; a unit makes it certain."""
    usual = np.array([plausibility.spacing_mm(name) for name in LEVELS]) / 1e3
    up = size * np.concatenate([[0.0], np.cumsum((usual[1:] + usual[:-1]) / 2.0)])
    films = [Film(0.6 * up, 0.8 * up, np.zeros(4))] * 2
    for columns, column in ((CENTRE[:2], "y_mm"), (CORNERS, "upper_left_y_mm")):
        found = fault(plausibility._size(films, [LEVELS] * 2, columns))
        assert found == (None if told is None else (column, told))


def test_names_that_are_no_levels_have_no_size() -> None:
    films = [leaning(0, 0, 0, 0, apart=5.0)]
    assert plausibility._size(films, [("a", "b", "c", "d")], CENTRE[:2]) is None


def curved(size: float, factor: float, mixed: float = 0.0) -> list[Film]:
    """Films along an arc whose line leans by so many deg, root mean square, between its ends; of
    tilts so many times those of the line, and a part that goes up where these go down."""
    line = np.array([0.0, size, size, -size, -size, 0.0])
    other = np.array([0.0, size, -size, size, -size, 0.0])
    half = np.tan(np.deg2rad(line))  # of the centres' differences over two levels
    right = np.zeros(6)
    right[2::2] = np.cumsum(2.0 * half[1:5:2])
    right[1] = 0.0
    right[3] = right[1] + 2.0 * half[2]
    right[5] = right[3] + 2.0 * half[4]
    return [Film(right, np.arange(6.0), np.deg2rad(factor * line + mixed * other))]


@sweep(
    "films, told",
    [
        (curved(10.0, 1.0), None),
        (curved(4.1, -1.0), "against"),
        (curved(3.9, -1.0), None),  # the line is too straight to tell a sign
        (curved(10.0, -0.72, 0.70), "against"),  # correlations of about -+0.717
        (curved(10.0, -0.69, 0.72), None),  # and of -0.692
        (curved(10.0, 1.0 / 57.3), "radians"),
        (curved(10.0, 2.9 / 57.2958), "radians"),
        (curved(10.0, 3.1 / 57.2958), None),
        (curved(10.0, 0.31 / 57.2958), "radians"),
        (curved(10.0, 0.29 / 57.2958), None),
        (curved(10.0, 0.72 / 57.3, 0.70 / 57.3), "radians"),
        (curved(10.0, 0.69 / 57.3, 0.72 / 57.3), None),
        (curved(10.0, 0.0), "alike"),
        (curved(3.9, 0.0), None),
    ],
)
def test_tilts_go_with_the_line_of_the_centres(films: list[Film], told: str | None) -> None:
    found = plausibility._tilts(films)
    if told is None:
        assert found is None
        return
    assert found is not None
    assert fault(found) == ("orientation_deg", False)
    assert told in f"{found.warning} {found.remedy}"


def boxes(turn: float, mirror: float = 1.0) -> pd.DataFrame:
    """Corners of three bodies 40 mm wide and 24 high, turned (deg); mirrored by -1."""
    c, s = np.cos(np.deg2rad(turn)), np.sin(np.deg2rad(turn))
    made = []
    for at in range(3):
        row = {}
        for end, up in (("upper", 12.0), ("lower", -12.0)):
            for side, left in (("left", 20.0 * mirror), ("right", -20.0 * mirror)):
                row[f"{end}_{side}_y_mm"] = c * left + s * up + 7.0
                row[f"{end}_{side}_z_mm"] = c * up - s * left + 30.0 * at
        made.append(row)
    return pd.DataFrame(made)[list(CORNERS)]


@sweep(
    "turn, mirror, column",
    [
        *((0, 1, None), (59, 1, None), (61, 1, "upper_left_y_mm"), (-61, 1, "upper_left_y_mm")),
        *((90, 1, "upper_left_y_mm"), (119, 1, "upper_left_y_mm"), (121, 1, "upper_left_z_mm")),
        *((180, 1, "upper_left_z_mm"), (0, -1, "upper_left_y_mm")),
        *((180, -1, "upper_left_z_mm"), (59, -1, "upper_left_y_mm")),
    ],
)
def test_corners_are_where_their_names_say(turn: float, mirror: float, column: str | None) -> None:
    """A body that leans by more than 60 deg lies on its side."""
    found = fault(plausibility._corners(boxes(turn, mirror)))
    assert found == (None if column is None else (column, True))


def test_mirrored_corners_are_told_apart_from_bodies_on_their_sides() -> None:
    told = plausibility._corners(boxes(0, -1)), plausibility._corners(boxes(61))
    assert [one and one.warning for one in told] == ["corners_left_right", "corners_aside"]


@sweep(
    "listed, told",
    [
        # names in the order in which the columns hold them, from the upper left corner on
        ("upper_left upper_right lower_right lower_left", "lower_left has the corner lower_right"),
        ("upper_left lower_left lower_right upper_right", "upper_right has the corner lower_left"),
        ("lower_right lower_left upper_left upper_right", "upper_left has the corner lower_right"),
    ],
)
@pytest.mark.filterwarnings("error")
def test_corners_listed_around_the_body_are_told_and_divide_by_nothing(
    listed: str, told: str
) -> None:
    sound = boxes(7)
    made = sound.copy()
    names = ("upper_left", "upper_right", "lower_left", "lower_right")
    for name, held in zip(names, listed.split(), strict=True):
        for axis in "yz":
            made[f"{name}_{axis}_mm"] = sound[f"{held}_{axis}_mm"]
    found = plausibility._corners(made)
    assert found is not None
    assert found.warning == "corners_around"
    assert told in str(found.remedy)
    film_of_rows(made.assign(vertebra=LEVELS[:3]), LEVELS[:3])


@sweep("largest, told", [(3.1, True), (3.2, False), (0.01, True), (0.0, False), (50.0, False)])
def test_cobb_angles_below_a_half_turn_in_radians_are_radians(largest: float, told: bool) -> None:
    patients = pd.DataFrame({"cobb_deg": [0.0, largest, np.nan]}, index=[5, 6, 7])
    cohort: Any = SimpleNamespace(
        name="ais", further={"patients": patients}, folder=Path("ais"), specimen_names=()
    )
    found = list(beyond_ranges(cohort, "subject_cobb"))
    assert [doubt.problem.row for doubt in found] == ([6] if told else [])
    assert all(not doubt.certain for doubt in found)
