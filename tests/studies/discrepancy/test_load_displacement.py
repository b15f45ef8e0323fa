"""The load over displacement: what a test does at each joint, and how its curve is drawn."""

from pathlib import Path

import numpy as np
import pytest
from discrepancy_cases import frames
from test_discrepancy_page import drawn, said

from spinepipe.effects import Wrench
from spinepipe.frames import Pose, rotation_zxy
from spinepipe.model import LoadCase, LoadStep
from spinepipe.studies.discrepancy.figures.load_displacement import (
    driven_coordinates,
    line_order,
    unloading,
    ways,
    worst_curves,
)
from spinepipe.studies.discrepancy.search.readings import applied_loads

RNG = np.random.default_rng(11)
FRAMES = tuple(
    Pose(rotation_zxy(*RNG.normal(0.0, 0.3, 3)), np.array([0.0, 0.03 * j, 0.0])) for j in range(3)
)


def moved(coordinates: np.ndarray) -> Pose:
    """The pose of a joint's upper frame in the lower one."""
    return Pose(rotation_zxy(*coordinates[3:]), coordinates[:3])


def work(wrench: Wrench, joint: int, coordinates: np.ndarray) -> float:
    """What a dead wrench does while one joint is moved from neutral, for small rotations."""
    if joint > wrench.body:
        return 0.0
    frame = FRAMES[joint]
    away = frame @ moved(coordinates) @ frame.inverse()
    turn = 0.5 * np.array(
        [away.rotation[2, 1], away.rotation[0, 2], away.rotation[1, 0]]
    ) - 0.5 * np.array([away.rotation[1, 2], away.rotation[2, 0], away.rotation[0, 1]])
    path = away.apply(wrench.point) - wrench.point
    return float(wrench.force @ path + wrench.moment @ turn)


def test_loads_at_joints_are_those_of_virtual_work() -> None:
    wrenches = tuple(
        Wrench(body, RNG.normal(0.0, 0.05, 3), RNG.normal(0.0, 50.0, 3), RNG.normal(0.0, 5.0, 3))
        for body in (1, 2)
    )
    (found,) = applied_loads(FRAMES, LoadCase("any", 1, (LoadStep(0, wrenches),)))
    small = 1e-6
    for joint in range(3):
        for at in range(6):
            step = small * np.eye(6)[at]
            both = [work(w, joint, step) - work(w, joint, -step) for w in wrenches]
            expected = sum(both) / (2.0 * small)
            assert found[joint, at] == pytest.approx(expected, rel=1e-6, abs=1e-6)


def test_a_joint_above_the_loaded_vertebra_is_not_loaded() -> None:
    wrench = Wrench(0, np.zeros(3), np.array([10.0, 0.0, 0.0]), np.zeros(3))
    (found,) = applied_loads(FRAMES, LoadCase("any", 1, (LoadStep(0, (wrench,)),)))
    assert np.abs(found[0]).max() > 1.0
    assert not found[1:].any()


def test_each_test_drives_one_coordinate_of_each_joint() -> None:
    gap = frames("NAMED")["gap"]
    found = driven_coordinates(gap)
    assert {(test, coordinate) for test, _, coordinate in found} == {
        ("flexion", "extension"),
        ("left_lateral_bending", "right_bending"),
        ("left_axial_rotation", "left_rotation"),
    }
    assert len(found) == 9
    first = worst_curves(gap)[0]
    assert (first.test, first.joint, first.coordinate) == ("flexion", "L4L5", "extension")
    places = [(one.test, one.joint) for one in worst_curves(gap)]
    assert len(places) == len(set(places))  # three specimens would be more panels than there are
    one = gap[gap["specimen"] == "b"]
    assert {curve.specimen for curve in worst_curves(one)} == {"b"}
    assert worst_curves(gap.assign(base=np.nan)) == []
    assert worst_curves(gap.assign(load=0.0)) == []


def test_a_force_drives_the_translation_it_points_along() -> None:
    gap = frames("NAMED")["gap"]
    shear = gap[gap["coordinate"] == "extension"].assign(
        coordinate="anterior", unit="mm", load=lambda rows: 40.0 * rows["step"]
    )
    both = gap.assign(load=0.1 * gap["load"])
    assert {c for _, _, c in driven_coordinates(shear)} == {"anterior"}
    joined = driven_coordinates(
        type(gap)(np.concatenate([both, shear]), columns=gap.columns).infer_objects()
    )
    assert ("flexion", "L4L5", "anterior") in joined  # 200 N over 8 mm against 0.5 N m over 8 deg


def test_unloading_is_the_way_back_to_zero() -> None:
    there_and_back = np.array([0.0, 2.0, 4.0, 2.0, 0.0, -2.0, -4.0, -2.0, 0.0])
    back = [3, 4, 7, 8]
    assert np.flatnonzero(unloading(there_and_back)).tolist() == back
    assert not unloading(np.array([0.0, 2.0, 4.0, -2.0, -4.0])).any()  # a jump is no unloading
    assert not unloading(np.array([0.0, 4.0, 3.99, 4.0])).any()  # held, but for noise
    assert not unloading(np.zeros(3)).any()


def test_a_jump_to_the_other_side_starts_anew_at_zero() -> None:
    first, second = ways(np.array([0.0, 2.5, 5.0, 7.5, -2.5, -5.0]))
    assert first.tolist() == [0, 1, 2, 3]
    assert second.tolist() == [0, 4, 5]
    (whole,) = ways(np.array([0.0, 2.5, 5.0, 2.5, 0.0, -2.5, -5.0]))
    assert whole.tolist() == list(range(7))
    (through,) = ways(np.array([4.0, 2.0, -0.5, -2.0, -4.0]))  # no jump: as the other steps
    assert through.tolist() == list(range(5))
    (alone,) = ways(np.array([3.0]))
    assert alone.tolist() == [0]


def test_axes_have_the_fields_words_and_units(root: Path) -> None:
    words = said(drawn("load_displacement", root, "NAMED"))
    assert "base off by" in words
    assert "model with the effects" in words
    assert "unloading" not in words
    gap = frames("NAMED")["gap"]
    figure = drawn("load_displacement", root, "NAMED", gap=gap)
    labels = {axis.get_ylabel() for axis in figure.axes if axis.get_visible()}
    assert "flexion–extension moment (N m)" in labels
    sheared = gap.assign(unit="mm", coordinate=gap["coordinate"].replace({"extension": "anterior"}))
    figure = drawn("load_displacement", root, "NULL", gap=sheared)
    axis = next(one for one in figure.axes if "translation" in one.get_xlabel())
    assert axis.get_xlabel() == "anterior–posterior translation (mm)"
    assert axis.get_ylabel() == "anterior–posterior force (N)"


def test_a_loop_is_drawn_with_both_branches(root: Path) -> None:
    gap = frames("NAMED")["gap"]
    load = -np.array([0.0, 1.0, 2.0, 3.0, 4.0, 3.0, 2.0, 0.5])[gap["step"]]
    looped = gap.assign(load=np.where(gap["load"] != 0.0, load, 0.0), with_effects=gap["base"])
    words = said(drawn("load_displacement", root, "NULL", gap=looped))
    assert "measured, loading" in words
    assert "measured, unloading" in words
    assert "model with the effects" not in words


def test_nothing_to_draw_is_said(root: Path) -> None:
    gap = frames("NAMED")["gap"].assign(base=np.nan, with_effects=np.nan)
    assert "no pose" in said(drawn("load_displacement", root, "NAMED", gap=gap))


def test_a_line_that_comes_back_on_itself_is_drawn_once() -> None:
    load = np.array([0.0, 1.0, 2.0, 1.0, 0.0, -1.0, -2.0, -1.0, 0.0])
    way = np.arange(9)
    once = line_order(load, 0.5 * load, way)
    assert (np.diff(load[once]) >= 0.0).all()
    loop = 0.5 * load - 0.1 * np.array([0, 1, 1, 1, -1, -1, -1, -1, 1])
    assert line_order(load, loop, way).tolist() == way.tolist()


def test_a_gap_aside_of_the_load_is_pointed_to(root: Path) -> None:
    gap = frames("NULL")["gap"]
    assert "aside of the load" not in said(drawn("load_displacement", root, "NULL", gap=gap))
    bent = (gap["test"] == "flexion") & (gap["coordinate"] == "right_bending")
    coupled = gap.assign(measured=gap["measured"].where(~bent, gap["measured"] + 1.0))
    words = said(drawn("load_displacement", root, "NULL", gap=coupled))
    assert "aside of the load" in words
    assert "lateral bending, in flexion" in words
