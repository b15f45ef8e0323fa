"""Where the loads bring a model, what is read there, and how that depends on the unknowns.

All load steps are solved together; those that settle, with the runs that tell the derivatives.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.model import LoadCase, SpineModel
from spinepipe.statics import Course, FreeParameter, System, follow, retrace, with_parameters
from spinepipe.statics.batched import Stack, poses_by, readings, readings_by, settle
from spinepipe.statics.transient import STEP
from spinepipe.world import Chain


@dataclass(frozen=True)
class CaseResiduals:
    """What is seen of every case at one point.

    Attributes
    ----------
    poses : (T, n) of every case. readings : (T, J, 6) likewise.
    by_x : (T, J, 6, m) derivatives of the readings by the unknowns.
    """

    poses: tuple[Array, ...]
    readings: tuple[Array, ...]
    by_x: tuple[Array, ...]


class AtRest:
    """Stable equilibria; each search starts from its last point, corrected to first order."""

    def __init__(
        self,
        model: SpineModel,
        cases: Sequence[LoadCase],
        free: Sequence[FreeParameter],
        reach: Array,
    ) -> None:
        """``reach`` (m,): how far from a point first order is trusted."""
        self._model, self._free, self._reach = model, free, reach
        self._cases = tuple(cases)
        self._stacks = _Stacks(self._cases)
        self._last: dict[int, tuple[Array, Array, Array]] = {}
        self._first: dict[int, tuple[Array, Array, Array]] = {}
        self._led: dict[tuple[int, bytes], tuple[SpineModel, tuple[Array, Array, Array] | None]]
        self._led = {}

    def forget(self) -> None:
        """Start the next points from the neutral pose."""
        self._last.clear()
        self._first.clear()

    def start_at(self, model: SpineModel, x: Array) -> None:
        """Begin a model's next searches from the poses to which the loads lead it at x (m,)."""
        self.lead([(model, x)])
        self._last.clear()
        _, first = self._led[id(model), x.tobytes()]
        if first is None:
            self._first.pop(id(model), None)
        else:
            self._first[id(model)] = first

    def lead(self, points: Sequence[tuple[SpineModel, Array]]) -> None:
        """Solve the poses to which the loads lead models at x (m,), all at once, for `start_at`."""
        new = [(model, x) for model, x in points if (id(model), x.tobytes()) not in self._led]
        if not new:
            return
        self.forget()
        self.solve([(number, x) for number, (_, x) in enumerate(new)], [model for model, _ in new])
        self._led = {
            (id(model), x.tobytes()): (model, self._last.get(number))
            for number, (model, x) in enumerate(new)
        }
        self.forget()

    def solve(
        self, points: Sequence[tuple[int, Array]], models: Sequence[SpineModel] = ()
    ) -> list[CaseResiduals | str]:
        """What is seen with the unknowns at x (m,), or why there is nothing.

        Parameters
        ----------
        points : x of each of some searches, with the search's number.
        models : of each point, where they are not all of this one; they differ from it in numbers.
        """
        models = models or [self._model] * len(points)
        there = _at_points(models, self._free, points)
        stack, unknowns = self._stacks.of(models, there), [self._free] * len(points)
        found = stack.solve(self._guesses(points, models, stack), why=False)
        q = np.where(np.isnan(found.q), 0.0, found.q)
        dq = poses_by(stack, q, unknowns)
        seen, by_x = readings(stack, q), readings_by(stack, q, dq, unknowns)
        ends, each = stack.first[1 : len(self._cases)], len(q) // len(points)
        result: list[CaseResiduals | str] = []
        for at, (number, x) in enumerate(points):
            own = slice(each * at, each * (at + 1))
            bad = np.flatnonzero(np.isnan(found.q[own, 0, 0]))
            if len(bad):
                result.append(found.messages[own.start + int(bad[0])])
                continue
            self._last[number] = (x.copy(), q[own], dq[own])
            poses = q[own].reshape(each, -1)
            parts = (tuple(np.split(one, ends)) for one in (poses, seen[own], by_x[own]))
            result.append(CaseResiduals(*parts))
        return result

    def _guesses(
        self, points: Sequence[tuple[int, Array]], models: Sequence[SpineModel], stack: Stack
    ) -> Array | None:
        """(L, J, 6) poses to start from, to first order; NaN for searches that have none."""
        if not self._first and not self._last:
            return None
        nothing = np.full((len(stack.run) // len(points), stack.joints, 6), np.nan)
        guesses = []
        for model, (number, x) in zip(models, points, strict=True):
            # the pose at its last point and how it goes on from there, no further than trusted
            known = self._last.get(number, self._first.get(id(model)))
            if known is None:
                guesses.append(nothing)
                continue
            there, q, dq = known
            guesses.append(q + dq @ np.clip(x - there, -self._reach, self._reach))
        return np.concatenate(guesses)

    def record(self, x: Array, model: SpineModel | None = None) -> tuple[Array, ...] | str:
        """(T, n) poses of every case by the engine of record, or why not.

        Both engines go the same way from the neutral pose (`tests.validation engines`): where the
        stack gets through, the engine starts each step from where that has come.
        """
        model = model or self._model
        self.start_at(model, x)
        there, first = with_parameters(model, self._free, x), self._first.get(id(model))
        if first is None:
            return by_record(there, self._cases)
        ends = np.cumsum([len(case.steps) for case in self._cases[:-1]])
        return by_record(there, self._cases, np.split(first[1], ends))


def _at_points(
    models: Sequence[SpineModel], free: Sequence[FreeParameter], points: Sequence[tuple[int, Array]]
) -> list[SpineModel]:
    """Each model with its unknowns where its search's point (number, x) has them."""
    each = zip(models, points, strict=True)
    return [with_parameters(model, free, x) for model, (_, x) in each]


class _Stacks:
    """Stacks of models in the same cases, kept for when the same are moved again."""

    def __init__(self, cases: Sequence[LoadCase]) -> None:
        self._cases = cases
        self._known: dict[tuple[int, ...], tuple[Sequence[SpineModel], Stack]] = {}

    def of(self, models: Sequence[SpineModel], there: Sequence[SpineModel]) -> Stack:
        """The stack of these models where their unknowns are now, each in all cases."""
        key = tuple(map(id, models))
        if key not in self._known:
            runs = [(number, case) for number in range(len(models)) for case in self._cases]
            self._known[key] = models, Stack.of(models, runs)
        return self._known[key][1].with_models(there)


class Settling:
    """Poses a time after each load step came on, from rest in the neutral pose.

    Derivatives are differences over the same steps in time, see `spinepipe.statics.transient`.
    """

    def __init__(
        self,
        model: SpineModel,
        cases: Sequence[LoadCase],
        free: Sequence[FreeParameter],
        course: Course,
    ) -> None:
        """``course``: how each step's load comes on and when the pose is read."""
        self._model, self._free, self._course = model, free, course
        alone = [steps_alone(case) for case in cases]
        known = {key: step for steps in alone for key, step in steps}  # cycles repeat their loads
        places = {key: number for number, key in enumerate(known)}
        self._cases = list(known.values())
        self._lanes = [np.array([places[key] for key, _ in steps]) for steps in alone]
        self._stacks = _Stacks(self._cases)
        self._sizes: dict[tuple[int, bytes], list[tuple[float, ...]]] = {}

    def forget(self) -> None:
        """Nothing: each run starts from the neutral pose."""

    def start_at(self, model: SpineModel, x: Array) -> None:
        """Nothing: each run starts from the neutral pose."""

    def lead(self, points: Sequence[tuple[SpineModel, Array]]) -> None:
        """Nothing: each run starts from the neutral pose."""

    def solve(
        self, points: Sequence[tuple[int, Array]], models: Sequence[SpineModel] = ()
    ) -> list[CaseResiduals | str]:
        """What is seen at the ends of settling runs; parameters as of `AtRest.solve`."""
        models = models or [self._model] * len(points)
        bases = _at_points(models, self._free, points)
        steps = STEP * np.eye(len(self._free))
        runs = [
            one
            for base in bases
            for one in (base, *(with_parameters(base, self._free, s) for s in steps))
        ]
        count, each = len(self._cases), 1 + len(steps)
        stack = self._stacks.of([model for model in models for _ in range(each)], runs)
        leads = np.arange(len(runs) * count).reshape(len(points), each, count)
        leads[:] = leads[:, :1]  # those that tell the derivatives take the steps of the point's own
        ends = settle(stack, self._course, leads.ravel())
        every = ends.q.reshape(len(points), each, count, -1, 6)
        result: list[CaseResiduals | str] = []
        for base, model, (_, x), lanes, q in zip(bases, models, points, leads, every, strict=True):
            trouble = min(
                set(range(lanes[0, 0], lanes[0, 0] + each * count)) & set(ends.trouble),
                default=None,
            )
            self._sizes[id(model), x.tobytes()] = [ends.sizes[lane] for lane in lanes[0].tolist()]
            result.append(self._seen(base, model, q) if trouble is None else ends.trouble[trouble])
        return result

    def _seen(self, base: SpineModel, model: SpineModel, every: Array) -> CaseResiduals:
        """What is seen of a model, from its ends (1 + m, cases, J, 6) and the changed ones."""
        # internal numerical differentiation: forward differences over the same steps of time
        dq = np.moveaxis((every[1:] - every[0]) / STEP, 0, -1)
        there = self._stacks.of([model], [base])
        seen, by_x = readings(there, every[0]), readings_by(there, every[0], dq, [self._free])
        poses = every[0].reshape(len(self._cases), -1)
        return CaseResiduals(*(tuple(one[at] for at in self._lanes) for one in (poses, seen, by_x)))

    def record(self, x: Array, model: SpineModel | None = None) -> tuple[Array, ...] | str:
        """The poses (T, n) of every case by the engine of record, over the steps of `solve`."""
        model = model or self._model
        there, sizes = with_parameters(model, self._free, x), self._sizes[id(model), x.tobytes()]
        chain = Chain(there)
        ends = []
        for case, taken in zip(self._cases, sizes, strict=True):
            system = System(chain, there, case)
            program = self._course.program(system.slots.loading(case.steps[0].wrenches))
            end = retrace(system, program, taken)
            if end is None:
                return "over the same steps of time the run is lost"
            ends.append(end)
        return tuple(np.stack([ends[number] for number in at]) for at in self._lanes)


def steps_alone(case: LoadCase) -> list[tuple[bytes, LoadCase]]:
    """Each load step as a case of its own, and what tells it from others."""
    found = []
    for step in case.steps:
        loads = [[w.body, *w.point, *w.force, *w.moment] for w in step.wrenches]
        key = case.test.encode() + np.array(loads, dtype=float).tobytes()
        found.append((key, replace(case, steps=(step,))))
    return found


class Disagreement(RuntimeError):
    """The stack and the engine of record do not put a model in the same pose."""


AGREEMENT = 1e-9
"""Of the largest translation and rotation of a model: what the two engines may differ by."""

LEAST_MOTION = np.array([1e-4] * 3 + [1e-3] * 3)
"""m and rad: smaller motion is held against this."""


def by_record(
    model: SpineModel, cases: Sequence[LoadCase], near: Sequence[Array] | None = None
) -> tuple[Array, ...] | str:
    """(T, n) poses of every case by the engine of record, or why not.

    Parameters
    ----------
    near : (T, J, 6) of every case, where each step may start; None: from the neutral pose.
    """
    chain = Chain(model)
    found = []
    for number, case in enumerate(cases):
        guesses = None if near is None else [q.ravel() for q in near[number]]
        solved = follow(System(chain, model, case), guesses)
        for step in solved:
            if not step.usable:
                return step.equilibrium.message
        found.append(np.stack([step.equilibrium.q for step in solved]))
    return tuple(found)


def on_record(
    model: SpineModel, cases: Sequence[LoadCase], poses: Sequence[Array], same: float
) -> tuple[Array, ...] | None:
    """The poses (T, n) of a stack as the engine of record has them, from the neutral pose.

    See `compare_with_record`.
    """
    return compare_with_record(by_record(model, cases), model, cases, poses, same)


def compare_with_record(
    record: tuple[Array, ...] | str,
    model: SpineModel,
    cases: Sequence[LoadCase],
    poses: Sequence[Array],
    same: float,
) -> tuple[Array, ...] | None:
    """The record's poses (T, n) of every case, held against those of a stack.

    Parameters
    ----------
    same : m and rad; None is returned where a pose differs by more: the loads lead elsewhere.

    Raises
    ------
    Disagreement
        For a smaller difference that is no rounding error.
    """
    if isinstance(record, str):
        return None
    for case, one, other in zip(cases, poses, record, strict=True):
        apart = np.abs(one - other).reshape(len(one), -1, 6)
        if apart.max(initial=0.0) > same:
            return None
        moved_by = np.abs(other).reshape(apart.shape).max(axis=(0, 1))
        largest = np.repeat([moved_by[:3].max(), moved_by[3:].max()], 3)
        allowed = AGREEMENT * np.maximum(largest, LEAST_MOTION)
        if (apart > allowed).any():
            step, joint, at = np.unravel_index(np.argmax(apart / allowed), apart.shape)
            place = 6 * joint + at
            raise Disagreement(
                f"{model.specimen}, test {case.test}, step {case.steps[step].step}, joint "
                f"{model.joints[joint]}: {one[step, place]:.17g} by the stack, "
                f"{other[step, place]:.17g} by the engine of record"
            )
    return record
