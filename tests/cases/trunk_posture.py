"""Where the points of a trunk go when its joints turn: a second account, for tests alone."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from spinepipe.muscles.trunk import NO_BODY, Trunk

Array = NDArray[np.float64]


def random_bends(seed: int, largest_deg: float = 8.0) -> Array:
    """(7, 3) rad: extension, right bending and left rotation of each joint, upwards."""
    drawn = np.random.default_rng(seed).uniform(-largest_deg, largest_deg, (7, 3))
    return np.radians(drawn)


def moved(trunk: Trunk, bends: Array) -> Array:
    """(M, P, 3) m, points after each joint has turned about its own centre, the sacrum at rest."""
    turned, shift = Rotation.identity(), np.zeros(3)
    poses = [(turned, shift)]
    for centre, angles in zip(trunk.joints, bends, strict=True):
        at = turned.apply(centre) + shift
        turned = turned * Rotation.from_euler("ZXY", angles)
        shift = at - turned.apply(centre)
        poses.append((turned, shift))
    points = trunk.muscles.point.copy()
    for k, (turned, shift) in enumerate(poses):
        on = trunk.muscles.body == k
        points[on] = turned.apply(points[on]) + shift if on.any() else points[on]
    return points


def lengths(trunk: Trunk, bends: Array) -> Array:
    """(M,) m, along straight lines from point to point."""
    points = moved(trunk, bends)
    steps = np.linalg.norm(np.diff(points, axis=1), axis=2)
    steps[trunk.muscles.body[:, 1:] == NO_BODY] = 0.0
    found: Array = steps.sum(axis=1)
    return found


def lever_arms(trunk: Trunk, bends: Array, step: float = 1e-5) -> Array:
    """(M, 7, 3) m, change of length per change of each joint angle, by central differences."""
    found = np.zeros((len(trunk.muscles), 7, 3))
    for joint in range(7):
        for axis in range(3):
            off = np.zeros((7, 3))
            off[joint, axis] = step
            ahead, behind = lengths(trunk, bends + off), lengths(trunk, bends - off)
            found[:, joint, axis] = (ahead - behind) / (2.0 * step)
    return found
