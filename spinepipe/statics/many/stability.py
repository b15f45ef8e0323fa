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

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects.contract import Array, Indices
from spinepipe.statics.equilibrium import decays
from spinepipe.statics.many.kernel import Chains, Loads, Survey, surveyed
from spinepipe.statics.many.proofs import apart, twists

Flags = NDArray[np.bool_]

FIRST = (0.8, 0.6, 0.4, 0.2)
"""Shares of |A| up to which c = 0 is tried."""

FURTHER, WEIGHTS = (1.5, 1.2, 1.1), (0.5, 1.0, 0.25)
"""Factors by which an interval ends above its start v1, and c over v1 tr(M)."""

MOST_INTERVALS = 12


def surely_stable(chains: Chains, loads: Loads, q: Array, tangents: Array) -> Flags:
    """(N,) which lanes are stable at q (N, J, 6) with the joints' tangents (N, J, 6, 6)."""
    seen = surveyed(chains, loads, q, tangents)
    damping = chains.damping[loads.chain]
    square = np.zeros(len(q))
    twists(seen, damping, square)
    top = np.sqrt(square)
    proven = _apart(seen, damping, 0.0 * top, top, 0.0 * top)
    doubt = np.flatnonzero(~proven)
    if len(doubt):
        proven[doubt] = _by_intervals(_part(seen, doubt), damping[doubt], top[doubt])
    for lane in np.flatnonzero(~proven):
        proven[lane] = _modes_decay(_part(seen, np.array([lane])), damping[lane])
    return proven


def _part(seen: Survey, lanes: Indices) -> Survey:
    """Some of the lanes."""
    return Survey(*(numbers[lanes] for numbers in seen))


def _apart(seen: Survey, damping: Array, low: Array, high: Array, weight: Array) -> Flags:
    """(N,) whether no mode lies between two rates; see `apart`."""
    found = np.zeros(len(low), dtype=bool)
    apart(seen, damping, low, high, weight, found)
    return found


def _by_intervals(seen: Survey, damping: Array, top: Array) -> Flags:
    """(N,) interval by interval up to top (N,)."""
    reached, nothing = np.zeros(len(top)), np.zeros(len(top))
    for share in FIRST:
        left = np.flatnonzero(reached == 0.0)
        some = (_part(seen, left), damping[left], nothing[left])
        good = _apart(*some, share * top[left], nothing[left])
        reached[left[good]] = share * top[left[good]]
    inertia = _trace(seen, damping)
    for _ in range(MOST_INTERVALS):
        going = np.flatnonzero((reached > 0.0) & (reached < top))
        before = reached.copy()
        for factor in FURTHER:
            for share in WEIGHTS:
                left = going[reached[going] == before[going]]
                low = reached[left]
                high, weight = np.minimum(factor * low, top[left]), share * low * inertia[left]
                good = _apart(_part(seen, left), damping[left], low, high, weight)
                reached[left[good]] = high[good]
        if not (reached > before).any():
            break
    found: Flags = reached >= top
    return found & (reached > 0.0)


def _trace(seen: Survey, damping: Array) -> Array:
    """(N,) trace of the mass matrix where damping is one."""
    momenta = seen.axes @ _and_beyond(seen.inertia)
    return np.sum(np.sum(momenta * seen.axes, axis=3) / damping, axis=(1, 2))


def _and_beyond(values: Array) -> Array:
    """Sums over a joint's vertebra and all those cranial to it, along axis 1."""
    result: Array = np.cumsum(values[:, ::-1], axis=1)[:, ::-1]
    return result


def masses(seen: Survey) -> Array:
    """(N, n, n) mass matrices, kg, kg m and kg m2."""
    count = len(seen.axes)
    momenta = (seen.axes @ _and_beyond(seen.inertia)).reshape(count, -1, 6)
    lower = np.tril(momenta @ seen.axes.reshape(count, -1, 6).swapaxes(1, 2))
    result: Array = lower + np.tril(lower, -1).swapaxes(1, 2)
    return result


def stiffnesses(seen: Survey) -> Array:
    """(N, n, n) tangents."""
    count, joints = seen.axes.shape[:2]
    n = 6 * joints
    axes = seen.axes.reshape(count, n, 6).swapaxes(1, 2)
    turned = seen.axes[..., :3] @ seen.slopes
    down = (turned + seen.rows).reshape(count, n, 6) @ axes
    moments = (seen.slopes @ seen.axes.swapaxes(2, 3)).swapaxes(2, 3)  # L s of each axis s
    up = (moments.reshape(count, n, 3) @ axes[:, :3]).swapaxes(1, 2)
    joint = np.repeat(np.arange(joints), 6)
    found = -np.where(joint[:, None] > joint, down, up)
    within = seen.blocks - turned @ seen.axes.swapaxes(2, 3)
    for j in range(joints):
        found[:, 6 * j : 6 * j + 6, 6 * j : 6 * j + 6] = within[:, j]
    return found


def _modes_decay(seen: Survey, damping: Array) -> bool:
    """Of one lane, mode by mode."""
    scale = 1.0 / np.sqrt(damping.ravel())
    both = scale[:, None] * scale
    mass, stiffness = masses(seen)[0] * both, stiffnesses(seen)[0] * both
    sign, _ = np.linalg.slogdet(stiffness)
    return bool(sign > 0.0 and decays(mass, stiffness))
