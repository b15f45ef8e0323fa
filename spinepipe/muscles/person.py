"""A person whose trunk is to hold tasks: geometry, joints, muscles and weight."""

from dataclasses import dataclass, replace

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.muscles.joint_laws import JointLaws
from spinepipe.muscles.passive_muscle import PassiveMuscle, fibres_of
from spinepipe.muscles.paths import Lines
from spinepipe.muscles.pose import Chain, posed, rotations_of
from spinepipe.muscles.subject import Subject
from spinepipe.muscles.trunk import LEVELS, Mass


@dataclass(frozen=True, eq=False)
class Person:
    """One person.

    Attributes
    ----------
    subject : sex, age, height, mass.
    chain : centres about which joints turn. lines : fascicles, and the trunk that they are of.
    laws, passive : joints and stretched muscles.
    masses : what bodies carry, arms and hands left out.
    diaphragm_m2 : area on which pressure in the abdomen pushes.
    upright : (8, 3) rad, Z, X', Y'' angles of the bodies when standing.
    rest, fibres : (M,) m, lengths of the fascicles when standing, and of their fibres.
    """

    subject: Subject
    chain: Chain
    lines: Lines
    laws: JointLaws
    passive: PassiveMuscle
    masses: tuple[Mass, ...]
    diaphragm_m2: float
    upright: Array
    rest: Array
    fibres: Array

    def standing(self, upright: Array) -> "Person":
        """The same person with an upright posture (8, 3) rad, in which muscles are at rest."""
        poses = posed(self.chain, rotations_of(self.chain, upright), np.zeros((len(LEVELS), 3)))
        rest = self.lines.pulls(poses).lengths
        fibres = fibres_of(self.lines.trunk.muscles, rest, self.passive.fibre_share)
        return replace(self, upright=upright, rest=rest, fibres=fibres)


def above(forces: Array, moments: Array, centres: Array) -> tuple[Array, Array]:
    """What acts on everything above each joint.

    Parameters
    ----------
    forces, moments : (..., 8, 3) on each body, moments about the origin. centres : (7, 3) m.

    Returns
    -------
    (..., 7, 3) N, and (..., 7, 3) N m about the joint.
    """
    summed = np.cumsum(forces[..., :0:-1, :], axis=-2)[..., ::-1, :]
    turning = np.cumsum(moments[..., :0:-1, :], axis=-2)[..., ::-1, :]
    # cross products of the arms with the sums, component by component: (i, j, k) and its turns
    after, last = [1, 2, 0], [2, 0, 1]
    return summed, turning - (
        centres[:, after] * summed[..., last] - centres[:, last] * summed[..., after]
    )
