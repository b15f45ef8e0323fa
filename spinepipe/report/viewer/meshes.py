"""Meshes of vertebrae: closed surfaces, with processes, from landmarks or from joint centres.

The shape is a plausible one: an oval body between two endplates, narrower at its waist, with a
spinous and two transverse processes that are drawn out of its facets. Lengths in mm.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.frames import FRAME_LANDMARKS, vertebra_rotation
from spinepipe.units import MM_PER_M

SIDES = 20
"""Facets around a body; one faces straight back."""

USUAL_SPACING_MM = 36.0
"""Between the joints below and above a lumbar vertebra; used where no two joints tell it."""

DISC_SHARE = 0.22
"""Of the distance between two joints; the rest is bone."""

_WIDTH_PER_SPACING, _DEPTH_PER_SPACING, _WIDTH_PER_DEPTH = 1.25, 0.95, 1.4
_WIDTH_PER_PEDICLES = 1.15

# Rings from the lower endplate to the upper: share of the height, and of the endplates' size
_VERTEBRA_RINGS = ((0.0, 1.0), (0.25, 0.89), (0.5, 0.87), (0.85, 0.93), (1.0, 1.0))
_SACRUM_RINGS = ((0.0, 0.55), (0.3, 0.68), (0.6, 0.82), (0.85, 0.95), (1.0, 1.0))
_PEDICLE_BAND = 2
"""Processes leave the upper half of a body: between the third ring and the fourth."""

# Facet that a process leaves, then its sections: way back, up and right as shares of depth, height
# and width, and the section's size as a share of the facet's
_PROCESSES = (
    (SIDES // 2 - 1, ((-0.55, -0.08, 0.0, 0.9), (-1.0, -0.32, 0.0, 0.8))),
    (SIDES // 2 - 4, ((-0.12, 0.02, 0.1, 0.85), (-0.3, 0.0, 0.52, 0.5))),
    (SIDES // 2 + 2, ((-0.12, 0.02, -0.1, 0.85), (-0.3, 0.0, -0.52, 0.5))),
)

Face = tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Mesh:
    """A closed surface.

    Attributes
    ----------
    vertices : (V, 3) mm. The first `SIDES` are the rim of the lower endplate, the next those of
        the upper one, both in the same order, so that a disc spans from rim to rim.
    faces : vertices of each face, counterclockwise as seen from outside.
    """

    vertices: Array
    faces: tuple[Face, ...]

    def seen_from(self, origin: Array, rotation: Array) -> "Mesh":
        """The same surface in a frame at ``origin`` (3,) mm with axes ``rotation`` (3, 3)."""
        return Mesh((self.vertices - origin) @ rotation, self.faces)


@dataclass(frozen=True, eq=False)
class Endplate:
    """A plane with its middle (also: a joint).

    Attributes
    ----------
    centre : (3,) mm. axes : (3, 3) columns anterior, superior, right.
    """

    centre: Array
    axes: Array

    def along(self, superior_mm: float) -> "Endplate":
        """The same plane further up, or down."""
        return Endplate(self.centre + superior_mm * self.axes[:, 1], self.axes)


def vertebra(
    low: Endplate, high: Endplate, width_mm: float, depth_mm: float, sacrum: bool = False
) -> Mesh:
    """A vertebra between its endplates; a sacrum tapers downwards and has no processes."""
    angles = (np.arange(SIDES) + 0.5) * 2.0 * np.pi / SIDES
    # the back of a body is flat or hollow: the spinal canal lies there
    hollow = np.where(np.cos(angles) < 0.0, 0.82 + 0.18 * np.abs(np.sin(angles)), 1.0)
    across = 0.5 * depth_mm * np.cos(angles) * hollow
    aside = 0.5 * width_mm * np.sin(angles)
    rings = []
    for share, scale in _SACRUM_RINGS if sacrum else _VERTEBRA_RINGS:
        centre = (1.0 - share) * low.centre + share * high.centre
        axes = (1.0 - share) * low.axes + share * high.axes
        x, z = (axes[:, k] / np.linalg.norm(axes[:, k]) for k in (0, 2))
        rings.append(centre + scale * (np.outer(across, x) + np.outer(aside, z)))
    # both rims first, then the rings between; `order` finds a ring's place from below
    mesh = _Builder([rings[0], rings[-1], *rings[1:-1]])
    order = [0, *range(2, len(rings)), 1]
    first, following = range(SIDES), [*range(1, SIDES), 0]
    mesh.faces.append(tuple(first))
    mesh.faces.append(tuple(SIDES + k for k in reversed(first)))
    facets = {}
    for band, (below, above) in enumerate(pairwise(order)):
        a, b = below * SIDES, above * SIDES
        for i, j in zip(first, following, strict=True):
            facets[band, i] = len(mesh.faces)
            mesh.faces.append((a + i, b + i, b + j, a + j))
    if not sacrum:
        axes = 0.5 * (low.axes + high.axes)
        height = float(np.linalg.norm(high.centre - low.centre))
        size = np.array([depth_mm, height, width_mm])
        for facet, sections in _PROCESSES:
            face = facets[_PEDICLE_BAND, facet]
            for back, up, right, scale in sections:
                mesh.extrude(face, axes @ (np.array([back, up, right]) * size), scale)
    return Mesh(np.vstack(mesh.vertices), tuple(mesh.faces))


class _Builder:
    """Vertices and faces that grow; a face that is drawn out keeps its place in the list."""

    def __init__(self, rings: Sequence[Array]) -> None:
        """Begin with rings of vertices (n, 3)."""
        self.vertices = [vertex for ring in rings for vertex in ring]
        self.faces: list[Face] = []
        self._base: dict[int, Array] = {}

    def extrude(self, face: int, way: Array, scale: float) -> None:
        """Draw a face out to ``way`` (3,) from where it first was; its size there is a share."""
        old = self.faces[face]
        base = self._base.setdefault(face, np.array([self.vertices[k] for k in old]))
        middle = base.mean(axis=0)
        new = tuple(range(len(self.vertices), len(self.vertices) + len(old)))
        self.vertices += list(middle + way + scale * (base - middle))
        corners = range(len(old))
        for k, n in zip(corners, [*corners[1:], 0], strict=True):
            self.faces.append((old[k], old[n], new[n], new[k]))
        self.faces[face] = new


def spine_meshes(
    names: Sequence[str],
    joints: Sequence[Endplate],
    landmarks_m: Mapping[str, Mapping[str, Array]] | None = None,
) -> list[Mesh]:
    """A mesh of each vertebra, in the frame of the joints.

    Endplates lie where landmarks say, else so far from the joints that discs have their usual
    share; the first and the last vertebra, of which one joint is known, are as high as their
    neighbours. Pedicle bases lie on the back of a body and so tell its depth.

    Parameters
    ----------
    names : caudal to cranial; a first one that begins with S is a sacrum.
    joints : one fewer, from below.
    landmarks_m : points (3,) in m by vertebra and name.
    """
    centres = np.array([joint.centre for joint in joints])
    apart = np.linalg.norm(np.diff(centres, axis=0), axis=1).tolist() or [USUAL_SPACING_MM]
    spacing = [apart[0], *apart, apart[-1]] if len(joints) > 1 else apart * 2
    meshes = []
    for k, (name, space) in enumerate(zip(names, spacing, strict=True)):
        below, above = (joints[k - 1] if k else None), (joints[k] if k < len(joints) else None)
        known = {n: p * MM_PER_M for n, p in (landmarks_m or {}).get(name, {}).items()}
        low, high = _endplates(known, below, above, space)
        width, depth = _WIDTH_PER_SPACING * space, _DEPTH_PER_SPACING * space
        if set(FRAME_LANDMARKS) <= set(known):
            left, right = known["left_pedicle_base"], known["right_pedicle_base"]
            way = 0.5 * (left + right) - 0.5 * (low.centre + high.centre)
            depth = 2.0 * abs(float(way @ low.axes[:, 0]))
            pedicles = float(np.linalg.norm(right - left))
            width = max(_WIDTH_PER_DEPTH * depth, _WIDTH_PER_PEDICLES * pedicles)
        meshes.append(vertebra(low, high, width, depth, sacrum=k == 0 and name.startswith("S")))
    return meshes


def _endplates(
    known: Mapping[str, Array], below: Endplate | None, above: Endplate | None, spacing_mm: float
) -> tuple[Endplate, Endplate]:
    """Lower and upper endplate; one that neither landmark nor joint tells, from the other."""
    half = 0.5 * DISC_SHARE * spacing_mm
    found = [
        None if below is None else below.along(half),
        None if above is None else above.along(-half),
    ]
    own = vertebra_rotation(known) if set(FRAME_LANDMARKS) <= set(known) else None
    for k, side in enumerate(("inferior", "superior")):
        beside = found[k] or found[1 - k]
        if (centre := known.get(f"{side}_endplate_centre")) is not None and beside is not None:
            found[k] = Endplate(centre, beside.axes if own is None else own)
    low, high = found
    height = (1.0 - DISC_SHARE) * spacing_mm
    if low is None:
        assert high is not None, "a vertebra has a joint above or below"
        return high.along(-height), high
    return low, low.along(height) if high is None else high
