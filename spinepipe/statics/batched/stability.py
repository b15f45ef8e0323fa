"""Which equilibria of a stack are stable for sure.

In coordinates where damping is one, M x'' + x' + (S + A) x = 0, with the tangent's symmetric and
skew parts S and A. Let A grow from nothing to what it is, t A: without A motion decays if S is
positive definite, and it decays to the end unless for some t a mode x exp(i w t) neither grows nor
decays. Such a mode has

    x* S x = w^2 x* M x   and   t x* (i A) x = -w x* x,   hence |w| <= |A|.

There is none up to a w where S - w^2 M is positive definite, which up to |A| proves nearly all
spines of up to ten joints. A moment m on a single vertebra is what A is of in most tests: then
A = U B U', with the turns U' of that vertebra about two axes across m and B = |m|/2 ((0, 1), (-1,
0)), and a mode at w needs, with H = S - w^2 M + i w and F(w) = U' H^-1 U,

    det(1 + t B F) = 1 + t^2 (|m|/2)^2 det F(w) = 0   (F is symmetric).

There is none where (|m|/2)^2 det F is no number from minus infinity to -1. F is computed at a few
w; how far off it may be between these is bounded, for |H(w)^-1| <= 1/w: with X = H^-1 U and E the
change of H, F changes by X' E X and at most |E X|^2 / w more (Nyquist's criterion, with bounds
between its samples). The rest is proven by the rates of all modes.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects.contract import Array, Indices
from spinepipe.statics.batched.dynamics import inertias_of, masses_of, momenta_of, tangents_of
from spinepipe.statics.batched.forward_kinematics import KinematicsAndLoads, forward_kinematics
from spinepipe.statics.batched.loads import Chains, Loads, part
from spinepipe.statics.batched.stability_certificate import (
    fill_skew_bounds,
    is_positive_definite,
    respond,
)
from spinepipe.statics.batched.vectors import blocks, lanes
from spinepipe.statics.equilibrium import decays

Flags = NDArray[np.bool_]

FIRST = (0.8, 0.6, 0.4, 0.2, 0.1)
"""Shares of |A| up to which S - w^2 M may be positive definite."""

PIECE, HALVINGS = 1.25, 5
"""Between that and |A|, F is bounded in pieces that end so many times above their start at most,
and one that fails is halved so often."""

STIFF = 1e6
"""Of the largest stiffness, springs on coordinates that a rig fixes."""

EVEN = 1e-12
"""Of a tangent's largest entry: by less, rounding makes what a joint holds unsymmetric."""


def surely_stable(chains: Chains, loads: Loads, q: Array, tangents: Array) -> Flags:
    """(N,) which lanes are stable at q (N, J, 6) with the joints' tangents (N, J, 6, 6)."""
    every = lanes_of(chains, loads, q, tangents)
    proven = proven_by_forms(every)
    for lane in np.flatnonzero(~proven):  # few: by the rates of all their modes
        mass, stiffness = matrices(every.part(np.array([lane])))
        sign, _ = np.linalg.slogdet(stiffness)
        proven[lane] = sign > 0.0 and decays(mass, stiffness)
    return proven


def lanes_of(chains: Chains, loads: Loads, q: Array, tangents: Array) -> "DynamicLanes":
    """Lanes at q (N, J, 6) with all that decides their stability."""
    sprung, chain = tangents, loads.chain
    if loads.supports.there:
        # stiff springs on what a rig fixes: a form that is positive with them is so in all rates
        # that leave fixed coordinates at rest, where the springs add nothing; what they prove is
        # proven however stiff they are
        sprung = tangents.copy()
        stiff = STIFF * np.abs(tangents).max(axis=(1, 2, 3), initial=1.0)
        springs = np.where(loads.supports.fixed, stiff[:, None, None], 0.0)
        sprung[:, :, range(6), range(6)] += springs
    seen = forward_kinematics(chains, loads, q, sprung)
    bent = np.abs(tangents - tangents.swapaxes(2, 3)).max(axis=(1, 2, 3))
    even = bent <= EVEN * np.abs(tangents).max(axis=(1, 2, 3))
    return DynamicLanes(seen, inertias_of(chains, chain, seen), chains.damping[chain], loads, even)


def proven_by_forms(every: "DynamicLanes") -> Flags:
    """(N,) which lanes are proven stable without the rates of their modes."""
    top = every.top
    proven = every.is_positive_definite(top)
    doubt = np.flatnonzero(~proven)
    if len(doubt):
        proven[doubt] = _by_response(every.part(doubt), top[doubt])
    return proven


@dataclass(frozen=True, eq=False)
class DynamicLanes:
    """Lanes with the inertia of each vertebra by its twist, in blocks (B, J, 6, 6, 4), and damping.

    Attributes
    ----------
    damping : (N, J, 6). even : (N,) whether what the joints hold is symmetric.
    """

    seen: KinematicsAndLoads
    inertia: Array
    damping: Array
    loads: Loads
    even: Flags

    def part(self, chosen: Indices) -> "DynamicLanes":
        """Some of them."""
        inertia = blocks(lanes(self.inertia, self.seen.count)[chosen])
        of = (self.damping[chosen], part(self.loads, chosen), self.even[chosen])
        return DynamicLanes(self.seen.part(chosen), inertia, *of)

    @property
    def top(self) -> Array:
        """(N,) no less than |A|."""
        squares = np.empty((len(self.inertia), self.inertia.shape[-1]))
        fill_skew_bounds(self.seen.numbers, blocks(self.damping), squares)
        return np.sqrt(lanes(squares, self.seen.count))

    def is_positive_definite(self, rate: Array) -> Flags:
        """(N,) whether S - w^2 M is positive definite at w = rate (N,)."""
        found = np.zeros(len(rate), dtype=bool)
        is_positive_definite(self.seen.numbers, self.inertia, blocks(rate**2), found)
        return found

    def moment(self) -> tuple[Flags, Indices, Array]:
        """(N,) whether moments act on one vertebra alone, which, and their sum (N, 3)."""
        rows, total = np.arange(len(self.damping)), np.zeros((*self.damping.shape[:2], 3))
        for body, moment in zip(
            self.loads.bodies.T, self.loads.moments.swapaxes(0, 1), strict=True
        ):
            np.add.at(total, (rows, body), moment * (body >= 0)[:, None])
        there = total.any(axis=2)
        body = there.argmax(axis=1)
        return there.sum(axis=1) == 1, body, total[rows, body]


def _by_response(every: DynamicLanes, top: Array) -> Flags:
    """(N,) which spines under a moment on one vertebra have no mode with w up to top (N,).

    Nyquist's criterion on det F(w), with bounds between its samples; see the head of this file.
    """
    # up to low the form itself is positive: only between it and |A| is F looked at
    low = np.zeros(len(top))
    for share in FIRST:
        low = np.where((low == 0.0) & every.is_positive_definite(share * top), share * top, low)
    single, body, moment = every.moment()
    found: Flags = single & every.even & (low > 0.0)
    going = np.flatnonzero(found)
    if not len(going):
        return found
    # two axes across the moment; the ground axis that it is least along gives the first of them
    size = np.linalg.norm(moment, axis=1)
    least = np.eye(3)[np.abs(moment).argmin(axis=1)]
    one = np.cross(moment, least)
    both = np.stack([one, np.cross(moment, one)], axis=1)
    across = both / np.maximum(np.linalg.norm(both, axis=2, keepdims=True), np.finfo(float).tiny)
    seen = (every.seen.axes, every.seen.rows, every.seen.stiff, every.seen.slopes)
    # trace of C^-1 M bounds x* M x by x* C x, for what the change of H does to F
    inertia = lanes(every.inertia, len(top))
    momenta = momenta_of(every.seen.axes, inertia)
    trace = np.sum(np.sum(momenta * every.seen.axes, axis=3) / every.damping, axis=(1, 2))
    # pieces of equal ratio from low to |A|, each sampled at its geometric middle
    width = np.log(top[going] / low[going])
    count = np.ceil(width / np.log(PIECE)).astype(np.int64)
    lane, ratio = np.repeat(going, count), np.exp(np.repeat(width / count, count))
    number = np.arange(len(lane)) - np.repeat(np.cumsum(count) - count, count)
    begin, end = low[lane] * ratio**number, low[lane] * ratio ** (number + 1)
    for _ in range(HALVINGS):
        middle = np.sqrt(begin * end)
        compliance, moving = np.empty((len(lane), 2, 2), complex), np.empty(len(lane))
        respond(seen, inertia, every.damping, (body, across), (lane, middle), compliance, moving)
        # x* C x of both motions, told by the imaginary part, and how far off F may be in the piece
        damped = -np.trace(compliance.imag, axis1=1, axis2=2) / middle
        squares, rates = end**2 - middle**2, end - middle
        beside = squares * np.sqrt(trace[lane] * moving) + rates * np.sqrt(damped)
        off = squares * moving + rates * damped + beside**2 / begin
        gain = (0.5 * size[lane]) ** 2
        # det F may lie this far from where it was sampled: is the ray (-inf, -1] further away?
        number = gain * np.linalg.det(compliance)
        change = gain * (np.linalg.norm(compliance, axis=(1, 2)) * off + 0.5 * off**2)
        distance = np.where(number.real < -1.0, np.abs(number.imag), np.abs(1.0 + number))
        left = np.flatnonzero(~(distance > change))
        if not len(left):
            return found
        lane = np.repeat(lane[left], 2)  # pieces that prove nothing are halved
        ends = np.stack([begin[left], middle[left], end[left]], axis=1)
        begin, end = ends[:, :2].ravel(), ends[:, 1:].ravel()
    found[lane] = False
    return found


def matrices(lane: DynamicLanes) -> tuple[Array, Array]:
    """Mass matrix and tangent (n, n) of one lane's free coordinates, where damping is one."""
    scale = 1.0 / np.sqrt(lane.damping.ravel())
    both = scale[:, None] * scale
    mass = masses_of(lane.seen, lanes(lane.inertia, 1))[0] * both
    tangent = tangents_of(lane.seen)[0] * both
    if not len(lane.seen.fixed):
        return mass, tangent
    free = np.ix_(*[np.flatnonzero(~lane.seen.fixed.ravel())] * 2)
    return mass[free], tangent[free]
