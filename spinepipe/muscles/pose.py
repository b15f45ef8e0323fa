"""Where the bodies of a trunk are: rotations given, translations of the joints by their forces."""

from dataclasses import dataclass, replace

import numpy as np
from numba import njit
from numpy.typing import NDArray

from spinepipe.effects.contract import Array
from spinepipe.frames import rotation_zxy
from spinepipe.muscles.trunk import Trunk

BEHIND_MM = 4.0
"""How far joints lie behind the centres of their discs (Ghezelbash 2016, section 2.1)."""

_SMALL = 1e-9
"""Angles, rad, whose square is below rounding: limits stand for quotients there."""


@dataclass(frozen=True, eq=False)
class JointCentres:
    """Centres about which a trunk's joints turn, in the source's pose.

    Attributes
    ----------
    centres : (7, 3) m, caudal to cranial.
    discs : (7, 3, 3) axes of the discs in columns: forwards, along the spine, to the right.
    """

    centres: Array
    discs: Array

    @classmethod
    def of(cls, trunk: Trunk, behind_m: float) -> "JointCentres":
        """Joints that lie so far behind the centres of their discs."""
        discs = np.array([rotation_zxy(tilt, 0.0, 0.0) for tilt in trunk.disc_tilt])
        return cls(trunk.joints - behind_m * discs[:, :, 0], discs)

    @property
    def origins(self) -> Array:
        """(8, 3) m, the point of each body that its pose is told of: the joint below it."""
        return np.vstack([self.centres[:1], self.centres])


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
        where = (self.rotations, self.places, self.origins)
        found: Array = _transform(*where, body.ravel(), points.reshape(-1, 3))
        return found.reshape(points.shape)

    def translated(self, translations: Array) -> "BodyPoses":
        """The same, not moved so far, with translations (7, 3) m of the joints."""
        steps = np.einsum("kij,kj->ki", self.discs, translations)
        shift = np.cumsum(steps, axis=0)
        places, centres = self.places.copy(), self.centres.copy()
        places[1:] += shift
        centres[1:] += shift[:-1]
        return replace(self, places=places, centres=centres)


def cross(arms: Array, forces: Array) -> Array:
    """(..., 3) cross products of (..., 3) each: `numpy.cross` takes longer for so few."""
    after, last = [1, 2, 0], [2, 0, 1]
    found: Array = arms[..., after] * forces[..., last] - arms[..., last] * forces[..., after]
    return found


@njit(cache=True)
def _transform(
    rotations: Array, places: Array, origins: Array, body: NDArray[np.int64], points: Array
) -> Array:
    """(N, 3) m, points (N, 3) of bodies (N,) where they are now."""
    found = np.empty(points.shape)
    for n, k in enumerate(body):
        x, y, z = points[n, 0], points[n, 1], points[n, 2]
        x, y, z = x - origins[k, 0], y - origins[k, 1], z - origins[k, 2]
        for i in range(3):
            turn = rotations[k, i]
            found[n, i] = places[k, i] + (turn[0] * x + turn[1] * y + turn[2] * z)
    return found


def rotations_of(chain: JointCentres, angles: Array) -> Array:
    """(8, 3, 3) of angles (8, 3) rad: extension, right bending, left rotation of every body.

    The pelvis is turned about Z, X', Y''. From body to body the difference of the angles is turned
    about the axes of the disc between them: a spine that bends sideways bends in every disc and
    twists in none, however the discs lean.
    """
    bent = np.diff(angles, axis=0)[:, [1, 2, 0]]  # about x, y, z
    turns = chain.discs @ rotation_of_vector(bent) @ np.swapaxes(chain.discs, 1, 2)
    found = [rotation_zxy(*angles[0])]
    for turn in turns:
        found.append(found[-1] @ turn)
    return np.array(found)


def place_bodies(chain: JointCentres, rotations: Array, translations: Array) -> BodyPoses:
    """The bodies with given rotations.

    Parameters
    ----------
    rotations : (8, 3, 3). translations : (7, 3) m, of the upper vertebra on the axes of the disc.
    """
    origins = chain.origins
    vectors = rotation_vector(np.swapaxes(rotations[:-1], 1, 2) @ rotations[1:])
    discs: Array = rotations[:-1] @ rotation_of_vector(0.5 * vectors) @ chain.discs
    # from each body's own joint to the one above it
    arms = np.einsum("kij,kj->ki", rotations[:-1], chain.centres - origins[:-1])
    places = np.cumsum(np.vstack([origins[:1], arms]), axis=0)
    turned = np.einsum("kji,kj->ki", chain.discs, vectors)
    return BodyPoses(rotations, places, origins, places[1:], discs, turned).translated(translations)


def rotation_vector(rotation: Array) -> Array:
    """(..., 3) rad, axis times angle of rotations (..., 3, 3) by less than half a turn.

    The antisymmetric part is the axis times the sine, the trace 1 + 2 cosines.
    """
    over, under = rotation[..., [2, 0, 1], [1, 2, 0]], rotation[..., [1, 2, 0], [2, 0, 1]]
    twice_sine: Array = over - under
    sine = 0.5 * np.sqrt(np.einsum("...i,...i->...", twice_sine, twice_sine))
    angle = np.arctan2(sine, 0.5 * (np.trace(rotation, axis1=-2, axis2=-1) - 1.0))
    straight = sine < _SMALL
    share = np.where(straight, 0.5, angle / (2.0 * np.where(straight, 1.0, sine)))
    return twice_sine * share[..., None]


def rotation_of_vector(vector: Array) -> Array:
    """(..., 3, 3) of axis times angle (..., 3), Rodrigues' formula."""
    angle = np.sqrt(np.einsum("...i,...i->...", vector, vector))[..., None, None]
    cross = np.zeros((*vector.shape, 3))
    cross[..., [2, 0, 1], [1, 2, 0]] = vector
    cross[..., [1, 2, 0], [2, 0, 1]] = -vector
    straight = angle < _SMALL
    size = np.where(straight, 1.0, angle)
    sine = np.where(straight, 1.0, np.sin(size) / size)
    cosine = np.where(straight, 0.5, (1.0 - np.cos(size)) / size**2)
    found: Array = np.eye(3) + sine * cross + cosine * (cross @ cross)
    return found
