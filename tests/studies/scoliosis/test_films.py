"""Films as they are read: axes, signs, corners, scales, scatter; and the angles of curves.

Would catch a sign, a unit or a corner taken for another, and readings averaged or scaled wrongly.
"""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from sweeps import sweep

from spinepipe import cohort as cohorts
from spinepipe.studies.scoliosis.curve_angles import lumbar_apex
from spinepipe.studies.scoliosis.films import CORNERS, FILMS, PATIENTS, Film, _sd, read_films

VERTEBRAE = ("L4", "L3", "L2", "L1")
HEADER = """\
cohort: filmed
title: One patient
source: made for a test
vertebrae: [L4, L3, L2, L1]
gravity: false
"""
POSITIONS = ("erect", "right_bending", "left_bending")


def centres(lean_deg: float) -> list[dict[str, object]]:
    """A straight spine that leans to the right, in the paper's axes: left positive."""
    lean = np.deg2rad(lean_deg)
    return [
        {
            "vertebra": name,
            "y_mm": -30.0 * at * np.sin(lean),
            "z_mm": 30.0 * at * np.cos(lean),
            "orientation_deg": -lean_deg if at else 0.0,
        }
        for at, name in enumerate(VERTEBRAE)
    ]


def cornered(lean_deg: float, size: float = 1.0, turn_deg: float = 0.0) -> list[dict[str, object]]:
    """The same as corners of bodies 40 mm wide and 24 mm high, the film turned and enlarged."""
    rows = []
    for at, name in enumerate(VERTEBRAE):
        tilt = np.deg2rad(lean_deg * (at > 0))
        lean = np.deg2rad(lean_deg)
        centre = 30.0 * at * np.array([np.sin(lean), np.cos(lean)])
        row: dict[str, object] = {"vertebra": name}
        for end, up in (("upper", 12.0), ("lower", -12.0)):
            for side, right in (("left", -20.0), ("right", 20.0)):
                c, s = np.cos(tilt), np.sin(tilt)
                point = centre + np.array([c * right + s * up, c * up - s * right])
                c, s = np.cos(np.deg2rad(turn_deg)), np.sin(np.deg2rad(turn_deg))
                x, y = size * np.array([c * point[0] + s * point[1], c * point[1] - s * point[0]])
                row[f"{end}_{side}_y_mm"], row[f"{end}_{side}_z_mm"] = 100.0 - x, 50.0 + y
        rows.append(row)
    return rows


def written(folder: Path, films: dict[str, list[dict[str, object]]]) -> cohorts.Cohort:
    """A cohort of one patient with these films."""
    folder = folder / "filmed"
    folder.mkdir()
    (folder / "cohort.yaml").write_text(HEADER, encoding="utf-8")
    (folder / "specimens.csv").write_text("specimen\np01\n", encoding="utf-8")
    rows = [
        {"specimen": "p01", "position": position, **row}
        for position, film in films.items()
        for row in film
    ]
    pd.DataFrame(rows).to_csv(folder / "films.csv", index=False)
    return cohorts.read(folder, (FILMS, PATIENTS))


def test_a_lean_to_the_right_is_positive(tmp_path: Path) -> None:
    films = dict(zip(POSITIONS, map(centres, (0.0, 10.0, -8.0)), strict=True))
    read = read_films(written(tmp_path, films), "p01")
    bent = read.films["right_bending"]
    np.testing.assert_allclose(bent.tilt, np.deg2rad([0.0, 10.0, 10.0, 10.0]), atol=1e-12)
    assert bent.right[-1] == pytest.approx(0.09 * np.sin(np.deg2rad(10.0)))
    np.testing.assert_allclose(np.rad2deg(read.turned("right_bending")), [10.0, 0.0, 0.0])
    np.testing.assert_allclose(np.rad2deg(read.turned("left_bending")), [-8.0, 0.0, 0.0])
    assert np.isnan(read.sd).all()


def test_corners_on_a_turned_and_enlarged_film_give_the_same(tmp_path: Path) -> None:
    films = {
        "erect": cornered(0.0),
        "right_bending": cornered(10.0, size=1.25, turn_deg=17.0),
        "left_bending": cornered(-8.0, size=0.8, turn_deg=-5.0),
    }
    read = read_films(written(tmp_path, films), "p01")
    assert read.scales["right_bending"] == pytest.approx(0.8)
    bent = read.films["right_bending"]
    np.testing.assert_allclose(bent.tilt, np.deg2rad([0.0, 10.0, 10.0, 10.0]), atol=1e-9)
    np.testing.assert_allclose(bent.up[-1], 0.09 * np.cos(np.deg2rad(10.0)), rtol=1e-9)
    np.testing.assert_allclose(bent.right[-1], 0.09 * np.sin(np.deg2rad(10.0)), rtol=1e-9)


def test_readings_are_averaged_and_their_scatter_is_the_noise(tmp_path: Path) -> None:
    """Errors of all vertebrae, the lowest among them, however much a reader turned the film."""
    rng = np.random.default_rng(4)
    films: dict[str, list[dict[str, object]]] = {}
    for position, lean in zip(POSITIONS, (0.0, 10.0, -8.0), strict=True):
        films[position] = []
        for observer in "ab":
            for repeat in range(1, 41):
                turned = float(rng.uniform(-3.0, 3.0))
                film = cornered(lean, turn_deg=turned)
                for row in film:
                    row |= {"observer": observer, "repeat": repeat}
                    for name in CORNERS:
                        row[name] = float(row[name]) + rng.normal(0.0, 0.25)  # type: ignore[arg-type]
                films[position] += film
    read = read_films(written(tmp_path, films), "p01")
    assert read.readings["erect"] == 80
    # the line between the centres of both endplates, 24 mm apart, each of two corners
    tilt = 0.25 / 24.0
    # where diagonals of 20 x 12 cross has the variance (20^2 + 12^2) / (2 x 12)^2 of a corner, here
    # and at the lowest, which turns the rest: 30, 60 and 90 mm above it
    centre = 0.25 * np.sqrt(2.0 * (20.0**2 + 12.0**2) / 24.0**2)
    aside = np.hypot(centre, tilt * 30.0 * np.sqrt((1 + 4 + 9) / 3.0)) / 1e3
    np.testing.assert_allclose(read.sd[[0, 2]], [aside, tilt], rtol=0.1)
    # of one vertebra's own centre, whatever the frame: the mean variance of right and up
    own = 0.25 * np.sqrt(0.5 * (20.0**2 + 12.0**2) * (1.0 / 24.0**2 + 1.0 / 40.0**2))
    assert read.own_sd == pytest.approx(own / 1e3, rel=0.1)
    assert np.rad2deg(read.films["right_bending"].tilt[-1]) == pytest.approx(10.0, abs=0.3)


@pytest.mark.parametrize("vertebrae", [2, 3, 15])
def test_a_tilt_s_own_sd_is_told_of_two_readings_of_few_vertebrae(vertebrae: int) -> None:
    """Mean of the variance over many films of two readings; K readings hold K - 1 errors."""
    rng = np.random.default_rng(vertebrae)
    tilts = rng.normal(0.0, 0.7, (4000, 2, 1, vertebrae))
    seen = np.repeat(tilts - tilts[..., :1], 3, axis=2)
    assert _sd(list(seen))[2] == pytest.approx(0.7, rel=0.03)
    every = [_sd([each])[2] ** 2 for each in seen]
    assert np.mean(every) == pytest.approx(0.49, rel=0.05)
    assert np.isnan(_sd([one[:1] for one in seen])).all()


def test_without_corners_the_chord_tells_of_scale(tmp_path: Path) -> None:
    films = dict(zip(POSITIONS, map(centres, (0.0, 10.0, -8.0)), strict=True))
    for row in films["right_bending"]:
        row["y_mm"], row["z_mm"] = 1.1 * float(row["y_mm"]), 1.1 * float(row["z_mm"])  # type: ignore[arg-type]
    read = read_films(written(tmp_path, films), "p01")
    assert read.scales["right_bending"] == 1.0
    assert read.chord("right_bending") == pytest.approx(1.1)


LEVELS = ("L4", "L3", "L2", "L1", *(f"T{number}" for number in range(12, 1, -1)))


@sweep(
    "bulges, apex",
    [
        (("L3", "T12", "T7"), "L3"),  # the lowest of two low ones
        (("L3", "T7"), "L3"),
        (("T11", "T5"), "T11"),
        (("T8", "T4"), "T8"),  # none is low: the lowest
    ],
)
def test_the_lumbar_apex_is_that_of_the_lowest_curve(bulges: tuple[str, ...], apex: str) -> None:
    """A zigzag of lines, one vertebra tilted to neither side where it turns."""
    corners, sides = [LEVELS.index(name) for name in bulges], 12.0 * np.array([1.0, -1.0] * 2)
    tilt = np.zeros(len(LEVELS))
    for number, start in enumerate([0, *(at + 1 for at in corners)]):
        tilt[start:] = sides[number]
    tilt[corners] = 0.0
    right = np.concatenate([[0.0], np.cumsum(np.sin(np.deg2rad(tilt)))[:-1]])
    film = Film(0.03 * right, 0.03 * np.arange(len(LEVELS)), np.deg2rad(tilt))
    found = lumbar_apex(film, LEVELS)
    assert found - LEVELS.index(apex) in (0, 1)  # between both the line is upright
