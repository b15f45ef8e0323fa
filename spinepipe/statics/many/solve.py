"""The same test of many spines that differ in numbers alone: poses and joint loads as arrays."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects.contract import Array
from spinepipe.statics.many.spines import Cases, Spines, stacked
from spinepipe.statics.many.stack import Stack


@dataclass(frozen=True, eq=False)
class ManySolved:
    """Poses and joint loads of M spines in T steps.

    Attributes
    ----------
    q : (M, T, J, 6) m and rad; NaN where there is no equilibrium.
    load : (M, T, J, 6) N and N m that the joints carry, conjugate to q; NaN likewise.
    status : (M, T) `Status`. messages : why not, or a warning, by (spine, step).
    by_engine : (M,) whether the engine of record solved the spine.
    """

    q: Array
    load: Array
    status: NDArray[np.str_]
    messages: dict[tuple[int, int], str]
    by_engine: NDArray[np.bool_]


def solve_many(spines: Spines, cases: Cases) -> ManySolved:
    """The same test of many spines, its steps one after the other."""
    stack = stacked(spines, cases)
    found = stack.solve()
    steps = len(cases.like.steps)
    shape = (len(spines), steps, stack.joints, 6)
    return ManySolved(
        found.q.reshape(shape),
        carried(stack, found.q).reshape(shape),
        found.status.reshape(shape[:2]),
        {divmod(lane, steps): told for lane, told in found.messages.items()},
        found.by_engine,
    )


def carried(stack: Stack, q: Array) -> Array:
    """(L, J, 6) N and N m that the joints' laws hold at poses q (L, J, 6), NaN where these are."""
    load = np.full(q.shape, np.nan)
    states = stack.initial_states()
    good = ~np.isnan(q[:, 0, 0])
    for runs in stack.chunks(np.arange(len(stack.remembers)), stepwise=True):
        for _, lanes in stack.steps(runs):
            there = lanes[good[lanes]]
            bound = stack.bound(there, states)
            load[there] = bound.held_by_laws(q[there]).load.reshape(-1, *q.shape[1:])
            stack.remember(states, bound, bound.after(q[there]))
    return load
