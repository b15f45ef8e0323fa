"""Which equilibria of a stack are stable for sure.

In coordinates where damping is one, M x'' + x' + (S + A) x = 0, with the tangent's symmetric and
skew parts S and A. Let A grow from nothing to what it is, t A: without A motion decays if S is
positive definite, and it decays to the end unless for some t a mode x exp(i w t) neither grows nor
decays. Such a mode has

    x* S x = w^2 x* M x   and   t x* (i A) x = -w x* x,   hence |w| <= |A|.

With v = |w| / t, no less than |w| and no more than |A|, there is none if S - v^2 M + c (v - i A) is
positive definite for some c >= 0: on x the last term is nothing, so x* S x > v^2 x* M x. Where
S - v2^2 M + c (v1 - i A) is positive definite that holds for all v from v1 to v2. One interval with
c = 0 proves nearly all spines of up to ten joints; others are proven interval by interval, and
the rest by the rates of all their modes.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects.contract import Array, Indices
from spinepipe.statics.equilibrium import decays
from spinepipe.statics.many.dynamics import inertias_of, tangents_of
from spinepipe.statics.many.proofs import apart, twists
from spinepipe.statics.many.survey import Chains, Loads, Survey, survey

Flags = NDArray[np.bool_]

FIRST = (0.8, 0.6, 0.4, 0.2)
"""Shares of |A| up to which c = 0 is tried."""

FURTHER, WEIGHTS = (1.5, 1.2, 1.1), (0.5, 1.0, 0.25)
"""Factors by which an interval ends above its start v1, and c over v1 tr(M)."""

MOST_INTERVALS = 12

STIFF = 1e6
"""Of the largest stiffness, springs on coordinates that a rig fixes."""


def surely_stable(chains: Chains, loads: Loads, q: Array, tangents: Array) -> Flags:
    """(N,) which lanes are stable at q (N, J, 6) with the joints' tangents (N, J, 6, 6)."""
    lanes = lanes_of(chains, loads, q, tangents)
    proven = proven_by_forms(lanes)
    for lane in np.flatnonzero(~proven):
        mass, stiffness = matrices(lanes.part(np.array([lane])))
        sign, _ = np.linalg.slogdet(stiffness)
        proven[lane] = sign > 0.0 and decays(mass, stiffness)
    return proven


def lanes_of(chains: Chains, loads: Loads, q: Array, tangents: Array) -> "Lanes":
    """Lanes at q (N, J, 6) with all that decides their stability."""
    seen, chain = survey(chains, loads, q, _held(loads, tangents)), loads.chain
    return Lanes(seen, inertias_of(chains, chain, seen), chains.damping[chain])


def _held(loads: Loads, tangents: Array) -> Array:
    """The tangents (N, J, 6, 6) with stiff springs on what a rig fixes.

    A form that is positive with them is so in all rates that leave fixed coordinates at rest,
    where the springs add nothing: what they prove is proven however stiff they are.
    """
    if not loads.supports.there:
        return tangents
    found = tangents.copy()
    stiff = STIFF * np.abs(tangents).max(axis=(1, 2, 3), initial=1.0)
    springs = np.where(loads.supports.fixed, stiff[:, None, None], 0.0)
    found[:, :, range(6), range(6)] += springs
    return found


def proven_by_forms(lanes: "Lanes") -> Flags:
    """(N,) which lanes are proven stable without the rates of their modes."""
    square = np.zeros(len(lanes.damping))
    twists(lanes.seen.numbers, lanes.damping, square)
    top, nothing = np.sqrt(square), np.zeros(len(square))
    proven = lanes.apart(nothing, top, nothing)
    doubt = np.flatnonzero(~proven)
    if len(doubt):
        proven[doubt] = _by_intervals(lanes.part(doubt), top[doubt])
    return proven


@dataclass(frozen=True, eq=False)
class Lanes:
    """Lanes with the inertia (N, J, 6, 6) of each vertebra by its twist, and damping (N, J, 6)."""

    seen: Survey
    inertia: Array
    damping: Array

    def part(self, lanes: Indices) -> "Lanes":
        """Some of them."""
        return Lanes(self.seen.part(lanes), self.inertia[lanes], self.damping[lanes])

    def apart(self, low: Array, high: Array, weight: Array) -> Flags:
        """(N,) whether no mode lies between two rates; see `proofs.apart`."""
        found = np.zeros(len(low), dtype=bool)
        apart(self.seen.numbers, self.inertia, self.damping, low, high, weight, found)
        return found

    @cached_property
    def momenta(self) -> Array:
        """(N, J, 6, 6) momentum by each axis of all that its joint carries."""
        result: Array = self.seen.axes @ np.cumsum(self.inertia[:, ::-1], axis=1)[:, ::-1]
        return result


def _by_intervals(lanes: Lanes, top: Array) -> Flags:
    """(N,) interval by interval up to top (N,)."""
    reached, nothing = np.zeros(len(top)), np.zeros(len(top))
    for share in FIRST:
        left = np.flatnonzero(reached == 0.0)
        good = lanes.part(left).apart(nothing[left], share * top[left], nothing[left])
        reached[left[good]] = share * top[left[good]]
    trace = np.sum(np.sum(lanes.momenta * lanes.seen.axes, axis=3) / lanes.damping, axis=(1, 2))
    for _ in range(MOST_INTERVALS):
        going = np.flatnonzero((reached > 0.0) & (reached < top))
        before = reached.copy()
        for factor in FURTHER:
            for share in WEIGHTS:
                left = going[reached[going] == before[going]]
                low = reached[left]
                high, weight = np.minimum(factor * low, top[left]), share * low * trace[left]
                good = lanes.part(left).apart(low, high, weight)
                reached[left[good]] = high[good]
        if not (reached > before).any():
            break
    found: Flags = (reached >= top) & (reached > 0.0)
    return found


def matrices(lane: Lanes) -> tuple[Array, Array]:
    """Mass matrix and tangent (n, n) of one lane's free coordinates, where damping is one."""
    scale = 1.0 / np.sqrt(lane.damping.ravel())
    both, n = scale[:, None] * scale, len(scale)
    lower = np.tril(lane.momenta.reshape(n, 6) @ lane.seen.axes.reshape(n, 6).T)
    mass, tangent = (lower + np.tril(lower, -1).T) * both, tangents_of(lane.seen)[0] * both
    if not len(lane.seen.fixed):
        return mass, tangent
    free = np.ix_(*[np.flatnonzero(~lane.seen.fixed.ravel())] * 2)
    return mass[free], tangent[free]
