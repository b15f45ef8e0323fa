"""Where markers are in a posture, and how fast they move with each coordinate."""

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.motion.skeleton import BODIES, MarkerSet, Skeleton, rotations

COUNT = 6 * len(BODIES)
"""Coordinates of all bodies."""


def marker_places(skeleton: Skeleton, markers: MarkerSet, q: Array) -> Array:
    """(F, K, 3) m in ground, of postures (F, 18, 6)."""
    return with_slopes(skeleton, markers, q, slopes=False)[0]


def with_slopes(
    skeleton: Skeleton, markers: MarkerSet, q: Array, slopes: bool = True
) -> tuple[Array, Array]:
    """Places (F, K, 3) m of markers, and their slopes (F, K, 3, 108) by the coordinates.

    A translation moves all above it along its axis; a rotation turns it about its axis through the
    origin of the body that it turns. Axes of rotation: z, x' and y'' of Z, X', Y''.
    """
    turns, origins, axes = _chain(skeleton, q)
    at = origins[:, markers.body] + np.einsum("fkij,kj->fki", turns[:, markers.body], markers.at)
    if not slopes:
        return at, np.zeros(0)
    frames, count = len(q), len(markers)
    found = np.zeros((frames, count, 3, len(BODIES), 6))
    carried = np.arange(len(BODIES))[None, :] <= markers.body[:, None]
    along = axes[:, :, :3]
    found[..., :3] = np.einsum("kb,fbci->fkibc", carried.astype(float), along)
    arms = at[:, :, None, :] - origins[:, None, :, :]
    turning = np.cross(axes[:, None, :, 3:], arms[:, :, :, None, :])
    found[..., 3:] = np.einsum("kb,fkbci->fkibc", carried.astype(float), turning)
    return at, found.reshape(frames, count, 3, COUNT)


def _chain(skeleton: Skeleton, q: Array) -> tuple[Array, Array, Array]:
    """Rotations (F, 18, 3, 3), origins (F, 18, 3) m and axes (F, 18, 6, 3) of the coordinates."""
    frames = len(q)
    turns = np.empty((frames, len(BODIES), 3, 3))
    origins = np.empty((frames, len(BODIES), 3))
    axes = np.empty((frames, len(BODIES), 6, 3))
    local = rotations(q[..., 3:])
    base, place = np.broadcast_to(np.eye(3), (frames, 3, 3)), np.zeros((frames, 3))
    for body in range(len(BODIES)):
        if body:
            step = skeleton.steps[body - 1]
            place = origins[:, body - 1] + turns[:, body - 1] @ step.origin
            base = turns[:, body - 1] @ step.rotation
        origins[:, body] = place + np.einsum("fij,fj->fi", base, q[:, body, :3])
        turns[:, body] = base @ local[:, body]
        axes[:, body, :3] = np.swapaxes(base, 1, 2)
        axes[:, body, 3] = base[:, :, 2]
        axes[:, body, 4] = _second(base, q[:, body, 3])
        axes[:, body, 5] = turns[:, body, :, 1]
    return turns, origins, axes


def _second(base: Array, extension: Array) -> Array:
    """(F, 3) x' of the joint: its x after the extension."""
    found: Array = (
        base[:, :, 0] * np.cos(extension)[:, None] + base[:, :, 1] * np.sin(extension)[:, None]
    )
    return found
