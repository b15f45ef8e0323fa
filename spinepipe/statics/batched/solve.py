"""The same test of many spines that differ in numbers alone: poses and joint loads as arrays."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects.contract import Array
from spinepipe.statics.batched.forward_kinematics import Flags, part
from spinepipe.statics.batched.newton import stands
from spinepipe.statics.batched.spines import Cases, Spines, stacked
from spinepipe.statics.batched.stack import Stack
from spinepipe.statics.equilibrium import RADIANS, SPACING
from spinepipe.status import Status


@dataclass(frozen=True, eq=False)
class ManySolved:
    """Poses and joint loads of M spines in A steps.

    Attributes
    ----------
    q : (M, A, J, 6) m and rad, of the steps that were asked for; NaN without equilibrium.
    load : (M, A, J, 6) N and N m that the joints carry, conjugate to q; NaN likewise.
    status : (M, A) `Status`. messages : why not, or a warning, by (spine, step).
    by_engine : (M,) whether the engine of record solved the spine.
    """

    q: Array
    load: Array
    status: NDArray[np.str_]
    messages: dict[tuple[int, int], str]
    by_engine: NDArray[np.bool_]


NEARLY_STRAIGHT = 0.05
"""Share of the way of a load by which those on it may lie beside it, where none of them is asked
for: what load cells read beside a moment that is meant to be pure."""


def solve_many(spines: Spines, cases: Cases, asked: Sequence[int] | None = None) -> ManySolved:
    """The same test of many spines, its steps one after the other.

    Parameters
    ----------
    asked : places of the T steps that are wanted, the first of all among them; None: all of them.
        Those between may be passed at once, see `_passed`.
    """
    every = range(len(cases.like.steps))
    asked = list(every if asked is None else asked)
    count, steps = len(spines), len(asked)
    short = stacked(spines, cases.steps(asked))
    q = np.full((count, steps, short.joints, 6), np.nan)
    status = np.full((count, steps), Status.CONVERGED.value, dtype="U20")
    messages: dict[tuple[int, int], str] = {}
    by_engine = np.zeros(count, dtype=bool)
    if count and steps < len(every):
        q = short.solve(why=False).q.reshape(q.shape)
        q[~_passed(stacked(spines, cases), short, q, asked)] = np.nan
        told = short.past_critical(
            q.reshape(-1, *q.shape[2:]), np.zeros(len(short.run), dtype=bool)
        )
        messages = {divmod(lane, steps): why for lane, why in told.items()}
    rest = np.flatnonzero(np.isnan(q[:, 0, 0, 0]))
    if len(rest):
        found = stacked(spines.part(rest), cases.part(rest)).solve()
        shape = (len(rest), len(every))
        q[rest] = found.q.reshape(*shape, *q.shape[2:])[:, asked]
        status[rest] = found.status.reshape(shape)[:, asked]
        by_engine[rest] = found.by_engine
        for lane, why in found.messages.items():
            number, step = divmod(lane, len(every))
            if step in asked:
                messages[int(rest[number]), asked.index(step)] = why
    load = carried(short, q.reshape(-1, *q.shape[2:])).reshape(q.shape)
    return ManySolved(q, load, status, messages, by_engine)


def _passed(stack: Stack, short: Stack, q: Array, asked: Sequence[int]) -> Flags:
    """(M,) which spines came to their asked steps, at poses q (M, A, J, 6), past all of theirs.

    A certified step follows the load on the straight way. It is taken for the way of all steps
    where their loads lie beside it by a twentieth at most, and where the chain, at places along the
    step, stands under the loads of both its ends even if softened by all that the others may do.
    """
    count, steps = len(q), len(stack.run) // len(q)
    good = ~np.isnan(q[:, :, 0, 0]).any(axis=1) & ~stack.remembers & (stack.spacing >= SPACING)
    if stack.loads.supports.there or not good.any():
        return np.zeros(count, dtype=bool)
    bodies, points, forces, moments = (
        one.reshape(count, steps, len(one[0]), -1) for one in stack.loads[1:5]
    )
    for places in (bodies, points):
        good &= (places == places[:, :1]).all(axis=(1, 2, 3))
    arms = points[:, 0, None] - stack.chains.origins[:, :, None]
    lever = np.linalg.norm(arms, axis=3).max(axis=1)
    loads, states = np.concatenate([forces, moments], axis=3), stack.initial_states()
    for place, (begin, end) in enumerate(pairwise(asked)):
        way, done = loads[:, end] - loads[:, begin], loads[:, begin + 1 : end] - loads[:, [begin]]
        square = np.maximum((way * way).sum(axis=(1, 2)), np.finfo(float).tiny)
        share = np.clip((done * way[:, None]).sum(axis=(2, 3)) / square[:, None], 0.0, 1.0)
        off = done - share[..., None, None] * way[:, None]
        force, moment = (one.max(axis=1, initial=0.0) for one in _sizes(off, lever))
        good &= moment <= NEARLY_STRAIGHT * _sizes(way[:, None], lever)[1][:, 0]
        softer = _softer(force, moment, stack.joints)
        moved = q[:, place + 1] - q[:, place]
        parts = np.ceil(np.abs(moved * RADIANS).max(axis=(1, 2)) / SPACING)
        for runs in stack.chunks(np.flatnonzero(good), stepwise=True):
            lanes = len(asked) * runs + place
            for number in range(int(parts[runs].max()) + 1):
                share = np.minimum(number / np.maximum(parts[runs], 1.0), 1.0)
                there = q[runs, place] + share[:, None, None] * moved[runs]
                tangents = short.bound(lanes, states).held(there).tangent
                weak = tangents - softer[runs, None, :, None] * np.eye(6)
                for step in (begin, end):
                    under = part(stack.loads, steps * runs + step)
                    good[runs] &= stands(stack.chains, under, there, weak)
    return good


def _sizes(loads: Array, lever: Array) -> tuple[Array, Array]:
    """(M, K) N, N m of wrenches (M, K, W, 6): forces, and moments with forces at levers (M, W)."""
    pull, turn = np.linalg.norm(loads[..., :3], axis=3), np.linalg.norm(loads[..., 3:], axis=3)
    return pull.sum(axis=2), (turn + lever[:, None] * pull).sum(axis=2)


def _softer(force: Array, moment: Array, joints: int) -> Array:
    """(M, 6) N/m and N m/rad by which loads (M,) N, N m soften a joint's coordinates at most.

    A turn of a joint changes what a load does to a rotation above by no more than its moment there,
    and to a translation by no more than its force; half of either is symmetric. A row of these over
    the 3 J coordinates of a kind bounds the form (Gershgorin), 1 cm counting as 1 rad.
    """
    per_metre = RADIANS[0]
    kinds = per_metre * force, moment + force / per_metre
    return 1.5 * joints * np.repeat(np.stack(kinds, axis=1), 3, axis=1)


def carried(stack: Stack, q: Array) -> Array:
    """(L, J, 6) N and N m that the joints' laws hold at poses q (L, J, 6), NaN where these are."""
    load = np.full(q.shape, np.nan)
    for lanes, bound in stack.walked(q):
        load[lanes] = bound.held_by_laws(q[lanes]).load.reshape(-1, *q.shape[1:])
    return load
