"""Points fixed in the vertebrae that load effects act at; m, ground, neutral pose."""

import numpy as np

from spinepipe.effects.contract import Array, Motion

TOP_HEIGHT_M = 0.03
"""Height of the most cranial vertebra above its joint, as nothing above says where it ends."""


def upper_ends(motion: Motion) -> Array:
    """(J, 3) origin of the joint above each vertebra; of the top one, 30 mm above its own joint.

    Above means along the joint's superior axis, which the last rotation leaves as it is.
    """
    top = motion.displacement(len(motion.joint_origins) - 1)
    superior = top.rotation.T @ motion.axes[-1]
    origins = motion.joint_origins
    return np.vstack([origins[1:], origins[-1] + TOP_HEIGHT_M * superior])


def centres(motion: Motion) -> Array:
    """(J, 3) centres of mass, or midway between its joints for a vertebra whose mass is unstated.

    A vertebra without a mass has its centre of mass at the origin of ground in the model.
    """
    stated = motion.centres_of_mass
    midway = (motion.joint_origins + upper_ends(motion)) / 2.0
    return np.where(stated.any(axis=1, keepdims=True), stated, midway)


def nothing_applied(motion: Motion) -> tuple[Array, Array]:
    """Load (n,) and tangent (n, n) of no load, to add to."""
    n = len(motion.axes)
    return np.zeros(n), np.zeros((n, n))
