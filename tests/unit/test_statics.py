"""Equilibria of upright chains, what has no equilibrium, and models that are refused.

Closed forms of tilted joints are in `tests/reference/test_equilibrium`.

Catches an equilibrium that is none, and a model accepted that has none.
"""

from dataclasses import replace

import numpy as np
import pytest
from example_effects import NOWHERE, bushing, loaded, spine
from sweeps import sweep

from spinepipe.effects import Wrench
from spinepipe.frames import Pose
from spinepipe.model import Body, LoadCase, LoadStep, RefusedModel, ScopedEffect, SpineModel
from spinepipe.statics import SolvedStep, System, follow
from spinepipe.status import Status
from spinepipe.world import Chain

ROUND_OFF = 1e-13
"""m and rad: loads are good to 1e-13 of their size, motion is of order 0.1."""


def upright(
    n: int,
    stiffness: tuple[float, ...],
    mass: float = 0.0,
    arm=(0.0, 0.02, 0.0),
    inertia: float = 0.0,
) -> SpineModel:
    """n upright joints 30 mm apart; the masses stand ``arm`` off their joint's centre."""
    origins = [np.array([0.0, 0.03 * j, 0.0]) for j in range(n)]
    scope = bushing(n)
    return SpineModel(
        specimen="upright",
        joints=tuple(f"L{n - j}L{n - j + 1}" for j in range(n)),
        frames=tuple(Pose(np.eye(3), origin) for origin in origins),
        bodies=tuple(
            Body(f"L{n - j}", mass, origins[j] + arm, inertia * np.eye(3)) for j in range(n)
        ),
        gravity=np.array([0.0, -9.81, 0.0]) if mass else np.zeros(3),
        damping=np.tile([200.0] * 3 + [1.0] * 3, (n, 1)),
        effects=(scope.with_values(np.tile(stiffness, (n, 1))),),
    )


SPRINGS = (1e5, 3e5, 1e5, 51.0, 40.0, 90.0)


def under(model: SpineModel, *wrenches: Wrench) -> SolvedStep:
    """The equilibrium of a model under wrenches, all in one step."""
    case = LoadCase("test", 1, (LoadStep(0, wrenches),))
    return follow(System(Chain(model), model, case))[0]


def moment(body: int, *components: float) -> Wrench:
    return Wrench(body, NOWHERE, NOWHERE, np.array(components))


@sweep("n", [6, 20])
def test_a_pure_flexion_moment_bends_every_level_alike(n: int) -> None:
    solved = under(upright(n, SPRINGS), moment(n - 1, 0.0, 0.0, -7.5))
    expected = np.zeros((n, 6))
    expected[:, 3] = -7.5 / 51.0
    assert solved.equilibrium.status is Status.CONVERGED
    np.testing.assert_allclose(solved.equilibrium.q.reshape(n, 6), expected, atol=ROUND_OFF)
    assert np.rad2deg(expected[0, 3]) == pytest.approx(-8.42585, abs=5e-6)


def test_a_solved_pose_leaves_no_load_over() -> None:
    model = spine(3)
    system = System(Chain(model), model, loaded(model))
    for step in follow(system):
        residual = system.balance(step.equilibrium.q, step.loading, step.states).residual
        assert np.abs(residual).max() < 1e-10  # loads are of order 100
        assert step.equilibrium.message == ""
        assert step.equilibrium.reached == 1.0


def test_a_large_load_is_reached_by_continuation() -> None:
    model = spine(3, gravity=False)
    solved = under(model, moment(2, 10.0, 12.0, -16.0))
    assert solved.equilibrium.status is Status.CONVERGED
    halves = [moment(2, *(share * np.array([10.0, 12.0, -16.0]))) for share in (0.25, 0.5, 0.75, 1)]
    case = LoadCase("slowly", 1, tuple(LoadStep(i, (w,)) for i, w in enumerate(halves)))
    slowly = follow(System(Chain(model), model, case))[-1]
    np.testing.assert_allclose(solved.equilibrium.q, slowly.equilibrium.q, rtol=0, atol=1e-12)


def test_a_pose_that_is_stable_though_the_symmetric_part_is_not_positive() -> None:
    """Six joints of 20 N m/rad under an axial moment of 10.5 N m."""
    soft = (1e5, 3e5, 1e5, 20.0, 20.0, 20.0)
    solved = under(upright(6, soft, inertia=1e-4), moment(5, 0.0, 0.0, 10.5))
    assert solved.equilibrium.status is Status.CONVERGED
    np.testing.assert_allclose(solved.equilibrium.q.reshape(6, 6)[:, 3], 10.5 / 20.0)


TIPPING = {
    "in one direction": (1e5, 3e5, 1e5, 5.0, 50.0, 90.0),
    "in two directions at once": (1e5, 3e5, 1e5, 5.0, 5.0, 90.0),
}


@sweep("inertia", [0.0, 1e-5, 1e-3])
@sweep("springs", TIPPING.values(), TIPPING)
def test_a_weight_that_tips_the_upright_pose(springs, inertia: float) -> None:
    """m g h = 9.81 N m/rad against 5: upright is an equilibrium, but not a stable one."""
    solved = under(upright(1, springs, 10.0, (0.0, 0.1, 0.0), inertia))
    assert solved.equilibrium.status is Status.UNSTABLE
    assert not solved.usable
    assert solved.equilibrium.factored is None
    assert 0.4 < solved.equilibrium.reached < 0.6  # 5 / 9.81
    assert np.isfinite(solved.equilibrium.q).all()
    assert "stability" in solved.equilibrium.message


def test_a_tiny_inertia_hides_no_tipping() -> None:
    solved = under(upright(1, TIPPING["in two directions at once"], 7.0, (0.0, 0.1, 0.0), 1e-10))
    assert solved.equilibrium.status is Status.UNSTABLE


def test_the_same_weight_stands_on_stiffer_springs() -> None:
    solved = under(upright(1, (1e5, 3e5, 1e5, 9.9, 9.9, 90.0), 10.0, (0.0, 0.1, 0.0), 1e-4))
    assert solved.equilibrium.status is Status.CONVERGED


def test_a_weight_off_centre_tips_over_without_another_pose() -> None:
    solved = under(upright(2, (1e5, 3e5, 1e5, 5.0, 50.0, 90.0), 10.0, (0.01, 0.1, 0.0), 1e-3))
    assert solved.equilibrium.status is Status.UNSTABLE
    assert "a joint turns beyond 80 degrees" in solved.equilibrium.message
    assert "%" in solved.equilibrium.message
    assert np.abs(solved.equilibrium.q).max() < np.deg2rad(80.0)


def test_a_joint_that_turns_too_far_is_not_said_to_tip_over() -> None:
    """2 N m on 1 N m/rad would stand at 115 degrees; 80 are reached at 70 % of it."""
    solved = under(upright(1, (1e5, 3e5, 1e5, 1.0, 40.0, 90.0)), moment(0, 0.0, 0.0, 2.0))
    assert solved.equilibrium.status is Status.UNSTABLE
    # the load goes on in fractions of 1/1024
    assert solved.equilibrium.reached == pytest.approx(np.deg2rad(80.0) / 2.0, abs=1.0 / 1024.0)
    assert "a joint turns beyond 80 degrees" in solved.equilibrium.message
    assert "tips over" not in solved.equilibrium.message


def spoiled(**changes: object) -> SpineModel:
    return replace(spine(2), **changes)


def test_no_and_too_many_joints_are_refused() -> None:
    with pytest.raises(RefusedModel, match="21 joints; 1 to 20"):
        upright(21, SPRINGS)
    with pytest.raises(RefusedModel, match="0 joints"):
        spoiled(joints=(), frames=(), bodies=(), damping=np.zeros((0, 6)), effects=())


@sweep(
    "changes, said",
    [
        ({"frames": spine(1).frames}, "differ in number"),
        ({"frames": (Pose(np.eye(3), np.full(3, np.nan)),) * 2}, "L2L3 is not finite"),
        ({"bodies": (replace(spine(1).bodies[0], mass=0.0),) * 2}, "no mass, but gravity is on"),
        ({"effects": (bushing(2).with_values(np.ones((1, 6))),)}, "values must be 2 x 6"),
        ({"effects": (bushing(2).with_values(np.zeros((2, 6))),)}, r"is 0 N/m, allowed 1 to"),
        ({"effects": (bushing(2).with_values(np.full((2, 6), np.nan)),)}, "is nan"),
        ({"effects": (ScopedEffect(bushing(2).effect, (0, 5), bushing(2).values),)}, "not all in"),
        ({"gravity": np.array([0.0, np.nan, 0.0])}, "gravity is not finite"),
        ({"damping": np.zeros((2, 6))}, "damping must be positive"),
        ({"damping": np.full((2, 6), np.nan)}, "damping must be positive"),
        ({"frames": (Pose(np.diag([1.0, 1.0, -1.0]), np.zeros(3)),) * 2}, "not a right-handed"),
        ({"frames": (Pose(2.0 * np.eye(3), np.zeros(3)),) * 2}, "not a right-handed"),
    ],
)
def test_models_no_solver_should_see_are_refused(changes, said) -> None:
    with pytest.raises(RefusedModel, match=said):
        spoiled(**changes)


@sweep(
    "changes, said",
    [
        ({"mass": -1.0}, "not negative"),
        ({"mass": np.inf}, "finite"),
        ({"com": np.full(3, np.inf)}, "finite"),
        ({"inertia": -np.eye(3)}, "no body has this inertia"),
        ({"inertia": np.diag([1.0, 1.0, 2.1])}, "no body has this inertia"),
        ({"inertia": np.eye(3) + np.diag([0.1, 0.0], 1)}, "not symmetric"),
    ],
)
def test_bodies_that_cannot_be_are_refused(changes, said) -> None:
    with pytest.raises(RefusedModel, match=said):
        replace(spine(1).bodies[0], **changes)


@sweep("moment, warned", [(7.5, False), (12.0, True)])
def test_a_symmetric_part_that_is_not_positive_is_a_warning(moment: float, warned: bool) -> None:
    """Six joints of 20 N m/rad: it turns between 10 and 10.5 N m, the pose stays stable."""
    model = upright(6, (1.5e5, 1.9e6, 1.4e5, 20.0, 20.0, 20.0))
    flexion = Wrench(5, np.array([0.0, 0.16, 0.0]), NOWHERE, np.array([0.0, 0.0, -moment]))
    found = under(model, flexion).equilibrium
    assert found.status is Status.CONVERGED
    assert ("symmetric part" in found.message) is warned
