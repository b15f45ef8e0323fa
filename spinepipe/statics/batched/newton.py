"""Newton on many lanes at once, and which of their ends the load leads to.

A step of the load is taken where it is certified to be a piece of a path of stable equilibria, see
`spinepipe.statics.equilibrium`: the tangent is positive under the whole load at its start, under
the load before at its end, and in between where it is long or bent. What is not certified is
halved (`continuation`).
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects.contract import Array, Indices
from spinepipe.statics.batched.dynamics import tangents_of
from spinepipe.statics.batched.effects import Bound
from spinepipe.statics.batched.elimination import POSITIVE, Changes, eliminated
from spinepipe.statics.batched.forward_kinematics import Chains, Loads, forward_kinematics, part
from spinepipe.statics.batched.stability import surely_stable
from spinepipe.statics.equilibrium import (
    LARGEST_ROTATION,
    LEAST_SHARE,
    LONGEST_STEP,
    MOST_ITERATIONS,
    OVERSHOT,
    STEP_TOLERANCE,
    decays,
    places_between,
)

Flags = NDArray[np.bool_]

Laws = Callable[[Indices], Bound]
"""What is at work on some of the lanes."""


FEW = 40
"""Lanes that are kept until half of them have arrived: to look again at their laws takes longer."""


class NewtonResults(NamedTuple):
    """How Newton went on N lanes.

    Attributes
    ----------
    q : (N, J, 6) where it ended. tangents : (N, J, 6, 6) of the joints there.
    arrived : (N,) whether q is an equilibrium.
    first : (N, J, 6) its first step. signs : (N,) of the tangent at the start, see
        `elimination.eliminated`.
    """

    q: Array
    tangents: Array
    arrived: Flags
    first: Array
    signs: Indices


class Before(NamedTuple):
    """What N lanes carry before a step, ``at`` (N,) of some loads; -1 where it needs no look."""

    chains: Chains
    loads: Loads
    at: Indices


def certified(
    chains: Chains,
    before: Before,
    loads: Loads,
    laws: Laws,
    spacing: Array,
    origin: Array,
    results: NewtonResults,
    guessed: bool = False,
) -> Flags:
    """(N,) which ends of Newton are the ends of a path of stable equilibria from an origin.

    Parameters
    ----------
    spacing : (N,) rad, see `places_between`. origin : (N, J, 6) pose under the load
        before. guessed : whether Newton started elsewhere.
    """
    good, begin = results.arrived.copy(), loads.supports.on(origin)
    first, signs = results.first, results.signs
    good[good] = surely_stable(
        chains, part(loads, np.flatnonzero(good)), results.q[good], results.tangents[good]
    )
    if guessed:
        held = laws(np.arange(len(begin))).held(begin)
        first, signs, _ = _step(chains, loads, begin, held.load, held.tangent)
    doubt = np.flatnonzero(good & (signs != POSITIVE))
    if len(doubt):
        tangents = laws(doubt).held(begin[doubt]).tangent
        good[doubt] = stands(chains, part(loads, doubt), begin[doubt], tangents)
    if not good.any():
        return good
    # the end under the load before, and places between under both loads
    ends = np.flatnonzero(good)
    near, lanes, shares = places_between(begin[ends], results.q[ends], first[ends], spacing[ends])
    lanes = ends[lanes]
    good[ends] = near
    between = begin[lanes] + shares[:, None, None] * (results.q - begin)[lanes]
    tangents = results.tangents[:0]
    if len(lanes):
        tangents = laws(lanes).held(between).tangent
        good[lanes[~stands(chains, part(loads, lanes), between, tangents)]] = False
    rows = np.append(ends, lanes)
    there = np.flatnonzero(before.at[rows] >= 0)
    if len(there):
        rows, carried = rows[there], part(before.loads, before.at[rows[there]])
        q = np.concatenate([results.q[ends], between])[there]
        tangents = np.concatenate([results.tangents[ends], tangents])[there]
        good[rows[~stands(before.chains, carried, q, tangents)]] = False
    return good


def stands(chains: Chains, loads: Loads, q: Array, tangents: Array) -> Flags:
    """(N,) from which poses q (N, J, 6) lanes without inertia would not move away.

    Where a pivot is not positive and the determinant is, constant moments may be why: the tangent's
    own eigenvalues tell.
    """
    seen = forward_kinematics(chains, loads, q, tangents)
    _, signs = eliminated(seen, Changes(np.empty((*q.shape, 0))), asked=True)
    found: Flags = signs == POSITIVE
    for lane in np.flatnonzero(signs == 1):
        scale = 1.0 / np.sqrt(chains.damping[loads.chain[lane]].ravel())
        tangent = tangents_of(seen.part(np.array([lane])))[0] * scale[:, None] * scale
        if len(seen.fixed):
            free = ~seen.fixed[lane].ravel()
            tangent = tangent[free][:, free]
        found[lane] = decays(np.zeros_like(tangent), tangent)
    return found


def newton(chains: Chains, loads: Loads, laws: Laws, start: Array) -> NewtonResults:
    """Newton with a line search, see `spinepipe.statics.equilibrium.newton`."""
    q = loads.supports.on(start)
    tangents, first = np.zeros((*q.shape, 6)), np.zeros_like(q)
    arrived, signs = np.zeros(len(q), dtype=bool), np.zeros(len(q), dtype=np.int64)
    left: Indices = np.arange(len(q))
    bound, acting = laws(left), loads
    going = np.ones(len(q), dtype=bool)
    step, drive = np.zeros_like(q), np.zeros(len(q))
    for iteration in range(MOST_ITERATIONS):
        here = q[left]
        held = bound.held(here)
        new, sign, missing = _step(
            chains, acting, here, held.load, held.tangent, asked=iteration == 0
        )
        if iteration == 0:
            first, signs = new.copy(), sign.copy()
        moved = np.abs(new)
        size, length = (moved / STEP_TOLERANCE).max(axis=(1, 2)), moved[..., 3:].max(axis=(1, 2))
        if length.max(initial=0.0) > LONGEST_STEP:
            new *= np.minimum(1.0, LONGEST_STEP / np.maximum(length, LONGEST_STEP))[:, None, None]
        with np.errstate(invalid="ignore", divide="ignore"):
            work = np.einsum("njk,njk->n", missing, step)
            over = going & ~(work <= OVERSHOT * drive)
            driven = -np.einsum("njk,njk->n", missing, new)
            if over.any():  # the step before is cut back: as much of it is left as its work tells
                share = np.clip(drive / (drive + work), LEAST_SHARE, 0.5)
                share = np.where(np.isfinite(work), share, 0.5)[over]
                sign[over] = drive[over] > 0.0
                here[over] -= step[over]
                new[over], driven[over] = step[over] * share[:, None, None], share * drive[over]
                size[over] = np.inf
        ended = here + new
        q[left[going]] = ended[going]
        there = going & (size < 1.0) & (sign > 0)
        arrived[left[there]] = True
        tangents[left[there]] = held.tangent[there]
        turned = np.abs(ended[..., 3:]).max(axis=(1, 2))
        going &= (sign > 0) & ~there & (turned < np.pi)
        if not going.any():
            break
        step, drive = new, np.where(driven > 0.0, driven, np.inf)
        if 2 * np.count_nonzero(going) <= len(going) or (len(going) > FEW and not going.all()):
            left, step, drive = left[going], step[going], drive[going]
            bound, acting, going = laws(left), part(loads, left), going[going]
    arrived &= np.abs(q[..., 3:]).max(axis=(1, 2)) <= LARGEST_ROTATION
    return NewtonResults(q, tangents, arrived, first, signs)


def _step(
    chains: Chains, loads: Loads, q: Array, held: Array, tangents: Array, asked: bool = True
) -> tuple[Array, Indices, Array]:
    """Newton steps (N, J, 6) from q, signs (N,) of the tangents, and what is missing (N, J, 6)."""
    seen = forward_kinematics(chains, loads, q, tangents)
    missing = held - seen.applied
    rates, signs = eliminated(seen, Changes(-missing[..., None]), asked)
    return rates[..., 0], signs, missing
