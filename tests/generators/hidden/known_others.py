"""The vocabulary's effects on geometry, loads and measurement, by name."""

from dataclasses import replace
from functools import partial

import numpy as np
from scipy.spatial.transform import Rotation

from . import pushes, readouts, turns
from .anatomy import COORDINATES
from .entry import (
    OTHER,
    SAME,
    Entry,
    formula,
    joints_of,
    reach,
    scope_of,
    sign,
    value,
)
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
    far = value(hidden, "reach") if formula(hidden) == "saturating" else 0.0
    return world.with_place(
        partial(turns.moving_centre, direction=rates, coordinate=coordinate, reach=far)
    )


def _draw_migration(rng, recipe: Recipe, coordinate):
    far = float(rng.uniform(0.5, 1.0) * reach("extension", recipe))
    return _draw_sagittal(rng, recipe, coordinate) | {"reach": far}


def _weight(world: World, hidden: Hidden, strength: float) -> World:
    """The same mass on each segment, or masses that fall evenly from below to above."""
    masses = strength * joints_of(world, hidden)
    if formula(hidden, "each") == "tapering":
        masses = masses * np.linspace(1.5, 0.5, len(masses))
    return world.with_push(pushes.Weight(world.bones, masses))


OFFSET_M = 0.008
"""How far behind the joints' centres the guides of another follower load lie."""


def _follower(world: World, hidden: Hidden, strength: float) -> World:
    """Through the centres of mass, which lie midway between joints here, or behind the joints.

    The ground's own guide lies as far below the lowest joint as the lowest segment's centre lies
    above it; or as far behind it as the others.
    """
    bones = world.bones
    guides, anchor = bones.centres, 2.0 * bones.origins[0] - bones.centres[0]
    if formula(hidden, "centres") == "behind":
        behind = -OFFSET_M * bones.rotations[:, :, 0]
        guides, anchor = bones.centres + behind, anchor + behind[0]
    return world.with_push(pushes.Follower(guides, anchor, strength))


def _misalignment(world: World, hidden: Hidden, strength: float) -> World:
    axis = np.array(value(hidden, "axis"))
    if formula(hidden, "frame") == "growing":
        moments = np.stack([case.moments for case in world.tests])
        return world.with_push(pushes.Growing(moments, axis, strength))
    tilt = Rotation.from_rotvec(strength * axis).as_matrix()
    return replace(world, turn_load=tilt @ world.turn_load)


def _draw_tilt(rng, recipe: Recipe, coordinate):
    """Two components, as of a loading frame that stands askew: about x and y of ground."""
    angle = rng.uniform(0.0, 2.0 * np.pi)
    return {"axis": [float(np.cos(angle)), float(np.sin(angle)), 0.0]}


def _load_offset(world: World, hidden: Hidden, strength: float) -> World:
    """A constant moment, or a cable that pulls sideways with a constant force."""
    moment, force = strength * np.array(value(hidden, "axis")), np.zeros(3)
    if formula(hidden, "moment") == "cable":
        x, _, z = moment
        moment, force = np.zeros(3), np.array([-z, 0.0, x]) / CABLE_M
    return world.with_push(pushes.Constant(moment, force, world.bones.centres[-1]))


CABLE_M = 0.1
"""Arm by which a strength in N m is a cable's force."""


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


def _soft_tissue(world: World, hidden: Hidden, strength: float) -> World:
    far, named = value(hidden, "reach"), formula(hidden, "root")
    return world.with_view(readouts.SoftTissue(scope_of(world, hidden), far, strength, named))


def _draw_soft_tissue(rng, recipe: Recipe, coordinate):
    return {"reach": float(rng.uniform(0.3, 0.6) * reach(coordinate, recipe))}


def _pose_drift(world: World, hidden: Hidden, strength: float) -> World:
    drift, pace = value(hidden, "sign") * strength, value(hidden, "pace")
    named = formula(hidden, "settling")
    return world.with_view(readouts.PoseDrift(scope_of(world, hidden), drift, pace, named))


def _draw_pose_drift(rng, recipe: Recipe, coordinate):
    return {"sign": sign(rng), "pace": float(np.exp(rng.uniform(*np.log((0.2, 1.0)))))}


PLACE, LOAD, READING = "geometry", "load", "measurement"
ENTRIES = {
    "joint_centre_offset": Entry(
        PLACE, "distance", "m", 0.003, 0.03, _centre_offset, _draw_sagittal, {"fixed": SAME}, ()
    ),
    "joint_centre_migration": Entry(
        PLACE,
        "rate",
        "m/rad",
        0.05,
        0.6,
        _migration,
        _draw_migration,
        {"linear": SAME, "saturating": OTHER},
        ("extension",),
    ),
    "segment_weight": Entry(
        LOAD,
        "mass",
        "kg",
        0.1,
        5.0,
        _weight,
        formulas={"each": SAME, "tapering": OTHER},
        coordinates=(),
        joints="all",
    ),
    "follower_load": Entry(
        LOAD,
        "tension",
        "N",
        20.0,
        800.0,
        _follower,
        formulas={"centres": SAME, "behind": OTHER},
        coordinates=(),
        joints="all",
    ),
    "load_misalignment": Entry(
        LOAD,
        "tilt",
        "rad",
        0.03,
        0.5,
        _misalignment,
        _draw_tilt,
        {"frame": SAME, "growing": OTHER},
        (),
        joints="all",
    ),
    "load_offset": Entry(
        LOAD,
        "moment",
        "N m",
        0.1,
        5.0,
        _load_offset,
        _draw_axis,
        {"moment": SAME, "cable": OTHER},
        (),
        joints="all",
    ),
    "marker_bias": Entry(
        READING, "tilt", "rad", 0.03, 0.5, _marker_bias, _draw_marker, {"frame": SAME}, ()
    ),
    "soft_tissue_artefact": Entry(
        READING,
        "share",
        "1",
        0.1,
        1.0,
        _soft_tissue,
        _draw_soft_tissue,
        {"root": SAME, "tanh": OTHER},
        joints="all",
    ),
    "neutral_pose_drift": Entry(
        READING,
        "drift",
        "rad",
        0.001,
        0.05,
        _pose_drift,
        _draw_pose_drift,
        {"settling": SAME, "square_root": OTHER, "slipping": OTHER},
    ),
}
