"""A person whose trunk is to hold tasks: geometry, joints, muscles and weight."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numba import njit
from numpy.typing import NDArray

from spinepipe.effects.contract import Array
from spinepipe.muscles.passive_tissue import JointLaws, PassiveMuscle
from spinepipe.muscles.paths import Lines
from spinepipe.muscles.pose import JointCentres, place_bodies, rotations_of
from spinepipe.muscles.subject import Subject
from spinepipe.muscles.trunk import EXTENSION, LEVELS, Mass
from spinepipe.units import STANDARD_GRAVITY


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
    chain: JointCentres
    lines: Lines
    laws: JointLaws
    passive: PassiveMuscle
    masses: tuple[Mass, ...]
    diaphragm_m2: float
    upright: Array
    rest: Array
    fibres: Array

    @cached_property
    def weights(self) -> tuple[NDArray[np.int64], Array, Array]:
        """Of the masses: bodies (K,), centres (K, 3) m in the source's pose, pushes (K, 3) N."""
        kg = np.array([mass.kg for mass in self.masses])
        bodies = np.array([mass.body for mass in self.masses], dtype=np.int64)
        at = np.array([mass.at for mass in self.masses]).reshape(-1, 3)
        return bodies, at, kg[:, None] * STANDARD_GRAVITY

    def with_upright(self, upright: Array) -> "Person":
        """The same person with an upright posture (8, 3) rad, in which muscles are at rest and
        ligaments slack."""
        still = np.zeros((len(LEVELS), 3))
        poses = place_bodies(self.chain, rotations_of(self.chain, upright), still)
        rest = self.lines.pulls(poses).lengths
        # the source's fibres, and where it has none a share of the path
        own = self.lines.trunk.muscles.fibre
        fibres = np.where(own > 0.0, own, self.passive.fibre_share * rest)
        laws = replace(self.laws, upright=poses.turned[:, EXTENSION])
        return replace(self, laws=laws, upright=upright, rest=rest, fibres=fibres)


def above(forces: Array, moments: Array, centres: Array) -> tuple[Array, Array]:
    """What acts on everything above each joint.

    Parameters
    ----------
    forces, moments : (..., 8, 3) on each body, moments about the origin. centres : (7, 3) m.

    Returns
    -------
    (..., 7, 3) N, and (..., 7, 3) N m about the joint.
    """
    many = forces.reshape(-1, *forces.shape[-2:]), moments.reshape(-1, *moments.shape[-2:])
    summed, turning = _above(*many, centres)
    shape = (*forces.shape[:-2], *centres.shape)
    return summed.reshape(shape), turning.reshape(shape)


@njit(cache=True)
def _above(forces: Array, moments: Array, centres: Array) -> tuple[Array, Array]:
    """As `above`, of (N, 8, 3)."""
    levels = len(centres)
    summed = np.zeros((len(forces), levels, 3))
    turning = np.zeros((len(forces), levels, 3))
    for n in range(len(forces)):
        force, moment = np.zeros(3), np.zeros(3)
        for k in range(levels - 1, -1, -1):
            for i in range(3):
                force[i] += forces[n, k + 1, i]
                moment[i] += moments[n, k + 1, i]
            for i in range(3):
                # cross product with the arm: (i, j, h) and its turns
                j, h = (i + 1) % 3, (i + 2) % 3
                summed[n, k, i] = force[i]
                turning[n, k, i] = moment[i] - (centres[k, j] * force[h] - centres[k, h] * force[j])
    return summed, turning
