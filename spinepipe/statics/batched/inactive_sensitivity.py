"""What laws, effects on geometry and instruments that are switched off would do to solved runs.

An idle law holds nothing, whatever its state, so that to first order only its own load grows with a
strength; one on geometry moves and turns what the laws hold. The chain answers these loads as it
answers any. Without memory its answers to unit loads on each axis serve all of them; laws that
remember are led through all loads at once, step by step. An instrument changes its own reading.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, TypeGuard, cast

import numpy as np

from spinepipe.effects import Effect, EffectKind
from spinepipe.effects.contract import Array, GeometryEffect, JointLaw, PathLaw
from spinepipe.statics.batched.derive import (
    answered,
    instrument_readings,
    instrument_readings_by,
    path_responses,
)
from spinepipe.statics.batched.stack import Stack
from spinepipe.statics.joint_forces import assemble_joint_forces
from spinepipe.statics.measurement_model import Instrument

Acting = JointLaw | PathLaw | GeometryEffect | Instrument


def acts_here(effect: Effect) -> TypeGuard[Acting]:
    """Whether what an effect that is off would do can be told without a model of its own."""
    return effect.kind is not EffectKind.LOAD


class Idle(NamedTuple):
    """An effect that is off, at S points of its shapes: values (S, P)."""

    effect: Acting
    values: Array


class _Held(NamedTuple):
    """What the laws see (L J, 6), the loads (L J, 6) and tangents (L J, 6, 6) that they hold there.

    ``first`` (L J, 6, 6): how that follows the joints' own coordinates; None where it is these.
    """

    q: Array
    load: Array
    tangent: Array
    first: Array | None

    def pulled(self, own: Array) -> Array:
        """(L J, 6, m) loads on the joints' own coordinates, from those on what the laws see."""
        return own if self.first is None else np.swapaxes(self.first, 1, 2) @ own


class _Own(NamedTuple):
    """Of each joint's own idle effect: loads (L, J, 6, m) that it would hold at fixed coordinates.

    ``shift`` (L, J, 6, m): by how much it would move what the laws see; None for laws.
    """

    load: Array
    shift: Array | None


@dataclass(frozen=True, eq=False)
class Answering:
    """Solved runs that may be asked what effects behind their own, all off, would do.

    Attributes
    ----------
    q : (L, J, 6) poses of all lanes.
    """

    stack: Stack
    q: Array

    @classmethod
    def of(cls, stack: Stack, q: Array) -> "Answering | None":
        """The runs at poses q, or None where any is solved by the engine of record."""
        return None if stack.alone.any() else cls(stack, q)

    def by_strengths(self, idle: Sequence[Idle]) -> list[Array]:
        """Derivative of all that is read, n = 6 J in each lane, by each parameter at each joint.

        Returns
        -------
        of each effect (L, J, n, S, P).
        """
        found: dict[int, Array] = {}
        loads: dict[int, _Own] = {}
        for number, one in enumerate(idle):
            if one.effect.kind is EffectKind.MEASUREMENT:
                found[number] = self._reported(cast(Instrument, one.effect), one.values)
            else:
                loads[number] = self._own(one)
        if loads and self.stack.remembers.any():
            found |= zip(loads, self._on_path(list(loads.values())), strict=True)
        else:
            found |= {number: self.to_unit_loads @ own.load for number, own in loads.items()}
        return [
            found[number].reshape(*found[number].shape[:3], *one.values.shape)
            for number, one in enumerate(idle)
        ]

    @cached_property
    def to_unit_loads(self) -> Array:
        """(L, J, n, 6) how all that is read answers a unit load that each joint holds besides."""
        lanes, joints, _ = self.q.shape
        n = 6 * joints
        unit = np.broadcast_to(-np.eye(n).reshape(joints, 6, n), (lanes, joints, 6, n))
        found = answered(self.stack, self.q, unit, observed=True).reshape(lanes, n, joints, 6)
        return np.ascontiguousarray(found.swapaxes(1, 2))

    def _reported(self, effect: Instrument, values: Array) -> Array:
        """(L, J, n, S P) what each joint's own instrument would change of what it reports."""
        own = instrument_readings_by(self.stack, self.instrument_readings, effect, values)
        of_joints = _shapes_last(own.reshape(-1, *own.shape[2:]), len(values))
        alone = _alone(of_joints.reshape(*self.q.shape, -1))
        lanes, joints, _ = self.q.shape
        by_joint = alone.reshape(lanes, 6 * joints, joints, -1)
        return np.moveaxis(by_joint, 2, 1)

    @cached_property
    def instrument_readings(self) -> Array:
        """(L, J, 6) what the instruments report."""
        return instrument_readings(self.stack, self.q)

    def _on_path(self, every: Sequence[_Own]) -> list[Array]:
        """(L, J, n, m) of each, where laws remember: all that is not zero, led through at once."""
        lanes, joints, _ = self.q.shape
        used = [np.flatnonzero(one.load.any(axis=(0, 1, 2))) for one in every]
        loads = np.concatenate(
            [_alone(one.load[..., some]) for one, some in zip(every, used, strict=True)], axis=-1
        )
        shift = None
        if any(one.shift is not None for one in every):
            shifts = (np.zeros(one.load.shape) if one.shift is None else one.shift for one in every)
            moved = [_alone(s[..., some]) for s, some in zip(shifts, used, strict=True)]
            shift = np.concatenate(moved, axis=-1)
        found = path_responses(self.stack, self.q, loads, shift).reshape(lanes, 6 * joints, -1)
        result = []
        ends = np.cumsum([joints * len(some) for some in used])[:-1]
        for one, some, part in zip(every, used, np.split(found, ends, axis=-1), strict=True):
            whole = np.zeros((lanes, joints, 6 * joints, one.load.shape[-1]))
            by_joint = part.reshape(lanes, 6 * joints, joints, len(some))
            whole[..., some] = np.moveaxis(by_joint, 2, 1)
            result.append(whole)
        return result

    @cached_property
    def held(self) -> _Held:
        """Loads and tangents where the laws of all lanes act."""
        joints, count = self.stack.joints, self.q.size // 6
        q, first = np.zeros((count, 6)), np.zeros((count, 6, 6))
        load, tangent = np.zeros((count, 6)), np.zeros((count, 6, 6))
        for lanes, bound in self.stack.walked(self.q):
            at = (joints * lanes[:, None] + np.arange(joints)).ravel()
            placed = bound.joint_kinematics(self.q[lanes])
            found = assemble_joint_forces(placed, bound.laws, bound.states, moved=False)
            q[at], load[at], tangent[at] = placed.q, found.load, found.tangent
            first[at] = placed.by_coordinate if bound.geometry else np.eye(6)
        return _Held(q, load, tangent, first if self.stack.effects.geometry else None)

    def _own(self, idle: Idle) -> _Own:
        """What each joint's own effect would do; m = S P, shapes first."""
        (effect, values), kind = idle, idle.effect.kind
        held, (points, count) = self.held, (len(values), self.q.size // 6)
        shape = (*self.q.shape, -1)
        if kind is EffectKind.PATH:
            own = self._by_step(cast(PathLaw, effect), values)
            return _Own(held.pulled(own).reshape(shape), None)
        q, every = np.tile(held.q, (points, 1)), np.repeat(values, count, axis=0)
        load = np.tile(held.load, (points, 1))
        if kind is EffectKind.GEOMETRY:
            moved = cast(GeometryEffect, effect).by_parameter(q, every)
            turned = (moved.by_coordinate * load[:, :, None, None]).sum(axis=1)
            shift = _shapes_last(moved.q, points)
            own = _shapes_last(turned, points) + held.tangent @ shift
            return _Own(held.pulled(own).reshape(shape), shift.reshape(shape))
        own = _shapes_last(cast(JointLaw, effect).by_parameter(q, every, load), points)
        return _Own(held.pulled(own).reshape(shape), None)

    def _by_step(self, law: PathLaw, values: Array) -> Array:
        """(L J, 6, S P) derivative of what a law that remembers holds, all its shapes at once."""
        (lanes, joints, _), (points, p) = self.q.shape, values.shape
        q, load = (one.reshape(lanes, 1, joints, 6) for one in (self.held.q, self.held.load))
        own = np.zeros((lanes, points, joints, 6, p))
        state = np.zeros((len(self.stack.remembers), points, joints, law.n_states))
        by_joint = np.repeat(values, joints, axis=0)
        for runs, at in self.stack.steps(np.arange(len(state))):
            here, carried = (np.repeat(one[at], points, axis=1).reshape(-1, 6) for one in (q, load))
            seconds = np.repeat(self.stack.seconds[at], points * joints)
            before = state[runs].reshape(len(here), -1)
            there = (here, np.tile(by_joint, (len(at), 1)), before, seconds, carried)
            own[at] = law.by_parameter_on_path(*there).reshape(own[at].shape)
            state[runs] = law.advance(*there).state.reshape(state[runs].shape)
        return own.transpose(0, 2, 3, 1, 4).reshape(lanes * joints, 6, points * p)


def _shapes_last(of_points: Array, points: int) -> Array:
    """(N, 6, S P) from (S N, 6, P)."""
    found = np.moveaxis(of_points.reshape(points, -1, *of_points.shape[1:]), 0, 2)
    return found.reshape(*found.shape[:2], -1)


def _alone(own: Array) -> Array:
    """(L, J, 6, J m) each joint's own columns (L, J, 6, m) apart, joints first."""
    lanes, joints, _, m = own.shape
    found = np.zeros((lanes, joints, 6, joints, m))
    every = np.arange(joints)
    found[:, every, :, every] = own.swapaxes(0, 1)
    return found.reshape(lanes, joints, 6, joints * m)
