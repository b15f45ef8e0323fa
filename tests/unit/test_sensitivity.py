"""Sensitivities to loads and joint poses are slopes of motion solved afresh.

Catches a wrong derivative by load, joint pose or stiffness.
"""

from dataclasses import replace

import numpy as np
import pytest
from example_effects import (
    POINTS,
    CubicStiffening,
    ExtraWeight,
    JointCentreOffset,
    Laxity,
    Relaxation,
    loaded,
    scoped,
    slope,
    spine,
)
from scipy.spatial.transform import Rotation

from spinepipe.effects import Wrench
from spinepipe.effects.contract import Array
from spinepipe.frames import Pose
from spinepipe.model import LoadCase, LoadStep, ScopedEffect, SpineModel
from spinepipe.statics import (
    System,
    by_joint_pose,
    by_load,
    by_parameters,
    follow,
    free_parameters,
    moved,
)
from spinepipe.world import Chain

LAWS = (
    scoped(CubicStiffening(), (0, 2)),
    scoped(Laxity(), (1,)),
    scoped(JointCentreOffset(), (0, 2), (0.008, -0.006)),
)
EFFECTS = [pytest.param((), id="springs"), pytest.param(LAWS, id="laws and geometry")]


def pose_of(model: SpineModel, case: LoadCase) -> Array:
    """(n,) pose at the end of a case."""
    return follow(System(Chain(model), model, case))[-1].equilibrium.q


def assert_close(found: Array, expected: Array) -> None:
    # poses are solved to 1e-13; what is left is the difference's own error
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-7 * np.abs(expected).max())


def with_wrench(case: LoadCase, number: int, **changes: Array) -> LoadCase:
    """The one-step case with one wrench changed."""
    wrenches = list(case.steps[0].wrenches)
    wrenches[number] = replace(wrenches[number], **changes)
    return replace(case, steps=(replace(case.steps[0], wrenches=tuple(wrenches)),))


def separate(case: LoadCase) -> LoadCase:
    """Force and moment on the top in one wrench, so that each wrench has a slot of its own."""
    force, moment, low = case.steps[0].wrenches
    top = replace(force, moment=moment.moment)
    return replace(case, steps=(LoadStep(0, (top, low), 2.0),))


@pytest.mark.parametrize("effects", EFFECTS)
@pytest.mark.parametrize("slot", [0, 1])
def test_loads(effects: tuple[ScopedEffect, ...], slot: int) -> None:
    model = spine(3, effects=effects)
    case = separate(loaded(model, 1))
    wrench: Wrench = case.steps[0].wrenches[slot]
    system = System(Chain(model), model, case)
    found = by_load(system, follow(system)[0], slot)
    for name, derivative, size in (
        ("force", found.by_force, 0.25),
        ("moment", found.by_moment, 0.05),
        ("point", found.by_point, 2e-3),
    ):
        expected = []
        for unit in np.eye(3):

            def motion(h: float, name: str = name, along: Array = unit) -> Array:
                changed = getattr(wrench, name) + h * along
                return pose_of(model, with_wrench(case, slot, **{name: changed}))

            expected.append(slope(motion, size))
        assert_close(derivative, np.stack(expected, axis=1))


def displaced(model: SpineModel, joint: int, component: int, size: float) -> SpineModel:
    """One joint frame moved in its own axes, vertebrae and loads left where they are."""
    frame, frames = model.frames[joint], list(model.frames)
    if component < 3:
        frames[joint] = Pose(frame.rotation, frame.origin + size * frame.rotation[:, component])
    else:
        turn = Rotation.from_rotvec(size * np.eye(3)[(2, 0, 1)[component - 3]]).as_matrix()
        frames[joint] = Pose(frame.rotation @ turn, frame.origin)
    return replace(model, frames=tuple(frames))


def pose_slopes(model: SpineModel, case: LoadCase, joint: int) -> Array:
    """(n, 6) derivative of the last pose by displacements of one joint frame."""
    columns = []
    for component in range(6):

        def motion(h: float, component: int = component) -> Array:
            return pose_of(displaced(model, joint, component, h), case)

        columns.append(slope(motion, 5e-4 if component < 3 else 5e-3))
    return np.stack(columns, axis=1)


@pytest.mark.parametrize(
    ("effects", "gravity"),
    [
        pytest.param((), False, id="weightless springs"),
        pytest.param(LAWS, True, id="laws and geometry with weight"),
    ],
)
def test_joint_poses(effects: tuple[ScopedEffect, ...], gravity: bool) -> None:
    model = spine(3, gravity, effects)
    case = loaded(model, 2)
    system = System(Chain(model), model, case)
    found = by_joint_pose(system, follow(system)[-1])
    for joint in range(3):
        expected = pose_slopes(model, case, joint)
        np.testing.assert_allclose(
            found[:, joint], expected, rtol=0, atol=1e-7 * np.abs(expected).max()
        )


@pytest.mark.parametrize("effect", [ExtraWeight(POINTS), Relaxation()], ids=["load", "path"])
def test_poses_and_loads_refuse_effects_they_do_not_cover(effect) -> None:
    model = spine(3, effects=(scoped(effect, (0, 1, 2)),))
    system = System(Chain(model), model, loaded(model, 2))
    last = follow(system)[-1]
    with pytest.raises(ValueError, match="do not cover"):
        by_joint_pose(system, last)
    with pytest.raises(ValueError, match="do not cover"):
        by_load(system, last, 0)


def test_stiffness_shared_by_joints_and_joint_by_joint() -> None:
    model = spine(3, effects=LAWS)
    case = loaded(model, 2)
    system = System(Chain(model), model, case)
    solved = follow(system)
    names = ["extension_nm_per_rad", "superior_n_per_m"]
    shared = free_parameters(model, 0, names, "per_specimen")
    single = free_parameters(model, 0, names, "per_joint")
    assert [p.label for p in shared] == names
    assert [p.label for p in single][:2] == [f"{names[0]}@L3L4", f"{names[0]}@L2L3"]
    by_shared, by_single = (by_parameters(system, solved, free)[-1] for free in (shared, single))
    # unknowns are logarithms: a shared one moves all, so derivatives add up
    np.testing.assert_allclose(by_single.reshape(18, 2, 3).sum(axis=2), by_shared, atol=1e-15)
    for column, unit in enumerate(np.eye(2)):

        def motion(h: float, along: Array = unit) -> Array:
            return pose_of(moved(model, shared, h * along), case)

        assert_close(by_shared[:, column], slope(motion, 0.02))


def test_unknown_parameters_and_groupings_are_refused() -> None:
    with pytest.raises(ValueError, match="no parameter 'stiffness'"):
        free_parameters(spine(1), 0, ["stiffness"], "per_joint")
    with pytest.raises(ValueError, match="per_specimen or per_joint"):
        free_parameters(spine(1), 0, ["extension_nm_per_rad"], "per_level")


def test_a_step_without_equilibrium_has_no_sensitivity() -> None:
    model = spine(2)
    press = Wrench(1, model.bodies[1].com, np.array([0.0, -5e4, 0.0]), np.zeros(3))
    system = System(Chain(model), model, LoadCase("press", 1, (LoadStep(4, (press,)),)))
    solved = follow(system)
    for differentiate in (
        lambda: by_joint_pose(system, solved[0]),
        lambda: by_load(system, solved[0], 0),
        lambda: by_parameters(system, solved, ()),
    ):
        with pytest.raises(ValueError, match="step 4 has no equilibrium"):
            differentiate()
