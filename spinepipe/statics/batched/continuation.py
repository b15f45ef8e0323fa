"""Lanes that do not take their load at once: it comes on in fractions, as in the engine of record.

A lane starts from the step before it, a first one from the neutral pose without any load or weight.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects.contract import Array, Indices
from spinepipe.statics.batched.effects import Bound
from spinepipe.statics.batched.forward_kinematics import Chains, Loads, part
from spinepipe.statics.batched.newton import Before, certified, newton
from spinepipe.statics.equilibrium import SMALLEST_FRACTION

Flags = NDArray[np.bool_]

SIDE_BY_SIDE, GROWTH = 16, 4.0
"""Parts of an increment that did not come on, which are tried at once; its growth after success."""

MOST_ROUNDS = 300
"""A lane that is not there after so many trials is given up."""

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
            scaled(self.before, lanes, 1.0 - reached),
            scaled(self.after, lanes, reached),
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


def scaled(loads: Loads, lanes: Indices, share: Array) -> Loads:
    """A share (N,) of the loads of some lanes."""
    some, on = part(loads, lanes), share[:, None, None]
    return some._replace(forces=some.forces * on, moments=some.moments * on)


def continued(
    chains: Chains, increment: Increment, laws: Laws, spacing: Array, start: Array
) -> tuple[Array, Flags]:
    """Poses (N, J, 6) under the whole load, and which lanes got there by certified steps."""
    q, count = start.copy(), len(start)
    reached, size = np.zeros(count), np.ones(count)
    going, lost = np.ones(count, dtype=bool), np.ones(count, dtype=bool)
    for _ in range(MOST_ROUNDS):
        lanes, sizes = _tried(np.flatnonzero(going), size, lost)
        target = np.minimum(1.0, reached[lanes] + sizes)
        own, loads = increment.on(chains, lanes, target)
        carried = ~increment.first[lanes] | (reached[lanes] > 0.0)
        at = np.where(carried, np.arange(len(lanes)), -1)
        before = Before(*increment.on(chains, lanes, reached[lanes]), at)
        on = _on(laws, lanes, increment.share(lanes, target))
        results = newton(own, loads, on, q[lanes])
        good = certified(own, before, loads, on, spacing[lanes], q[lanes], results)
        there, first = np.unique(lanes[good], return_index=True)
        best = np.flatnonzero(good)[first]
        missed = np.setdiff1d(lanes, there)
        going[missed] = ~lost[missed]
        lost[there], lost[missed] = sizes[best] < size[there], True
        size[there] = np.where(lost[there], 2.0 / SIDE_BY_SIDE, GROWTH) * size[there]
        q[there], reached[there] = results.q[best], target[best]
        size = np.minimum(size, 1.0 - reached)
        going &= (reached < 1.0) & (size > SMALLEST_FRACTION)
        if not going.any():
            break
    return q, reached >= 1.0


def _tried(going: Indices, size: Array, lost: Flags) -> tuple[Indices, Array]:
    """Lanes, and the increments that each tries side by side, the largest first.

    One: the size of the lane; of a lane that was just lost that and its sixteenths, and below these
    halves in turn, which all start from the same pose. A few lanes more cost less than one trial
    after the other.
    """
    finest = np.log2(1.0 / (SIDE_BY_SIDE * SMALLEST_FRACTION))
    shares = np.append(np.arange(SIDE_BY_SIDE, 1.0, -1.0), 0.5 ** np.arange(finest + 1.0))
    increments = size[going, None] * shares / SIDE_BY_SIDE
    tried = lost[going, None] & (increments > SMALLEST_FRACTION)
    tried[:, 0] = True
    row, column = np.nonzero(tried)
    return going[row], increments[row, column]


def _on(laws: Laws, lanes: Indices, share: Array) -> Callable[[Indices], Bound]:
    """What is at work on some of these lanes (N,) with their shares (N,)."""
    return lambda some: laws(lanes[some], share[some])
