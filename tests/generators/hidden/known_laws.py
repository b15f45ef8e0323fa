"""The vocabulary's joint laws and path laws, by name."""

import numpy as np

from . import contacts, history, springs
from .anatomy import N_JOINTS
from .entry import Entry, joints_of, reach_rad, scope_of, sign, value
from .recipe import Hidden, Recipe
from .world import World


def _stiffening(world: World, hidden: Hidden, strength: float) -> World:
    return world.with_law(
        springs.Stiffening(scope_of(world, hidden), value(hidden, "shape"), strength)
    )


def _draw_stiffening(rng, recipe: Recipe, coordinate):
    return {"shape": str(rng.choice(list(springs.SHAPES)))}


def _neutral_zone(world: World, hidden: Hidden, strength: float) -> World:
    width = value(hidden, "half_width_rad")
    return world.with_law(springs.NeutralZone(scope_of(world, hidden), width, strength))


def _draw_neutral_zone(rng, recipe: Recipe, coordinate):
    return {"half_width_rad": float(rng.uniform(0.25, 0.5) * reach_rad(coordinate, recipe))}


def _asymmetry(world: World, hidden: Hidden, strength: float) -> World:
    share = value(hidden, "sign") * strength
    return world.with_law(springs.Asymmetry(scope_of(world, hidden), share))


def _draw_sign(rng, recipe: Recipe, coordinate):
    return {"sign": sign(rng)}


def _coupling(world: World, hidden: Hidden, strength: float) -> World:
    stiffness = value(hidden, "sign") * strength
    return world.with_law(contacts.Coupling(joints_of(world, hidden), stiffness))


def _facet(world: World, hidden: Hidden, strength: float) -> World:
    side, gap = value(hidden, "side"), value(hidden, "gap_rad")
    return world.with_law(contacts.Facet(scope_of(world, hidden), side, gap, strength))


def _draw_facet(rng, recipe: Recipe, coordinate):
    gap = float(rng.uniform(0.2, 0.6) * reach_rad(coordinate, recipe))
    return {"side": sign(rng), "gap_rad": gap}


def _levels(world: World, hidden: Hidden, strength: float) -> World:
    ratios = np.exp(strength * np.array(value(hidden, "pattern")))
    return world.with_law(springs.Factors(scope_of(world, hidden), ratios))


def _draw_levels(rng, recipe: Recipe, coordinate):
    pattern = rng.normal(size=N_JOINTS)
    pattern -= pattern.mean()
    return {"pattern": [float(v) for v in pattern / pattern.std()]}


def _laxity(world: World, hidden: Hidden, strength: float) -> World:
    ratios = np.full(len(world.stiffness), 1.0 - strength)
    return world.with_law(springs.Factors(scope_of(world, hidden), ratios))


def _preloaded(world: World, hidden: Hidden, strength: float) -> World:
    return world.with_law(springs.Preloaded(scope_of(world, hidden), strength))


def _friction(world: World, hidden: Hidden, strength: float) -> World:
    width = value(hidden, "width_rad")
    return world.with_law(history.Friction(scope_of(world, hidden), strength, width))


def _draw_friction(rng, recipe: Recipe, coordinate):
    return {"width_rad": float(rng.uniform(0.1, 0.3) * reach_rad(coordinate, recipe))}


def _creep(world: World, hidden: Hidden, strength: float) -> World:
    seconds = value(hidden, "time_s")
    law = history.Creep(scope_of(world, hidden), world.stiffness, strength, seconds)
    return world.with_law(law)


def _draw_creep(rng, recipe: Recipe, coordinate):
    return {"time_s": float(rng.uniform(1.0, 5.0) * recipe.hold_s)}


LAW, PATH = "joint law", "path"
ENTRIES = {
    "nonlinear_stiffening": Entry(LAW, "rate", "1/rad", 3.0, 80.0, _stiffening, _draw_stiffening),
    "neutral_zone": Entry(LAW, "softness", "1", 0.3, 0.95, _neutral_zone, _draw_neutral_zone),
    "flexion_extension_asymmetry": Entry(LAW, "share", "1", 0.1, 0.8, _asymmetry, _draw_sign),
    "bending_rotation_coupling": Entry(
        LAW, "stiffness", "N m/rad", 5.0, 80.0, _coupling, _draw_sign, coordinates=()
    ),
    "facet_contact": Entry(LAW, "stiffness", "N m/rad", 30.0, 3000.0, _facet, _draw_facet),
    "level_dependence": Entry(LAW, "log_sd", "1", 0.1, 1.0, _levels, _draw_levels, joints="all"),
    "local_laxity": Entry(
        LAW, "fraction", "1", 0.3, 0.95, _laxity, joints="one", one_specimen=True
    ),
    "preload_stiffening": Entry(LAW, "per_newton", "1/N", 1e-3, 0.05, _preloaded),
    "hysteresis": Entry(PATH, "load", "N m", 0.2, 4.0, _friction, _draw_friction),
    "creep": Entry(PATH, "fraction", "1", 0.1, 3.0, _creep, _draw_creep),
}
