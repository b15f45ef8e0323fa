"""How groups of markers are turned, taken for rigid: a first look at a motion, without a model."""

import numpy as np
from numpy.typing import NDArray

from spinepipe.decomposition import svd
from spinepipe.effects.contract import Array

FLAT = 1e-6
"""Second extent of a group over its first below which it is a line, which tells no turn.

Two markers are a line, and one has no extent.
"""


def turns(model: Array, places: Array, seen: NDArray[np.bool_]) -> tuple[Array, NDArray[np.bool_]]:
    """Rotations (F, 3, 3) that take a group nearest to where it was seen, and whether it tells one.

    Frames with fewer than three markers in sight, or markers in one line, tell none; theirs is
    that of no turn. Mirrored places are met as well as a rotation can.

    Parameters
    ----------
    model : (K, 3) m. places : (F, K, 3) m. seen : (F, K).
    """
    count = seen.sum(axis=1)
    share = seen[..., None] / np.maximum(count, 1)[:, None, None]
    from_middle = seen[..., None] * (model - (share * model).sum(axis=1, keepdims=True))
    apart = seen[..., None] * (places - (share * places).sum(axis=1, keepdims=True))
    left, sizes, right = svd(np.einsum("fki,fkj->fij", apart, from_middle))
    told = np.asarray(sizes[:, 1] > FLAT * np.maximum(sizes[:, 0], FLAT**3))
    hand = np.ones((len(places), 3))
    hand[:, 2] = np.sign(np.linalg.det(left) * np.linalg.det(right))
    found = np.einsum("fij,fj,fjk->fik", left, hand, right)
    return np.where(told[:, None, None], found, np.eye(3)), told


def angles(rotations: Array) -> Array:
    """(..., 3) rad: extension, right bending and left rotation of rotations (..., 3, 3)."""
    across = np.arcsin(np.clip(rotations[..., 2, 1], -1.0, 1.0))
    up = np.arctan2(-rotations[..., 0, 1], rotations[..., 1, 1])
    along = np.arctan2(-rotations[..., 2, 0], rotations[..., 2, 2])
    return np.stack([up, across, along], axis=-1)
