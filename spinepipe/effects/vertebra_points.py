"""Points fixed in the vertebrae that load effects act at; m, ground, neutral pose."""

import numpy as np

from spinepipe.effects.contract import Array, Neutral

TOP_HEIGHT_M = 0.03
"""Height of the most cranial vertebra above its joint, as nothing above says where it ends."""


def upper_ends(neutral: Neutral) -> Array:
    """(..., J, 3) origin of the joint above each vertebra; of the top one, 30 mm above its own.

    Above means along the joint's superior axis.
    """
    top = neutral.origins[..., -1:, :] + TOP_HEIGHT_M * neutral.rotations[..., -1:, :, 1]
    return np.concatenate([neutral.origins[..., 1:, :], top], axis=-2)


def centres(neutral: Neutral) -> Array:
    """(..., J, 3) centres of mass, or midway between its joints for a vertebra of unstated mass.

    A vertebra without a mass has its centre of mass at the origin of ground in the model.
    """
    stated = neutral.centres_of_mass
    midway = (neutral.origins + upper_ends(neutral)) / 2.0
    return np.where(stated.any(axis=-1, keepdims=True), stated, midway)
