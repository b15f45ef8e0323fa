"""Lanes that do not take their load at once: it comes on in fractions, as in the engine of record.

A lane starts from the step before it, a first one from the neutral pose without any load or weight.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects.contract import Array, Indices
from spinepipe.statics.equilibrium import FIRST_INCREMENT, SMALLEST_FRACTION
from spinepipe.statics.many.bound import Bound
from spinepipe.statics.many.newton import settled
from spinepipe.statics.many.survey import Chains, Loads, part

Flags = NDArray[np.bool_]

Laws = Callable[[Indices, Array], Bound]
"""What is at work on some of the lanes, and the share (N,) of it that is on."""


@dataclass(frozen=True, eq=False)
class Increment:
    """Loads that N lanes carry already, and those to come; ``first``: whether all begins here."""

    before: Loads
    after: Loads
    first: Flags

    def on(self, chains: Chains, lanes: Indices, reached: Array) -> tuple[Chains, Loads]:
        """Lanes with a fraction (N,) of the increment; each has a chain of its own."""
        before, after = (
            _scaled(self.before, lanes, 1.0 - reached),
            _scaled(self.after, lanes, reached),
        )
        loads = Loads(
            np.arange(len(lanes)),
            np.concatenate([before.bodies, after.bodies], axis=1),
            np.concatenate([before.points, after.points], axis=1),
            np.concatenate([before.forces, after.forces], axis=1),
            np.concatenate([before.moments, after.moments], axis=1),
            before.supports.towards(after.supports, reached),
        )
        own = Chains(*(numbers[self.after.chain[lanes]] for numbers in chains))
        weight = own.gravity * self.share(lanes, reached)[:, None]
        return own._replace(gravity=weight), loads

    def share(self, lanes: Indices, reached: Array) -> Array:
        """(N,) share of the weight and of loads across joints that is on."""
        return np.where(self.first[lanes], reached, 1.0)


def _scaled(loads: Loads, lanes: Indices, share: Array) -> Loads:
    """A share (N,) of the loads of some lanes."""
    some, on = part(loads, lanes), share[:, None, None]
    return some._replace(forces=some.forces * on, moments=some.moments * on)


def continued(
    chains: Chains, increment: Increment, laws: Laws, start: Array
) -> tuple[Array, Flags]:
    """Poses (N, J, 6) under the whole load, and which lanes got there by stable equilibria."""
    q, count = start.copy(), len(start)
    reached, size = np.zeros(count), np.full(count, FIRST_INCREMENT)
    going, lost = np.ones(count, dtype=bool), np.zeros(count, dtype=bool)
    while going.any():
        lanes, sizes = _tried(np.flatnonzero(going), size, lost)
        target = np.minimum(1.0, reached[lanes] + sizes)
        share = increment.share(lanes, target)
        own, loads = increment.on(chains, lanes, target)
        found, good = settled(own, loads, _on(laws, lanes, share), q[lanes])
        there, first = np.unique(lanes[good], return_index=True)
        best = np.flatnonzero(good)[first]
        missed = np.setdiff1d(lanes, there)
        going[missed] = ~lost[missed] & (size[missed] > SMALLEST_FRACTION)
        lost[missed], lost[there] = True, False
        q[there], reached[there], size[there] = found[best], target[best], 2.0 * sizes[best]
        size[missed] *= 0.5
        going &= reached < 1.0
    return q, reached >= 1.0


def _tried(going: Indices, size: Array, lost: Flags) -> tuple[Indices, Array]:
    """Lanes, and the increments that each tries side by side, the largest first.

    One: the size of the lane; of a lane that was just lost that and all its halves in turn, which
    start from the same pose. A few lanes more cost less than one trial after the other.
    """
    halves = size[going, None] * 0.5 ** np.arange(-np.log2(SMALLEST_FRACTION) + 1)
    tried = lost[going, None] & (2.0 * halves > SMALLEST_FRACTION)
    tried[:, 0] = True
    row, column = np.nonzero(tried)
    return going[row], halves[row, column]


def _on(laws: Laws, lanes: Indices, share: Array) -> Callable[[Indices], Bound]:
    """What is at work on some of these lanes (N,) with their shares (N,)."""
    return lambda some: laws(lanes[some], share[some])
