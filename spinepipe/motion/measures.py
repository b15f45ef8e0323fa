"""What is measured of motions: how vertebrae are turned against each other, how rigid clusters are.

Angles between neighbours are those of Z, X', Y'', like the coordinates of joints, but between the
frames of bodies: a spine that stands curved has angles that are not zero.
"""

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects.contract import Array
from spinepipe.frames import zxy_angles

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


def between_neighbours(turns: Array) -> Array:
    """(..., 17, 3, 3) rotation of each body in the one below, of bodies (..., 18, 3, 3)."""
    found: Array = np.swapaxes(turns[..., :-1, :, :], -1, -2) @ turns[..., 1:, :, :]
    return found


def sagittal_angles(turns: Array) -> Array:
    """(..., 17) rad, extension of each body against the one below, of bodies (..., 18, 3, 3)."""
    found: Array = zxy_angles(between_neighbours(turns))[..., 0]
    return found


def turned_apart(one: Array, other: Array) -> Array:
    """(...) rad, angle of the one rotation that leads from one (..., 3, 3) to the other.

    From the distance of the matrices, 2 sqrt(2) sin(angle / 2), which is exact for small angles
    where their trace is not.
    """
    apart = np.linalg.norm(one - other, axis=(-2, -1)) / np.sqrt(8.0)
    found: Array = 2.0 * np.arcsin(np.minimum(apart, 1.0))
    return found
