"""Where markers are in a posture, and how fast they move with each coordinate."""

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.motion.skeleton import BODIES, MarkerSet, Skeleton, rotations

COUNT = 6 * len(BODIES)
"""Coordinates of all bodies."""

_CROSS = np.zeros((3, 3, 3))
"""Levi-Civita symbol: component i of a cross product is the sum of its (i, j, k) a_j b_k."""
_CROSS[[0, 1, 2], [1, 2, 0], [2, 0, 1]], _CROSS[[0, 1, 2], [2, 0, 1], [1, 2, 0]] = 1.0, -1.0


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
    at = origins[:, markers.body] + (turns[:, markers.body] @ markers.at[..., None])[..., 0]
    if not slopes:
        return at, np.zeros(0)
    frames, count = len(q), len(markers)
    found = np.empty((frames, count, 3, len(BODIES), 6))
    carried = np.arange(len(BODIES)) <= markers.body[:, None]
    found[..., :3] = np.transpose(axes[:, :, :3], (0, 3, 1, 2))[:, None]
    # a rotation about axis w through o moves p by w x p - w x o, the first one product for all p
    crossed = np.einsum("ijk,fbcj->fkibc", _CROSS, axes[:, :, 3:])
    still = np.einsum("fkibc,fbk->fibc", crossed, origins)
    moved = at @ crossed.reshape(frames, 3, -1)
    found[..., 3:] = moved.reshape(frames, count, *still.shape[1:]) - still[:, None]
    found *= carried[:, None, :, None]
    return at, found.reshape(frames, count, 3, COUNT)


def _chain(skeleton: Skeleton, q: Array) -> tuple[Array, Array, Array]:
    """Rotations (F, 18, 3, 3), origins (F, 18, 3) m and axes (F, 18, 6, 3) of the coordinates."""
    steps = skeleton.steps
    turned = np.array([np.eye(3), *(step.rotation for step in steps)])
    apart = np.array([np.zeros(3), *(step.origin for step in steps)])
    # joint after joint each body's rotation; all else follows from those at once
    turns = turned @ rotations(q[..., 3:])
    for body in range(1, len(BODIES)):
        turns[:, body] = turns[:, body - 1] @ turns[:, body]
    bases = np.empty_like(turns)
    bases[:, 0], bases[:, 1:] = np.eye(3), turns[:, :-1] @ turned[1:]
    legs = (bases @ q[..., :3, None])[..., 0]
    legs[:, 1:] += (turns[:, :-1] @ apart[1:, :, None])[..., 0]
    axes = np.empty((*legs.shape[:2], 6, 3))
    axes[:, :, :3] = np.swapaxes(bases, 2, 3)
    axes[:, :, 3] = bases[..., 2]
    # x' of the joint: its x after the extension
    cosine, sine = np.cos(q[..., 3, None]), np.sin(q[..., 3, None])
    axes[:, :, 4] = bases[..., 0] * cosine + bases[..., 1] * sine
    axes[:, :, 5] = turns[..., 1]
    return turns, np.cumsum(legs, axis=1), axes
