"""Joint laws that remember the load path: friction and creep, solved implicitly in every step."""

from dataclasses import dataclass

import numpy as np

from .scope import Scope
from .world import Now


@dataclass(frozen=True)
class Friction:
    """Rate-independent friction: a load that tends to +-``load`` N m as the joint moves on.

    Dahl's law: dF/dq = (load - F sign(dq)) / width, integrated exactly over a step, so that
    the branch after a reversal approaches the other side over ``width`` rad. memory: F and last q.
    """

    scope: Scope
    load: float
    width: float

    def __call__(self, q, carried, memory, now: Now):
        return self.scope.into(carried, self._force(q, memory))

    def renewed(self, q, memory, now: Now):
        return np.stack([self.scope.into(q, self._force(q, memory)), q])

    def _force(self, q, memory):
        before, last = self.scope.of(memory[0]), self.scope.of(memory[1])
        moved = self.scope.of(q) - last
        limit = self.load * np.sign(moved)
        return limit + (before - limit) * np.exp(-np.abs(moved) / self.width)


@dataclass(frozen=True)
class Creep:
    """A standard linear solid: under a constant load the rotation grows by ``fraction``.

    q = elastic + slow; load = k elastic; seconds * d(slow)/dt = fraction * elastic - slow,
    integrated exactly over the step with the elastic part as at its end. memory: the slow part.
    """

    scope: Scope
    stiffness: np.ndarray
    fraction: float
    seconds: float

    def __call__(self, q, carried, memory, now: Now):
        elastic = self._elastic(q, memory, now)
        k = self.scope.of(self.stiffness)
        return self.scope.into(carried, k * (elastic - self.scope.of(q)))

    def renewed(self, q, memory, now: Now):
        slow = self.scope.of(q) - self._elastic(q, memory, now)
        return np.stack([self.scope.into(q, slow), np.zeros_like(q)])

    def _elastic(self, q, memory, now):
        stays = np.exp(-now.seconds / self.seconds)
        slow = self.scope.of(memory[0]) * stays
        return (self.scope.of(q) - slow) / (1.0 + self.fraction * (1.0 - stays))
