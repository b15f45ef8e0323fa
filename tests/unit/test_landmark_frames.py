"""Joint frames by landmarks against the cohort's own rule, differences, and models built anew.

Catches joint frames that differ from the cohort's rule, or a wrong derivative by a landmark.
"""

from dataclasses import replace

import numpy as np
import pytest
from example_effects import spine

from spinepipe.calibration.solvers import AtRest
from spinepipe.cohort.landmark_frames import LandmarkFrames, displacement
from spinepipe.cohort.specimen import frames_from_landmarks
from spinepipe.effects import Wrench, create
from spinepipe.effects.contract import Array
from spinepipe.frames import FRAME_LANDMARKS, Pose, reexpress
from spinepipe.model import LoadCase, LoadStep, ScopedEffect

pytestmark = pytest.mark.numeric

VERTEBRAE = ("V3", "V2", "V1")
BODY_MM = np.array([[0.0, 26.0, 1.0], [1.0, 0.0, 0.0], [-20.0, 18.0, -15.0], [-21.0, 17.0, 16.0]])
NAMES = (
    ("V3", "superior_endplate_centre"),
    *(("V2", name) for name in FRAME_LANDMARKS),
    *(("V1", name) for name in FRAME_LANDMARKS),
    ("V1", "spinous_process"),
)
"""V3 is potted: its joint takes the frame of V2 alone; the spinous process moves no joint."""


def marks(seed: int, sd_mm: float = 1.5) -> Array:
    rng = np.random.default_rng(seed)
    rows = [
        BODY_MM[0] - [0, 36, 0],
        *BODY_MM,
        *(BODY_MM + np.array([3, 36, 1])),
        np.array([-50.0, 40, 0]),
    ]
    return (np.array(rows) + sd_mm * rng.normal(size=(len(rows), 3))) / 1000.0


def frames(points: Array) -> tuple[Pose, ...]:
    sides: dict[str, dict[str, Array]] = {name: {} for name in VERTEBRAE}
    for (vertebra, mark), point in zip(NAMES, points, strict=True):
        sides[vertebra][mark] = point
    return frames_from_landmarks(VERTEBRAE, sides)


STATED = frames(marks(0))
ALL = np.arange(len(NAMES))


def test_frames_of_many_sets_are_those_of_the_cohort_one_by_one() -> None:
    sets = np.array([marks(seed) for seed in range(6)])
    found = LandmarkFrames(VERTEBRAE, NAMES, STATED).at(sets, ALL)
    assert found.defined.all()
    for by, points in zip(found.by, sets, strict=True):
        # angles are near 0.1 rad and lengths near 1 m in ground: rounding of a few operations
        np.testing.assert_allclose(by, displacement(STATED, frames(points)), rtol=0, atol=1e-13)


def test_derivatives_are_those_of_the_rule() -> None:
    """Central differences of the cohort's own rule; step and rounding leave 1e-7 of the largest."""
    points, step = marks(3), 1e-6
    found = LandmarkFrames(VERTEBRAE, NAMES, STATED).at(points[None], ALL).by_points[0]
    for place, axis in np.ndindex(*points.shape):
        moved = np.zeros_like(points)
        moved[place, axis] = step
        ends = [displacement(STATED, frames(points + side * moved)) for side in (1, -1)]
        slope = (ends[0] - ends[1]) / (2 * step)
        np.testing.assert_allclose(
            found[:, :, place, axis], slope, rtol=0, atol=1e-7 * np.abs(found).max()
        )


def test_landmarks_that_move_no_joint_are_known() -> None:
    moving = LandmarkFrames(VERTEBRAE, NAMES, STATED).moving(marks(0))
    assert [NAMES[place] for place in ALL if place not in moving] == [("V1", "spinous_process")]


def test_landmarks_that_define_no_frame_are_told_apart() -> None:
    good, coincide, parallel = marks(1), marks(1), marks(1)
    coincide[4] = coincide[3]  # both pedicle bases of V2
    parallel[4] = parallel[3] + (parallel[1] - parallel[2])
    for bad in (coincide, parallel):
        with pytest.raises(ValueError, match="V2V3"):
            frames(bad)
    found = LandmarkFrames(VERTEBRAE, NAMES, STATED).at(np.array([good, coincide, parallel]), ALL)
    assert found.defined.tolist() == [True, False, False]


def test_offset_and_tilt_are_the_joint_in_another_frame() -> None:
    """The motion of a model whose frames are moved, told in the stated frames, is that of offsets
    and tilts: two ways of solving the same spine, which share no geometry effect."""
    moved = frames(marks(7))
    base = replace(spine(2, gravity=False), frames=STATED)
    load = Wrench(1, np.array([0.02, 0.08, 0.01]), np.array([3.0, -20.0, 2.0]), np.ones(3))
    case = LoadCase("load", 1, (LoadStep(1, (load,)),))
    alone = AtRest(replace(base, frames=moved), [case], (), np.zeros(0)).solve([(0, np.zeros(0))])
    by = displacement(STATED, moved)
    effects = [
        ScopedEffect(create(name), (0, 1), part)
        for name, part in (("joint_centre_offset", by[:, :3]), ("axes_tilt", by[:, 3:]))
    ]
    model = base.with_effects((*base.effects, *effects))
    seen = AtRest(model, [case], (), np.zeros(0)).solve([(0, np.zeros(0))])
    assert not isinstance(alone[0], str)
    assert not isinstance(seen[0], str)
    told = [
        reexpress(q, moved[joint], STATED[joint]) for joint, q in enumerate(alone[0].readings[0][0])
    ]
    # both solve to 1e-12 of a step; motion is of 1e-3 m and 1e-2 rad
    np.testing.assert_allclose(seen[0].readings[0][0], told, rtol=0, atol=1e-11)
    assert np.abs(seen[0].readings[0][0] - alone[0].readings[0][0]).max() > 1e-5
