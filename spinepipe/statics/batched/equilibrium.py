"""Which equilibria loads lead many lanes to: Newton, a certificate, else the load in parts.

As `spinepipe.statics.equilibrium` does for one chain. A step of the load is taken where it is
certified to be a piece of a path of stable equilibria: the tangent is positive under the whole load
at its start, under the load before at its end, and in between where it is long or bent. What is not
certified comes on in fractions (`continue_in_parts`), each lane from the step before it, the first
from the neutral pose without any load or weight.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects.contract import Array, Indices
from spinepipe.statics.batched.dynamics import tangents_of
from spinepipe.statics.batched.effects import Bound
from spinepipe.statics.batched.elimination import POSITIVE, Changes, eliminate
from spinepipe.statics.batched.forward_kinematics import forward_kinematics
from spinepipe.statics.batched.loads import Chains, Loads, part, scale_loads
from spinepipe.statics.batched.stability import surely_stable
from spinepipe.statics.equilibrium import (
    LARGEST_ROTATION,
    LEAST_SHARE,
    LONGEST_STEP,
    MOST_ITERATIONS,
    OVERSHOT,
    SMALLEST_FRACTION,
    STEP_TOLERANCE,
    places_between,
)

Flags = NDArray[np.bool_]

Laws = Callable[[Indices], Bound]
"""What is at work on some of the lanes."""

FEW = 40
"""Up to so many lanes all stay until half have arrived: to bind their laws anew takes longer."""

SIDE_BY_SIDE, GROWTH = 16, 4.0
"""Parts of an increment that did not come on, which are tried at once; its growth after success."""

MOST_ROUNDS = 300
"""A lane that is not there after so many trials is given up."""

SharedLaws = Callable[[Indices, Array], Bound]
"""What is at work on some of the lanes, and the share (N,) of it that is on."""


class NewtonResults(NamedTuple):
    """How Newton went on N lanes.

    Attributes
    ----------
    q : (N, J, 6) where it ended. tangents : (N, J, 6, 6) of the joints there.
    arrived : (N,) whether q is an equilibrium.
    first : (N, J, 6) its first step. signs : (N,) of the tangent at the start, see
        `elimination.eliminate`.
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


def certify(
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
    # 1: the end is stable
    good, begin = results.arrived.copy(), loads.supports.on(origin)
    first, signs = results.first, results.signs
    good[good] = surely_stable(
        chains, part(loads, np.flatnonzero(good)), results.q[good], results.tangents[good]
    )
    # 2: the tangent is positive at the origin under the whole load; Newton has told it but where it
    # started elsewhere
    if guessed:
        held = laws(np.arange(len(begin))).joint_forces(begin)
        first, signs, _ = _step(chains, loads, begin, held.load, held.tangent)
    doubt = np.flatnonzero(good & (signs != POSITIVE))
    if len(doubt):
        tangents = laws(doubt).joint_forces(begin[doubt]).tangent
        good[doubt] = stands(chains, part(loads, doubt), begin[doubt], tangents)
    if not good.any():
        return good
    # 3: and so at the end under the load before, and at places between under both loads
    ends = np.flatnonzero(good)
    near, lanes, shares = places_between(begin[ends], results.q[ends], first[ends], spacing[ends])
    lanes = ends[lanes]
    good[ends] = near
    between = begin[lanes] + shares[:, None, None] * (results.q - begin)[lanes]
    tangents = results.tangents[:0]
    if len(lanes):
        tangents = laws(lanes).joint_forces(between).tangent
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
    _, signs = eliminate(seen, Changes(np.empty((*q.shape, 0))), asked=True)
    found: Flags = signs == POSITIVE
    doubt = np.flatnonzero(signs == 1)
    if len(doubt):
        scale = chains.damping[loads.chain[doubt]].reshape(len(doubt), -1) ** -0.5
        tangent = tangents_of(seen.part(doubt)) * scale[:, :, None] * scale[:, None]
        if len(seen.fixed):
            # a held coordinate stands apart from the others, with an eigenvalue of one
            held = seen.fixed[doubt].reshape(len(doubt), -1)
            tangent[held[:, :, None] | held[:, None]] = 0.0
            tangent += held[:, None] * np.eye(held.shape[1])
        found[doubt] = np.linalg.eigvals(tangent).real.min(axis=1) > 0.0
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
        # a Newton step of each lane that is still going, no longer than its tangent tells
        here = q[left]
        held = bound.joint_forces(here)
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
            if over.any():
                # line search: the step before is cut back to the zero of the straight line between
                # the work along it at its start (-drive) and at its end
                share = np.clip(drive / (drive + work), LEAST_SHARE, 0.5)
                share = np.where(np.isfinite(work), share, 0.5)[over]
                sign[over] = drive[over] > 0.0
                here[over] -= step[over]
                new[over], driven[over] = step[over] * share[:, None, None], share * drive[over]
                size[over] = np.inf
        # who has arrived, who has left the path (determinant not positive) or joint motion
        ended = here + new
        q[left[going]] = ended[going]
        there = going & (size < 1.0) & (sign > 0)
        arrived[left[there]] = True
        tangents[left[there]] = held.tangent[there]
        turned = np.abs(ended[..., 3:]).max(axis=(1, 2))
        going &= (sign > 0) & ~there & (turned < np.pi)
        if not going.any():
            break
        # lanes that have ended are left out once they are many
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
    rates, signs = eliminate(seen, Changes(-missing[..., None]), asked)
    return rates[..., 0], signs, missing


@dataclass(frozen=True, eq=False)
class Increment:
    """Loads that N lanes carry already, and those to come; ``first``: whether all begins here."""

    before: Loads
    after: Loads
    first: Flags

    def on(self, chains: Chains, lanes: Indices, reached: Array) -> tuple[Chains, Loads]:
        """Lanes with a fraction (N,) of the increment; each has a chain of its own."""
        before, after = (
            scale_loads(self.before, lanes, 1.0 - reached),
            scale_loads(self.after, lanes, reached),
        )
        own_chain, supports = (
            np.arange(len(lanes)),
            before.supports.towards(after.supports, reached),
        )
        loads = before.with_wrenches(*after[1:5])._replace(chain=own_chain, supports=supports)
        own = Chains(*(numbers[self.after.chain[lanes]] for numbers in chains))
        weight = own.gravity * self.share(lanes, reached)[:, None]
        return own._replace(gravity=weight), loads

    def share(self, lanes: Indices, reached: Array) -> Array:
        """(N,) share of the weight and of loads across joints that is on."""
        return np.where(self.first[lanes], reached, 1.0)


def continue_in_parts(
    chains: Chains, increment: Increment, laws: SharedLaws, spacing: Array, start: Array
) -> tuple[Array, Flags]:
    """Poses (N, J, 6) under the whole load, and which lanes got there by certified steps."""
    q, count = start.copy(), len(start)
    reached, size = np.zeros(count), np.ones(count)
    going, lost = np.ones(count, dtype=bool), np.ones(count, dtype=bool)
    for _ in range(MOST_ROUNDS):
        # a round of trials: from what each lane has reached to several targets side by side
        lanes, sizes = _tried(np.flatnonzero(going), size, lost)
        target = np.minimum(1.0, reached[lanes] + sizes)
        own, loads = increment.on(chains, lanes, target)
        carried = ~increment.first[lanes] | (reached[lanes] > 0.0)
        at = np.where(carried, np.arange(len(lanes)), -1)
        before = Before(*increment.on(chains, lanes, reached[lanes]), at)
        on = _on(laws, lanes, increment.share(lanes, target))
        results = newton(own, loads, on, q[lanes])
        good = certify(own, before, loads, on, spacing[lanes], q[lanes], results)
        # each lane goes on from the largest increment that was certified (they stand in that order)
        there, first = np.unique(lanes[good], return_index=True)
        best = np.flatnonzero(good)[first]
        # one that was certified at none of them is tried finer next, and given up after that
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


def _on(laws: SharedLaws, lanes: Indices, share: Array) -> Callable[[Indices], Bound]:
    """What is at work on some of these lanes (N,) with their shares (N,)."""
    return lambda some: laws(lanes[some], share[some])
