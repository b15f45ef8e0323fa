"""One small effect of each kind, and a tilted spine to try them on."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from spinepipe.effects import (
    Advance,
    AppliedLoad,
    Effect,
    EffectKind,
    JointResponse,
    Motion,
    Observation,
    Parameter,
    Placement,
    PlacementByParameter,
    Wrench,
    create,
)
from spinepipe.effects.contract import Array, Indices
from spinepipe.frames import Pose, rotation_zxy
from spinepipe.model import Body, LoadCase, LoadStep, ScopedEffect, SpineModel
from spinepipe.statics import System, follow
from spinepipe.units import COORDINATES
from spinepipe.world import Chain

SUPERIOR, EXTENSION = COORDINATES.index("superior"), COORDINATES.index("extension")
NOWHERE = np.zeros(3)


def number(name: str, unit: str, low: float, high: float, default: float, **kwargs) -> Parameter:
    """A parameter with one prior SD of a tenth of its default."""
    settings = {"prior_scale": 0.1 * default, "logarithmic": False, "meaning": name, **kwargs}
    return Parameter(name, unit, low, high, default, **settings)


@dataclass(frozen=True)
class CubicStiffening:
    """Joint law: a load that grows with the cube of one coordinate."""

    coordinate: str = "extension"
    per_joint: bool = True
    name: ClassVar[str] = "cubic_stiffening"
    kind: ClassVar[EffectKind] = EffectKind.JOINT_LAW
    parameters: ClassVar[tuple[Parameter, ...]] = (
        number("rise", "N m/rad^3", 1.0, 1e6, 2e3, logarithmic=True),
    )

    def respond(self, q: Array, parameters: Array, carried: Array) -> JointResponse:
        at = COORDINATES.index(self.coordinate)
        load, tangent = np.zeros_like(q), np.zeros((*q.shape, 6))
        load[:, at] = parameters[:, 0] * q[:, at] ** 3
        tangent[:, at, at] = 3.0 * parameters[:, 0] * q[:, at] ** 2
        return JointResponse(load, tangent)

    def by_parameter(self, q: Array, parameters: Array, carried: Array) -> Array:
        at = COORDINATES.index(self.coordinate)
        derivative = np.zeros((*q.shape, 1))
        derivative[:, at, 0] = q[:, at] ** 3
        return derivative


@dataclass(frozen=True)
class Laxity:
    """Joint law on what is carried: a share of the load of the laws before it is lost."""

    name: ClassVar[str] = "laxity"
    kind: ClassVar[EffectKind] = EffectKind.JOINT_LAW
    per_joint: ClassVar[bool] = True
    parameters: ClassVar[tuple[Parameter, ...]] = (number("fraction", "1", 0.0, 0.9, 0.2),)

    def respond(self, q: Array, parameters: Array, carried: Array) -> JointResponse:
        by_carried = -parameters[:, :, None] * np.eye(6)
        return JointResponse(-parameters * carried, np.zeros((*q.shape, 6)), by_carried)

    def by_parameter(self, q: Array, parameters: Array, carried: Array) -> Array:
        return -carried[:, :, None]


@dataclass(frozen=True)
class PreloadStiffening:
    """Joint law on what is carried: resistance to extension grows with the compression."""

    name: ClassVar[str] = "preload_stiffening"
    kind: ClassVar[EffectKind] = EffectKind.JOINT_LAW
    per_joint: ClassVar[bool] = True
    parameters: ClassVar[tuple[Parameter, ...]] = (number("rise", "m/rad", 0.0, 10.0, 0.1),)

    def respond(self, q: Array, parameters: Array, carried: Array) -> JointResponse:
        load, tangent, by_carried = np.zeros_like(q), *np.zeros((2, *q.shape, 6))
        load[:, EXTENSION] = -parameters[:, 0] * carried[:, SUPERIOR] * q[:, EXTENSION]
        tangent[:, EXTENSION, EXTENSION] = -parameters[:, 0] * carried[:, SUPERIOR]
        by_carried[:, EXTENSION, SUPERIOR] = -parameters[:, 0] * q[:, EXTENSION]
        return JointResponse(load, tangent, by_carried)

    def by_parameter(self, q: Array, parameters: Array, carried: Array) -> Array:
        derivative = np.zeros((*q.shape, 1))
        derivative[:, EXTENSION, 0] = -carried[:, SUPERIOR] * q[:, EXTENSION]
        return derivative


@dataclass(frozen=True)
class ExtraWeight:
    """Load: a weight that was left out, at one point of each vertebra (m, ground, neutral)."""

    points: tuple[tuple[float, float, float], ...]
    name: ClassVar[str] = "extra_weight"
    kind: ClassVar[EffectKind] = EffectKind.LOAD
    per_joint: ClassVar[bool] = True
    parameters: ClassVar[tuple[Parameter, ...]] = (
        number("weight", "N", 0.0, 500.0, 20.0, logarithmic=True),
    )

    def apply(
        self, motion: Motion, wrenches: tuple[Wrench, ...], joints: Indices, parameters: Array
    ) -> AppliedLoad:
        acting = [self._at(motion, body, weight) for body, weight in enumerate(parameters[:, 0])]
        return AppliedLoad(sum(a.load for a in acting), sum(a.tangent for a in acting))

    def by_parameter(
        self, motion: Motion, wrenches: tuple[Wrench, ...], joints: Indices, parameters: Array
    ) -> Array:
        unit = [self._at(motion, body, 1.0).load for body in range(len(parameters))]
        return np.stack(unit, axis=1)[:, :, None]

    def _at(self, motion: Motion, body: int, weight: float) -> AppliedLoad:
        force = np.array([0.0, -weight, 0.0])
        return motion.wrench(body, np.array(self.points[body]), force, NOWHERE)


@dataclass(frozen=True)
class FollowerLoad:
    """Load that turns with a vertebra: compression along its own superior axis, one for all."""

    body: int
    point: tuple[float, float, float]
    name: ClassVar[str] = "follower_load"
    kind: ClassVar[EffectKind] = EffectKind.LOAD
    per_joint: ClassVar[bool] = False
    parameters: ClassVar[tuple[Parameter, ...]] = (number("compression", "N", 0.0, 1e3, 60.0),)

    def apply(
        self, motion: Motion, wrenches: tuple[Wrench, ...], joints: Indices, parameters: Array
    ) -> AppliedLoad:
        compression, last = parameters[0, 0], 6 * self.body + 5
        downwards = -motion.axes[last]  # the last rotation's axis is fixed in the vertebra
        point = np.array(self.point)
        fixed = motion.wrench(self.body, point, compression * downwards, NOWHERE)
        turned = np.cross(motion.axes, downwards)
        turned[last:] = 0.0
        velocities = motion.velocities(self.body, point)
        return AppliedLoad(fixed.load, fixed.tangent + compression * velocities @ turned.T)

    def by_parameter(
        self, motion: Motion, wrenches: tuple[Wrench, ...], joints: Indices, parameters: Array
    ) -> Array:
        velocities = motion.velocities(self.body, np.array(self.point))
        return -(velocities @ motion.axes[6 * self.body + 5])[:, None, None]


@dataclass(frozen=True)
class JointCentreOffset:
    """Geometry: the laws act about a centre displaced in the joint frame, forwards and up."""

    per_joint: bool = True
    name: ClassVar[str] = "joint_centre_offset"
    kind: ClassVar[EffectKind] = EffectKind.GEOMETRY
    parameters: ClassVar[tuple[Parameter, ...]] = (
        number("forward", "m", -0.05, 0.05, 0.0, prior_scale=0.005),
        number("up", "m", -0.05, 0.05, 0.0, prior_scale=0.005),
    )

    def place(self, q: Array, parameters: Array) -> Placement:
        rotation, first, second = _rotations(q[:, 3:])
        centre = np.column_stack([parameters, np.zeros(len(parameters))])
        centre = np.broadcast_to(centre, (len(q), 3))
        moved, by_coordinate = q.copy(), np.tile(np.eye(6), (len(q), 1, 1))
        by_coordinates = np.zeros((len(q), 6, 6, 6))
        moved[:, :3] += np.einsum("jxy,jy->jx", rotation - np.eye(3), centre)
        by_coordinate[:, :3, 3:] = np.einsum("jaxy,jy->jxa", first, centre)
        by_coordinates[:, :3, 3:, 3:] = np.einsum("jabxy,jy->jxab", second, centre)
        return Placement(moved, by_coordinate, by_coordinates)

    def by_parameter(self, q: Array, parameters: Array) -> PlacementByParameter:
        rotation, first, _ = _rotations(q[:, 3:])
        by_q, by_coordinate = np.zeros((len(q), 6, 2)), np.zeros((len(q), 6, 6, 2))
        by_q[:, :3] = (rotation - np.eye(3))[:, :, :2]
        by_coordinate[:, :3, 3:] = first[..., :2].transpose(0, 2, 1, 3)
        return PlacementByParameter(by_q, by_coordinate)


def _rotations(angles: Array) -> tuple[Array, Array, Array]:
    """(J, 3, 3) Rz Rx Ry of (J, 3) angles and its derivatives (J, 3, 3, 3), (J, 3, 3, 3, 3)."""
    spins = np.cross(np.eye(3)[[2, 0, 1]][:, None], np.eye(3)).transpose(0, 2, 1)
    single = [np.stack([rotation_zxy(*row) for row in np.diag(one)]) for one in angles]
    shape = (len(angles), 3, 3)
    first, second = np.empty((*shape, 3)), np.empty((*shape, 3, 3))
    for joint, factors in enumerate(single):
        for a in range(3):
            once = [spins[i] @ f if i == a else f for i, f in enumerate(factors)]
            first[joint, a] = np.linalg.multi_dot(once)
            for b in range(3):
                twice = [spins[i] @ f if i == b else f for i, f in enumerate(once)]
                second[joint, a, b] = np.linalg.multi_dot(twice)
    return np.stack([np.linalg.multi_dot(factors) for factors in single]), first, second


@dataclass(frozen=True)
class Relaxation:
    """Path: a spring in extension whose rest angle creeps after the angle, step by step."""

    name: ClassVar[str] = "relaxation"
    kind: ClassVar[EffectKind] = EffectKind.PATH
    per_joint: ClassVar[bool] = True
    n_states: ClassVar[int] = 1
    parameters: ClassVar[tuple[Parameter, ...]] = (
        number("spring", "N m/rad", 0.1, 1e3, 25.0, logarithmic=True),
        number("time", "s", 0.01, 1e4, 3.0, logarithmic=True),
    )

    def respond_on_path(
        self, q: Array, parameters: Array, state: Array, seconds: float, carried: Array
    ) -> JointResponse:
        load, tangent = np.zeros_like(q), np.zeros((*q.shape, 6))
        load[:, EXTENSION] = parameters[:, 0] * (q[:, EXTENSION] - state[:, 0])
        tangent[:, EXTENSION, EXTENSION] = parameters[:, 0]
        return JointResponse(load, tangent)

    def by_parameter_on_path(
        self, q: Array, parameters: Array, state: Array, seconds: float, carried: Array
    ) -> Array:
        derivative = np.zeros((*q.shape, 2))
        derivative[:, EXTENSION, 0] = q[:, EXTENSION] - state[:, 0]
        return derivative

    def by_state(
        self, q: Array, parameters: Array, state: Array, seconds: float, carried: Array
    ) -> Array:
        derivative = np.zeros((*q.shape, 1))
        derivative[:, EXTENSION, 0] = -parameters[:, 0]
        return derivative

    def advance(
        self, q: Array, parameters: Array, state: Array, seconds: float, carried: Array
    ) -> Advance:
        time = parameters[:, 1]
        kept, away = np.exp(-seconds / time), q[:, EXTENSION] - state[:, 0]
        by_coordinate, by_parameter = np.zeros((len(q), 1, 6)), np.zeros((len(q), 1, 2))
        by_coordinate[:, 0, EXTENSION] = 1.0 - kept
        by_parameter[:, 0, 1] = -kept * seconds / time**2 * away
        return Advance(
            state + ((1.0 - kept) * away)[:, None], by_coordinate, by_parameter, kept[:, None, None]
        )


@dataclass(frozen=True)
class MarkerError:
    """Measurement: a gain and a fixed error of the reported extension."""

    per_joint: bool = True
    name: ClassVar[str] = "marker_error"
    kind: ClassVar[EffectKind] = EffectKind.MEASUREMENT
    parameters: ClassVar[tuple[Parameter, ...]] = (
        number("gain", "1", 0.5, 2.0, 1.0),
        number("bias", "rad", -0.2, 0.2, 0.0, prior_scale=0.02),
    )

    def observe(self, q: Array, parameters: Array) -> Observation:
        seen, by_coordinate = q.copy(), np.tile(np.eye(6), (len(q), 1, 1))
        seen[:, EXTENSION] = parameters[:, 0] * q[:, EXTENSION] + parameters[:, 1]
        by_coordinate[:, EXTENSION, EXTENSION] = parameters[:, 0]
        return Observation(seen, by_coordinate)

    def by_parameter(self, q: Array, parameters: Array) -> Array:
        derivative = np.zeros((*q.shape, 2))
        derivative[:, EXTENSION, 0] = q[:, EXTENSION]
        derivative[:, EXTENSION, 1] = 1.0
        return derivative


def scoped(effect: Effect, joints: tuple[int, ...], *rows: tuple[float, ...]) -> ScopedEffect:
    """An effect on these joints, with one row of values for all, rows as given, or its defaults."""
    count = len(joints) if effect.per_joint else 1
    given = rows or (tuple(parameter.default for parameter in effect.parameters),)
    values = np.array(given * (count // len(given)), dtype=float)
    return ScopedEffect(effect, joints, values)


SPRINGS = ((1.1e5, 3.3e5, 0.9e5, 41.0, 34.0, 77.0), (0.8e5, 2.9e5, 1.2e5, 36.0, 45.0, 88.0))
CENTRE = np.array([0.012, 0.02, 0.003])
POINTS = ((0.01, 0.04, 0.002), (0.015, 0.08, -0.003), (0.01, 0.13, 0.004))


def bushing(n: int) -> ScopedEffect:
    """Springs of two different strengths in turn."""
    rows = [SPRINGS[joint % 2] for joint in range(n)]
    return scoped(create("linear_bushing"), tuple(range(n)), *rows)


def spine(n: int = 3, gravity: bool = True, effects: tuple[ScopedEffect, ...] = ()) -> SpineModel:
    """A spine of n tilted joints 36 mm apart under skew gravity, on springs and more effects."""
    tilts = np.array([[0.2, -0.1, 0.15], [-0.1, 0.2, -0.05], [0.1, 0.05, -0.2]])
    frames = tuple(
        Pose(rotation_zxy(*tilts[j % 3]), np.array([0.004 * j, 0.036 * j, -0.003 * j]))
        for j in range(n)
    )
    bodies = tuple(
        Body(f"L{n - j}", 0.8, frames[j].origin + CENTRE, np.diag([3e-4, 4e-4, 5e-4]))
        for j in range(n)
    )
    return SpineModel(
        specimen="tilted",
        joints=tuple(f"L{n - j}L{n - j + 1}" for j in range(n)),
        frames=frames,
        bodies=bodies,
        gravity=np.array([1.0, -9.6, 1.5]) if gravity else np.zeros(3),
        damping=np.tile([200.0] * 3 + [1.0] * 3, (n, 1)),
        effects=(bushing(n), *effects),
    )


def loaded(model: SpineModel, steps: int = 3, test: str = "all ways") -> LoadCase:
    """Moment and force on the top, and a force below it, that grow, fall and take 2 s a step."""
    top, low = model.n_joints - 1, max(model.n_joints - 2, 0)
    upper, lower = model.bodies[top].com + np.array([0.0, 0.02, 0.01]), model.bodies[low].com
    sizes = [(0.6, 1.0, 0.3)[step % 3] for step in range(steps)]
    return LoadCase(
        test,
        1,
        tuple(
            LoadStep(
                step,
                (
                    Wrench(top, upper, size * np.array([9.0, -25.0, 6.0]), NOWHERE),
                    Wrench(top, upper, NOWHERE, size * np.array([2.0, -2.5, 3.5])),
                    Wrench(low, lower, size * np.array([-5.0, -15.0, 8.0]), NOWHERE),
                ),
                2.0 * (step + 1),
            )
            for step, size in enumerate(sizes)
        ),
    )


def slope(function: Callable[[float], Array], step: float) -> Array:
    """Derivative at zero by a central difference of fourth order."""
    near, far = function(step) - function(-step), function(2 * step) - function(-2 * step)
    return (8.0 * near - far) / (12.0 * step)


def massless() -> SpineModel:
    """A weightless joint under a body without mass: it stands, and cannot move in time."""
    model = spine(1, gravity=False)
    body = replace(model.bodies[0], mass=0.0, inertia=np.zeros((3, 3)))
    return replace(model, bodies=(body,))


def top_heavy() -> SpineModel:
    """A joint that 60 kg a hand above it tip over."""
    model = spine(1)
    above = model.frames[0].origin + np.array([0.002, 0.1, 0.0])
    return replace(model, bodies=(replace(model.bodies[0], mass=60.0, com=above),))


def solved_poses(model: SpineModel, case: LoadCase) -> Array:
    """(T, J, 6) of a model in a case, by the engine of record."""
    solved = follow(System(Chain(model), model, case))
    return np.stack([step.equilibrium.q.reshape(-1, 6) for step in solved])
