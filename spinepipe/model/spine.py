"""The spine model: rigid vertebrae on six-coordinate joints, with named effects. SI throughout."""

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from spinepipe.effects import Effect, Wrench
from spinepipe.effects.contract import Array, Neutral
from spinepipe.frames import Pose
from spinepipe.units import without_step_0

MOST_JOINTS = 20
"""Beyond 120 coordinates PyBullet's answers are silently wrong."""

STRAIGHT = 1e-6
"""Share of a load by which files round it."""

ORTHONORMAL = 1e-9
ROUNDING = 1e-9


class RefusedModel(ValueError):
    """A model that no solver should be given; the message says what and why."""


@dataclass(frozen=True)
class Body:
    """A vertebra with what is fixed to it.

    Attributes
    ----------
    mass : kg. com : (3,) centre of mass, m; inertia : (3, 3) about it, kg m2; both in ground axes
    at the neutral pose.
    """

    name: str
    mass: float
    com: Array
    inertia: Array

    def __post_init__(self) -> None:
        problem = _impossible(self)
        if problem:
            raise RefusedModel(f"body {self.name}: {problem}")


@dataclass(frozen=True)
class ScopedEffect:
    """An effect at work: on which joints, with which parameter values.

    Attributes
    ----------
    joints : indices into the model's joints.
    values : (R, P) one row per joint in scope, or one row when the effect is not per joint.
    tests : names of the tests in scope; ``("*",)`` for all.
    """

    effect: Effect
    joints: tuple[int, ...]
    values: Array
    tests: tuple[str, ...] = ("*",)

    def in_scope(self, test: str) -> bool:
        """Whether the effect acts in this test."""
        return self.tests == ("*",) or test in self.tests

    def with_values(self, values: Array) -> "ScopedEffect":
        """The same effect with other parameter values (R, P)."""
        return replace(self, values=values)


@dataclass(frozen=True)
class Support:
    """A joint coordinate that a rig fixes during a load step, with whatever load that takes.

    Attributes
    ----------
    joint, coordinate : places, the coordinate in the order of `spinepipe.units.COORDINATES`.
    value : m or rad, where it is fixed.
    read_as : m per N or rad per N m by which the rig's load on it counts as a reading; None where
        that load was not measured. See `spinepipe.statics.batched.derive`.
    """

    joint: int
    coordinate: int
    value: float
    read_as: float | None = None

    @property
    def place(self) -> int:
        """Its number among the coordinates of a model."""
        return 6 * self.joint + self.coordinate


@dataclass(frozen=True)
class LoadStep:
    """Loads of one step of a test; ``time`` in s where the test records it.

    ``supports`` : joint coordinates that are fixed, the same ones in all steps of a test.
    """

    step: int
    wrenches: tuple[Wrench, ...]
    time: float | None = None
    supports: tuple[Support, ...] = ()


@dataclass(frozen=True)
class LoadCase:
    """One cycle of one test: its load steps in the order in which they were applied."""

    test: str
    cycle: int
    steps: tuple[LoadStep, ...]

    def __post_init__(self) -> None:
        for step in self.steps:
            for load in step.wrenches:
                if not np.isfinite([*load.point, *load.force, *load.moment]).all():
                    raise RefusedModel(f"test {self.test}, step {step.step}: a load is not finite")
            places = [support.place for support in step.supports]
            if places != self.fixed or len(set(places)) < len(places):
                told = "coordinates are fixed once each, the same ones in all steps"
                raise RefusedModel(f"test {self.test}, step {step.step}: {told}")
            if not np.isfinite([support.value for support in step.supports]).all():
                told = "a coordinate is fixed at no finite value"
                raise RefusedModel(f"test {self.test}, step {step.step}: {told}")

    @property
    def fixed(self) -> list[int]:
        """Places of the coordinates that a rig fixes, among the n of a model."""
        return [support.place for step in self.steps[:1] for support in step.supports]

    def leading_to(self, wanted: Sequence[int], pressed: bool) -> list[int]:
        """Places of the wanted steps, and of those before them at which the load turns.

        From step to step the load goes in proportion.

        Parameters
        ----------
        wanted : their places. pressed : whether weight, or a load that no step lists, comes on
            first.
        """
        loads, kept = self._loads(pressed), set(wanted)
        last, found = np.zeros(loads.shape[1]), []
        for place in range(max(kept) + 1):
            if place in kept or not _straight(last, loads[place], loads[place + 1]):
                found.append(place)
                last = loads[place]
        return found

    def _loads(self, pressed: bool) -> Array:
        """(T, n) all that a step states, N, N m, m and rad, and whether anything else presses."""
        rows: list[dict[tuple[object, ...], float]] = []
        for step in self.steps:
            row: dict[tuple[object, ...], float] = {("pressed",): float(pressed)}
            for wrench in step.wrenches:
                numbers = (*wrench.force.tolist(), *wrench.moment.tolist())
                for at, number in enumerate(numbers):
                    key = (wrench.body, *wrench.point.tolist(), at)
                    row[key] = row.get(key, 0.0) + number
            row |= {(one.joint, one.coordinate): one.value for one in step.supports}
            rows.append(row)
        keys = dict.fromkeys(key for row in rows for key in row)
        return np.array([[row.get(key, 0.0) for key in keys] for row in rows])


def _straight(start: Array, middle: Array, end: Array) -> bool:
    """Whether a load lies on the straight way between two others."""
    way, done = end - start, middle - start
    share = float(np.clip(done @ way / max(float(way @ way), 1e-300), 0.0, 1.0))
    off = np.abs(done - share * way).max(initial=0.0)
    return bool(off <= STRAIGHT * max(np.abs(way).max(initial=0.0), np.abs(done).max(initial=0.0)))


@dataclass(frozen=True)
class MeasuredCase:
    """One cycle of one test with its measured motion.

    Attributes
    ----------
    measured : (T, J, 6) m and rad by load step, NaN where not measured.
    zeroed : whether the step-0 coordinates were subtracted from the measurement.
    """

    case: LoadCase
    measured: Array
    zeroed: bool = False

    @cached_property
    def readings(self) -> Array:
        """(T, J, 6) what was read: the zeros that zeroing makes of step 0 are no readings."""
        return without_step_0(self.measured, self.zeroed)


@dataclass(frozen=True)
class SpineModel:
    """A serial chain, caudal to cranial; the lowest vertebra is ground.

    Attributes
    ----------
    joints : names, e.g. ``("L3L4", "L2L3")``; joint j carries ``bodies[j]``.
    frames : joint frames in ground, neutral pose.
    gravity : (3,) m/s2 in ground.
    damping : (J, 6) N s/m and N m s/rad, resisting each coordinate's rate.
    """

    specimen: str
    joints: tuple[str, ...]
    frames: tuple[Pose, ...]
    bodies: tuple[Body, ...]
    gravity: Array
    damping: Array
    effects: tuple[ScopedEffect, ...]

    def __post_init__(self) -> None:
        problem = _problem(self)
        if problem:
            raise RefusedModel(f"{self.specimen}: {problem}")

    @cached_property
    def n_joints(self) -> int:
        """Number of joints J; the model has 6 J coordinates."""
        return len(self.joints)

    @cached_property
    def neutral(self) -> Neutral:
        """Where it is in its neutral pose."""
        return Neutral(
            np.array([frame.rotation for frame in self.frames]),
            np.array([frame.origin for frame in self.frames]),
            np.array([body.com for body in self.bodies]),
        )

    def with_effects(self, effects: tuple[ScopedEffect, ...]) -> "SpineModel":
        """The same geometry and bodies, which are not looked at again, with other effects."""
        other = copy(self)
        object.__setattr__(other, "effects", effects)
        problem = _effect_problem(other)
        if problem:
            raise RefusedModel(f"{self.specimen}: {problem}")
        return other


def _problem(model: SpineModel) -> str | None:
    """The first reason to refuse a model, or None."""
    n = len(model.joints)
    if not 1 <= n <= MOST_JOINTS:
        return f"{n} joints; 1 to {MOST_JOINTS} are allowed (PyBullet is wrong beyond)"
    if not len(model.frames) == len(model.bodies) == len(model.damping) == n:
        return "joints, frames, bodies and damping differ in number"
    if not np.isfinite(model.gravity).all():
        return "gravity is not finite"
    if not (np.isfinite(model.damping).all() and np.all(model.damping > 0.0)):
        return "damping must be positive: it decides what is stable"
    # frames
    rotations = np.array([frame.rotation for frame in model.frames])
    origins = np.array([frame.origin for frame in model.frames])
    unit = np.abs(rotations @ rotations.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2))
    proper = (unit < ORTHONORMAL) & (np.linalg.det(rotations) > 0.0)
    finite = np.isfinite(origins).all(axis=1) & np.isfinite(rotations).all(axis=(1, 2))
    for joint, is_finite, is_proper in zip(model.joints, finite, proper, strict=True):
        if not is_finite:
            return f"the frame of joint {joint} is not finite"
        if not is_proper:
            return f"the frame of joint {joint} is not a right-handed rotation"
    # bodies: weight without mass moves nothing
    for body in model.bodies:
        if body.mass == 0.0 and np.any(model.gravity):
            return f"body {body.name} has no mass, but gravity is on"
    return _effect_problem(model)


def _impossible(body: Body) -> str | None:
    """Why no body can have this mass and inertia, or None."""
    numbers = np.concatenate([[body.mass], body.com, body.inertia.ravel()])
    if not np.isfinite(numbers).all() or body.mass < 0.0:
        return "mass, centre and inertia must be finite, mass not negative"
    moments = np.linalg.eigvalsh(body.inertia)
    slack = ROUNDING * abs(moments[2])
    if np.abs(body.inertia - body.inertia.T).max() > slack:
        return "its inertia is not symmetric"
    if moments[0] < -slack or moments[2] > moments[0] + moments[1] + slack:
        return (
            "no body has this inertia; principal moments are not negative, "
            "and none is larger than the sum of the others"
        )
    return None


def _effect_problem(model: SpineModel) -> str | None:
    for scoped in model.effects:
        if not set(scoped.joints) <= set(range(len(model.joints))):
            return f"effect {scoped.effect.name}: joints {scoped.joints} are not all in the model"
        rows = len(scoped.joints) if scoped.effect.per_joint else 1
        declared = scoped.effect.parameters
        if scoped.values.shape != (rows, len(declared)):
            return f"effect {scoped.effect.name}: values must be {rows} x {len(declared)}"
        limits = np.array([(one.low, one.high) for one in declared]).reshape(-1, 2)
        outside = ~((scoped.values >= limits[:, 0]) & (scoped.values <= limits[:, 1]))
        if outside.any():
            at = int(np.flatnonzero(outside.any(axis=0))[0])
            parameter, found = declared[at], scoped.values[outside[:, at], at][0]
            return (
                f"effect {scoped.effect.name}: {parameter.name} is {found:.6g} "
                f"{parameter.unit}, allowed {parameter.low:.3g} to {parameter.high:.3g}"
            )
    return None
