"""Simple solids for vertebrae: two discs at the endplates, as wide as the pedicles are apart."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from spinepipe.cohort.specimen import Landmarks
from spinepipe.effects.contract import Array
from spinepipe.frames import Pose

CORNERS = 20
LONE_DISC_MM = 6.0
"""Thickness drawn of a vertebra of which only one endplate is known."""

_USUAL_RADIUS_MM = 18.0
_PEDICLES = ("left_pedicle_base", "right_pedicle_base")


@dataclass(frozen=True)
class Solid:
    """A drum: corners of its lower and upper face, mm.

    Attributes
    ----------
    points : (2 * CORNERS + 2, 3) lower ring, upper ring, the two centres.
    triangles : (n, 3) indices into the points.
    """

    points: Array
    triangles: Array


def solids(points: Landmarks, frames: Mapping[str, Pose], mm_per_m: float) -> dict[str, Solid]:
    """Drum of each vertebra; one without endplate centres has none.

    Parameters
    ----------
    points : landmarks, m.
    frames : of each vertebra, the joint frame that gives a lone endplate its tilt.
    """
    widths = [
        float(np.linalg.norm(named[_PEDICLES[1]] - named[_PEDICLES[0]]))
        for named in points.values()
        if set(_PEDICLES) <= set(named)
    ]
    radius = 0.5 * mm_per_m * float(np.mean(widths)) if widths else _USUAL_RADIUS_MM
    found = {}
    for vertebra, named in points.items():
        ends = _ends(named, frames[vertebra].rotation[:, 1], mm_per_m)
        if ends is not None:
            found[vertebra] = _drum(*ends, radius)
    return found


def _ends(named: Mapping[str, Array], up: Array, mm_per_m: float) -> tuple[Array, Array] | None:
    """Centres of the lower and upper face."""
    low, high = (named.get(f"{side}_endplate_centre") for side in ("inferior", "superior"))
    if low is not None and high is not None:
        return low * mm_per_m, high * mm_per_m
    if high is not None:
        return high * mm_per_m - LONE_DISC_MM * up, high * mm_per_m
    if low is not None:
        return low * mm_per_m, low * mm_per_m + LONE_DISC_MM * up
    return None


def _drum(low: Array, high: Array, radius: float) -> Solid:
    axis = (high - low) / np.linalg.norm(high - low)
    across = np.cross(axis, [1.0, 0.0, 0.0])
    across /= np.linalg.norm(across)
    angles = np.linspace(0.0, 2.0 * np.pi, CORNERS, endpoint=False)
    ring = radius * (
        np.outer(np.cos(angles), across) + np.outer(np.sin(angles), np.cross(axis, across))
    )
    points = np.vstack([low + ring, high + ring, low, high])
    first = np.arange(CORNERS)
    following = (first + 1) % CORNERS
    sides = [
        (first, following, first + CORNERS),
        (following, following + CORNERS, first + CORNERS),
        (first, following, np.full(CORNERS, 2 * CORNERS)),
        (first + CORNERS, following + CORNERS, np.full(CORNERS, 2 * CORNERS + 1)),
    ]
    return Solid(points, np.vstack([np.column_stack(side) for side in sides]))
