"""Muscles as strings: pulled tight over the vertebrae that they lie on.

A fascicle runs through its points as a string. Where it passes vertebrae that it is not fixed to, a
bar across each of them, behind the vertebra and parallel to its right-left axis, keeps it off: the
string is the shortest that stays behind all bars. It slides along a bar without friction, so the
length is continuous when it touches and when it lifts off, and lever arms are slopes of the length.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from spinepipe.effects.contract import Array

MOST_BARS = 17
MOST_ROUNDS = 60
_TOUCH_M = 1e-10
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
def _slide(x: Array, at: Array, along: Array, s: Array, n: int) -> None:
    """Move n contacts along their bars until the string is shortest; Newton, tridiagonal.

    The ends of the string are x[0] and x[n + 1]; its contacts are set between them.
    """
    upper, lower, right = np.zeros(n), np.zeros(n), np.zeros(n)
    middle, u = np.zeros(n), np.zeros(3)
    for _ in range(_STEPS):
        for i in range(n):
            for k in range(3):
                x[i + 1, k] = at[i, k] + s[i] * along[i, k]
        middle[:], upper[:], right[:] = 0.0, 0.0, 0.0
        for i in range(n + 1):
            length = _between(x[i], x[i + 1], u) + 1e-12
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
        if largest < 1e-13:
            return
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
    """How far the string from p to q passes behind a bar, and where along the bar."""
    a, b, c, e, away, rising = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(3):
        d, w = q[k] - p[k], p[k] - bar[k]
        a, e = a + d * d, e + d * w
        b, c = b + d * along[k], c + w * along[k]
        away, rising = away + w * behind[k], rising + d * behind[k]
    rest = a - b * b
    t = 0.0
    if rest > 1e-18:
        t = min(max((b * c - e) / rest, 0.0), 1.0)
    return away + t * rising, c + t * b


@njit(cache=True)
def _over(ends: Array, bars: Array, along: Array, behind: Array, touched: Array, s: Array) -> int:
    """Which of the bars the string touches (flags, set), where (s, set); rounds taken."""
    n = len(bars)
    at, across, slid = np.zeros((n, 3)), np.zeros((n, 3)), np.zeros(n)
    index, x = np.zeros(n, dtype=np.int64), np.zeros((n + 2, 3))
    back, on = np.zeros(3), np.zeros(3)
    x[0] = ends[0]
    touched[:] = False
    for rounds in range(MOST_ROUNDS):
        k = 0
        for i in range(n):
            if touched[i]:
                at[k], across[k], slid[k], index[k] = bars[i], along[i], s[i], i
                k += 1
        x[k + 1] = ends[1]
        _slide(x, at, across, slid, k)
        for j in range(k):
            s[index[j]] = slid[j]
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
        pull, which = -1e-12, -1
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
def wrap_path(
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
    """Strings pulled tight, and what a unit of tension does to the bodies.

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
    trace = np.zeros((many, most + MOST_BARS, 3))
    held = np.zeros(most + MOST_BARS, dtype=np.int64)
    lying = np.full((many, most + MOST_BARS), -1)
    ends, u, back = np.zeros((2, 3)), np.zeros(3), np.zeros(3)
    for m in range(many):
        x, n, bar = trace[m], 0, first_bar[m]
        for k in range(most):
            if body[m, k] < 0:
                break
            x[n], held[n] = points[m, k], body[m, k]
            n += 1
            stop = bar
            while stop < first_bar[m + 1] and bar_leg[stop] == k:
                stop += 1
            if stop > bar:
                ends[0], ends[1] = points[m, k], points[m, k + 1]
                touched, s = np.zeros(stop - bar, dtype=np.bool_), np.zeros(stop - bar)
                _over(ends, bars[bar:stop], along[bar:stop], behind[bar:stop], touched, s)
                for i in range(stop - bar):
                    if touched[i]:
                        x[n] = bars[bar + i] + s[i] * along[bar + i]
                        held[n] = -1 - bar_body[bar + i]
                        n += 1
                        contacts[m] += 1
            bar = stop
        traced[m] = n
        for k in range(n):
            lying[m, k] = held[k] if held[k] >= 0 else -1 - held[k]
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
        for k in range(1, n - 1):
            if held[k] < 0:
                back /= _between(x[k], x[k - 1], back)
                u /= _between(x[k], x[k + 1], u)
                back += u
                pushes[m] += np.sqrt(_dot(back, back))
    return lengths, forces, moments, contacts, pushes, trace, traced, lying
