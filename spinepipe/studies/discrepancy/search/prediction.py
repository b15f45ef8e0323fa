"""Specimens under models: their predicted readings and derivatives by unknowns, in one stack."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from spinepipe.calibration.solvers import on_record
from spinepipe.effects import EffectKind
from spinepipe.effects.contract import Array, Indices
from spinepipe.model import LoadCase, SpineModel
from spinepipe.statics import FreeParameter, with_parameters
from spinepipe.statics.batched import (
    Answering,
    Idle,
    Stack,
    StepPoses,
    answered,
    poses_by,
    readings,
    readings_by,
)
from spinepipe.units import COORDINATES, subtract_baseline

BUSHING = "linear_bushing"

SAME = 1e-7
"""m and rad by which a pose may differ when it is solved afresh from the neutral pose."""


class NoEquilibrium(RuntimeError):
    """A test has no stable pose under the model; the message says which and why."""


@dataclass(frozen=True)
class Predicted:
    """Predicted readings of each test, (T, J, 6), and their derivatives, (T, J, 6, m).

    ``poses`` : (T, n) that they are read at.
    """

    readings: tuple[Array, ...]
    by_x: tuple[Array, ...]
    poses: tuple[Array, ...]


@dataclass(frozen=True, eq=False)
class PredictedSpecimen:
    """A specimen's model, its tests, and what may move of the model."""

    model: SpineModel
    cases: Sequence[LoadCase]
    free: Sequence[FreeParameter]


class JointPrediction:
    """Specimens under a model each, solved again and again from near poses."""

    def __init__(
        self,
        subjects: Mapping[str, PredictedSpecimen],
        zeroed: bool,
        near: Mapping[str, Sequence[Array]] | None = None,
    ) -> None:
        """``near``: poses (T, n) of each test, by specimen, near which the first are looked for."""
        self.subjects, self.zeroed = dict(subjects), zeroed
        members = list(self.subjects.values())
        runs = [(number, case) for number, one in enumerate(members) for case in one.cases]
        self._runs = np.cumsum([0, *(len(one.cases) for one in members)])
        self._free = [one.free for one in members]
        self._stack = Stack.of([one.model for one in members], runs)
        self._last: tuple[Array, Array, Array] | None = None
        self._near: Array | None = None
        if near:
            every = np.concatenate([q for name in self.subjects for q in near[name]])
            self._near = every.reshape(len(every), -1, 6)

    def at(self, x: Mapping[str, Array]) -> dict[str, Predicted]:
        """Prediction of each with its unknowns moved by x (m,) from its model's values.

        Raises
        ------
        NoEquilibrium
            When a load step has no stable pose.
        """
        names = list(self.subjects)
        models = [self.model(name, x[name]) for name in names]
        stack = self._stack.with_models(models)
        every = self._padded([x[name] for name in names])
        found = stack.solve(self._guess(every), why=False)
        _must_stand(found, stack, models)
        q = found.q
        dq = poses_by(stack, q, self._free)
        self._last = (every, q, dq)
        seen, by_x = readings(stack, q), readings_by(stack, q, dq, self._free)
        predicted = {}
        for number, name in enumerate(names):
            # the stack has all steps of all tests one under the other: those of each test
            runs = range(self._runs[number], self._runs[number + 1])
            tests = [slice(stack.first[run], stack.first[run + 1]) for run in runs]
            own = by_x[..., : len(x[name])]
            predicted[name] = Predicted(
                tuple(subtract_baseline(seen[steps], self.zeroed) for steps in tests),
                tuple(subtract_baseline(own[steps], self.zeroed) for steps in tests),
                tuple(q[steps].reshape(len(q[steps]), -1) for steps in tests),
            )
        return predicted

    def model(self, name: str, x: Array) -> SpineModel:
        """The model of a specimen with its unknowns moved by x (m,)."""
        one = self.subjects[name]
        return with_parameters(one.model, one.free, x)

    def _padded(self, x: Sequence[Array]) -> Array:
        """(M, m) unknowns of each specimen, those that it does not have zero."""
        found = np.zeros((len(x), max((len(one) for one in x), default=0)))
        for row, one in zip(found, x, strict=True):
            row[: len(one)] = one
        return found

    def _guess(self, x: Array) -> Array | None:
        """(L, J, 6) poses to start from: one Euler step of a continuation from the last ones."""
        if self._last is None:
            return self._near
        there, q, dq = self._last
        change = (x - there)[self._stack.loads.chain]
        guess: Array = q + (dq @ change[:, None, :, None])[..., 0]
        return guess

    def leads_to(self, x: Mapping[str, Array], predicted: Mapping[str, Predicted]) -> bool:
        """Whether the loads lead to the same poses from the neutral one."""
        names = list(self.subjects)
        stack = self._stack.with_models([self.model(name, x[name]) for name in names])
        found = stack.solve(why=False)
        if found.trouble:
            return False
        there = np.concatenate([q for name in names for q in predicted[name].poses])
        return bool(np.abs(found.q.reshape(there.shape) - there).max() <= SAME)


def solve_on_record(model: SpineModel, cases: Sequence[LoadCase]) -> None:
    """Solve a specimen's tests by the engine of record beside the stack.

    Raises
    ------
    NoEquilibrium
        Where the engine of record finds none, or another.
    Disagreement
        For a small difference that is no rounding error.
    """
    solved = SolvedSpecimen(model, cases, zeroed=False)
    poses = [q.reshape(len(q), -1) for q in solved.poses]
    if on_record(model, cases, poses, SAME) is None:
        raise NoEquilibrium(f"{model.specimen}: the engine of record finds no such motion")


class Simulated:
    """One specimen's tests under one model."""

    def __init__(
        self,
        model: SpineModel,
        cases: Sequence[LoadCase],
        zeroed: bool,
        free: Sequence[FreeParameter],
    ) -> None:
        self._together = JointPrediction(
            {model.specimen: PredictedSpecimen(model, tuple(cases), free)}, zeroed
        )
        self._name = model.specimen

    def at(self, x: Array) -> Predicted:
        """Prediction with the unknowns moved by x (m,) from the model's values.

        Raises
        ------
        NoEquilibrium
            When a load step has no stable pose.
        """
        return self._together.at({self._name: x})[self._name]


class SolvedSpecimen:
    """A specimen's tests solved under one model, for derivatives by what it lacks."""

    def __init__(self, model: SpineModel, cases: Sequence[LoadCase], zeroed: bool) -> None:
        """Solve all tests.

        Raises
        ------
        NoEquilibrium
            When a load step has no stable pose.
        """
        self.model, self.cases, self.zeroed = model, tuple(cases), zeroed
        self._stack = Stack.of([model], [(0, case) for case in self.cases])
        found = self._stack.solve()
        _must_stand(found, self._stack, [model])
        self._q = found.q

    @property
    def poses(self) -> tuple[Array, ...]:
        """(T, J, 6) of each test."""
        return self._by_test(self._q)

    def by(self, full: SpineModel, free: Sequence[FreeParameter]) -> tuple[Array, ...]:
        """(T, J, 6, m) derivatives of each test's readings by unknowns of idle effects.

        Parameters
        ----------
        full : the solved model with further effects behind its own, all of them off.
        free : unknowns of ``full``.
        """
        stack = Stack.of([full], [(0, case) for case in self.cases])
        # an effect that is off changes no pose: derivatives are taken where the bare model stands
        if all(full.effects[one.effect].effect.kind is EffectKind.MEASUREMENT for one in free):
            dq = np.zeros((*self._q.shape, len(free)))  # instruments move no joint
        else:
            dq = poses_by(stack, self._q, [free])
        found = self._by_test(readings_by(stack, self._q, dq, [free]))
        return tuple(subtract_baseline(one, self.zeroed) for one in found)

    @cached_property
    def answering(self) -> Answering | None:
        """How the tests answer what is off; None where the engine of record solves any of them."""
        return Answering.of(self._stack, self._q)

    def by_strengths(self, idle: Sequence[Idle]) -> list[tuple[Array, ...]]:
        """(T, J, 6, J, S, P) derivatives of each test by each parameter of effects that are off.

        The second J: the joint whose parameter it is.
        """
        assert self.answering is not None
        lanes, joints, _ = self._q.shape
        found = []
        for by_strength in self.answering.by_strengths(idle):
            every = np.moveaxis(by_strength, 1, 2)  # the joint of the parameter behind that read
            every = every.reshape(lanes, joints, 6, joints, *every.shape[3:])
            tests = self._by_test(every)
            found.append(tuple(subtract_baseline(one, self.zeroed) for one in tests))
        return found

    def by_loads(self, loads: Sequence[Array], at: int) -> tuple[Array, ...]:
        """(T, J, 6, K x J) motion by each load (T, J, K) at each joint alone, loads first.

        ``at``: the coordinate on which the loads hold the joints besides their laws.
        """
        alone = []
        for one in loads:
            steps, joints, count = one.shape
            apart = np.zeros((steps, joints, 6, count, joints))
            every = np.arange(joints)
            apart[:, every, at, :, every] = one.swapaxes(0, 1)
            alone.append(apart.reshape(steps, joints, 6, count * joints))
        sources = np.negative(np.concatenate(alone))
        return self._by_test(answered(self._stack, self._q, sources))

    def _by_test(self, of_lanes: Array) -> tuple[Array, ...]:
        return tuple(np.split(of_lanes, self._stack.first[1:-1]))


def bushing_stiffness(model: SpineModel) -> Array:
    """(J, 6) N/m and N m/rad, of all linear bushings of each joint together."""
    total = np.zeros((model.n_joints, len(COORDINATES)))
    for scoped in model.effects:
        if scoped.effect.name == BUSHING:
            total[list(scoped.joints)] += scoped.values
    return total


def _must_stand(found: StepPoses, stack: Stack, models: Sequence[SpineModel]) -> None:
    """Refuse poses of which one is missing, with the first that is and why."""
    if found.trouble is None:
        return
    lane, why = found.trouble
    run: Indices = stack.run[lane]
    model, case = models[int(stack.loads.chain[lane])], stack.case(int(run))
    step = case.steps[lane - int(stack.first[run])]
    raise NoEquilibrium(f"{model.specimen}, test {case.test}, step {step.step}: {why}")
