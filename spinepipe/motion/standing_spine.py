"""The spine of a person who stands upright: joints, and slices of the trunk around them.

It is the trunk of `spinepipe.muscles`, made as large as the person, so that loads along a motion
and the muscles that hold them are of one body. Above T11T12, where that trunk is rigid, a joint
lies midway between the centres of its two vertebrae.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.motion.body_segments import RigidPart, cylinder
from spinepipe.motion.skeleton import BODIES, JOINTS
from spinepipe.muscles.pose import JointCentres, place_bodies, rotations_of
from spinepipe.muscles.subject import Subject
from spinepipe.muscles.trunk import LEVELS, SLICES, Mass, Trunk, body_of


@dataclass(frozen=True, eq=False)
class StandingSpine:
    """A person's spine in ground axes, the centre of the disc L5S1 at the origin.

    Attributes
    ----------
    subject : sex, age, height, mass.
    joints : (17, 3) m, about which the bodies turn, as `JOINTS`.
    slices : (17,) of the trunk, L5 to T1 as `BODIES`; inertia in ground axes.
    """

    subject: Subject
    joints: Array
    slices: tuple[RigidPart, ...]


def standing_spine(
    subject: Subject, trunk: Trunk, chain: JointCentres, upright: Array, masses: Sequence[Mass]
) -> StandingSpine:
    """The spine of a person.

    Parameters
    ----------
    trunk : at the person's size. chain : its joints.
    upright : (8, 3) rad, how the person stands, from the source's pose.
    masses : of `spinepipe.muscles.masses.masses_of`; the head, which has markers, is left out.
    """
    poses = place_bodies(chain, rotations_of(chain, upright), np.zeros((len(LEVELS), 3)))
    # vertebrae from below, L5 to T1, as the bodies above the pelvis are
    above = BODIES[1:]
    bodies = np.array([body_of(name) for name in above], dtype=np.int64)
    vertebrae = poses.of(bodies, trunk.vertebrae[[SLICES.index(name) for name in above]])
    joints = np.empty((len(JOINTS), 3))
    joints[: len(LEVELS)] = poses.centres
    joints[len(LEVELS) :] = 0.5 * (vertebrae[len(LEVELS) - 1 : -1] + vertebrae[len(LEVELS) :])
    own = {mass.name.removeprefix("slice_"): mass for mass in masses}
    centres = poses.of(bodies, np.array([own[name].at for name in above]))
    # from each slice's joint to that above it; T1, above which there is none, is as high as T2
    axes = np.diff(joints, axis=0)
    axes = np.vstack([axes, axes[-1:]])
    return StandingSpine(
        subject,
        joints,
        tuple(
            RigidPart(name, own[name].kg, centre, cylinder(axis, own[name].kg, name))
            for name, centre, axis in zip(above, centres, axes, strict=True)
        ),
    )
