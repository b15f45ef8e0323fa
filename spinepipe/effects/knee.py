"""A knee of any sharpness: a line that bends from one slope to another, and its chords.

``G(u) = u (1 + |u|^n)^(-1/n)`` goes from -1 to 1 with slope 1 at zero: by a corner at ±1 where n is
large, as ``u / sqrt(1 + u^2)`` for n = 2, and near tanh(u) for n = 2.7.
"""

import numpy as np

from spinepipe.effects.contract import Array

NEAR = 3e-3
"""Chords shorter than this are taken as a mean of slopes: differences would lose their digits."""

_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(5)
_POINTS, _WEIGHTS = 0.5 * (_POINTS + 1.0), 0.5 * _WEIGHTS

_LEAST = 1e-150
"""In place of zero where a logarithm is taken: what it is a factor of vanishes there."""


def inside(u: Array, n: Array) -> tuple[Array, Array, Array]:
    """``g(u) = G(u) / u`` and its derivatives by u and n."""
    log, steep, whole = _powers(u, n)
    g = np.exp(-whole / n)
    size = np.maximum(np.abs(u), _LEAST)
    return g, -np.sign(u) * g * steep / size, g * (whole / n - steep * log) / n


def _powers(u: Array, n: Array) -> tuple[Array, Array, Array]:
    """``log|u|``, ``|u|^n / (1 + |u|^n)`` and ``log(1 + |u|^n)``; none is infinite."""
    log = np.log(np.maximum(np.abs(u), _LEAST))
    whole = np.logaddexp(0.0, n * log)
    return log, np.exp(n * log - whole), whole


def _slope(u: Array, n: Array) -> tuple[Array, Array, Array]:
    """``G'(u) = (1 + |u|^n)^(-1/n - 1)`` and its derivatives by u and n."""
    log, steep, whole = _powers(u, n)
    slope = np.exp(-(1.0 / n + 1.0) * whole)
    size = np.maximum(np.abs(u), _LEAST)
    by_u = -np.sign(u) * slope * (n + 1.0) * steep / size
    return slope, by_u, slope * (whole / n**2 - (1.0 / n + 1.0) * steep * log)


def chord(u: Array, n: Array, offset: Array) -> tuple[Array, Array, Array, Array]:
    """``(G(u - offset) + G(offset)) / u`` and its derivatives by u, n and offset.

    That is the mean slope of G from -offset to u - offset.
    """
    u, n, offset = np.broadcast_arrays(u, n, offset)
    near = np.abs(u) < NEAR
    found = _difference(np.where(near, 1.0, u), n, offset)
    if near.any():
        found[:, near] = _mean_slope(u[near], n[near], offset[near])
    return found[0], found[1], found[2], found[3]


def _difference(u: Array, n: Array, offset: Array) -> Array:
    """(4, ...) value and derivatives from G and its slope at both ends of the chord."""
    ends = np.stack([u - offset, offset])
    log, steep, whole = _powers(ends, n)
    g, slope = np.exp(-whole / n), np.exp(-(1.0 / n + 1.0) * whole)
    g_by_n = g * (whole / n - steep * log) / n
    mean, by_n = (ends * g).sum(axis=0) / u, (ends * g_by_n).sum(axis=0) / u
    return np.stack([mean, (slope[0] - mean) / u, by_n, (slope[1] - slope[0]) / u])


def _mean_slope(u: Array, n: Array, offset: Array) -> Array:
    """The same by Gauss's rule with five points, for short chords."""
    found = np.zeros((4, *u.shape))
    for point, weight in zip(_POINTS, _WEIGHTS, strict=True):
        slope, by_u, by_n = _slope(point * u - offset, n)
        found += weight * np.stack([slope, point * by_u, by_n, -by_u])
    return found
