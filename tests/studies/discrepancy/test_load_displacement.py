"""The load over displacement: what a test does at each joint, and how its curve is drawn."""

import numpy as np
import pytest
from discrepancy_cases import frames

from spinepipe.cohort.load_response import joint_loads
from spinepipe.effects import Wrench
from spinepipe.frames import Pose, rotation_zxy
from spinepipe.model import LoadCase, LoadStep
from spinepipe.studies.discrepancy.charts import ways, worst_curves
from spinepipe.studies.discrepancy.curve_rows import driven_coordinates

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
    (found,) = joint_loads(FRAMES, LoadCase("any", 1, (LoadStep(0, wrenches),)))
    small = 1e-6
    for joint in range(3):
        for at in range(6):
            step = small * np.eye(6)[at]
            both = [work(w, joint, step) - work(w, joint, -step) for w in wrenches]
            expected = sum(both) / (2.0 * small)
            assert found[joint, at] == pytest.approx(expected, rel=1e-6, abs=1e-6)


def test_a_joint_above_the_loaded_vertebra_is_not_loaded() -> None:
    wrench = Wrench(0, np.zeros(3), np.array([10.0, 0.0, 0.0]), np.zeros(3))
    (found,) = joint_loads(FRAMES, LoadCase("any", 1, (LoadStep(0, (wrench,)),)))
    assert np.abs(found[0]).max() > 1.0
    assert not found[1:].any()


def test_each_test_drives_one_coordinate_of_each_joint() -> None:
    gap = frames("NAMED")["gap"]
    found = driven_coordinates(gap)
    assert {(test, coordinate) for (test, _), coordinate in found.items()} == {
        ("flexion", "extension"),
        ("left_lateral_bending", "right_bending"),
        ("left_axial_rotation", "left_rotation"),
    }
    assert len(found) == 9
    first = worst_curves(gap)[0].iloc[0]
    assert (first["test"], first["joint"], first["driven"]) == ("flexion", "L4L5", "extension")
    motions = [curve["coordinate"].iloc[0] for curve in worst_curves(gap)]
    assert set(motions) == {"extension", "right_bending", "left_rotation"}
    assert len(motions) == 4
    assert worst_curves(gap.assign(load=0.0)) == []


def test_a_force_drives_the_translation_it_points_along() -> None:
    gap = frames("NAMED")["gap"]
    shear = gap[gap["coordinate"] == "extension"].assign(
        coordinate="anterior", unit="mm", load=lambda rows: 40.0 * rows["step"]
    )
    both = gap.assign(load=0.1 * gap["load"])
    assert set(driven_coordinates(shear).values()) == {"anterior"}
    joined = driven_coordinates(
        type(gap)(np.concatenate([both, shear]), columns=gap.columns).infer_objects()
    )
    assert joined["flexion", "L4L5"] == "anterior"  # 200 N over 8 mm against 0.5 N m over 8 deg


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
