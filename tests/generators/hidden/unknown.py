"""Effects outside the vocabulary, by name."""

import numpy as np

from . import foreign
from .anatomy import COORDINATES
from .design import tests
from .entry import OTHER, Entry, joints_of, reach, scope_of, sign, value
from .recipe import Hidden, Recipe
from .world import World


def _neighbours(world: World, hidden: Hidden, strength: float) -> World:
    return world.with_law(foreign.Leaning(scope_of(world, hidden), strength))


def _clicks(world: World, hidden: Hidden, strength: float) -> World:
    period = value(hidden, "period")
    return world.with_law(foreign.Clicks(scope_of(world, hidden), period, strength))


def _draw_clicks(rng, recipe: Recipe, coordinate):
    return {"period": float(rng.uniform(0.8, 1.6) * reach(coordinate, recipe))}


def _bump(world: World, hidden: Hidden, strength: float) -> World:
    angle, width = value(hidden, "angle"), value(hidden, "width")
    return world.with_law(foreign.Bump(scope_of(world, hidden), angle, width, strength))


def _draw_bump(rng, recipe: Recipe, coordinate):
    far = reach(coordinate, recipe)
    return {
        "angle": float(sign(rng) * rng.uniform(0.3, 0.7) * far),
        "width": float(rng.uniform(0.3, 0.5) * far),
    }


def _quadratic(world: World, hidden: Hidden, strength: float) -> World:
    stiffness = value(hidden, "sign") * strength
    return world.with_law(foreign.QuadraticCross(joints_of(world, hidden), stiffness))


def _draw_sign(rng, recipe: Recipe, coordinate):
    return {"sign": sign(rng)}


def _walk(world: World, hidden: Hidden, strength: float) -> World:
    walk = strength * np.cumsum(np.array(value(hidden, "steps"))[world.number], axis=0)
    return world.with_law(foreign.NeutralWalk(scope_of(world, hidden), world.stiffness, walk))


def _draw_walk(rng, recipe: Recipe, coordinate):
    steps = rng.normal(size=(recipe.n_specimens, len(tests(recipe)), recipe.joints))
    return {"steps": steps.tolist()}


def _drift(world: World, hidden: Hidden, strength: float) -> World:
    sizes = np.array(
        [np.linalg.norm(np.hstack([c.moments, c.forces]), axis=1) for c in world.tests]
    )
    share = sizes / sizes.max(axis=1, keepdims=True)
    angle = value(hidden, "sign") * strength
    return world.with_view(foreign.OrderDrift(scope_of(world, hidden), share, angle))


LAW, READING = "joint law", "measurement"
ALIEN = {"own": OTHER}
ENTRIES = {
    "neighbour_coupling": Entry(
        LAW,
        "stiffness",
        "N m/rad",
        5.0,
        200.0,
        _neighbours,
        formulas=ALIEN,
        joints="all",
        known=False,
    ),
    "periodic_click": Entry(
        LAW, "load", "N m", 0.2, 5.0, _clicks, _draw_clicks, ALIEN, COORDINATES, known=False
    ),
    "angle_bump": Entry(
        LAW, "load", "N m", 0.2, 8.0, _bump, _draw_bump, ALIEN, COORDINATES, known=False
    ),
    "quadratic_cross_coupling": Entry(
        LAW, "stiffness", "N m/rad2", 50.0, 2000.0, _quadratic, _draw_sign, ALIEN, (), known=False
    ),
    "neutral_pose_walk": Entry(
        LAW, "step_sd", "rad", 0.002, 0.1, _walk, _draw_walk, ALIEN, joints="all", known=False
    ),
    "test_order_drift": Entry(
        READING, "angle", "rad", 0.001, 0.1, _drift, _draw_sign, ALIEN, joints="all", known=False
    ),
}
