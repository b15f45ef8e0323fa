"""Laws that the motion of every spine obeys, whatever its shape, springs and loads.

Catches motion that breaks symmetry, superposition or another law of all spines.
"""

from dataclasses import dataclass, replace

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from spinepipe.effects import Wrench, create
from spinepipe.effects.contract import Array
from spinepipe.frames import Pose, coordinates_of, joint_pose, reexpress, rotation_zxy, transform_of
from spinepipe.model import Body, LoadCase, LoadStep, ScopedEffect, SpineModel
from spinepipe.statics import System, follow
from spinepipe.world import Chain

FEW = settings(max_examples=15)

ROUND_OFF = 1e-11
"""m and rad: Newton's steps end below 1e-9 and square, loads are good to 1e-13."""

seeds = st.integers(0, 10**6)
joint_numbers = st.integers(1, 4)


@dataclass(frozen=True)
class Loaded:
    """A spine and the wrenches on it."""

    model: SpineModel
    wrenches: tuple[Wrench, ...]

    def poses(self, *shares: float) -> list[Array]:
        """(J, 6) pose after each step, the wrenches times these shares in turn."""
        steps = tuple(
            LoadStep(
                number,
                tuple(replace(w, force=s * w.force, moment=s * w.moment) for w in self.wrenches),
            )
            for number, s in enumerate(shares or (1.0,))
        )
        solved = follow(System(Chain(self.model), self.model, LoadCase("test", 1, steps)))
        assert all(step.usable for step in solved)
        return [step.equilibrium.q.reshape(-1, 6) for step in solved]


def random_spine(seed: int, n: int, gravity: bool = True) -> Loaded:
    """Tilted joints some 36 mm apart, springs within a factor, loads on the upper bodies."""
    rng = np.random.default_rng(seed)
    origins = [np.array([0.0, 0.036 * j, 0.0]) + rng.normal(0, 4e-3, 3) for j in range(n)]
    springs = np.array([1e5, 3e5, 1e5, 50.0, 45.0, 90.0]) * rng.uniform(0.6, 1.6, (n, 6))
    bodies = []
    for origin in origins:
        spread = rng.normal(0, 0.01, (6, 3))  # six points of 0.1 kg: an inertia that can be
        inertia = 0.1 * (np.sum(spread**2) * np.eye(3) - spread.T @ spread)
        bodies.append(Body("L", rng.uniform(0.1, 1.0), origin + rng.normal(0, 0.01, 3), inertia))
    wrenches = [
        Wrench(
            body, origins[body] + rng.normal(0, 0.02, 3), rng.normal(0, 15, 3), rng.normal(0, 2, 3)
        )
        for body in {n - 1, max(n - 3, 0)}
    ]
    model = SpineModel(
        specimen="random",
        joints=tuple(f"J{j}" for j in range(n)),
        frames=tuple(Pose(rotation_zxy(*rng.normal(0, 0.2, 3)), origin) for origin in origins),
        bodies=tuple(bodies),
        gravity=np.array([0.5, -9.7, 0.8]) if gravity else np.zeros(3),
        damping=np.tile([200.0] * 3 + [1.0] * 3, (n, 1)),
        effects=(ScopedEffect(create("linear_bushing"), tuple(range(n)), springs),),
    )
    return Loaded(model, tuple(wrenches))


def with_stiffness(spine: Loaded, values: Array) -> Loaded:
    model = spine.model.with_effects((spine.model.effects[0].with_values(values),))
    return replace(spine, model=model)


MIRROR = np.diag([1.0, 1.0, -1.0])
FLIPS = np.array([1.0, 1.0, -1.0, 1.0, -1.0, -1.0])
"""right, right bending and left rotation change sign in the mirror."""


def mirrored(spine: Loaded) -> Loaded:
    """Left for right; moments are axial vectors."""
    model = spine.model
    return Loaded(
        replace(
            model,
            frames=tuple(
                Pose(MIRROR @ f.rotation @ MIRROR, MIRROR @ f.origin) for f in model.frames
            ),
            bodies=tuple(
                replace(b, com=MIRROR @ b.com, inertia=MIRROR @ b.inertia @ MIRROR)
                for b in model.bodies
            ),
            gravity=MIRROR @ model.gravity,
        ),
        tuple(
            Wrench(w.body, MIRROR @ w.point, MIRROR @ w.force, -MIRROR @ w.moment)
            for w in spine.wrenches
        ),
    )


@FEW
@given(seeds, joint_numbers)
def test_a_mirrored_specimen_moves_mirrored(seed: int, n: int) -> None:
    spine = random_spine(seed, n)
    poses, mirror = spine.poses(0.5, 1.0), mirrored(spine).poses(0.5, 1.0)
    np.testing.assert_allclose(mirror, FLIPS * poses, rtol=0, atol=ROUND_OFF)


def carried(spine: Loaded, place: Pose) -> Loaded:
    """Spine, gravity and loads moved as one."""
    model, turn = spine.model, place.rotation
    return Loaded(
        replace(
            model,
            frames=tuple(place @ frame for frame in model.frames),
            bodies=tuple(
                replace(b, com=place.apply(b.com), inertia=turn @ b.inertia @ turn.T)
                for b in model.bodies
            ),
            gravity=turn @ model.gravity,
        ),
        tuple(
            Wrench(w.body, place.apply(w.point), turn @ w.force, turn @ w.moment)
            for w in spine.wrenches
        ),
    )


@FEW
@given(seeds, joint_numbers)
def test_a_rigid_motion_of_everything_changes_no_joint_coordinate(seed: int, n: int) -> None:
    spine, rng = random_spine(seed, n), np.random.default_rng(seed + 1)
    place = Pose(Rotation.random(rng=rng).as_matrix(), rng.normal(0, 0.5, 3))
    np.testing.assert_allclose(carried(spine, place).poses(), spine.poses(), rtol=0, atol=ROUND_OFF)


@FEW
@given(seeds, joint_numbers, st.floats(1.1, 20.0))
def test_a_stiffer_coordinate_moves_no_further(seed: int, n: int, factor: float) -> None:
    """d(q_i^2)/dk_i = -2 q_i^2 (K^-1)_ii, and K's inverse has a positive diagonal here."""
    spine, rng = random_spine(seed, n, gravity=False), np.random.default_rng(seed + 1)
    values = spine.model.effects[0].values.copy()
    joint, coordinate = rng.integers(n), rng.integers(6)
    soft = abs(spine.poses()[0][joint, coordinate])
    values[joint, coordinate] *= factor
    stiff = abs(with_stiffness(spine, values).poses()[0][joint, coordinate])
    assert stiff <= soft * (1.0 + 1e-9)


@FEW
@given(seeds, joint_numbers, st.floats(1.1, 10.0))
def test_a_force_does_less_work_and_stores_less_on_a_stiffer_spine(
    seed: int, n: int, factor: float
) -> None:
    """All springs times a factor: of two minima of energy, the stiffer has the smaller work."""
    spine = random_spine(seed, n, gravity=False)
    spine = Loaded(spine.model, (replace(spine.wrenches[-1], moment=np.zeros(3)),))
    values = spine.model.effects[0].values
    soft, stiff = spine.poses()[0], with_stiffness(spine, factor * values).poses()[0]
    assert work(spine, stiff) <= work(spine, soft)
    assert np.sum(values * stiff**2) <= np.sum(values * soft**2)


def work(spine: Loaded, pose: Array) -> float:
    """Of the one force, from the neutral pose, J."""
    (wrench,) = spine.wrenches
    point = displacement(spine.model, pose, wrench.body).apply(wrench.point)
    return float(wrench.force @ (point - wrench.point))


def displacement(model: SpineModel, pose: Array, body: int) -> Pose:
    """Of a vertebra from its neutral pose, in ground."""
    moved = Pose(np.eye(3), np.zeros(3))
    for frame, q in zip(model.frames[: body + 1], pose[: body + 1], strict=True):
        moved = moved @ frame @ transform_of(q) @ frame.inverse()
    return moved


@FEW
@given(seeds, joint_numbers, st.floats(0.1, 50.0))
def test_load_and_stiffness_times_a_number_leave_the_motion(
    seed: int, n: int, factor: float
) -> None:
    spine = random_spine(seed, n, gravity=False)
    values = factor * spine.model.effects[0].values
    wrenches = tuple(
        replace(w, force=factor * w.force, moment=factor * w.moment) for w in spine.wrenches
    )
    scaled = replace(with_stiffness(spine, values), wrenches=wrenches)
    np.testing.assert_allclose(scaled.poses(), spine.poses(), rtol=0, atol=ROUND_OFF)


@FEW
@given(seeds, joint_numbers, st.lists(st.floats(-0.8, 1.2), max_size=5))
def test_without_path_effects_the_way_does_not_matter(
    seed: int, n: int, shares: list[float]
) -> None:
    spine = random_spine(seed, n)
    there = spine.poses(*shares, 1.0)[-1]
    np.testing.assert_allclose(there, spine.poses()[0], rtol=0, atol=ROUND_OFF)


@FEW
@given(seeds, joint_numbers)
def test_the_top_joint_holds_the_forces_on_the_top_vertebra(seed: int, n: int) -> None:
    """The uppermost joint's translation springs carry the forces on the uppermost vertebra."""
    spine = random_spine(seed, n)
    pose, model = spine.poses()[0], spine.model
    below = displacement(model, pose, n - 2) if n > 1 else Pose(np.eye(3), np.zeros(3))
    top = n - 1
    axes = below.rotation @ model.frames[top].rotation
    force = sum((w.force for w in spine.wrenches if w.body == top), np.zeros(3))
    force = force + model.bodies[top].mass * model.gravity
    held = model.effects[0].values[top, :3] * pose[top, :3]
    np.testing.assert_allclose(axes @ held, force, rtol=0, atol=1e-6)


@FEW
@given(seeds)
def test_motion_told_in_another_frame_and_back_is_the_same(seed: int) -> None:
    rng = np.random.default_rng(seed)
    one, other = (
        Pose(Rotation.random(rng=rng).as_matrix(), rng.normal(0, 0.1, 3)) for _ in range(2)
    )
    q = np.concatenate([rng.normal(0, 0.01, 3), rng.normal(0, 0.3, 3)])
    again = reexpress(reexpress(q, one, other), other, one)
    np.testing.assert_allclose(again, q, rtol=0, atol=1e-12)
    np.testing.assert_allclose(coordinates_of(transform_of(q)), q, rtol=0, atol=1e-13)


def vertebra(rng: np.random.Generator, height: float) -> dict[str, Array]:
    """Landmarks of a vertebra, each palpated 2 mm off."""
    upright = {
        "superior_endplate_centre": [0.0, height + 0.026, 0.0],
        "inferior_endplate_centre": [0.0, height, 0.0],
        "left_pedicle_base": [-0.02, height + 0.018, -0.015],
        "right_pedicle_base": [-0.02, height + 0.018, 0.015],
    }
    return {name: np.array(point) + rng.normal(0, 2e-3, 3) for name, point in upright.items()}


@FEW
@given(seeds)
def test_mirrored_landmarks_give_a_mirrored_joint(seed: int) -> None:
    rng = np.random.default_rng(seed)
    lower, upper = vertebra(rng, 0.0), vertebra(rng, 0.036)
    swap = {"left_pedicle_base": "right_pedicle_base", "right_pedicle_base": "left_pedicle_base"}
    joint = joint_pose(lower, upper)
    mirror = joint_pose(
        *({swap.get(n, n): MIRROR @ p for n, p in side.items()} for side in (lower, upper))
    )
    np.testing.assert_allclose(mirror.origin, MIRROR @ joint.origin, rtol=0, atol=1e-15)
    np.testing.assert_allclose(mirror.rotation, MIRROR @ joint.rotation @ MIRROR, atol=1e-13)


@FEW
@given(seeds)
def test_landmarks_carried_along_carry_the_joint(seed: int) -> None:
    rng = np.random.default_rng(seed)
    lower, upper = vertebra(rng, 0.0), vertebra(rng, 0.036)
    place = Pose(Rotation.random(rng=rng).as_matrix(), rng.normal(0, 0.5, 3))
    expected = place @ joint_pose(lower, upper)
    found = joint_pose(*({n: place.apply(p) for n, p in side.items()} for side in (lower, upper)))
    np.testing.assert_allclose(found.origin, expected.origin, rtol=0, atol=1e-14)
    np.testing.assert_allclose(found.rotation, expected.rotation, rtol=0, atol=1e-13)
