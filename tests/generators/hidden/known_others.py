"""The vocabulary's effects on geometry, loads and measurement, by name."""

from dataclasses import replace
from functools import partial

import numpy as np
from scipy.spatial.transform import Rotation

from . import pushes, turns
from .anatomy import COORDINATES
from .entry import Entry, joints_of, value
from .recipe import Hidden, Recipe
from .world import World


def _centre_offset(world: World, hidden: Hidden, strength: float) -> World:
    """The true centres stand elsewhere; the motion is told about the stated ones."""
    direction = np.array(value(hidden, "direction"))
    offsets = strength * joints_of(world, hidden)[:, None] * direction
    shift = np.einsum("jik,jk->ji", world.bones.rotations, offsets)
    moved = replace(world.bones, origins=world.bones.origins + shift)
    straight = np.broadcast_to(np.eye(3), (len(offsets), 3, 3))
    told = partial(turns.told_from, tilts=straight, offsets=-offsets)
    return replace(world, bones=moved).with_view(told)


def _draw_sagittal(rng, recipe: Recipe, coordinate):
    angle = rng.uniform(0.0, 2.0 * np.pi)
    return {"direction": [float(np.cos(angle)), float(np.sin(angle)), 0.0]}


def _migration(world: World, hidden: Hidden, strength: float) -> World:
    direction = strength * np.array(value(hidden, "direction"))
    rates = joints_of(world, hidden)[:, None] * direction
    coordinate = COORDINATES.index(hidden.coordinate or "extension")
    return world.with_place(partial(turns.moving_centre, direction=rates, coordinate=coordinate))


def _weight(world: World, hidden: Hidden, strength: float) -> World:
    return world.with_push(pushes.Weight(world.bones, joints_of(world, hidden), strength))


def _follower(world: World, hidden: Hidden, strength: float) -> World:
    return world.with_push(pushes.Follower(world.bones, strength))


def _misalignment(world: World, hidden: Hidden, strength: float) -> World:
    axis = np.array(value(hidden, "axis"))
    tilt = Rotation.from_rotvec(strength * axis).as_matrix()
    return replace(world, turn_load=tilt @ world.turn_load)


def _draw_tilt(rng, recipe: Recipe, coordinate):
    """Two components, as of a loading frame that stands askew: about x and y of ground."""
    angle = rng.uniform(0.0, 2.0 * np.pi)
    return {"axis": [float(np.cos(angle)), float(np.sin(angle)), 0.0]}


def _load_offset(world: World, hidden: Hidden, strength: float) -> World:
    return world.with_push(pushes.Constant(strength * np.array(value(hidden, "axis"))))


def _draw_axis(rng, recipe: Recipe, coordinate):
    axis = rng.normal(size=3)
    return {"axis": [float(v) for v in axis / np.linalg.norm(axis)]}


def _marker_bias(world: World, hidden: Hidden, strength: float) -> World:
    """The frame in which the motion is told stands askew and aside of the stated one."""
    joints = joints_of(world, hidden)[:, None]
    tilts = Rotation.from_rotvec(strength * joints * np.array(value(hidden, "axis")))
    offsets = joints * np.array(value(hidden, "offset_m"))
    told = partial(turns.told_from, tilts=tilts.as_matrix(), offsets=offsets)
    return world.with_view(told)


def _draw_marker(rng, recipe: Recipe, coordinate):
    offset = rng.normal(0.0, 0.002, 3) if recipe.translations else np.zeros(3)
    return {**_draw_axis(rng, recipe, coordinate), "offset_m": [float(v) for v in offset]}


PLACE, LOAD, READING = "geometry", "load", "measurement"
ENTRIES = {
    "joint_centre_offset": Entry(
        PLACE, "distance", "m", 0.003, 0.03, _centre_offset, _draw_sagittal, ()
    ),
    "joint_centre_migration": Entry(
        PLACE, "rate", "m/rad", 0.05, 0.6, _migration, _draw_sagittal, ("extension",)
    ),
    "segment_weight": Entry(LOAD, "mass", "kg", 0.1, 5.0, _weight, coordinates=(), joints="all"),
    "follower_load": Entry(
        LOAD, "tension", "N", 20.0, 800.0, _follower, coordinates=(), joints="all"
    ),
    "load_misalignment": Entry(
        LOAD, "tilt", "rad", 0.03, 0.5, _misalignment, _draw_tilt, (), joints="all"
    ),
    "load_offset": Entry(
        LOAD, "moment", "N m", 0.1, 5.0, _load_offset, _draw_axis, (), joints="all"
    ),
    "marker_bias": Entry(READING, "tilt", "rad", 0.03, 0.5, _marker_bias, _draw_marker, ()),
}
