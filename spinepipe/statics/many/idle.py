"""What laws, and effects on geometry, that are switched off would do to solved runs.

An idle law holds nothing, whatever its state, so that to first order only its own load grows with a
strength; one on geometry moves and turns what the laws hold. The chain answers these loads as it
answers any: its answers to unit loads on each axis serve all of them.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from spinepipe.effects.contract import Array, GeometryEffect, JointLaw, PathLaw
from spinepipe.statics.holding import Holding
from spinepipe.statics.many.derive import answered
from spinepipe.statics.many.stack import Stack

Acting = JointLaw | PathLaw | GeometryEffect


@dataclass(frozen=True, eq=False)
class Answering:
    """Solved runs whose laws act on the joints' own coordinates and remember nothing.

    Attributes
    ----------
    q : (L, J, 6) poses of all lanes.
    """

    stack: Stack
    q: Array

    @classmethod
    def of(cls, stack: Stack, q: Array) -> "Answering | None":
        """The runs at poses q, or None where effects of other kinds stand in between."""
        effects = stack.effects
        between = effects.geometry or effects.measurement
        return None if between or stack.remembers.any() or stack.alone.any() else cls(stack, q)

    @cached_property
    def to_unit_loads(self) -> Array:
        """(L, J, n, 6) how all n coordinates answer a unit load that each joint holds besides."""
        lanes, joints, _ = self.q.shape
        n = 6 * joints
        unit = np.broadcast_to(-np.eye(n).reshape(joints, 6, n), (lanes, joints, 6, n))
        found = answered(self.stack, self.q, unit).reshape(lanes, n, joints, 6)
        return np.ascontiguousarray(found.swapaxes(1, 2))

    @cached_property
    def held(self) -> Holding:
        """Loads (L, J, 6) that the laws hold, and tangents (L, J, 6, 6)."""
        load, tangent = np.zeros_like(self.q), np.zeros((*self.q.shape, 6))
        for runs in self.stack.chunks(np.arange(len(self.stack.remembers))):
            lanes = self.stack.lanes(runs)
            found = self.stack.bound(lanes, {}).held_by_laws(self.q[lanes])
            load[lanes] = found.load.reshape(load[lanes].shape)
            tangent[lanes] = found.tangent.reshape(tangent[lanes].shape)
        return Holding(load, tangent)

    def by_strengths(self, effect: Acting, off: Array) -> Array:
        """(L, J, n, P) derivative of all coordinates by each parameter (P,) at each joint."""
        return self.to_unit_loads @ self._own(effect, off).reshape(*self.q.shape, -1)

    def _own(self, effect: Acting, off: Array) -> Array:
        """(L J, 6, P) derivative of what is held at each joint at fixed coordinates."""
        q, load = self.q.reshape(-1, 6), self.held.load.reshape(-1, 6)
        values = np.tile(off, (len(q), 1))
        if isinstance(effect, PathLaw):
            return self._on_path(effect, off)
        if isinstance(effect, GeometryEffect):
            moved, tangent = effect.by_parameter(q, values), self.held.tangent.reshape(-1, 6, 6)
            turned = (moved.by_coordinate * load[:, :, None, None]).sum(axis=1)
            return turned + tangent @ moved.q
        return effect.by_parameter(q, values, load)

    def _on_path(self, law: PathLaw, off: Array) -> Array:
        """The same of a law that remembers, step by step."""
        lanes, joints, _ = self.q.shape
        own = np.zeros((lanes, joints, 6, len(off)))
        state = np.zeros((len(self.stack.remembers), joints, law.n_states))
        for runs, at in self.stack.steps(np.arange(len(state))):
            q, load = self.q[at].reshape(-1, 6), self.held.load[at].reshape(-1, 6)
            values, seconds = np.tile(off, (len(q), 1)), np.repeat(self.stack.seconds[at], joints)
            there = (q, values, state[runs].reshape(len(q), -1), seconds, load)
            own[at] = law.by_parameter_on_path(*there).reshape(own[at].shape)
            state[runs] = law.advance(*there).state.reshape(state[runs].shape)
        return own
