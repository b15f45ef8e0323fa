"""Many tests of many models solved in lockstep: a stack of runs, its poses, readings, derivatives.

A run is one model in one test. Steps of a run without memory stand side by side; where laws
remember, all runs go from step to step together. What cannot be proven stable here goes to the
engine of record, and so does a model with an effect that takes no stack.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dpotrf

from spinepipe.effects import EffectKind
from spinepipe.effects.contract import Array, Indices, straight_over
from spinepipe.model import LoadCase, RefusedModel, SpineModel
from spinepipe.statics.batched.dynamics import tangents_of
from spinepipe.statics.batched.effects import Bound, PathStates
from spinepipe.statics.batched.equilibrium import (
    Before,
    Increment,
    certify,
    continue_in_parts,
    newton,
    stands,
)
from spinepipe.statics.batched.forward_kinematics import forward_kinematics
from spinepipe.statics.batched.lanes import Acting, Effects, ranges
from spinepipe.statics.batched.loads import (
    Chains,
    Loads,
    chains_of,
    durations,
    part,
    scale_loads,
    supports_of,
    with_dead_loads,
    wrenches_of,
)
from spinepipe.statics.equilibrium import NOT_POSITIVE, PAST_CRITICAL, ROUNDING, SPACING
from spinepipe.statics.path import follow
from spinepipe.statics.system import System
from spinepipe.status import Status
from spinepipe.world import Chain

Flags = NDArray[np.bool_]
Run = tuple[int, LoadCase]
"""A model's number, and a test of it."""

NO_WAY = "no stable equilibrium on the way from the neutral pose"

CHUNK = 80_000
"""Numbers in the tangents that are worked on together: they should stay in a core's cache."""


@dataclass(frozen=True, eq=False)
class StepPoses:
    """Where the steps of all runs end; a lane is a step of a run.

    Attributes
    ----------
    q : (L, J, 6) m and rad; NaN where there is no equilibrium.
    status : (L,) `Status`. messages : why not, or a warning, by lane.
    by_engine : (R,) whether the engine of record solved the run.
    """

    q: Array
    status: NDArray[np.str_]
    messages: Mapping[int, str]
    by_engine: Flags

    @property
    def trouble(self) -> tuple[int, str] | None:
        """The first lane without an equilibrium and why, or None."""
        bad = np.flatnonzero(np.isnan(self.q[:, 0, 0]))
        return (int(bad[0]), self.messages[int(bad[0])]) if len(bad) else None


@dataclass(frozen=True, eq=False)
class Stack:
    """Runs of models with equally many joints.

    Attributes
    ----------
    model, case : by number, what the engine of record is given of a model and of a run.
    chains : their numbers. listed, loads : of every lane, without and with load effects.
    run, first : (L,) run of each lane, (R + 1,) lanes before each run.
    seconds : (L,) duration of each step.
    released : (L,) steps in which a force is other than it was, and not only more of the same.
    spacing : (R,) rad, how often along a step the tangent is looked at.
    remembers, alone : (R,) runs with laws that have a state, and those for the engine.
    """

    model: Callable[[int], SpineModel]
    case: Callable[[int], LoadCase]
    chains: Chains
    effects: Effects
    listed: Loads
    loads: Loads
    run: Indices
    first: Indices
    seconds: Array
    released: Flags
    spacing: Array
    remembers: Flags
    alone: Flags

    @classmethod
    def of(cls, models: Sequence[SpineModel], runs: Sequence[Run]) -> "Stack":
        """Runs of models; ValueError where these differ in their number of joints."""
        if len({model.n_joints for model in models}) != 1:
            raise ValueError("models of a stack have equally many joints")
        cases = {id(case): case for _, case in runs}  # models share them: each is read once
        of_case = np.array([len(case.steps) for case in cases.values()], dtype=np.int64)
        first = dict(zip(cases, np.cumsum(of_case) - of_case, strict=True))
        steps = np.array([len(case.steps) for _, case in runs], dtype=np.int64)
        lanes = ranges(np.array([first[id(case)] for _, case in runs], dtype=np.int64), steps)
        chain = np.repeat(np.array([number for number, _ in runs], dtype=np.int64), steps)
        every = [step for case in cases.values() for step in case.steps]
        supports = supports_of(every, models[0].n_joints)
        own = Loads(np.zeros(len(every), dtype=np.int64), *wrenches_of(every), supports)
        listed = part(own, lanes)._replace(chain=chain)
        seconds = np.concatenate([np.zeros(0), *map(durations, cases.values())])[lanes]
        return cls.made(
            tuple(models).__getitem__,
            [case for _, case in runs].__getitem__,
            chains_of(models),
            Effects.of(models, [(number, case.test) for number, case in runs]),
            listed,
            steps,
            seconds,
        )

    @classmethod
    def made(
        cls,
        model: Callable[[int], SpineModel],
        case: Callable[[int], LoadCase],
        chains: Chains,
        effects: Effects,
        listed: Loads,
        steps: Indices,
        seconds: Array,
    ) -> "Stack":
        """Runs of chains; ``steps`` (R,) of each run, and how long each takes, ``seconds`` (L,)."""
        run = np.repeat(np.arange(len(steps)), steps)
        paths = [law for law in effects.laws if law.effect.kind is EffectKind.PATH]
        # rad: places of a step are looked at as often as any law or geometry effect asks for
        spacing = np.full(len(steps), SPACING)
        for one in (*effects.laws, *effects.geometry):
            spacing[one.acts] = np.minimum(spacing[one.acts], straight_over(one.effect))
        return cls(
            model,
            case,
            chains,
            effects,
            listed,
            with_dead_loads(effects.dead, chains, listed, run),
            run,
            np.concatenate([[0], np.cumsum(steps)]),
            seconds,
            _released(listed, chains, run, bool(effects.dead)),
            spacing,
            _runs_with(paths, len(steps)),
            _runs_with(effects.others, len(steps)),
        )

    @property
    def joints(self) -> int:
        """J, of every model."""
        return self.chains.origins.shape[1]

    def with_models(self, models: Sequence[SpineModel]) -> "Stack":
        """The same with other values of the models' effects."""
        effects = self.effects.with_models(models)
        loads = with_dead_loads(effects.dead, self.chains, self.listed, self.run)
        return replace(self, model=tuple(models).__getitem__, effects=effects, loads=loads)

    def solve(self, guess: Array | None = None, why: bool = True) -> StepPoses:
        """Equilibria of all lanes.

        Parameters
        ----------
        guess : (L, J, 6) poses near by; runs without them, or NaN, start from the neutral pose.
        why : whether the engine of record is asked about runs without memory that have none here.
        """
        # from poses near by first, then what is left from the neutral pose, step by step
        q = np.full((len(self.run), self.joints, 6), np.nan)
        open_ones, at_once = ~self.alone, np.zeros(len(q), dtype=bool)
        if guess is not None:
            near = open_ones & ~np.isnan(guess[self.first[:-1], 0, 0])
            for runs in self.chunks(np.flatnonzero(near & ~self.remembers)):
                open_ones[runs] = ~self._solve_at_once(runs, guess, q)
            for runs in self.chunks(np.flatnonzero(near & self.remembers), stepwise=True):
                open_ones[runs] = ~self._solve_step_by_step(runs, guess, q, at_once)
        for runs in self.chunks(np.flatnonzero(open_ones), stepwise=True):
            open_ones[runs] = ~self._solve_step_by_step(runs, None, q, at_once)
        status = np.full(len(self.run), Status.CONVERGED.value, dtype="U20")
        messages = self.past_critical(q, at_once) if why else {}
        by_engine = self.alone | (open_ones & (self.remembers | why))
        for number in np.flatnonzero(by_engine).tolist():
            self._solve_by_engine(number, q, status, messages)
        for number in np.flatnonzero(open_ones & ~by_engine).tolist():
            lanes = range(self.first[number], self.first[number + 1])
            status[lanes] = Status.UNSTABLE.value
            messages |= dict.fromkeys(lanes, NO_WAY)
        return StepPoses(q, status, messages, by_engine)

    def past_critical(self, q: Array, at_once: Flags) -> dict[int, str]:
        """By lane with a pose q (L, J, 6) whose load would move the neutral pose away.

        It is certified not to be so where one step brings there from the neutral pose, and in later
        steps under the same forces.
        """
        bodies, points, forces = self.loads.bodies, self.loads.points, self.loads.forces
        first = self.first[self.run]
        at_once = at_once[first] & (bodies == bodies[first]).all(axis=1)
        at_once &= (points == points[first]).all(axis=(1, 2))
        at_once &= (forces == forces[first]).all(axis=(1, 2))
        weight = np.abs(self.chains.gravity).sum(axis=1)[self.loads.chain]
        pressed = np.abs(self.loads.forces).sum(axis=(1, 2)) + weight > 0.0
        found: dict[int, str] = {}
        less = 1.0 - ROUNDING
        chains = self.chains._replace(gravity=less * self.chains.gravity)
        for runs in self.chunks(np.arange(len(self.remembers))):
            lanes = self.lanes(runs)
            lanes = lanes[pressed[lanes] & ~at_once[lanes] & ~np.isnan(q[lanes, 0, 0])]
            if not len(lanes):
                continue
            # a hair less than the load: at the critical load itself rounding would decide
            share = np.full(len(lanes), less)
            loads = scale_loads(self.loads, lanes, share)
            neutral = loads.supports.on(np.zeros_like(q[lanes]))
            bound = self.bound(lanes, self.initial_states(), share)
            stood = stands(chains, loads, neutral, bound.joint_forces(neutral).tangent)
            found |= dict.fromkeys(lanes[~stood].tolist(), PAST_CRITICAL)
        return found

    def warnings(self, q: Array) -> dict[int, str]:
        """By lane at a stable pose q (L, J, 6), what the engine of record would warn of.

        Only for runs without memory.
        """
        lanes = np.flatnonzero(~np.isnan(q[:, 0, 0]))
        held = self.bound(lanes, self.initial_states()).joint_forces(q[lanes])
        tangents = tangents_of(
            forward_kinematics(self.chains, part(self.loads, lanes), q[lanes], held.tangent)
        )
        found = {}
        for lane, tangent in zip(lanes.tolist(), tangents, strict=True):
            both = tangent + tangent.T
            if self.loads.supports.there:
                free = ~self.loads.supports.fixed[lane].ravel()
                both = both[free][:, free]
            _, refused = dpotrf(both, lower=True)
            if refused:
                found[lane] = NOT_POSITIVE
        return found

    def chunks(self, runs: Indices, stepwise: bool = False) -> Iterator[Indices]:
        """Runs in portions that are worked on together: all their steps, or a step at a time."""
        if not len(runs):
            return
        widths = np.ones(len(runs)) if stepwise else self.first[runs + 1] - self.first[runs]
        size = max(1, CHUNK // (36 * self.joints))
        yield from np.split(runs, np.flatnonzero(np.diff(np.cumsum(widths) // size)) + 1)

    def lanes(self, runs: Indices) -> Indices:
        """All lanes of some runs, run by run."""
        return ranges(self.first[runs], self.first[runs + 1] - self.first[runs])

    def _solve_at_once(self, runs: Indices, guess: Array, q: Array) -> Flags:
        """Enter the poses of runs without memory, all steps together; which runs are solved."""
        lanes, states = self.lanes(runs), self.initial_states()
        found, good = self._solve_certified(lanes, states, guess[lanes], None)
        whole: Flags = np.logical_and.reduceat(good, np.searchsorted(self.run[lanes], runs))
        there = np.repeat(whole, np.diff(self.first)[runs])
        q[lanes[there]] = found[there]
        return whole

    def _solve_step_by_step(
        self, runs: Indices, guess: Array | None, q: Array, at_once: Flags
    ) -> Flags:
        """Enter the poses of runs whose steps follow each other; which runs are solved.

        And which lanes (L,) a single step brings there from the neutral pose.
        """
        good = np.ones(len(runs), dtype=bool)
        last = np.zeros((len(self.remembers), *q.shape[1:]))
        states = self.initial_states()
        for live, lanes in self.steps(runs):
            going = good[live]
            live, lanes = live[going], lanes[going]
            if not len(lanes):
                break
            origin = last[runs[live]]
            near = None if guess is None else guess[lanes]
            found, arrived = self._solve_certified(lanes, states, near, origin)
            at_once[lanes] = arrived & (self.first[runs[live]] == lanes)
            lost = np.flatnonzero(~arrived)
            if len(lost):
                found[lost], arrived[lost] = self._continued(lanes[lost], origin[lost], states)
            good[live] = arrived
            q[lanes], last[runs[live]] = found, found
            if self.remembers[runs].any():
                bound = self.bound(lanes, states)
                self.remember(states, bound, bound.states_after(found))
        q[self.lanes(runs[~good])] = np.nan
        return good

    def steps(self, runs: Indices) -> Iterator[tuple[Indices, Indices]]:
        """Step by step: which of the runs have it, and the lanes of these."""
        steps = np.diff(self.first)[runs]
        for number in range(int(steps.max(initial=0))):
            live = np.flatnonzero(steps > number)
            yield live, self.first[runs[live]] + number

    def portions(self, runs: Flags) -> Iterator[Indices]:
        """Lanes of some of the runs (R,), all steps of those without memory, others step by step.

        In this order states may be advanced.
        """
        for some in self.chunks(np.flatnonzero(runs & ~self.remembers)):
            yield self.lanes(some)
        for some in self.chunks(np.flatnonzero(runs & self.remembers), stepwise=True):
            for _, lanes in self.steps(some):
                yield lanes

    def walked(self, q: Array) -> Iterator[tuple[Indices, Bound]]:
        """Lanes with a pose q (L, J, 6), in portions, with what acts and what that remembers."""
        good, states = ~np.isnan(q[:, 0, 0]), self.initial_states()
        for lanes in self.portions(np.ones(len(self.remembers), dtype=bool)):
            there = lanes[good[lanes]]
            bound = self.bound(there, states)
            yield there, bound
            if bound.states.of:
                self.remember(states, bound, bound.states_after(q[there]))

    def initial_states(self, *unknowns: int) -> dict[int, Array]:
        """States of all path laws before the first step, zero; or their derivatives."""
        return {
            number: np.zeros((len(law.joint), law.effect.n_states, *unknowns))  # type: ignore[attr-defined]
            for number, law in enumerate(self.effects.laws)
            if law.effect.kind is EffectKind.PATH
        }

    @staticmethod
    def remember(states: dict[int, Array], bound: Bound, after: Mapping[int, Array]) -> None:
        """Enter the states of path laws, or their derivatives, after a step of some lanes."""
        for number, state in after.items():
            states[number][bound.places[number]] = state

    def bound(self, lanes: Indices, states: PathStates, share: Array | None = None) -> Bound:
        """Laws and geometry at work on some lanes; ``share`` (N,) of loads across joints."""
        chain = self.loads.chain[lanes]
        return Bound(
            self.effects,
            self.chains.neutral,
            (chain, self.run[lanes], self.seconds[lanes]),
            states,
            np.ones(len(lanes)) if share is None else share,
        )

    def _solve_certified(
        self, lanes: Indices, states: PathStates, guess: Array | None, origin: Array | None
    ) -> tuple[Array, Flags]:
        """Poses (N, J, 6) of lanes, and which are certified to be where the loads lead.

        Parameters
        ----------
        guess : (N, J, 6) where Newton starts. origin : (N, J, 6) poses of the steps before. One of
            them may be missing: Newton starts at the origin, or all steps are among the lanes.
        """

        def laws(some: Indices) -> Bound:
            return self.bound(lanes[some], states)

        loads, start = part(self.loads, lanes), origin if guess is None else guess
        assert start is not None
        results = newton(self.chains, loads, laws, start)
        if origin is None:
            follows = self.first[self.run[lanes]] < lanes
            origin = np.where(follows[:, None, None], np.roll(results.q, 1, axis=0), 0.0)
        before = Before(self.chains, self.loads, np.where(self.released[lanes], lanes - 1, -1))
        spacing = self.spacing[self.run[lanes]]
        given = (spacing, origin, results, guess is not None)
        return results.q, certify(self.chains, before, loads, laws, *given)

    def _continued(self, lanes: Indices, start: Array, states: PathStates) -> tuple[Array, Flags]:
        """The same from the steps before, the load in fractions."""
        first = self.first[self.run[lanes]] == lanes
        before = part(self.loads, np.where(first, lanes, lanes - 1))
        for numbers in (before.forces, before.moments, before.supports.values):
            if len(numbers):
                numbers[first] = 0.0
        increment = Increment(before, part(self.loads, lanes), first)

        def laws(some: Indices, share: Array) -> Bound:
            return self.bound(lanes[some], states, share)

        return continue_in_parts(self.chains, increment, laws, self.spacing[self.run[lanes]], start)

    def _solve_by_engine(
        self, number: int, q: Array, status: NDArray[np.str_], messages: dict[int, str]
    ) -> None:
        """Enter what the engine of record says of one run."""
        lanes = np.arange(self.first[number], self.first[number + 1])
        try:
            model = self.model(int(self.loads.chain[lanes[0]]))
            solved = follow(System(Chain(model), model, self.case(number)))
        except RefusedModel as refusal:
            status[lanes] = Status.REFUSED.value
            messages |= dict.fromkeys(lanes.tolist(), str(refusal))
            return
        for lane, step in zip(lanes.tolist(), solved, strict=True):
            status[lane] = step.equilibrium.status.value
            if step.equilibrium.message:
                messages[lane] = step.equilibrium.message
            if step.usable:
                q[lane] = step.equilibrium.q.reshape(-1, 6)


def _released(listed: Loads, chains: Chains, run: Indices, dead: bool) -> Flags:
    """(L,) see `Stack`; ``dead``: whether effects add loads that stay."""
    found = np.zeros(len(run), dtype=bool)
    lanes = np.flatnonzero(run[1:] == run[:-1]) + 1
    now, last = listed.forces[lanes], listed.forces[lanes - 1]
    same_places = (listed.bodies[lanes] == listed.bodies[lanes - 1]).all(axis=1)
    same_places &= (listed.points[lanes] == listed.points[lanes - 1]).all(axis=(1, 2))
    # more of the same: the last forces are a share, from none to all, of those now
    squares = np.sum(now * now, axis=(1, 2))
    share = np.sum(now * last, axis=(1, 2)) / np.where(squares > 0.0, squares, 1.0)
    more = (last == share[:, None, None] * now).all(axis=(1, 2)) & (share >= 0.0) & (share <= 1.0)
    if dead or chains.gravity.any():  # beside loads that stay, only the same are no others
        more &= share == 1.0
    found[lanes] = ~(same_places & (more | ~last.any(axis=(1, 2))))
    return found


def _runs_with(effects: Sequence[Acting], count: int) -> Flags:
    """(R,) which runs have any of these effects."""
    found = np.zeros(count, dtype=bool)
    for one in effects:
        found |= one.acts
    return found
