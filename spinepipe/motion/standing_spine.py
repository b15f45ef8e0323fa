"""The spine of a person who stands upright: joints, and slices of the trunk around them.

It is the trunk of `spinepipe.muscles`, made as large as the person, so that loads along a motion
and the muscles that hold them are of one body. Above T11T12, where that trunk is rigid, a joint
lies midway between the centres of its two vertebrae.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.facts import several
from spinepipe.motion.body_segments import RigidPart, cylinder
from spinepipe.motion.skeleton import BODIES, JOINTS
from spinepipe.muscles.masses import masses_of
from spinepipe.muscles.pose import BEHIND_MM, JointCentres, place_bodies, rotations_of
from spinepipe.muscles.regressions import packaged
from spinepipe.muscles.scaling import scale_trunk
from spinepipe.muscles.subject import REFERENCE, Subject
from spinepipe.muscles.trunk import LEVELS, SLICES, Mass, Trunk, body_of
from spinepipe.units import MM_PER_M

UPRIGHT_DEG = several(__name__, "upright_extension")[""]
"""How S1 to T11 are turned in extension from the source's pose, in a man who stands: what the
search of `spinepipe.muscles.upright` finds, in which stiffness of joints has a say."""


@dataclass(frozen=True, eq=False)
class StandingSpine:
    """A person's spine in ground axes, the centre of the disc L5S1 at the origin.

    Attributes
    ----------
    subject : sex, age, height, mass.
    joints : (17, 3) m, centres of the discs, as `JOINTS`: moments are told about these.
    slices : (17,) of the trunk, L5 to T1 as `BODIES`; inertia in ground axes.
    """

    subject: Subject
    joints: Array
    slices: tuple[RigidPart, ...]


def usual_spine(subject: Subject, source: Trunk) -> StandingSpine:
    """The spine of a person of whom sex, age, height and mass are known, of a reference trunk."""
    trunk = scale_trunk(source, subject, REFERENCE, packaged())
    upright = np.zeros((len(UPRIGHT_DEG), 3))
    upright[:, 0] = np.deg2rad(UPRIGHT_DEG)
    chain = JointCentres.of(trunk, BEHIND_MM / MM_PER_M)
    return standing_spine(subject, trunk, chain, upright, masses_of(trunk, subject))


def standing_spine(
    subject: Subject, trunk: Trunk, chain: JointCentres, upright: Array, masses: Sequence[Mass]
) -> StandingSpine:
    """The spine of a person.

    Parameters
    ----------
    trunk : at the person's size. chain : about which its bodies turned until they stood upright.
    upright : (8, 3) rad, how the person stands, from the source's pose.
    masses : of `spinepipe.muscles.masses.masses_of`; the head, which has markers, is left out.
    """
    poses = place_bodies(chain, rotations_of(chain, upright), np.zeros((len(LEVELS), 3)))
    # vertebrae from below, L5 to T1, as the bodies above the pelvis are
    above = BODIES[1:]
    bodies = np.array([body_of(name) for name in above], dtype=np.int64)
    vertebrae = poses.of(bodies, trunk.vertebrae[[SLICES.index(name) for name in above]])
    joints = np.empty((len(JOINTS), 3))
    joints[: len(LEVELS)] = poses.of(np.arange(len(LEVELS)), trunk.joints)
    joints[len(LEVELS) :] = 0.5 * (vertebrae[len(LEVELS) - 1 : -1] + vertebrae[len(LEVELS) :])
    own = {mass.name.removeprefix("slice_"): mass for mass in masses}
    centres = poses.of(bodies, np.array([own[name].at for name in above]))
    # from each slice's joint to that above it; T1, above which there is none, is as high as T2
    axes = np.diff(joints, axis=0)
    axes = np.vstack([axes, axes[-1:]])
    return StandingSpine(
        subject,
        joints - joints[0],
        tuple(
            RigidPart(name, own[name].kg, centre - joints[0], cylinder(axis, own[name].kg, name))
            for name, centre, axis in zip(above, centres, axes, strict=True)
        ),
    )
