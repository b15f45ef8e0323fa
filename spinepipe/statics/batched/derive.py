"""What is read of a stack at solved poses, and exact derivatives of poses and readings by unknowns.

An instrument reads a coordinate; where a rig fixes that and its load is measured, it reads the
reaction instead, in the coordinate's own unit (`Support.read_as`).

Unknowns are a model's own, `FreeParameter`; arrays have as many columns as the model with most of
them, and the columns that a model does not have stay zero.
"""

from collections.abc import Sequence

import numpy as np

from spinepipe.effects import MeasurementEffect
from spinepipe.effects.contract import Array, Indices, MeasurementBeside, MeasurementContext
from spinepipe.statics.batched.effects import Bound, Slopes
from spinepipe.statics.batched.elimination import NONE, Changes, missing, solve_rates
from spinepipe.statics.batched.forward_kinematics import KinematicsAndLoads, forward_kinematics
from spinepipe.statics.batched.lanes import Acting
from spinepipe.statics.batched.loads import Flags, dead_loads_by, part
from spinepipe.statics.batched.stack import Stack
from spinepipe.statics.measurement_model import (
    Instrument,
    measurement_context,
    read,
    read_by,
    reading_derivative,
    share_passed,
)
from spinepipe.statics.path import follow, reaction
from spinepipe.statics.sensitivity import FreeParameter, by_parameters
from spinepipe.statics.sensitivity import reactions_by as engine_reactions_by
from spinepipe.statics.system import System
from spinepipe.world import Chain

Unknowns = Sequence[Sequence[FreeParameter]]
"""For each model of a stack, what moves."""


def answered(stack: Stack, q: Array, sources: Array, observed: bool = False) -> Array:
    """(L, J, 6, m) how what is read at poses q (L, J, 6) answers loads on the axes (L, J, 6, m).

    States of laws that remember are as at the start.

    Parameters
    ----------
    observed : read through the instruments' effects; without it nothing is between.
    """
    found, held = np.zeros(sources.shape), np.zeros(sources.shape)
    for runs in stack.chunks(np.arange(len(stack.remembers))):
        lanes = stack.lanes(runs)
        bound = stack.bound(lanes, stack.initial_states())
        tangents = bound.joint_forces(q[lanes]).tangent
        seen = forward_kinematics(stack.chains, part(stack.loads, lanes), q[lanes], tangents)
        found[lanes], _ = solve_rates(seen, Changes(sources[lanes]))
        if stack.loads.supports.there:
            held[lanes] = missing(seen, found[lanes], Changes(sources[lanes]))
    if observed:
        found = _observed(stack, q, found, None)
    if stack.loads.supports.there:
        found = _with_reactions(stack, found, held)
    return found


def path_responses(stack: Stack, q: Array, own: Array, shift: Array | None) -> Array:
    """(L, J, 6, m) how what is read at poses q answers loads, laws that remember led along.

    Parameters
    ----------
    own : (L, J, 6, m) what the joints would hold besides. shift : (L, J, 6, m) by how much what
        the laws see would move, its load in ``own`` already; None for nothing.
    """
    found, held, still = np.zeros(own.shape), np.zeros(own.shape), Slopes.none(own.shape[3])
    states, states_by_x = stack.initial_states(), stack.initial_states(still.m)
    for runs in stack.chunks(np.arange(len(stack.remembers)), stepwise=True):
        for _, lanes in stack.steps(runs):
            bound, there = stack.bound(lanes, states), q[lanes]
            before = bound.states_of(states_by_x)
            loads = own[lanes] + bound.joint_forces_by(there, still, before)
            seen = forward_kinematics(
                stack.chains, part(stack.loads, lanes), there, bound.joint_forces(there).tangent
            )
            dq = solve_rates(seen, Changes(-loads))[0]
            found[lanes] = dq
            if stack.loads.supports.there:
                held[lanes] = missing(seen, dq, Changes(-loads))
            moved = None if shift is None else shift[lanes]
            stack.remember(
                states_by_x, bound, bound.states_after_by(there, dq, still, before, moved)
            )
            stack.remember(states, bound, bound.states_after(there))
    found = _observed(stack, q, found, None)
    if stack.loads.supports.there:
        found = _with_reactions(stack, found, held)
    return found


def _with_reactions(stack: Stack, read: Array, reactions: Array) -> Array:
    """What is read on all lanes (L, J, 6, ...), with reactions where they are read."""
    read_as = stack.loads.supports.read_as
    read_as = read_as.reshape(read_as.shape + (1,) * (read.ndim - 3))
    return np.where(read_as > 0.0, read_as * reactions, read)


def _supported(stack: Stack) -> Flags:
    """(R,) runs of the stack whose rigs fix anything."""
    if not stack.loads.supports.there:
        return np.zeros(len(stack.alone), dtype=bool)
    fixed = np.logical_or.reduceat(stack.loads.supports.fixed.any(axis=(1, 2)), stack.first[:-1])
    found: Flags = fixed & ~stack.alone
    return found


def reactions(stack: Stack, q: Array) -> Array:
    """(L, J, 6) N and N m of rigs on what they fix at poses q (L, J, 6), zero elsewhere.

    Positive in the direction of the coordinate.
    """
    found, states = np.zeros(q.shape), stack.initial_states()
    for lanes in stack.portions(_supported(stack)):
        bound = stack.bound(lanes, states)
        held = bound.joint_forces(q[lanes])
        seen = forward_kinematics(stack.chains, part(stack.loads, lanes), q[lanes], held.tangent)
        found[lanes] = np.where(seen.fixed, held.load - seen.applied, 0.0)
        stack.remember(states, bound, bound.states_after(q[lanes]))
    for run in np.flatnonzero(stack.alone).tolist():
        system = _system(stack, run)
        for lane, step in enumerate(follow(system), int(stack.first[run])):
            found[lane] = reaction(system, step).reshape(stack.joints, 6)
    return found


def reactions_by(stack: Stack, q: Array, dq: Array, unknowns: Unknowns) -> Array:
    """(L, J, 6, m) derivative of the reactions, from that of the poses (L, J, 6, m)."""
    moved = _DerivedEffects(stack, unknowns)
    found = np.zeros(dq.shape)
    states, states_by_x = stack.initial_states(), stack.initial_states(moved.m)
    for lanes in stack.portions(_supported(stack)):
        bound = stack.bound(lanes, states)
        slopes = moved.on(bound)
        before = bound.states_of(states_by_x)
        found[lanes] = moved.reactions(lanes, bound, (q[lanes], dq[lanes]), slopes, before)
        after = bound.states_after_by(q[lanes], dq[lanes], slopes, before)
        stack.remember(states_by_x, bound, after)
        stack.remember(states, bound, bound.states_after(q[lanes]))
    for run in np.flatnonzero(stack.alone).tolist():
        system, free = _system(stack, run), unknowns[int(stack.loads.chain[stack.first[run]])]
        every = engine_reactions_by(system, follow(system), free)
        for lane, by_x in enumerate(every, int(stack.first[run])):
            found[lane, ..., : len(free)] = by_x.reshape(stack.joints, 6, len(free))
    return found


def _system(stack: Stack, run: int) -> System:
    """A run as the engine of record takes it."""
    model = stack.model(int(stack.loads.chain[stack.first[run]]))
    return System(Chain(model), model, stack.case(run))


def poses_by(stack: Stack, q: Array, unknowns: Unknowns) -> Array:
    """(L, J, 6, m) derivative of all poses q (L, J, 6) by the unknowns."""
    moved = _DerivedEffects(stack, unknowns)
    found = np.zeros((*q.shape, moved.m))
    states, states_by_x = stack.initial_states(), stack.initial_states(moved.m)
    for lanes in stack.portions(~stack.alone):
        bound = stack.bound(lanes, states)
        slopes = moved.on(bound)
        before = bound.states_of(states_by_x)
        dq = found[lanes] = moved.poses(lanes, bound, q[lanes], slopes, before)
        if before:  # some of these remember: so do the derivatives of what they do
            stack.remember(states_by_x, bound, bound.states_after_by(q[lanes], dq, slopes, before))
            stack.remember(states, bound, bound.states_after(q[lanes]))
    for run in np.flatnonzero(stack.alone).tolist():
        system, free = _system(stack, run), unknowns[int(stack.loads.chain[stack.first[run]])]
        every = by_parameters(system, follow(system), free)
        for lane, dq in enumerate(every, int(stack.first[run])):
            found[lane, ..., : len(free)] = dq.reshape(stack.joints, 6, len(free))
    return found


class _DerivedEffects:
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
        sources = np.negative(bound.joint_forces_by(q, slopes, states_by_x))
        seen = forward_kinematics(
            stack.chains, part(stack.loads, lanes), q, bound.joint_forces(q).tangent
        )
        return solve_rates(seen, Changes(sources, self._pushes(lanes, seen)))[0]

    def _pushes(self, lanes: Indices, seen: KinematicsAndLoads) -> Array:
        """(N, J, 6, m) derivative of the wrench on each vertebra, or none."""
        if not self.dead:
            return NONE
        stack = self.stack
        run, listed = stack.run[lanes], part(stack.listed, lanes)
        return dead_loads_by(self.dead, stack.chains, listed, run, seen.turned, seen.shifted)

    def reactions(
        self,
        lanes: Indices,
        bound: Bound,
        there: tuple[Array, Array],
        slopes: Slopes,
        states_by_x: dict[int, Array],
    ) -> Array:
        """(N, J, 6, m) derivative of the reactions of some lanes.

        Parameters
        ----------
        there : poses q (N, J, 6) and their derivatives (N, J, 6, m).
        """
        stack, (q, dq) = self.stack, there
        seen = forward_kinematics(
            stack.chains, part(stack.loads, lanes), q, bound.joint_forces(q).tangent
        )
        own = bound.joint_forces_by(q, slopes, states_by_x)
        by_x = missing(seen, dq, Changes(-own, self._pushes(lanes, seen)))
        found: Array = np.where(seen.fixed[..., None], by_x, 0.0)
        return found


def _instrument(one: Acting) -> Instrument:
    assert isinstance(one.effect, MeasurementEffect | MeasurementBeside)
    return one.effect


def _beside(
    stack: Stack, effect: Instrument, seen: Array, flat: Indices
) -> MeasurementContext | None:
    """What stands beside joints at places ``flat`` of all (L J, 6), if the effect asks for it."""
    if not isinstance(effect, MeasurementBeside):
        return None
    runs = range(len(stack.remembers))
    along = np.concatenate([share_passed(stack.case(run)) for run in runs])
    every = measurement_context(seen.reshape(-1, stack.joints, 6), along)
    return MeasurementContext(every.above[flat], every.below[flat], every.passed[flat])


def _neighbours(stack: Stack, by_x: Array, flat: Indices) -> tuple[Array, Array]:
    """Derivatives (K, 6, m) of the joints above and below, from those of all (L J, 6, m)."""
    every = by_x.reshape(len(by_x) // stack.joints, stack.joints, *by_x.shape[1:])
    above, below = np.zeros(every.shape), np.zeros(every.shape)
    above[:, :-1], below[:, 1:] = every[:, 1:], every[:, :-1]
    return above.reshape(by_x.shape)[flat], below.reshape(by_x.shape)[flat]


def readings(stack: Stack, q: Array) -> Array:
    """(L, J, 6) what is read at poses q (L, J, 6)."""
    seen = instrument_readings(stack, q)
    if not stack.loads.supports.there:
        return seen
    return _with_reactions(stack, seen, reactions(stack, q))


def instrument_readings(stack: Stack, q: Array) -> Array:
    """(L, J, 6) what the instruments make of poses q (L, J, 6)."""
    seen = q.reshape(-1, 6).copy()
    for one in stack.effects.measurement:
        places, lanes = one.on(stack.run)
        flat = stack.joints * lanes + one.joint[places]
        effect = _instrument(one)
        around = _beside(stack, effect, seen, flat)
        seen[flat] = read(effect, seen[flat], one.values[one.row[places]], around).q
    return seen.reshape(q.shape)


def instrument_readings_by(stack: Stack, seen: Array, effect: Instrument, values: Array) -> Array:
    """(S, L J, 6, P) how one more instrument, that is off, would change what is reported.

    Parameters
    ----------
    seen : (L, J, 6) what those there report. values : (S, P) at S points of its shapes.
    """
    joints, every = seen.reshape(-1, 6), np.arange(seen.size // 6)
    around = _beside(stack, effect, joints, every)
    found = [
        read_by(effect, joints, np.tile(one, (len(every), 1)), around)
        for one in values  # few: instruments have no shapes, or one
    ]
    if stack.loads.supports.there:  # a load that is measured is none that instruments report
        moves = stack.loads.supports.read_as.reshape(-1, 6, 1) <= 0.0
        found = [one * moves for one in found]
    return np.stack(found)


def readings_by(stack: Stack, q: Array, dq: Array, unknowns: Unknowns) -> Array:
    """(L, J, 6, m) derivative of what is reported, from that of the poses (L, J, 6, m)."""
    by_x = _observed(stack, q, dq, unknowns)
    if not stack.loads.supports.there:
        return by_x
    return _with_reactions(stack, by_x, reactions_by(stack, q, dq, unknowns))


def _observed(stack: Stack, q: Array, dq: Array, unknowns: Unknowns | None) -> Array:
    """(L, J, 6, m) what instruments make of the motion dq (L, J, 6, m) of poses q (L, J, 6).

    ``unknowns`` that move the instruments' own effects besides; None for none.
    """
    if not stack.effects.measurement:
        return dq
    seen, by_x = q.reshape(-1, 6).copy(), dq.reshape(q.size // 6, *dq.shape[2:]).copy()
    for one in stack.effects.measurement:
        places, lanes = one.on(stack.run)
        flat, rows = stack.joints * lanes + one.joint[places], one.row[places]
        effect = _instrument(one)
        around = _beside(stack, effect, seen, flat)
        observed = read(effect, seen[flat], one.values[rows], around)
        neighbours = None if around is None else _neighbours(stack, by_x, flat)
        by_x[flat] = reading_derivative(observed, by_x[flat], neighbours)
        if unknowns is not None:
            slope = one.by_unknowns(unknowns, dq.shape[3])[rows]
            by_x[flat] += read_by(effect, seen[flat], one.values[rows], around) @ slope
        seen[flat] = observed.q
    return by_x.reshape(dq.shape)
