"""Where markers are in a posture, and how fast they move with each coordinate."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from spinepipe.effects.contract import Array
from spinepipe.motion.skeleton import BODIES, MarkerSet, Skeleton

COUNT = 6 * len(BODIES)
"""Coordinates of all bodies."""


def marker_places(skeleton: Skeleton, markers: MarkerSet, q: Array) -> Array:
    """(F, K, 3) m in ground, of postures (F, 18, 6)."""
    return with_slopes(skeleton, markers, q, slopes=False)[0]


def with_slopes(
    skeleton: Skeleton, markers: MarkerSet, q: Array, slopes: bool = True
) -> tuple[Array, Array]:
    """Places (F, K, 3) m of markers, and their slopes (F, K, 3, 108) by the coordinates."""
    shape = (len(q), len(markers), 3)
    places, found = np.empty(shape), np.zeros((*shape, COUNT) if slopes else (0, 0, 0, 0))
    on_body = np.ascontiguousarray(markers.at)  # another layout would be compiled again
    _place(np.ascontiguousarray(q), *joints_of(skeleton), markers.body, on_body, places, found)
    return places, found


def joints_of(skeleton: Skeleton) -> tuple[Array, Array]:
    """Rotations (18, 3, 3) and origins (18, 3) m of joints in the body below, of the pelvis too."""
    steps = skeleton.steps
    turned = np.array([np.eye(3), *(step.rotation for step in steps)])
    return turned, np.array([np.zeros(3), *(step.origin for step in steps)])


@njit(cache=True)
def forward_kinematics(
    q: Array, turned: Array, apart: Array, turns: Array, origins: Array, axes: Array
) -> None:
    """Forward kinematics of one posture (18, 6), joint after joint from the pelvis up.

    Parameters
    ----------
    turned, apart : each joint's frame in the body below.
    turns, origins, axes : (18, 3, 3), (18, 3) m and (18, 6, 3) of the bodies, which are written;
        an axis for each coordinate, those of rotation z, x' and y'' of Z, X', Y''.
    """
    below, last, base = np.eye(3), np.zeros(3), np.empty((3, 3))
    for b in range(len(turned)):
        now = q[b]
        cz, cx, cy = np.cos(now[3]), np.cos(now[4]), np.cos(now[5])
        sz, sx, sy = np.sin(now[3]), np.sin(now[4]), np.sin(now[5])
        # the joint's frame in ground: of the body below, times the fixed step
        for i in range(3):
            for j in range(3):
                base[i, j] = (
                    below[i, 0] * turned[b, 0, j]
                    + below[i, 1] * turned[b, 1, j]
                    + below[i, 2] * turned[b, 2, j]
                )
        for i in range(3):
            origins[b, i] = last[i]
            for j in range(3):
                origins[b, i] += below[i, j] * apart[b, j] + base[i, j] * now[j]
                axes[b, j, i] = base[i, j]
            # rotation Z, X', Y'' applied to a row of axes, one plane rotation at a time: x and y
            # after the extension, y and z after the bending, z and x after the rotation
            x, y = base[i, 0] * cz + base[i, 1] * sz, base[i, 1] * cz - base[i, 0] * sz
            y, z = y * cx + base[i, 2] * sx, base[i, 2] * cx - y * sx
            axes[b, 3, i], axes[b, 4, i], axes[b, 5, i] = base[i, 2], x, y
            turns[b, i, 0], turns[b, i, 1], turns[b, i, 2] = x * cy - z * sy, y, z * cy + x * sy
        below, last = turns[b], origins[b]


@njit(cache=True)
def _place(
    q: Array,
    turned: Array,
    apart: Array,
    body: NDArray[np.int64],
    on_body: Array,
    places: Array,
    slopes: Array,
) -> None:
    """Forward kinematics and geometric Jacobian, frame by frame.

    A translation moves all above it along its axis; a rotation turns it about its axis w through
    the origin o of the body that it turns, so that a point p moves by w x (p - o).
    """
    bodies = len(turned)
    turns, origins, axes = np.empty((bodies, 3, 3)), np.empty((bodies, 3)), np.empty((bodies, 6, 3))
    for f in range(len(q)):
        forward_kinematics(q[f], turned, apart, turns, origins, axes)
        for k in range(len(body)):
            own, p = turns[body[k]], places[f, k]
            for i in range(3):
                p[i] = origins[body[k], i]
                for j in range(3):
                    p[i] += own[i, j] * on_body[k, j]
            if len(slopes) == 0:
                continue
            for b in range(body[k] + 1):
                x, y, z = p[0] - origins[b, 0], p[1] - origins[b, 1], p[2] - origins[b, 2]
                for j in range(3):
                    w, column = axes[b, 3 + j], 6 * b + j
                    for i in range(3):
                        slopes[f, k, i, column] = axes[b, j, i]
                    slopes[f, k, 0, column + 3] = w[1] * z - w[2] * y
                    slopes[f, k, 1, column + 3] = w[2] * x - w[0] * z
                    slopes[f, k, 2, column + 3] = w[0] * y - w[1] * x
