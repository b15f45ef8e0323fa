"""Where the bodies of a trunk are: rotations given, translations of the joints by their forces."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects.contract import Array
from spinepipe.frames import rotation_zxy
from spinepipe.muscles.trunk import BODIES, LEVELS, Mass, Trunk

_SMALL = 1e-9


@dataclass(frozen=True, eq=False)
class Chain:
    """Centres about which a trunk's joints turn, in the source's pose.

    Attributes
    ----------
    centres : (7, 3) m, caudal to cranial.
    discs : (7, 3, 3) axes of the discs in columns: forwards, along the spine, to the right.
    """

    centres: Array
    discs: Array

    @classmethod
    def of(cls, trunk: Trunk, behind_m: float) -> "Chain":
        """Joints that lie so far behind the centres of their discs."""
        discs = np.array([rotation_zxy(tilt, 0.0, 0.0) for tilt in trunk.disc_tilt])
        return cls(trunk.joints - behind_m * discs[:, :, 0], discs)

    @property
    def origins(self) -> Array:
        """(8, 3) m, the point of each body that its pose is told of: the joint below it."""
        found: Array = np.vstack([self.centres[:1], self.centres])
        return found


@dataclass(frozen=True, eq=False)
class BodyPoses:
    """Bodies of a trunk, caudal to cranial, in ground.

    Attributes
    ----------
    rotations : (8, 3, 3), places : (8, 3) m of the bodies' origins, origins : (8, 3) m where those
        are in the source's pose.
    centres : (7, 3) m, joints as the body below carries them.
    discs : (7, 3, 3) axes of the discs, halfway between the vertebrae.
    turned : (7, 3) rad, rotation vector of each joint on the axes of its disc: right bending, left
        rotation, extension.
    """

    rotations: Array
    places: Array
    origins: Array
    centres: Array
    discs: Array
    turned: Array

    def of(self, body: NDArray[np.int64], points: Array) -> Array:
        """(..., 3) m, points (..., 3) of bodies (...) where they are now."""
        turned = np.einsum("...ij,...j->...i", self.rotations[body], points - self.origins[body])
        found: Array = turned + self.places[body]
        return found

    def masses(self, masses: tuple[Mass, ...]) -> Array:
        """(K, 3) m, where centres of mass are now."""
        body = np.array([mass.body for mass in masses], dtype=np.int64)
        return self.of(body, np.array([mass.at for mass in masses]).reshape(-1, 3))


def rotations_of(chain: Chain, angles: Array) -> Array:
    """(8, 3, 3) of angles (8, 3) rad: extension, right bending, left rotation of every body.

    The pelvis is turned about Z, X', Y''. From body to body the difference of the angles is turned
    about the axes of the disc between them: a spine that bends sideways bends in every disc and
    twists in none, however the discs lean.
    """
    found = [rotation_zxy(*angles[0])]
    for disc, (extension, bending, rotation) in zip(
        chain.discs, np.diff(angles, axis=0), strict=True
    ):
        turn = disc @ rotation_of_vector(np.array([bending, rotation, extension])) @ disc.T
        found.append(found[-1] @ turn)
    return np.array(found)


def posed(chain: Chain, rotations: Array, translations: Array) -> BodyPoses:
    """The bodies with given rotations.

    Parameters
    ----------
    rotations : (8, 3, 3). translations : (7, 3) m, of the upper vertebra on the axes of the disc.
    """
    origins = chain.origins
    places = np.zeros((len(BODIES), 3))
    places[0] = origins[0]
    centres = np.zeros((len(LEVELS), 3))
    between = np.einsum("kij,kil->kjl", rotations[:-1], rotations[1:])
    vectors = np.array([rotation_vector(one) for one in between])
    halves = np.array([rotation_of_vector(0.5 * one) for one in vectors])
    discs: Array = rotations[:-1] @ halves @ chain.discs
    for level in range(len(LEVELS)):
        arm = rotations[level] @ (chain.centres[level] - origins[level])
        centres[level] = places[level] + arm
        places[level + 1] = centres[level] + discs[level] @ translations[level]
    turned = np.einsum("kji,kj->ki", chain.discs, vectors)
    return BodyPoses(rotations, places, origins, centres, discs, turned)


def rotation_vector(rotation: Array) -> Array:
    """(3,) rad, axis times angle of a rotation by less than half a turn."""
    twice_sine = np.array(
        [
            rotation[2, 1] - rotation[1, 2],
            rotation[0, 2] - rotation[2, 0],
            rotation[1, 0] - rotation[0, 1],
        ]
    )
    sine = 0.5 * float(np.sqrt(twice_sine @ twice_sine))
    angle = float(np.arctan2(sine, 0.5 * (np.trace(rotation) - 1.0)))
    found: Array = twice_sine * (0.5 if sine < _SMALL else angle / (2.0 * sine))
    return found


def rotation_of_vector(vector: Array) -> Array:
    """(3, 3) of axis times angle (3,), Rodrigues' formula."""
    angle = float(np.sqrt(vector @ vector))
    x, y, z = vector
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    sine = 1.0 if angle < _SMALL else np.sin(angle) / angle
    cosine = 0.5 if angle < _SMALL else (1.0 - np.cos(angle)) / angle**2
    found: Array = np.eye(3) + sine * cross + cosine * (cross @ cross)
    return found
