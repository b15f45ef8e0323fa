"""Varied spines: what factors do to frames, bodies, stiffness and loads, worked by hand."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cohort_cases import add, both, cell, joints, swap, text, without, write
from scipy.spatial.transform import Rotation
from sweeps import sweep

from spinepipe import cohort as cohorts
from spinepipe.cohort import Cohort
from spinepipe.cohort.specimen import joint_frames, landmarks
from spinepipe.frames import FRAME_LANDMARKS, joint_pose, transform_of
from spinepipe.studies.global_sensitivity.factors import FactorChange, Of
from spinepipe.studies.global_sensitivity.start import DescribedSpecimen, asked_tests, start_of
from spinepipe.studies.global_sensitivity.vary import (
    SpineSamples,
    many_joint_frames,
    one_joint_frame,
    vary,
)

STIFFNESS = np.array([24600.0, 110000.0, 13500.0, 37.0, 64.0, 268.0])
DAMPING = np.array([1000.0] * 3 + [1.4] * 3)
TURNED_LANDMARKS = both(
    cell("landmarks.csv", 10, "x_mm", "1.5"),
    cell("landmarks.csv", 12, "y_mm", "66"),
    cell("landmarks.csv", 9, "z_mm", "14"),
)
"""Vertebrae of specimen a that are not straight."""


@pytest.fixture
def cohort(tmp_path: Path) -> Cohort:
    """L4, L3, L2 of two specimens, in one test with forces, moments and gravity."""
    return cohorts.read(write(tmp_path / "small", TURNED_LANDMARKS))


def start(cohort: Cohort, all_steps: bool = False) -> DescribedSpecimen:
    """Specimen a in all its tests."""
    return start_of(cohort, "a", STIFFNESS, DAMPING, cohort.tests, all_steps)


def one(cohort: Cohort, *changes: tuple[FactorChange, float]) -> SpineSamples:
    """One sample of some factors with their values."""
    whats, values = zip(*changes, strict=True)
    return vary(start(cohort, all_steps=True), whats, np.array([values]))


def test_without_factors_spines_are_the_cohorts_own(cohort: Cohort) -> None:
    varied = vary(start(cohort), (FactorChange(Of.NOTHING),), np.linspace(0.0, 1.0, 3)[:, None])
    own = joint_frames(cohort, "a")
    for i in range(3):
        model = varied.spines.model(i)
        for frame, expected in zip(model.frames, own, strict=True):
            np.testing.assert_array_equal(frame.rotation, expected.rotation)
            np.testing.assert_array_equal(frame.origin, expected.origin)
        np.testing.assert_array_equal(model.effects[0].values, np.tile(STIFFNESS, (2, 1)))
        np.testing.assert_array_equal(model.damping, np.tile(DAMPING, (2, 1)))
    assert varied.kept.tolist() == [0, 1, 2]
    assert varied.refused == {}


def test_a_moved_landmark_makes_the_frames_that_joint_pose_makes(cohort: Cohort) -> None:
    change = FactorChange(Of.LANDMARK, ("L3",), 2, "superior_endplate_centre")
    varied = one(cohort, (change, 0.004))
    points = landmarks(cohort, "a")
    at = points["L3"]["superior_endplate_centre"]
    points["L3"]["superior_endplate_centre"] = at + np.array([0.0, 0.0, 0.004])
    expected = [joint_pose(points["L4"], points["L3"]), joint_pose(points["L3"], points["L2"])]
    for frame, pose in zip(varied.spines.model(0).frames, expected, strict=True):
        np.testing.assert_allclose(frame.rotation, pose.rotation, rtol=0, atol=1e-14)
        np.testing.assert_allclose(frame.origin, pose.origin, rtol=0, atol=1e-17)


def test_a_moved_endplate_moves_the_joint_above_by_half(cohort: Cohort) -> None:
    change = FactorChange(Of.LANDMARK, ("L3",), 0, "superior_endplate_centre")
    origins = one(cohort, (change, 0.004)).spines.origins[0]
    own = [frame.origin for frame in joint_frames(cohort, "a")]
    np.testing.assert_allclose(origins[0], own[0], rtol=0, atol=1e-17)
    np.testing.assert_allclose(origins[1], own[1] + [0.002, 0.0, 0.0], rtol=0, atol=1e-17)


def test_poses_that_are_given_stay_when_landmarks_move(tmp_path: Path) -> None:
    given = both(TURNED_LANDMARKS, text("joints.csv", joints()))
    change = FactorChange(Of.LANDMARK, ("L3",), 0, "superior_endplate_centre")
    cohort = cohorts.read(write(tmp_path / "small", given))
    moved = one(cohort, (change, 0.004)).spines
    np.testing.assert_array_equal(moved.origins[0], [[0.0, 0.005, 0.0], [0.0, 0.041, 0.0]])


@sweep("complete", ["both", "lower", "upper"])
def test_many_frames_are_those_of_joint_pose(complete: str) -> None:
    rng = np.random.default_rng(11)
    upright = np.array([[0, 26, 0], [0, 0, 0], [-20, 18, -15], [-20, 18, 15]]) / 1000.0
    lower = upright + rng.normal(0.0, 0.003, (400, 4, 3))
    upper = upright + np.array([0.0, 0.036, 0.0]) + rng.normal(0.0, 0.003, (400, 4, 3))
    whole, facing = np.ones(4, dtype=bool), np.array([True, True, False, False])
    given = (
        facing if complete == "upper" else whole,
        facing if complete == "lower" else whole,
    )
    found = many_joint_frames(lower, upper, *given)
    assert found.defined.all()
    for i in range(400):
        pose = one_joint_frame(lower[i], upper[i], *given)
        np.testing.assert_allclose(found.rotations[i], pose.rotation, rtol=0, atol=1e-14)
        np.testing.assert_allclose(found.origins[i], pose.origin, rtol=0, atol=1e-14)


def test_one_joint_frame_reads_the_landmarks_by_their_names() -> None:
    rng = np.random.default_rng(12)
    lower, upper = rng.normal(size=(2, 4, 3))
    sides = (dict(zip(FRAME_LANDMARKS, side, strict=True)) for side in (lower, upper))
    expected = joint_pose(*sides)
    found = one_joint_frame(lower, upper, np.ones(4, dtype=bool), np.ones(4, dtype=bool))
    np.testing.assert_array_equal(found.rotation, expected.rotation)


def test_landmarks_that_define_no_frame_refuse_their_sample_alone(cohort: Cohort) -> None:
    # specimen a's L3: pedicle bases at z -15 and 14 mm; 29 mm bring the left one onto the other
    change = FactorChange(Of.LANDMARK, ("L3",), 2, "left_pedicle_base")
    values = np.array([[0.001], [0.029], [0.002]])
    varied = vary(start(cohort), (change,), values)
    assert list(varied.refused) == [1]
    assert varied.refused[1].startswith("joint L3L4: left_pedicle_base and right_pedicle_base coin")
    assert varied.kept.tolist() == [0, 2]
    assert len(varied.spines) == len(varied.cases[0]) == 2
    alone = vary(start(cohort), (change,), values[[2]]).spines
    np.testing.assert_array_equal(varied.spines.rotations[1], alone.rotations[0])


def test_stiffness_out_of_bounds_refuses_its_sample_alone(cohort: Cohort) -> None:
    change = FactorChange(Of.STIFFNESS, ("L2L3",), 3)
    varied = vary(start(cohort), (change,), np.array([[1.0], [1e7]]))
    assert varied.kept.tolist() == [0]
    assert "joint L2L3: extension_nm_per_rad is 3.7e+08 N m/rad" in varied.refused[1]


def test_frames_move_along_and_turn_about_their_own_axes(cohort: Cohort) -> None:
    centre, axes = (
        FactorChange(Of.JOINT_CENTRE, ("L2L3",), 1),
        FactorChange(Of.JOINT_AXES, ("L2L3",), 2),
    )
    moved = one(cohort, (centre, 0.003), (axes, 0.2)).spines.model(0).frames
    own = joint_frames(cohort, "a")
    assert not np.allclose(own[1].rotation, np.eye(3), atol=1e-3)
    np.testing.assert_array_equal(moved[0].origin, own[0].origin)
    expected = own[1] @ transform_of([0.0, 0.003, 0.0, 0.0, 0.0, 0.2])
    np.testing.assert_allclose(moved[1].rotation, expected.rotation, rtol=0, atol=1e-15)
    np.testing.assert_allclose(moved[1].origin, expected.origin, rtol=0, atol=1e-17)


def test_landmarks_are_moved_before_the_frames_they_make(cohort: Cohort) -> None:
    landmark = FactorChange(Of.LANDMARK, ("L3",), 2, "superior_endplate_centre")
    centre = FactorChange(Of.JOINT_CENTRE, (), 0)
    both_ways = [
        one(cohort, *order)
        for order in (
            ((landmark, 0.004), (centre, 0.002)),
            ((centre, 0.002), (landmark, 0.004)),
        )
    ]
    made = one(cohort, (landmark, 0.004)).spines
    for varied in both_ways:
        expected = made.origins[0] + 0.002 * made.rotations[0, :, :, 0]
        np.testing.assert_allclose(varied.spines.origins[0], expected, rtol=0, atol=1e-17)


def test_stiffness_of_one_coordinate_and_several_factors_of_it(cohort: Cohort) -> None:
    every, upper = FactorChange(Of.STIFFNESS, (), 3), FactorChange(Of.STIFFNESS, ("L2L3",), 3)
    values = one(cohort, (every, 2.0), (upper, 5.0)).spines.values[0][0]
    expected = np.tile(STIFFNESS, (2, 1))
    expected[:, 3] = [2.0 * 37.0, 10.0 * 37.0]
    np.testing.assert_allclose(values, expected, rtol=1e-15)


def test_doubled_masses_double_inertias_and_leave_centres(cohort: Cohort) -> None:
    twice = one(cohort, (FactorChange(Of.MASS, ("L2",)), 2.0)).spines.model(0).bodies
    assert [body.mass for body in twice] == [0.06, 0.12]
    np.testing.assert_array_equal(twice[0].inertia, np.diag([2e-5, 3e-5, 2e-5]))
    np.testing.assert_array_equal(twice[1].inertia, np.diag([4e-5, 6e-5, 4e-5]))
    np.testing.assert_array_equal(twice[1].com, [0.0, 0.059, 0.0])


def test_a_centre_of_mass_moves_and_loads_stay(cohort: Cohort) -> None:
    varied = one(cohort, (FactorChange(Of.CENTRE_OF_MASS, ("L2",), 0), 0.01))
    np.testing.assert_array_equal(varied.spines.coms[0], [[0, 0.023, 0], [0.01, 0.059, 0]])
    # step 0 names no point: it is the cohort's own centre of mass
    np.testing.assert_array_equal(varied.cases[0].points[0, 0, 0], [0.0, 0.059, 0.0])


def test_damping_is_scaled(cohort: Cohort) -> None:
    damping = one(cohort, (FactorChange(Of.DAMPING), 3.0)).spines.damping[0]
    np.testing.assert_array_equal(damping, np.tile(3.0 * DAMPING, (2, 1)))


def test_a_load_turned_by_a_right_angle(cohort: Cohort) -> None:
    # 100 N downwards with 2 N m about -z; about +x, y turns to z and z to -y
    turned = one(cohort, (FactorChange(Of.LOAD_DIRECTION, axis=0), np.pi / 2.0)).cases[0]
    np.testing.assert_allclose(turned.forces[0, 2, 0], [0.0, 0.0, -100.0], atol=1e-13)
    np.testing.assert_allclose(turned.moments[0, 2, 0], [0.0, 2.0, 0.0], atol=1e-13)
    np.testing.assert_array_equal(turned.points[0, 2, 0], [0.015, 0.072, 0.0])


def test_turns_about_two_axes_are_one_rotation_vector(cohort: Cohort) -> None:
    x, z = FactorChange(Of.LOAD_DIRECTION, axis=0), FactorChange(Of.LOAD_DIRECTION, axis=2)
    one_way = one(cohort, (x, 0.3), (z, 0.2)).cases[0]
    np.testing.assert_array_equal(one(cohort, (z, 0.2), (x, 0.3)).cases[0].forces, one_way.forces)
    expected = Rotation.from_rotvec([0.3, 0.0, 0.2]).apply([0.0, -100.0, 0.0])
    np.testing.assert_allclose(one_way.forces[0, 2, 0], expected, atol=1e-13)


def test_size_and_point_of_loads(cohort: Cohort) -> None:
    size, point = FactorChange(Of.LOAD_SIZE), FactorChange(Of.LOAD_POINT, axis=2)
    case = one(cohort, (size, 1.5), (point, -0.005)).cases[0].case(0)
    assert [step.step for step in case.steps] == [0, 1, 2]
    (wrench,) = case.steps[2].wrenches
    np.testing.assert_allclose(wrench.force, [0.0, -150.0, 0.0], rtol=1e-15)
    np.testing.assert_allclose(wrench.moment, [0.0, 0.0, -3.0], rtol=1e-15)
    np.testing.assert_allclose(wrench.point, [0.015, 0.072, -0.005], rtol=1e-15)


def test_numbers_of_nobodys_loads_stay_zero(tmp_path: Path) -> None:
    second = add("loads.csv", "*,flexion,2,L3,0,-10,0,0,0,0,5,20,0,2")
    cohort = cohorts.read(write(tmp_path / "small", second))
    moved = one(cohort, (FactorChange(Of.LOAD_POINT, axis=0), 0.001)).cases[0]
    np.testing.assert_array_equal(moved.points[0, 1, 1], np.zeros(3))
    np.testing.assert_allclose(moved.points[0, 2, 1], [0.006, 0.02, 0.0], rtol=1e-15)


def test_samples_are_the_same_alone_and_together(cohort: Cohort) -> None:
    changes = (
        FactorChange(Of.LANDMARK, ("L3",), 1, "right_pedicle_base"),
        FactorChange(Of.JOINT_AXES, (), 0),
        FactorChange(Of.LOAD_DIRECTION, axis=2),
    )
    values = np.random.default_rng(5).normal(0.0, 0.002, (40, 3))
    whole = vary(start(cohort), changes, values)
    for i in range(40):
        alone = vary(start(cohort), changes, values[i : i + 1])
        assert whole.spines.rotations[i].tobytes() == alone.spines.rotations[0].tobytes()
        assert whole.spines.origins[i].tobytes() == alone.spines.origins[0].tobytes()
        assert whole.cases[0].forces[i].tobytes() == alone.cases[0].forces[0].tobytes()


@sweep(
    "zeroed, gravity, all_steps, computed, from_first, stored",
    [
        (False, True, False, [0, 2], False, (2,)),  # the weight comes on first
        (True, True, False, [0, 2], True, (2,)),
        (True, False, False, [2], False, (2,)),  # nothing acts in step 0: it is the neutral pose
        (True, True, True, [0, 1, 2], True, (0, 1, 2)),
        (False, True, True, [0, 1, 2], False, (0, 1, 2)),
    ],
)
def test_steps_and_where_motion_begins(
    cohort: Cohort,
    zeroed: bool,
    gravity: bool,
    all_steps: bool,
    computed: list[int],
    from_first: bool,
    stored: tuple[int, ...],
) -> None:
    changed = replace(cohort, zeroed_at_step_0=zeroed, gravity=gravity)
    (test,) = asked_tests(changed, "a", changed.tests, all_steps)
    assert [step.step for step in test.case.steps] == computed
    assert test.from_first is from_first
    assert test.steps == stored


def test_a_load_in_step_0_counts_where_the_cohort_was_zeroed(tmp_path: Path) -> None:
    loaded = swap("loads.csv", "*,flexion,0,L2,0,0,0", "*,flexion,0,L2,0,-5,0")
    weightless = swap("cohort.yaml", "gravity: true", "gravity: false")
    zeroed = swap("cohort.yaml", "step_0: false", "step_0: true")
    point = [cell("loads.csv", 2, name, "10") for name in ("px_mm", "py_mm", "pz_mm")]
    changes = (loaded, weightless, zeroed, without("bodies.csv"), *point)
    cohort = cohorts.read(write(tmp_path / "small", *changes))
    (test,) = asked_tests(cohort, "a", cohort.tests, False)
    assert [step.step for step in test.case.steps] == [0, 1, 2]  # at step 1 the load turns
    assert test.from_first
