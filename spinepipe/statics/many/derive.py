"""Derivatives of a stack's poses and readings by unknowns, exact, at solved poses.

Unknowns are a model's own, `FreeParameter`; arrays have as many columns as the model with most of
them, and the columns that a model does not have stay zero.
"""

from collections.abc import Sequence

import numpy as np

from spinepipe.effects import MeasurementEffect
from spinepipe.effects.contract import Array, Indices
from spinepipe.statics.many.bound import Bound, Slopes
from spinepipe.statics.many.dead import pushes
from spinepipe.statics.many.elimination import Changes, answers
from spinepipe.statics.many.lanes import Acting
from spinepipe.statics.many.stack import Stack
from spinepipe.statics.many.survey import part, survey
from spinepipe.statics.path import follow
from spinepipe.statics.sensitivity import FreeParameter, by_parameters
from spinepipe.statics.system import System
from spinepipe.world import Chain

Unknowns = Sequence[Sequence[FreeParameter]]
"""For each model of a stack, what moves."""


def answered(stack: Stack, q: Array, sources: Array) -> Array:
    """(L, J, 6, m) how poses q (L, J, 6) answer loads on the joints' axes (L, J, 6, m).

    States of laws that remember are as at the start.
    """
    found = np.zeros(sources.shape)
    for runs in stack.chunks(np.arange(len(stack.remembers))):
        lanes = stack.lanes(runs)
        bound = stack.bound(lanes, stack.initial_states())
        tangents = bound.held(q[lanes]).tangent
        seen = survey(stack.chains, part(stack.loads, lanes), q[lanes], tangents)
        found[lanes], _ = answers(seen, Changes(sources[lanes]))
    return found


def poses_by(stack: Stack, q: Array, unknowns: Unknowns) -> Array:
    """(L, J, 6, m) derivative of all poses q (L, J, 6) by the unknowns."""
    moved = _Moved(stack, unknowns)
    found = np.zeros((*q.shape, moved.m))
    states, states_by_x = stack.initial_states(), stack.initial_states(moved.m)
    for runs in stack.chunks(np.flatnonzero(~stack.remembers & ~stack.alone)):
        lanes = stack.lanes(runs)
        bound = stack.bound(lanes, states)
        before = {n: by_x[bound.places[n]] for n, by_x in states_by_x.items() if n in bound.places}
        found[lanes] = moved.poses(lanes, bound, q[lanes], moved.on(bound), before)
    for runs in stack.chunks(np.flatnonzero(stack.remembers & ~stack.alone), stepwise=True):
        _step_by_step(stack, runs, q, moved, found)
    for run in np.flatnonzero(stack.alone).tolist():
        _by_engine(stack, run, unknowns, found)
    return found


def _by_engine(stack: Stack, run: int, unknowns: Unknowns, found: Array) -> None:
    """Enter the derivatives of a run with an effect that takes no stack."""
    owner = int(stack.loads.chain[stack.first[run]])
    model, free = stack.model(owner), unknowns[owner]
    system = System(Chain(model), model, stack.case(run))
    by_x = by_parameters(system, follow(system), free)
    for lane, dq in enumerate(by_x, int(stack.first[run])):
        found[lane, ..., : len(free)] = dq.reshape(stack.joints, 6, len(free))


def _step_by_step(stack: Stack, runs: Indices, q: Array, moved: "_Moved", found: Array) -> None:
    """Enter the derivatives of runs with laws that remember, step by step."""
    states, states_by_x = stack.initial_states(), stack.initial_states(moved.m)
    for _, lanes in stack.steps(runs):
        bound = stack.bound(lanes, states)
        slopes = moved.on(bound)
        before = {n: by_x[bound.places[n]] for n, by_x in states_by_x.items() if n in bound.places}
        dq = moved.poses(lanes, bound, q[lanes], slopes, before)
        found[lanes] = dq
        stack.remember(states_by_x, bound, bound.after_by(q[lanes], dq, slopes, before))
        stack.remember(states, bound, bound.after(q[lanes]))


class _Moved:
    """The effects of a stack with the derivatives of their values by m unknowns."""

    def __init__(self, stack: Stack, unknowns: Unknowns) -> None:
        self.stack = stack
        self.m = max((len(free) for free in unknowns), default=0)
        effects = stack.effects
        self.laws, self.geometry, self.cables, self.dead = (
            [(one, one.by_unknowns(unknowns, self.m)) for one in group]
            for group in (effects.laws, effects.geometry, effects.cables, effects.dead)
        )

    def on(self, bound: Bound) -> Slopes:
        """Derivatives of the values at each place on some lanes."""
        every = (
            (self.laws, bound.places),
            (self.geometry, bound.geometry_places),
            (self.cables, {n: cable.places for n, cable in bound.cables.items()}),
        )
        laws, geometry, cables = (
            {n: group[n][1][group[n][0].row[at]] for n, at in places.items()}
            for group, places in every
        )
        return Slopes(laws, geometry, cables, self.m)

    def poses(
        self,
        lanes: Indices,
        bound: Bound,
        q: Array,
        slopes: Slopes,
        states_by_x: dict[int, Array],
    ) -> Array:
        """(N, J, 6, m) derivative of the poses of some lanes."""
        stack = self.stack
        sources = np.negative(bound.held_by(q, slopes, states_by_x))
        seen = survey(stack.chains, part(stack.loads, lanes), q, bound.held(q).tangent)
        if not self.dead:
            return answers(seen, Changes(sources))[0]
        run, listed = stack.run[lanes], part(stack.listed, lanes)
        pushed = pushes(self.dead, stack.chains, listed, run, seen.turned, seen.shifted)
        return answers(seen, Changes(sources, pushed))[0]


def observing(one: Acting) -> MeasurementEffect:
    """The effect on what is measured."""
    assert isinstance(one.effect, MeasurementEffect)
    return one.effect


def readings(stack: Stack, q: Array) -> Array:
    """(L, J, 6) what the instruments report at poses q (L, J, 6)."""
    seen = q.reshape(-1, 6).copy()
    for one in stack.effects.measurement:
        places, lanes = one.on(stack.run)
        flat = stack.joints * lanes + one.joint[places]
        seen[flat] = observing(one).observe(seen[flat], one.values[one.row[places]]).q
    return seen.reshape(q.shape)


def readings_by(stack: Stack, q: Array, dq: Array, unknowns: Unknowns) -> Array:
    """(L, J, 6, m) derivative of what is reported, from that of the poses (L, J, 6, m)."""
    seen, by_x = q.reshape(-1, 6).copy(), dq.reshape(q.size // 6, *dq.shape[2:]).copy()
    for one in stack.effects.measurement:
        places, lanes = one.on(stack.run)
        flat, rows = stack.joints * lanes + one.joint[places], one.row[places]
        observed = observing(one).observe(seen[flat], one.values[rows])
        own = observing(one).by_parameter(seen[flat], one.values[rows])
        slope = one.by_unknowns(unknowns, dq.shape[3])[rows]
        by_x[flat] = observed.by_coordinate @ by_x[flat] + own @ slope
        seen[flat] = observed.q
    return by_x.reshape(dq.shape)
