"""A trunk: seven joints from the sacrum to the eleventh thoracic vertebra, and the muscles on them.

Ground axes: x forwards, y up, z to the right; m. The origin is the centre of L5S1. The *source* is
the published model that geometry and muscles are taken from. Everything is given where it lies in
the source's own pose: a body's rotation counts from there, where it is none.

Two orders: bodies, joints and discs run from below (caudal to cranial), `SLICES` and the vertebrae
that carry them from above.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects.contract import Array

BODIES = ("S1", "L5", "L4", "L3", "L2", "L1", "T12", "T11")
"""Caudal to cranial; S1 stands for the pelvis, T11 for T1 to T11 with ribs, head and arms.

`spinepipe.motion.skeleton.BODIES` is another list: there each vertebra up to T1 is a body.
"""

LEVELS = ("L5S1", "L4L5", "L3L4", "L2L3", "L1L2", "T12L1", "T11T12")
"""Joints, caudal to cranial: level k joins body k and body k + 1."""

SLICES = (*(f"T{n}" for n in range(1, 13)), *(f"L{n}" for n in range(1, 6)))
"""Vertebrae that carry a slice of the trunk's mass, T1 to L5: cranial to caudal."""

THORAX = len(BODIES) - 1
"""Index into BODIES of the body of the ribs, the arms and the head."""

NO_BODY = -1
"""In the place of an index into BODIES where a path has no further point."""

RECTUS = "rectus_abdominis"
"""Group of the fascicles whose ends are those of the rectus sheath. The sheath, and the ends of
other muscles in it, are scaled to a person as this muscle's points are."""

GLOBAL_EXTENSORS = ("longissimus_thoracis", "iliocostalis_thoracis")
"""Groups that run from the pelvis or the lumbar spine to the thorax; they wrap over the vertebrae
that they pass, see `Muscles.wraps`."""

SIDES = ("right", "left")

EXTENSION = 2
"""Axis of bodies and discs that extension is about: the one to the right."""


def body_of(vertebra: str) -> int:
    """Body that a vertebra belongs to: T1 to T10 move with T11."""
    return BODIES.index(vertebra) if vertebra in BODIES else THORAX


@dataclass(frozen=True, eq=False)
class Muscles:
    """M fascicles as paths of up to P points; shorter paths repeat their last point.

    Attributes
    ----------
    names : of fascicles, each once; `r` or `l` at the end where the source has it.
    groups : longissimus_thoracis, rectus_abdominis, ...
    sides : right (z positive) or left.
    pcsa : (M,) m2, physiological cross-sectional area.
    fibre : (M,) m, length of the fibres at rest; 0 where the source gives none.
    body : (M, P) index into BODIES of each point, NO_BODY past the end of the path.
    point : (M, P, 3) m, where the points lie in the source's pose.
    wraps : (M,) whether the fascicle lies on the vertebrae that it passes and cannot cross them.
    in_sheath : (M,) whether one end hangs in the rectus sheath and not on a bone. Such a path has
        two points, the first on a bone (ribs: external oblique, pelvis: internal oblique), the
        second in the sheath. That one has THORAX as its body for want of a better: it is no point
        of the ribs, and stays at its share of the way between the sheath's two ends.
    """

    names: tuple[str, ...]
    groups: tuple[str, ...]
    sides: tuple[str, ...]
    pcsa: Array
    fibre: Array
    body: NDArray[np.int64]
    point: Array
    wraps: NDArray[np.bool_]
    in_sheath: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.names)

    def of(self, chosen: NDArray[np.bool_]) -> "Muscles":
        """Those where ``chosen`` (M,) is true."""
        at = np.flatnonzero(chosen)
        return Muscles(
            tuple(self.names[k] for k in at),
            tuple(self.groups[k] for k in at),
            tuple(self.sides[k] for k in at),
            *(
                getattr(self, name)[at]
                for name in ("pcsa", "fibre", "body", "point", "wraps", "in_sheath")
            ),
        )


@dataclass(frozen=True, eq=False)
class Trunk:
    """One person's trunk.

    Attributes
    ----------
    source : where geometry and muscles come from, with its version.
    joints : (7, 3) m, centres of the discs in the order of `LEVELS`. The points about which joints
        turn may lie behind them: `spinepipe.muscles.pose.JointCentres`.
    disc_tilt : (7,) rad, by how much the disc's plane is turned from the horizontal about +z;
        positive: its front edge is up, as in extension.
    disc_height, disc_area : (7,) m and m2, in the order of `LEVELS`.
    vertebrae : (17, 3) m, centres of T1 to L5 in the order of `SLICES`. The centres of mass of the
        slices lie ahead of them.
    head : (3,) m, centre of mass of head and neck.
    shoulders : (2, 3) m, right and left.
    arm_length : m, from shoulder to the middle of the hand.
    sheath : (2, 2, 3) m, the rectus sheath: first right and left, then lower and upper end.
    muscles : its fascicles.
    """

    source: str
    joints: Array
    disc_tilt: Array
    disc_height: Array
    disc_area: Array
    vertebrae: Array
    head: Array
    shoulders: Array
    arm_length: float
    sheath: Array
    muscles: Muscles


@dataclass(frozen=True, eq=False)
class Mass:
    """A part of the body, or what a hand holds, that the trunk carries.

    Attributes
    ----------
    name : slice_T1, head, right_forearm, right_hand_load, ...
    body : index into BODIES of the body that carries it.
    kg : its mass.
    at : (3,) m, centre of mass, ground axes: of slices and head in the source's pose, of arms and
        what hands hold in the posture of the moment.
    """

    name: str
    body: int
    kg: float
    at: Array
