"""Fascicles and discs that sources lack or have wrong: by hand, on points that are easy to see."""

from dataclasses import replace

import numpy as np
import pytest

from spinepipe.muscles.myo_sim import multifidus_above_l1, place_by_ct
from spinepipe.muscles.trunk import BODIES, LEVELS, NO_BODY, THORAX
from spinepipe.muscles.trunk_source import (
    Fascicle,
    disc_areas,
    disc_heights,
    disc_tilts,
    mirror_wrong_sides,
    muscles_of,
    sheath_of,
    tilts,
    vertebra_centres,
)

L1, T12, T11 = (BODIES.index(name) for name in ("L1", "T12", "T11"))


def fascicle(name: str, *bodies: int, mm2: float = 10.0, group: str = "multifidus") -> Fascicle:
    """A path 20 mm to the right, each point 10 mm behind the joint below its body; joints are 30 mm
    apart, those of the sacrum and of L5 the same."""
    side = "right" if name.endswith("_r") else "left"
    z = 0.02 if side == "right" else -0.02
    point = np.array([[-0.01, 0.03 * max(body - 1, 0), z] for body in bodies])
    return Fascicle(name, group, side, 1e-6 * mm2, 0.05, bodies, point)


JOINTS = np.array([[0.0, 0.03 * level, 0.0] for level in range(len(LEVELS))])
LONG = [
    fascicle("to_sacrum_r", L1, 0, mm2=7.0),
    fascicle("longer_r", L1, 2, mm2=20.0),
    fascicle("short_r", L1, 3, mm2=30.0),
    fascicle("to_sacrum_l", L1, 0, mm2=8.0),
    fascicle("longer_l", L1, 2, mm2=21.0),
    fascicle("short_l", L1, 3, mm2=31.0),
    fascicle("of_l2_r", L1 - 1, 2, mm2=1000.0),
    fascicle("higher_r", T12, 2, mm2=1000.0),
    replace(fascicle("other_r", L1, 2, mm2=1000.0), group="longissimus"),
]


def test_multifidus_of_l1_goes_on_upwards_with_all_of_its_cross_section() -> None:
    """What runs to the sacrum cannot: its cross-section goes to the longest that can."""
    found, remark = multifidus_above_l1(LONG, JOINTS, np.zeros(7))
    told = {one.name: (one.body, round(1e6 * one.pcsa, 9), one.side) for one in found}
    assert told == {
        "longer_at_T12_r": ((T12, 3), 27.0, "right"),
        "short_at_T12_r": ((T12, 4), 30.0, "right"),
        "longer_at_T12_l": ((T12, 3), 29.0, "left"),
        "short_at_T12_l": ((T12, 4), 31.0, "left"),
        "longer_at_T11_r": ((T11, 4), 27.0, "right"),
        "short_at_T11_r": ((T11, 5), 30.0, "right"),
        "longer_at_T11_l": ((T11, 4), 29.0, "left"),
        "short_at_T11_l": ((T11, 5), 31.0, "left"),
    }
    assert "8 fascicles of L1 are repeated for T12 and above, 234 mm2 in all" in remark
    for one in found:
        expected = [[-0.01, 0.03 * (body - 1), one.point[0, 2]] for body in one.body]
        np.testing.assert_allclose(one.point, expected, atol=1e-15)


def test_multifidus_goes_on_as_far_as_it_reaches_down_to_t12() -> None:
    """From T10 the one over two levels, and from T9 that over three, cross T11T12 alone."""
    joints = np.array([[0.0, 0.03 * level, 0.0] for level in range(12)])
    found, _ = multifidus_above_l1(LONG, joints, np.zeros(12))
    above = {
        one.name: one.body for one in found if one.side == "right" and "_at_T1" not in one.name
    }
    above |= {one.name: one.body for one in found if one.name.endswith("_at_T10_r")}
    assert above == {
        "longer_at_T10_r": (THORAX, 5),
        "short_at_T10_r": (THORAX, T12),
        "longer_at_T9_r": (THORAX, T12),
    }


def test_muscles_of_the_back_are_moved_to_where_ct_finds_them() -> None:
    """Along a straight spine: multifidus of L3 by 12.5 mm backwards and 5 mm aside, midway to L4
    by the mean of both, below L5 as there; the left is the mirror of the right, and what is no
    muscle of the back stays."""
    vertebrae = np.array([[0.0, 0.03 * level, 0.0] for level in range(16, -1, -1)])
    point = np.array([[0.01, y, 0.02] for y in (0.06, 0.045, -0.1)])
    right = replace(fascicle("a_r", 3, 2, 0), point=point)
    left = replace(right.mirrored(), name="a_l", side="left")
    other = replace(right, group="psoas")
    (r, lft, same), _ = place_by_ct([right, left, other], vertebrae)
    moved = 1e-3 * np.array([[-12.5, 0, 5.0], [-12.35, 0, 5.05], [-11.2, 0, 6.0]])
    np.testing.assert_allclose(r.point - point, moved, atol=1e-15)
    np.testing.assert_allclose(lft.point, r.point * [1.0, 1.0, -1.0], atol=1e-15)
    np.testing.assert_array_equal(same.point, point)


def test_repeated_points_lie_on_their_vertebra_as_it_leans() -> None:
    """T12 is extended by a quarter turn against L1: behind it is below."""
    leaning = np.zeros(7)
    leaning[T12 - 1 :] = np.pi / 2
    at_t12, *_ = multifidus_above_l1([LONG[1], LONG[4]], JOINTS, leaning)[0]
    np.testing.assert_allclose(at_t12.point[0], [0.0, JOINTS[T12 - 1, 1] - 0.01, 0.02], atol=1e-15)
    np.testing.assert_allclose(at_t12.point[1], [-0.01, 0.06, 0.02], atol=1e-15)


def test_fascicles_on_the_wrong_side_are_mirrored_and_named() -> None:
    right, left = fascicle("a_r", 0, 1), fascicle("b_l", 0, 1)
    wrong = left.mirrored()
    middle = replace(right, name="c_r", point=right.point * [1.0, 1.0, 0.0])
    kept, remarks = mirror_wrong_sides([right, wrong, middle])
    np.testing.assert_array_equal(kept[1].point, left.point)
    np.testing.assert_array_equal(kept[0].point, right.point)
    assert remarks == ("mirrored, because the source has them on the other side: b_l",)
    assert mirror_wrong_sides([right, left, middle])[1] == ()
    assert right.mirrored().on_wrong_side
    most = replace(right, point=np.array([[0, 0, -0.01], [0, 0, 0.02]]))
    assert not most.on_wrong_side


def test_paths_run_upwards_and_are_filled_up_with_their_last_point() -> None:
    down, three = (
        fascicle("down_r", 3, 1),
        fascicle("three_l", 0, 2, 5, group="longissimus_thoracis"),
    )
    hung = replace(fascicle("hung_r", 7, 0, group="external_oblique"), in_sheath=True)
    found = muscles_of([down, three, hung])
    assert found.body.tolist() == [[1, 3, NO_BODY], [0, 2, 5], [7, 0, NO_BODY]]
    np.testing.assert_array_equal(found.point[0], down.point[[1, 0, 0]])
    np.testing.assert_array_equal(found.point[2], hung.point[[0, 1, 1]])
    assert found.wraps.tolist() == [False, True, False]
    assert found.in_sheath.tolist() == [False, False, True]
    assert three.length == pytest.approx(0.12)


def test_the_sheath_runs_between_the_mean_ends_of_each_side_s_rectus() -> None:
    names = ("a_r", "b_r", "c_l")
    rectus = [fascicle(name, 0, 7, group="rectus_abdominis") for name in names]
    rectus[1] = replace(rectus[1], point=rectus[1].point + np.array([0.02, 0.04, 0]))
    found = sheath_of(muscles_of([*rectus, fascicle("d_l", 0, 3)]))
    expected = [[[0.0, 0.02, 0.02], [0.0, 0.20, 0.02]], [[-0.01, 0.0, -0.02], [-0.01, 0.18, -0.02]]]
    np.testing.assert_allclose(found, expected, atol=1e-15)
    with pytest.raises(ValueError, match="no rectus_abdominis on the left"):
        sheath_of(muscles_of(rectus[:2]))


def test_discs_are_those_of_their_sources() -> None:
    """Heights of 14 adults in mm; areas of one man's endplates, mm2, whose L4L5 has 1550, brought
    to 1455 there; the two uppermost are from memory."""
    heights = [12.99, 13.82, 12.45, 11.59, 10.0, 8.25, 6.5]
    np.testing.assert_allclose(1e3 * disc_heights(), heights)
    assert heights[5] == (heights[4] + heights[6]) / 2.0, "midway between its neighbours"
    man = np.array([1406.0, 1550.0, 1478.0, 1438.0, 1457.0])
    expected = [*(1455.0 / 1550.0 * man), 0.83 * 1455.0, 0.72 * 1455.0]
    np.testing.assert_allclose(1e6 * disc_areas(), expected)


def test_vertebrae_and_discs_lie_along_their_joints() -> None:
    """A line that leans backwards is extended; a disc lies midway between its vertebrae."""
    joints = np.array([[0, 0, 0], [-1, 1, 0.3], [-1, 2, 0.3], [0, 3, 0.3]], dtype=float)
    np.testing.assert_allclose(np.rad2deg(tilts(joints)), [45.0, 0.0, -45.0])
    found = disc_tilts(np.array([0.4, 0.2, -0.6]))
    np.testing.assert_allclose(found, [0.4, 0.3, -0.2])
    centres = vertebra_centres(joints)
    np.testing.assert_allclose(centres, [[-0.5, 2.5, 0.3], [-1, 1.5, 0.3], [-0.5, 0.5, 0.15]])
