"""Joints and stretched muscles: measured points, slopes, and what they are stiffened by."""

from dataclasses import replace

import numpy as np
import pytest

from spinepipe.muscles.passive_tissue import (
    AXIAL_N_PER_M,
    CURVES,
    T11T12_WITH_RIBS,
    JointLaws,
    Ligaments,
    MomentCurve,
    PassiveMuscle,
)

ALL = [(name, axis) for name in CURVES for axis in range(3)]
STEP = 1e-6


@pytest.mark.parametrize(("name", "axis"), ALL)
def test_curves_rise_through_nought_without_a_jump(name: str, axis: int) -> None:
    curve = CURVES[name][axis]
    angles = np.deg2rad(np.linspace(-30.0, 30.0, 6001))
    moments = curve.moment(angles)
    assert np.all(np.diff(moments) > 0.0)
    assert curve.moment(np.zeros(1))[0] == pytest.approx(0.0, abs=1e-12)
    slopes = (curve.moment(angles + STEP) - curve.moment(angles - STEP)) / (2.0 * STEP)
    corners = np.deg2rad(np.array(curve.degrees)[[0, -1]])
    smooth = np.abs(angles[:, None] - corners).min(axis=1) > 1e-4
    assert curve.slope(angles)[smooth] == pytest.approx(slopes[smooth], rel=1e-4)


HEUER_NM, JARAMILLO_NM = (1.0, 2.5, 5.0, 7.5), (2.0, 4.0, 6.0, 8.0)
MEASURED = {
    "disc_heuer": (
        ((2.27, 3.6, 5.08, 6.43), HEUER_NM, (2.27, 3.6, 5.08, 6.43), HEUER_NM),
        ((1.32, 2.7, 4.36, 5.73), HEUER_NM, (1.32, 2.7, 4.36, 5.73), HEUER_NM),
        ((4.95, 6.64, 8.38, 10.11), HEUER_NM, (1.23, 5.15, 7.92, 10.28), HEUER_NM),
    ),
    "disc_jaramillo": (
        ((4.39, 5.77, 6.58, 7.1), JARAMILLO_NM, (4.39, 5.77, 6.58, 7.1), JARAMILLO_NM),
        ((3.21, 4.51, 5.43, 5.79), JARAMILLO_NM, (3.21, 4.51, 5.43, 5.79), JARAMILLO_NM),
        ((7.32, 9.26, 10.76, 11.87), JARAMILLO_NM, (5.47, 6.77, 7.65, 8.27), JARAMILLO_NM),
    ),
    "disc_han": (
        *(
            (deg, nm, deg, nm)
            for deg, nm in (
                ((2.0, 4.0, 6.0, 8.0, 10.0), (1.43, 2.93, 4.51, 6.15, 7.86)),
                ((1.0, 2.0, 3.0, 4.0), (1.03, 2.09, 3.22, 4.47)),
                ((2.0, 4.0, 6.0, 8.0, 10.0), (0.90, 1.79, 2.76, 3.90, 5.32)),
            )
        ),
    ),
    # 2.3 and 8.4 N m/deg; 1.8 in flexion and 2.6 in extension
    "segment": (
        ((4.0, 10.0), (9.2, 23.0), (4.0, 10.0), (9.2, 23.0)),
        ((4.0, 10.0), (33.6, 84.0), (4.0, 10.0), (33.6, 84.0)),
        ((0.5, 5.0, 10.0), (0.9, 9.0, 18.0), (0.5, 5.0, 10.0), (1.3, 13.0, 26.0)),
    ),
}
"""Entered again: about x, y, z the degrees and N m to the negative side, and to the positive."""


@pytest.mark.parametrize("name", MEASURED)
def test_curves_run_through_all_that_was_measured(name: str) -> None:
    for curve, (back, back_nm, fore, fore_nm) in zip(CURVES[name], MEASURED[name], strict=True):
        at = np.deg2rad([*(-deg for deg in back), *fore])
        np.testing.assert_allclose(curve.moment(at), [*(-m for m in back_nm), *fore_nm], rtol=1e-12)
        ends = np.deg2rad([-2.0 * back[-1], 2.0 * fore[-1]])
        # straight on, as steep as from the last but one measured point to the last
        (b1, b0), (f1, f0) = [0.0, *back][:-3:-1], [0.0, *fore][:-3:-1]
        (bm1, bm0), (fm1, fm0) = [0.0, *back_nm][:-3:-1], [0.0, *fore_nm][:-3:-1]
        beyond = [
            -bm1 - (bm1 - bm0) / (b1 - b0) * back[-1],
            fm1 + (fm1 - fm0) / (f1 - f0) * fore[-1],
        ]
        np.testing.assert_allclose(curve.moment(ends), beyond, rtol=1e-12)


def test_mixed_joints_are_a_disc_sideways_and_whole_segments_else() -> None:
    assert CURVES["mixed"] == (CURVES["disc_heuer"][0], *CURVES["segment"][1:])
    angle = np.deg2rad([3.0])
    for curve, stiffness in zip(CURVES["segment_gould"], (68.8, 291.0, 51.0), strict=True):
        assert curve.moment(angle)[0] == pytest.approx(stiffness * angle[0])


def test_axial_stiffness_is_that_of_kitazaki_and_griffin() -> None:
    """Entered again from Table 4, MN/m."""
    printed = {
        "L5S1": 1.47,
        "L4L5": 1.87,
        "L3L4": 2.0,
        "L2L3": 2.0,
        "L1L2": 2.13,
        "T12L1": 1.8,
        "T11T12": 1.5,
    }
    assert {name: value / 1e6 for name, value in AXIAL_N_PER_M.items()} == pytest.approx(printed)


def test_a_curve_that_falls_is_refused() -> None:
    with pytest.raises(ValueError, match="must rise"):
        MomentCurve((-1.0, 0.0, 1.0), (-1.0, 0.0, -0.5))


def laws(stiffens: bool = True) -> JointLaws:
    """Seven joints alike."""
    return JointLaws(
        CURVES["segment"],
        np.ones((7, 3)),
        np.full(7, 2e6),
        np.tile([1e5, 2e5], (7, 1)),
        stiffens,
    )


def test_compression_stiffens_as_measured_and_no_more_beyond() -> None:
    """Gardner-Morse 2004: 1.71 at 250 N, 2.11 at 500 N."""
    pressed = np.array([-100.0, 0.0, 125.0, 250.0, 375.0, 500.0, 3000.0])
    expected = [1.0, 1.0, 1.355, 1.71, 1.91, 2.11, 2.11]
    assert laws().stiffening(pressed) == pytest.approx(expected)
    assert laws(stiffens=False).stiffening(pressed) == pytest.approx(np.ones(7))


def test_joints_resist_and_yield() -> None:
    turned = np.zeros((7, 3))
    turned[:, 2] = np.deg2rad(-5.0)
    moment = laws(stiffens=False).moments(turned, np.zeros(7))
    assert moment[:, 2] == pytest.approx(np.full(7, 9.0))
    pushes = np.tile([10.0, -400.0, 20.0], (7, 1))
    assert laws().translations(pushes)[0] == pytest.approx([1e-4, -2e-4, 1e-4])


FULL = np.deg2rad(np.array([12.0, 12.9, 10.8, 8.5, 9.0, 7.0, 4.0]))
BEHIND = Ligaments(np.linspace(100.0, 40.0, 7), FULL)


def test_ligaments_are_slack_upright_and_extended_and_reach_their_moment_in_full_flexion() -> None:
    """And are little before: at half of it (e^2 - 1) / (e^4 - 1), an eighth."""
    for share, expected in ((-0.5, 0.0), (0.0, 0.0), (0.5, 1.0 / (np.e**2 + 1.0)), (1.0, 1.0)):
        assert BEHIND.moments(share * FULL) == pytest.approx(expected * BEHIND.at_full)


def test_ligaments_go_straight_on_beyond_full_flexion() -> None:
    steepest = BEHIND.at_full * 4.0 / FULL / (1.0 - np.exp(-4.0))
    for share in (1.0, 1.1, 3.0):
        assert BEHIND.slopes(share * FULL) == pytest.approx(steepest)
        beyond = BEHIND.at_full + (share - 1.0) * FULL * steepest
        assert BEHIND.moments(share * FULL) == pytest.approx(beyond)


@pytest.mark.parametrize("share", [-0.2, 0.3, 0.9, 1.2])
def test_slopes_of_ligaments(share: float) -> None:
    there, back = (BEHIND.moments(share * FULL + s) for s in (STEP, -STEP))
    assert BEHIND.slopes(share * FULL) == pytest.approx((there - back) / (2.0 * STEP), rel=1e-6)


def test_ligaments_count_from_upright_and_are_not_stiffened_by_compression() -> None:
    """They pull backwards where a joint is flexed; extended further than upright they do not."""
    upright = np.deg2rad(np.linspace(-3.0, 3.0, 7))
    behind = replace(laws(), ligaments=BEHIND, upright=upright)
    turned = np.zeros((7, 3))
    turned[:, 2] = upright - FULL
    assert behind.ligament_moments(turned) == pytest.approx(BEHIND.at_full)
    extended = np.zeros((7, 3))
    extended[:, 2] = upright + 0.1
    assert behind.ligament_moments(extended) == pytest.approx(np.zeros(7))
    assert laws().ligament_moments(turned) == pytest.approx(np.zeros(7))
    pressed = np.full(7, 500.0)
    steeper = behind.slopes(turned, pressed) - laws().slopes(turned, pressed)
    assert steeper[:, 2] == pytest.approx(BEHIND.slopes(FULL))
    assert steeper[:, :2] == pytest.approx(np.zeros((7, 2)))


def test_t11t12_has_curves_of_its_own() -> None:
    """Wilke 2017: 7.5 N m at 3.5 deg of flexion and extension, 4.25 sideways, 3.75 in axial
    rotation, the middle of the printed ranges; the other joints keep theirs."""
    own = replace(laws(stiffens=False), t11t12=T11T12_WITH_RIBS)
    turned = np.tile(np.deg2rad([4.25, 3.75, 3.5]), (7, 1))
    assert own.moments(turned, np.zeros(7))[-1] == pytest.approx(np.full(3, -7.5))
    others = laws(stiffens=False).moments(turned, np.zeros(7))
    np.testing.assert_array_equal(own.moments(turned, np.zeros(7))[:-1], others[:-1])


@pytest.mark.parametrize(
    ("shape", "strain", "share"),
    [
        (5.0, 0.1, 0.0088),
        (5.0, 0.3, 0.0759),
        (5.0, 0.6, 1.0),
        (4.0, 0.2, 0.0521),
        (4.0, 0.5, 0.5043),
    ],
)
def test_stretched_muscles_follow_thelen(shape: float, strain: float, share: float) -> None:
    curve, one = PassiveMuscle(0.6, shape), np.ones(1)
    found = curve.forces(one * (1.0 + strain), one, one, 100.0 * one)[0]
    assert found == pytest.approx(100.0 * share, abs=0.006)
    assert curve.forces(0.9 * one, one, one, 100.0 * one)[0] == 0.0


def test_slopes_of_stretched_muscles() -> None:
    curve, one = PassiveMuscle(), np.ones(3)
    lengths, fibres = np.array([0.95, 1.1, 1.4]), np.array([1.0, 0.5, 0.8])
    there, back = (curve.forces(lengths + s, one, fibres, 50.0 * one) for s in (STEP, -STEP))
    slopes = curve.slopes(lengths, one, fibres, 50.0 * one)
    assert slopes == pytest.approx((there - back) / (2.0 * STEP), rel=1e-6, abs=1e-9)
