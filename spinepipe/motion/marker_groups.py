"""Groups of markers taken for rigid, without a model: how they are turned, how rigid they are."""

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from spinepipe.decomposition import svd
from spinepipe.effects.contract import Array

FLAT = 1e-6
"""Second extent of a group over its first below which it is a line, which tells no turn.

Two markers are a line, and one has no extent.
"""

FEWEST_FRAMES = 3
"""Of which a spread over time is told."""


@dataclass(frozen=True)
class Rigidity:
    """How much the distances between the markers of a cluster vary.

    Attributes
    ----------
    variability_m : SD over time of each distance, their mean; None where too few frames see all.
    variability_percent : each SD as a share of its mean distance, their mean.
    frames : that see the whole cluster.
    """

    variability_m: float | None
    variability_percent: float | None
    frames: int


def rigidity(places: Array, seen: NDArray[np.bool_]) -> Rigidity:
    """Rigidity of markers (F, K, 3) m, over frames in which all of them are seen (F, K)."""
    whole = places[seen.all(axis=1)]
    if len(whole) < FEWEST_FRAMES or places.shape[1] < 2:
        return Rigidity(None, None, len(whole))
    apart = [
        np.linalg.norm(whole[:, i] - whole[:, j], axis=1)
        for i, j in combinations(range(places.shape[1]), 2)
    ]
    spread = np.std(apart, axis=1, ddof=1)
    share = 100.0 * spread / np.mean(apart, axis=1)
    return Rigidity(float(spread.mean()), float(share.mean()), len(whole))


def rigid_rotations(
    model: Array, places: Array, seen: NDArray[np.bool_]
) -> tuple[Array, NDArray[np.bool_]]:
    """Rotations (F, 3, 3) that take a group nearest to where it was seen, and whether it tells one.

    Least squares by singular values (Kabsch 1976; Umeyama 1991 for the sign of the third).
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
    # FLAT**3: a group without any extent has two sizes of zero, which would pass each other
    told = np.asarray(sizes[:, 1] > FLAT * np.maximum(sizes[:, 0], FLAT**3))
    # the least direction is turned over where the product would mirror
    hand = np.ones((len(places), 3))
    hand[:, 2] = np.sign(np.linalg.det(left) * np.linalg.det(right))
    found = np.einsum("fij,fj,fjk->fik", left, hand, right)
    return np.where(told[:, None, None], found, np.eye(3)), told


def runs(where: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and last of each run of true ones, as of frames that do not see a marker."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], where, [False]]).astype(int)))
    return [(int(a), int(b) - 1) for a, b in edges.reshape(-1, 2)]
