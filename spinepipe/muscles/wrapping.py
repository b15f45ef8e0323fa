"""Muscle paths over vertebrae: shortest strings over cylinders of no radius, by an active set.

A fascicle runs through its points as a string. Where it passes vertebrae that it is not fixed to, a
bar across each of them, behind the vertebra and parallel to its right-left axis, keeps it off: the
string is the shortest that stays behind all bars. It slides along a bar without friction, so the
length is continuous when it touches and when it lifts off, and lever arms are slopes of the length.

The length is a convex function of where the contacts are, and bars bound it on one side: an
active-set method (Nocedal and Wright 2006, section 16.5) finds which bars carry the string, and
Newton's method where on them its contacts lie.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from spinepipe.effects.contract import Array

MOST_BARS = 17
MOST_ROUNDS = 60
_TOUCH_M = 1e-10
"""A string that passes this far before a bar touches it: above rounding of places in a body."""
_PULL = -1e-12
"""Push of a bar, per newton of tension, that counts as a pull: below rounding of unit vectors."""
_STEPS = 50


@njit(cache=True)
def _dot(a: Array, b: Array) -> float:
    """Of two vectors (3,): `@` would hand so few numbers to BLAS, which takes ten times as long."""
    return float(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


@njit(cache=True)
def _between(a: Array, b: Array, way: Array) -> float:
    """Distance from a to b, whose difference is written to `way`: an array made anew costs more."""
    for k in range(3):
        way[k] = b[k] - a[k]
    return float(np.sqrt(_dot(way, way)))


@njit(cache=True)
def _slide_contacts(x: Array, at: Array, along: Array, s: Array, n: int) -> None:
    """Newton's method for the n places s along bars at which a string is shortest.

    The ends of the string are x[0] and x[n + 1]; its contacts at + s along are set between them. A
    contact knows its two neighbours alone, so the Hessian is tridiagonal.
    """
    upper, lower, right = np.zeros(n), np.zeros(n), np.zeros(n)
    middle, u = np.zeros(n), np.zeros(3)
    for _ in range(_STEPS):
        for i in range(n):
            for k in range(3):
                x[i + 1, k] = at[i, k] + s[i] * along[i, k]
        middle[:], upper[:], right[:] = 0.0, 0.0, 0.0
        # negative gradient and Hessian of the length, piece by piece: a piece of unit vector u and
        # length l pulls its ends by u, and resists being turned by (1 - u u^T) / l
        for i in range(n + 1):
            length = _between(x[i], x[i + 1], u) + 1e-12  # neighbours may lie on one place
            u /= length
            if i > 0:
                c = _dot(along[i - 1], u)
                right[i - 1] += c
                middle[i - 1] += (1.0 - c * c) / length
            if i < n:
                c = _dot(along[i], u)
                right[i] -= c
                middle[i] += (1.0 - c * c) / length
            if 0 < i < n:
                a, b = _dot(along[i - 1], u), _dot(along[i], u)
                upper[i - 1] = -(_dot(along[i - 1], along[i]) - a * b) / length
        largest = 0.0
        for i in range(n):
            largest = max(largest, abs(right[i]))
        if largest < 1e-13:  # a few roundings of unit vectors
            return
        # Thomas' algorithm: forward elimination, then back substitution into the step
        lower[:] = upper
        for i in range(1, n):
            factor = lower[i - 1] / middle[i - 1]
            middle[i] -= factor * upper[i - 1]
            right[i] -= factor * right[i - 1]
        for i in range(n - 1, -1, -1):
            if i < n - 1:
                right[i] -= upper[i] * right[i + 1]
            right[i] /= middle[i]
            s[i] += right[i]


@njit(cache=True)
def _gap(p: Array, q: Array, bar: Array, along: Array, behind: Array) -> tuple[float, float]:
    """How far the string from p to q passes behind a bar, and where along the bar.

    At the place of the string that is nearest to the bar's line, t of the way from p to q.
    """
    a, b, c, e, away, rising = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(3):
        d, w = q[k] - p[k], p[k] - bar[k]
        a, e = a + d * d, e + d * w
        b, c = b + d * along[k], c + w * along[k]
        away, rising = away + w * behind[k], rising + d * behind[k]
    rest = a - b * b
    t = 0.0
    if rest > 1e-18:  # m2; else the string runs along the bar, and any place is as near
        t = min(max((b * c - e) / rest, 0.0), 1.0)
    return away + t * rising, c + t * b


@njit(cache=True)
def _active_bars(
    ends: Array, bars: Array, along: Array, behind: Array, touched: Array, s: Array
) -> int:
    """Active set of a string from ends[0] to ends[1]: which bars it touches (flags, set), where
    along them (s, set); rounds taken.

    Each round solves for the bars of the set, then takes in the bar that the string passes farthest
    on the wrong side, or where there is none leaves out the one that would have to pull it. A bar
    just taken in is cleared and one just left out is slack, beyond the tolerances, so rounding does
    not bring back the set of the round before; for the rest rounds are bounded.
    """
    n = len(bars)
    at, across, slid = np.zeros((n, 3)), np.zeros((n, 3)), np.zeros(n)
    index, x = np.zeros(n, dtype=np.int64), np.zeros((n + 2, 3))
    back, on = np.zeros(3), np.zeros(3)
    x[0] = ends[0]
    touched[:] = False
    for rounds in range(MOST_ROUNDS):
        # the equality-constrained problem: contacts on the bars of the set
        k = 0
        for i in range(n):
            if touched[i]:
                at[k], across[k], slid[k], index[k] = bars[i], along[i], s[i], i
                k += 1
        x[k + 1] = ends[1]
        _slide_contacts(x, at, across, slid, k)
        for j in range(k):
            s[index[j]] = slid[j]
        # primal feasibility: the bar that is passed farthest in front comes in
        worst, which, place, before = -_TOUCH_M, -1, 0.0, 0
        for i in range(n):
            if touched[i]:
                before += 1
                continue
            gap, along_bar = _gap(x[before], x[before + 1], bars[i], along[i], behind[i])
            if gap < worst:
                worst, which, place = gap, i, along_bar
        if which >= 0:
            touched[which] = True
            s[which] = place
            continue
        # dual feasibility: the bar whose multiplier, its push backwards, is most negative goes out
        pull, which = _PULL, -1
        for j in range(k):
            first, second = _between(x[j + 1], x[j], back), _between(x[j + 1], x[j + 2], on)
            bar = behind[index[j]]
            push = -_dot(back, bar) / first - _dot(on, bar) / second
            if push < pull:
                pull, which = push, index[j]
        if which < 0:
            return rounds
        touched[which] = False
    return MOST_ROUNDS


@njit(cache=True)
def wrap_paths(
    points: Array,
    body: NDArray[np.int64],
    first_bar: NDArray[np.int64],
    bar_leg: NDArray[np.int64],
    bar_body: NDArray[np.int64],
    bars: Array,
    along: Array,
    behind: Array,
    bodies: int,
) -> tuple[
    Array, Array, Array, NDArray[np.int64], Array, Array, NDArray[np.int64], NDArray[np.int64]
]:
    """Shortest paths of muscles over bars, and what a unit of tension does to the bodies.

    Parameters
    ----------
    points : (M, P, 3) m, in ground, where bodies are now. body : (M, P), below 0 past the end.
    first_bar : (M + 1,) where each muscle's bars begin in the lists below, caudal to cranial or
        the other way round, as the muscle runs.
    bar_leg, bar_body, bars, along, behind : (B,), (B,), (B, 3) each: between which points the bar
        is met (leg k is from point k to k + 1), its vertebra, a point of it, m, and directions.

    Returns
    -------
    lengths (M,) m; forces (M, bodies, 3) and moments about the origin (M, bodies, 3) per newton;
    contacts (M,); pushes (M,), sum of the contact forces per newton; trace (M, P + bars, 3) m, the
    points of the strings; traced (M,), how many; on (M, P + bars), the body that each lies on.
    """
    many, most = body.shape
    lengths, pushes = np.zeros(many), np.zeros(many)
    forces, moments = np.zeros((many, bodies, 3)), np.zeros((many, bodies, 3))
    contacts, traced = np.zeros(many, dtype=np.int64), np.zeros(many, dtype=np.int64)
    # room for a path that touches every bar between two of its points
    trace = np.zeros((many, most + MOST_BARS, 3))
    lying = np.full((many, most + MOST_BARS), -1)
    on_bar = np.zeros(most + MOST_BARS, dtype=np.bool_)
    ends, u, back = np.zeros((2, 3)), np.zeros(3), np.zeros(3)
    for m in range(many):
        # the muscle's own points, and between them its contacts with the bars of that leg
        x, n, bar = trace[m], 0, first_bar[m]
        for k in range(most):
            if body[m, k] < 0:
                break
            x[n], lying[m, n], on_bar[n] = points[m, k], body[m, k], False
            n += 1
            stop = bar
            while stop < first_bar[m + 1] and bar_leg[stop] == k:
                stop += 1
            if stop > bar:
                ends[0], ends[1] = points[m, k], points[m, k + 1]
                touched, s = np.zeros(stop - bar, dtype=np.bool_), np.zeros(stop - bar)
                _active_bars(ends, bars[bar:stop], along[bar:stop], behind[bar:stop], touched, s)
                for i in range(stop - bar):
                    if touched[i]:
                        x[n] = bars[bar + i] + s[i] * along[bar + i]
                        lying[m, n], on_bar[n] = bar_body[bar + i], True
                        n += 1
                        contacts[m] += 1
            bar = stop
        traced[m] = n
        # each piece pulls the bodies of its two ends towards each other
        for k in range(n - 1):
            length = _between(x[k], x[k + 1], u)
            lengths[m] += length
            if length > 0.0:
                u /= length
            for end in range(2):
                on, at = lying[m, k + end], x[k + end]
                sign = 1.0 if end == 0 else -1.0
                for i in range(3):
                    j, h = (i + 1) % 3, (i + 2) % 3
                    forces[m, on, i] += sign * u[i]
                    moments[m, on, i] += sign * (at[j] * u[h] - at[h] * u[j])
        # a contact is pushed by the sum of the two unit tensions that meet there
        for k in range(1, n - 1):
            if on_bar[k]:
                back /= _between(x[k], x[k - 1], back)
                u /= _between(x[k], x[k + 1], u)
                back += u
                pushes[m] += np.sqrt(_dot(back, back))
    return lengths, forces, moments, contacts, pushes, trace, traced, lying
