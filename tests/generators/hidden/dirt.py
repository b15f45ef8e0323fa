"""Small imperfections of every real laboratory, which are no effect and must not be named."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from scipy.spatial.transform import Rotation

from . import turns
from .contacts import OffDiagonals
from .world import World

Dirt = Callable[[World, float, np.random.Generator], World]


def posture(world: World, size: float, rng: np.random.Generator) -> World:
    """True joint axes are off the stated ones by ``size`` deg SD (all three axes together)."""
    n_joints = len(world.stiffness)
    errors = rng.normal(0.0, np.deg2rad(size) / np.sqrt(3.0), (n_joints, 3))
    turned = world.bones.rotations @ Rotation.from_rotvec(errors).as_matrix()
    return replace(world, bones=replace(world.bones, rotations=turned))


def frames(world: World, size: float, rng: np.random.Generator) -> World:
    """Motion told in frames that are tilted by 0.3 to ``size`` deg about any axis."""
    n_joints = len(world.stiffness)
    axes = rng.normal(size=(n_joints, 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    angles = np.deg2rad(rng.uniform(min(0.3, size), size, (n_joints, 1)))
    tilts = Rotation.from_rotvec(angles * axes).as_matrix()
    told = partial(turns.told_from, tilts=tilts, offsets=np.zeros((n_joints, 3)))
    return world.with_view(told)


def gain(world: World, size: float, rng: np.random.Generator) -> World:
    """The load cell reads wrong by a share ``size`` (SD), another in every test."""
    return replace(world, gain=world.gain * (1.0 + rng.normal(0.0, size, len(world.gain))))


def rotation_order(world: World, size: float, rng: np.random.Generator) -> World:
    """The true law acts on X-Y-Z angles; ``size`` is 1."""
    return world.with_place(turns.as_xyz)


def off_diagonals(world: World, size: float, rng: np.random.Generator) -> World:
    """Small couplings between rotations: ``size`` (SD) of the mean of the two stiffnesses."""
    roots = np.sqrt(world.stiffness[:, 3:])
    drawn = np.triu(rng.normal(0.0, size, (3, 3)), 1)
    matrix = np.zeros((len(roots), 6, 6))
    matrix[:, 3:, 3:] = (drawn + drawn.T) * roots[:, :, None] * roots[:, None, :]
    return world.with_law(OffDiagonals(matrix))


DIRT: dict[str, Dirt] = {
    "posture": posture,
    "frames": frames,
    "gain": gain,
    "rotation_order": rotation_order,
    "off_diagonals": off_diagonals,
}
USUAL = {"posture": 3.0, "frames": 1.0, "gain": 0.02, "rotation_order": 1.0, "off_diagonals": 0.02}
"""Sizes of the trial: deg, deg, share, yes, share."""


def soiled(world: World, dirt: dict[str, float], rng: np.random.Generator) -> World:
    """The world with all dirt of a recipe; every kind draws from its own stream."""
    for (name, put), stream in zip(DIRT.items(), rng.spawn(len(DIRT)), strict=True):
        if dirt.get(name, 0.0):
            world = put(world, dirt[name], stream)
    return world
