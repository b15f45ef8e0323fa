"""Films and angles of a few vertebrae, worked by hand; how models miss them, and reading noise.

Would catch a wrong end or apex of a curve, a centre or height of a vertebra read wrongly, and
scatter of readings pooled by the wrong numbers.
"""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scoliosis_cases import mirrored
from sweeps import sweep

from spinepipe import cohort as cohorts
from spinepipe.status import PrescribedStatus
from spinepipe.studies.scoliosis import films as film_module
from spinepipe.studies.scoliosis.curve_angles import (
    SpinalCurve,
    curves,
    lumbar_apex,
    main_curve,
    region,
)
from spinepipe.studies.scoliosis.films import (
    CORNERS,
    FILMS,
    PATIENTS,
    Film,
    PatientFilms,
    film_of_rows,
    height,
    read_films,
    reading_noise,
)
from spinepipe.studies.scoliosis.personal import Patient
from spinepipe.studies.scoliosis.settings import Scoliosis

STUDY = {"study": "s", "kind": "scoliosis", "cohort": "ais"}


def film(*rows: tuple[float, float, float]) -> Film:
    """Right, up and tilt (deg) of each vertebra."""
    right, up, tilt = np.array(rows).T
    return Film(right, up, np.deg2rad(tilt))


ROOF = film((0, 0, 40), (1, 1, 10), (1.5, 2, -5), (0, 2, -30))


def test_ferguson_s_angle_is_that_of_the_lines_to_the_apex() -> None:
    """From (0, 0) to (1, 1) the line leans 45 deg to the right, from there to (0, 2) 45 back."""
    curve = SpinalCurve(lower=0, upper=3, apex=1, side=1)
    assert np.rad2deg(curve.ferguson(ROOF)) == pytest.approx(90.0)
    assert np.rad2deg(curve.cobb(ROOF)) == pytest.approx(70.0)
    left = SpinalCurve(0, 3, 1, -1)
    assert left.ferguson(ROOF) == -curve.ferguson(ROOF)
    assert left.cobb(ROOF) == -curve.cobb(ROOF)


def test_the_apex_is_farthest_from_the_line_between_the_ends() -> None:
    """Of the line from (0, 0) to (0, 2): 1 and 1.5 away, whichever is higher."""
    assert curves(ROOF) == (SpinalCurve(0, 3, 2, 1),)
    lower_bulge = film((0, 0, 40), (1.5, 1, 10), (1.0, 2, -5), (0, 2, -30))
    assert curves(lower_bulge) == (SpinalCurve(0, 3, 1, 1),)
    slanting = film((0, 0, 40), (0.2, 3, 10), (3, 3.5, -5), (4, 4, -30))  # the line at 45 deg
    assert curves(slanting) == (SpinalCurve(0, 3, 1, 1),)


def tilted(*tilts: float) -> Film:
    """A spine of these tilts, deg."""
    tilt = np.deg2rad(tilts)
    right = np.concatenate([[0.0], np.cumsum(np.sin((tilt[1:] + tilt[:-1]) / 2.0))])
    up = np.concatenate([[0.0], np.cumsum(np.cos((tilt[1:] + tilt[:-1]) / 2.0))])
    return Film(right, up, tilt)


@sweep(
    "tilts, ends",
    [
        ((0, 6, 12, 6, 0), [(0, 2), (2, 4)]),
        ((0, 6, 12, 8, 13), [(0, 4)]),  # a wave of 4 deg is none
        ((0, 6, 12, 6, 13), [(0, 2)]),  # of 6 deg it is one, if ends apart by one are no curve
        ((0, 4, 0, -1, 0, 0), [(0, 5)]),  # all of it a wave: one curve from end to end
        ((0, 4, 0, -4, 0, 0), [(1, 3)]),
        ((0, -4.5, -4.5, 0, 8, 16, 22, 18, 12, 8, 4, 2, 0), [(1, 6), (6, 12)]),
        ((0, 2, 4, 6, 8, 12, 18, 22, 16, 8, 0, -4.5, -4.5), [(0, 7), (7, 12)]),
        ((0, 5, 10, 5, 0), [(0, 2), (2, 4)]),
        ((0, 5, 0), [(0, 2)]),  # 5 deg is a wave
        ((0, 5.1, 0), []),  # ends apart by one
        ((0, 6, 0, 6), []),
        ((0, 0, 10), [(0, 2)]),
        ((0, 4, 6, 10, 3), [(0, 3)]),
        ((0, -6, -12, -5, 2), [(0, 2), (2, 4)]),
        ((0, 8, 8, 8, 0), [(0, 3), (1, 4)]),  # as far tilted: the outermost of each curve
        ((0, 8, 8, -10), [(0, 2), (1, 3)]),
        ((0, 8, 6, 8, 0), [(0, 3), (1, 4)]),
        ((10, 0, 0), [(0, 2)]),
        ((0, 10, 0, -10, -20), [(1, 4)]),
    ],
)
def test_ends_lie_where_the_tilt_turns_back_by_more_than_five_degrees(
    tilts: tuple[float, ...], ends: list[tuple[int, int]]
) -> None:
    assert [(one.lower, one.upper) for one in curves(tilted(*tilts))] == ends


STEPS = st.one_of(st.integers(-30, 30), st.integers(-300, 300).map(lambda tenths: tenths / 10))


@given(st.lists(STEPS, min_size=2, max_size=18))
@example([0, -4.5, -4.5, 0, 8, 16, 22, 18, 12, 8, 4, 2, 0])
def test_upside_down_and_mirrored_a_film_has_the_same_curves(tilts: list[float]) -> None:
    """And no two vertebrae of a curve have a larger angle, if the spine has one at all."""
    erect, last = tilted(*tilts), len(tilts) - 1
    rolled, flipped = tilted(*tilts[::-1]), mirrored(erect)
    found = [(one.lower, one.upper, one.cobb(erect)) for one in curves(erect)]
    assert found == [(one.lower, one.upper, one.cobb(flipped)) for one in curves(flipped)]
    for one, other in zip(curves(erect), curves(flipped), strict=True):
        assert one.apex == other.apex
        if one.cobb(erect) != 0.0:  # ends that are equally tilted have no side
            assert one.side == -other.side
            assert one.ferguson(erect) == pytest.approx(other.ferguson(flipped), abs=1e-12)
    turned = [(last - one.upper, last - one.lower, one.cobb(rolled)) for one in curves(rolled)]
    assert found == turned[::-1]
    for low, high, cobb in found:
        within = erect.tilt[low : high + 1]
        if np.ptp(erect.tilt) > np.deg2rad(5.001):
            assert cobb == np.ptp(within) > np.deg2rad(5.0)


def test_the_main_curve_is_that_of_the_largest_angle() -> None:
    film = tilted(0, 10, 20, 5, -10)
    lower, upper = curves(film)
    assert (main_curve(film), main_curve(tilted(0, 15, 30, 20, 5))) == (upper, lower)
    assert (lower.side, upper.side) == (-1, 1)
    assert np.rad2deg([lower.cobb(film), upper.cobb(film)]) == pytest.approx([20.0, 30.0])


def test_a_spine_of_two_vertebrae_has_no_curve() -> None:
    assert curves(tilted(0, 20)) == ()
    assert lumbar_apex(tilted(0, 20), ("L5", "L4")) == 0


def test_a_curve_at_the_sacrum_or_high_up_is_no_lumbar_one() -> None:
    """The upper curve has its apex at L1, the lower one at T10 by its names here."""
    zigzag = tilted(0, 10, 20, 10, 0)
    assert [one.apex for one in curves(zigzag)] == [1, 3]
    assert lumbar_apex(zigzag, ("S1", "T10", "x", "L1", "T12")) == 3
    assert lumbar_apex(zigzag, ("S1", "T12", "x", "L1", "T12")) == 1
    assert lumbar_apex(zigzag, ("S1", "T10", "x", "T9", "T8")) == 1


@sweep(
    "apex, named",
    [
        *(("C7", "PT"), ("T1", "PT"), ("T3", "PT"), ("T5", "PT")),
        *(("T6", "MT"), ("T9", "MT"), ("T10", "MT"), ("T11", "MT")),
        *(("T12", "TL/L"), ("L1", "TL/L"), ("L2", "TL/L"), ("S1", "TL/L")),
    ],
)
def test_a_curve_is_named_by_its_apex(apex: str, named: str) -> None:
    assert region(apex) == named


def test_what_is_read_off_a_film() -> None:
    np.testing.assert_allclose(np.rad2deg(ROOF.turned), [-30, -15, -25])
    np.testing.assert_allclose(ROOF.top, [0.0, 2.0, np.deg2rad(-30)])
    np.testing.assert_allclose(ROOF.rows, [ROOF.right, ROOF.up, ROOF.tilt])
    joints = [[0.25, 0.25], [1.125, 1.25], [1.125, 2.0]]  # on the way to the vertebra above
    np.testing.assert_allclose(ROOF.joints(0.25), joints, atol=1e-15)


def test_from_its_lowest_vertebra_a_film_is_turned_back_by_its_tilt() -> None:
    """The lowest leans 90 deg to the right: what is right of it is below, what is up is left."""
    seen = film((1, 2, 90), (4, 2, 60), (1, 4, 0)).seen_from_below()
    np.testing.assert_allclose(seen.right, [0, 0, -2], atol=1e-15)
    np.testing.assert_allclose(seen.up, [0, 3, 0], atol=1e-15)
    np.testing.assert_allclose(np.rad2deg(seen.tilt), [0, -30, -90])


def cornered(**corners: tuple[float, float]) -> pd.DataFrame:
    """A film of one vertebra, y to the left and z up, mm."""
    cells = {
        f"{name}_{axis}_mm": at
        for name, place in corners.items()
        for axis, at in zip("yz", place, strict=True)
    }
    return pd.DataFrame([{"vertebra": "L4", **dict.fromkeys(CORNERS), **cells}])


def test_the_centre_of_a_wedge_is_where_its_diagonals_cross() -> None:
    """20 mm above a base of 60 mm lies a top of 20 mm: the diagonals cross at 3 / 4 of it."""
    rows = cornered(
        lower_left=(30, 0), lower_right=(-30, 0), upper_left=(10, 20), upper_right=(-10, 20)
    )
    found = film_of_rows(rows, ("L4",))
    np.testing.assert_allclose([found.right[0], found.up[0]], [0.0, 0.015], atol=1e-15)
    assert found.tilt[0] == 0.0
    assert height(rows) == pytest.approx(0.020)


def test_a_vertebra_leans_with_the_line_through_its_endplates() -> None:
    """Upper endplate 15 mm to the right of the lower one and 20 above: atan(3 / 4), 25 mm high."""
    rows = cornered(
        lower_left=(30, 0), lower_right=(-10, 0), upper_left=(15, 20), upper_right=(-25, 20)
    )
    found = film_of_rows(rows, ("L4",))
    assert np.tan(found.tilt[0]) == pytest.approx(0.75)
    assert found.right[0] == pytest.approx(-0.0025)
    assert height(rows) == pytest.approx(0.025)


def test_one_corner_short_the_centre_is_taken() -> None:
    rows = cornered(lower_left=(30, 0), lower_right=(-30, 0), upper_left=(10, 20))
    rows = rows.assign(y_mm=-3.0, z_mm=7.0, orientation_deg=-8.0)
    found = film_of_rows(rows, ("L4",))
    np.testing.assert_allclose(found.rows[:, 0], [0.003, 0.007, np.deg2rad(8.0)])
    assert height(rows) is None


HEADER = "cohort: c\ntitle: t\nsource: made\nvertebrae: [L4, L3, L2]\ngravity: false\n"


def test_scatter_of_readings_is_pooled_by_how_many_there_are(tmp_path: Path) -> None:
    """Tilts of L3 and L2 read 1 deg apart twice on one film, and 3 deg apart two by two on one:
    variances 1/2 and 3, freedoms 1 and 3."""
    tilts = {"erect": [0.0, 1.0], "right_bending": [3.0, 6.0, 3.0, 6.0], "left_bending": [-4.0]}
    rows = [
        {
            "specimen": "p1",
            "position": position,
            "vertebra": name,
            "observer": "a",
            "repeat": 1 + repeat,
            "y_mm": 0.0,
            "z_mm": 30.0 * at,
            "orientation_deg": tilt if at else 0.0,
        }
        for position, each in tilts.items()
        for repeat, tilt in enumerate(each)
        for at, name in enumerate(("L4", "L3", "L2"))
    ]
    folder = tmp_path / "c"
    folder.mkdir()
    (folder / "cohort.yaml").write_text(HEADER, encoding="utf-8")
    (folder / "specimens.csv").write_text("specimen\np1\n", encoding="utf-8")
    pd.DataFrame(rows).to_csv(folder / "films.csv", index=False)
    read = read_films(cohorts.read(folder, (FILMS, PATIENTS)), "p1")
    assert read.readings == {"erect": 2, "right_bending": 4, "left_bending": 1}
    # off by (0, d, d) for the lowest is at nought: a third of d^2 about the mean, by V - 1
    expected = np.sqrt((1 * 0.5 + 3 * 3.0) / 4 / 3)
    np.testing.assert_allclose(np.rad2deg(read.sd[2]), expected)
    np.testing.assert_allclose(read.sd[:2], 0.0, atol=1e-15)
    np.testing.assert_allclose(np.rad2deg(read.films["right_bending"].tilt), [0.0, -4.5, -4.5])


def posed(status: PrescribedStatus, shown: Film, r: list[float]) -> Any:
    return SimpleNamespace(result=SimpleNamespace(status=status), film=shown, r=np.deg2rad(r))


@sweep(
    "status", [PrescribedStatus.CONVERGED, PrescribedStatus.UNREACHABLE, PrescribedStatus.UNSTABLE]
)
def test_a_pose_misses_a_film_by_root_mean_squares_above_the_lowest(
    status: PrescribedStatus,
) -> None:
    """Two vertebrae above the lowest: places off by 5 mm and nothing, tilts by 3 and 4 deg; both
    segments turn by 1 and 7 deg less than on the film."""
    read = film((0, 0, 0), (0.1, 1, 2), (0.2, 2, 4))
    erect = film((0, 0, 0), (0, 1, 0), (0, 2, 0))
    shown = film((9, 9, 9), (0.103, 1.004, 5), (0.2, 2, 0))
    nothing: dict[str, Any] = {}
    films = {"erect": erect, "neutral": read}
    patient: Any = SimpleNamespace(read=PatientFilms(films, nothing, np.full(3, np.nan), nothing))
    found = Patient.errors(patient, "neutral", posed(status, shown, [1.0, -5.0]))
    if status is PrescribedStatus.UNSTABLE:
        assert set(found.values()) == {None}
        return
    assert found["place_rmse_mm"] == pytest.approx(5.0 / np.sqrt(2.0))
    assert found["tilt_rmse_deg"] == pytest.approx(np.sqrt(12.5))
    assert found["rotation_rmse_deg"] == pytest.approx(5.0)


ONE = ((1,), (1, 1))
"""Readings of the films of two patients."""


@sweep(
    "sds, readings, stated, expected",
    [
        (
            [(3e-3, 4e-3, 0.02), (3e-3, 4e-3, 0.04)],
            ((4, 4), (4,)),
            {},
            (np.sqrt(12.5) / 2.0, np.rad2deg(np.sqrt(1e-3)) / 2.0),
        ),
        # a film read once is read no better for the repeats of others: (1 + 1/2) / 2
        (
            [(np.nan,) * 3, (3e-3, 4e-3, 0.02)],
            ((1,), (2,)),
            {"tilt_sd_deg": 9.0},
            (np.sqrt(12.5 * 0.75), np.rad2deg(0.02) * np.sqrt(0.75)),
        ),
        ([(np.nan,) * 3] * 2, ONE, {"place_sd_mm": 0.4, "tilt_sd_deg": 0.9}, (0.4, 0.9)),
        ([(np.nan,) * 3] * 2, ONE, {"tilt_sd_deg": 0.9}, (np.nan, 0.9)),
    ],
)
def test_readings_tell_how_films_are_read_and_else_the_study(
    sds: list[tuple[float, ...]],
    readings: tuple[tuple[int, ...], ...],
    stated: dict[str, float],
    expected: tuple[float, float],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Repetitions before what is stated; places each way, as up and right are read alike."""
    told = {
        f"p{number}": SimpleNamespace(
            sd=np.array(sd), own_sd=0.5 * sd[0], readings=dict(enumerate(counts))
        )
        for number, (sd, counts) in enumerate(zip(sds, readings, strict=True))
    }
    monkeypatch.setattr(film_module, "read_films", lambda _, name: told[name])
    study = Scoliosis.model_validate(STUDY | stated)
    cohort: Any = SimpleNamespace(specimen_names=tuple(told))
    np.testing.assert_allclose(reading_noise(study, cohort)[:2], expected)
