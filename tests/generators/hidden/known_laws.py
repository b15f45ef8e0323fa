"""The vocabulary's joint laws and path laws, by name."""

import numpy as np

from . import contacts, history, springs
from .anatomy import COORDINATES
from .entry import OTHER, SAME, Entry, formula, joints_of, reach, scope_of, sign, value
from .recipe import Hidden, Recipe
from .world import World


def _stiffening(world: World, hidden: Hidden, strength: float) -> World:
    knee = hidden.shape.get("knee", 0.5)
    shape = formula(hidden, "exponential")
    return world.with_law(springs.Stiffening(scope_of(world, hidden), shape, strength, knee))


def _draw_stiffening(rng, recipe: Recipe, coordinate):
    return {"knee": float(rng.uniform(0.35, 0.65))}


def _neutral_zone(world: World, hidden: Hidden, strength: float) -> World:
    width, centre = value(hidden, "half_width"), hidden.shape.get("centre", 0.0)
    named = formula(hidden, "corner")
    zone = "tanh" if named == "off_centre" else named
    at = centre if named == "off_centre" else 0.0
    return world.with_law(springs.NeutralZone(scope_of(world, hidden), width, strength, zone, at))


def _draw_neutral_zone(rng, recipe: Recipe, coordinate):
    width = float(rng.uniform(0.25, 0.5) * reach(coordinate, recipe))
    return {"half_width": width, "centre": float(sign(rng) * rng.uniform(0.3, 0.8) * width)}


def _asymmetry(world: World, hidden: Hidden, strength: float) -> World:
    share = value(hidden, "sign") * strength
    width = value(hidden, "width") if formula(hidden, "sharp") == "smooth" else 0.0
    return world.with_law(springs.Asymmetry(scope_of(world, hidden), share, width))


def _draw_asymmetry(rng, recipe: Recipe, coordinate):
    width = float(rng.uniform(0.1, 0.25) * reach(coordinate, recipe))
    return {"sign": sign(rng), "width": width}


def _coupling(world: World, hidden: Hidden, strength: float) -> World:
    stiffness = value(hidden, "sign") * strength
    wide = value(hidden, "reach") if formula(hidden) == "saturating" else 0.0
    return world.with_law(contacts.Coupling(joints_of(world, hidden), stiffness, wide))


def _draw_coupling(rng, recipe: Recipe, coordinate):
    wide = float(rng.uniform(0.8, 1.5) * reach("right_bending", recipe))
    return {"sign": sign(rng), "reach": wide}


def _facet(world: World, hidden: Hidden, strength: float) -> World:
    side, gap = value(hidden, "side"), value(hidden, "gap")
    width = hidden.shape.get("width", gap)
    stop = contacts.Facet(scope_of(world, hidden), side, gap, strength, formula(hidden), width)
    return world.with_law(stop)


def _draw_facet(rng, recipe: Recipe, coordinate):
    far = reach(coordinate, recipe)
    gap, width = float(rng.uniform(0.2, 0.6) * far), float(rng.uniform(0.15, 0.3) * far)
    return {"side": sign(rng), "gap": gap, "width": width}


def _draw_levels(rng, recipe: Recipe, coordinate):
    """A drawn pattern, and a trend from level to level."""
    drawn, trend = rng.normal(size=recipe.joints), np.arange(recipe.joints) * float(sign(rng))
    return {"pattern": _standard(drawn), "trend": _standard(trend)}


def _standard(pattern: np.ndarray) -> list[float]:
    off = pattern - pattern.mean()
    return [float(v) for v in off / max(off.std(), 1e-12)]


def _levels(world: World, hidden: Hidden, strength: float) -> World:
    key = "trend" if formula(hidden, "drawn") == "trend" else "pattern"
    ratios = np.exp(strength * np.array(value(hidden, key)))
    return world.with_law(springs.Factors(scope_of(world, hidden), ratios))


def _laxity(world: World, hidden: Hidden, strength: float) -> World:
    ratios = np.full(len(world.stiffness), 1.0 - strength)
    fades = value(hidden, "fades") if formula(hidden, "share") == "fading" else 0.0
    return world.with_law(springs.Factors(scope_of(world, hidden), ratios, fades))


def _draw_laxity(rng, recipe: Recipe, coordinate):
    return {"fades": float(rng.uniform(1.5, 2.5) * reach(coordinate, recipe))}


def _preloaded(world: World, hidden: Hidden, strength: float) -> World:
    law = springs.Preloaded(scope_of(world, hidden), strength, formula(hidden))
    return world.with_law(law)


def _friction(world: World, hidden: Hidden, strength: float) -> World:
    width, named = value(hidden, "width"), formula(hidden, "dahl")
    return world.with_law(history.Friction(scope_of(world, hidden), strength, width, named))


def _draw_friction(rng, recipe: Recipe, coordinate):
    return {"width": float(rng.uniform(0.1, 0.3) * reach(coordinate, recipe))}


def _creep(world: World, hidden: Hidden, strength: float) -> World:
    seconds, named = value(hidden, "time_s"), formula(hidden, "kelvin")
    law = history.Creep(scope_of(world, hidden), world.stiffness, strength, seconds, named)
    return world.with_law(law)


def _draw_creep(rng, recipe: Recipe, coordinate):
    return {"time_s": float(rng.uniform(1.0, 5.0) * recipe.hold_s)}


LAW, PATH = "joint law", "path"
EVERY = COORDINATES
ENTRIES = {
    "nonlinear_stiffening": Entry(
        LAW,
        "rate",
        "1/rad",
        3.0,
        40.0,
        _stiffening,
        _draw_stiffening,
        {"exponential": SAME, "tangent": SAME, "cubic": SAME, "bilinear": SAME}
        | {"power": OTHER, "hyperbolic": OTHER, "sinh": OTHER, "tabulated": OTHER},
        EVERY,
    ),
    "neutral_zone": Entry(
        LAW,
        "softness",
        "1",
        0.3,
        0.95,
        _neutral_zone,
        _draw_neutral_zone,
        {"corner": SAME, "tanh": OTHER, "erf": OTHER, "arctan": OTHER, "off_centre": OTHER},
        EVERY,
    ),
    "flexion_extension_asymmetry": Entry(
        LAW,
        "share",
        "1",
        0.1,
        0.8,
        _asymmetry,
        _draw_asymmetry,
        {"sharp": SAME, "smooth": OTHER},
        EVERY,
    ),
    "bending_rotation_coupling": Entry(
        LAW,
        "stiffness",
        "N m/rad",
        5.0,
        80.0,
        _coupling,
        _draw_coupling,
        {"linear": SAME, "saturating": OTHER},
        (),
    ),
    "facet_contact": Entry(
        LAW,
        "stiffness",
        "N m/rad",
        30.0,
        3000.0,
        _facet,
        _draw_facet,
        {"linear": SAME, "hertz": SAME, "exponential": OTHER, "soft": OTHER},
        EVERY,
    ),
    "level_dependence": Entry(
        LAW,
        "log_sd",
        "1",
        0.1,
        1.0,
        _levels,
        _draw_levels,
        {"drawn": SAME, "trend": SAME},
        joints="all",
    ),
    "local_laxity": Entry(
        LAW,
        "fraction",
        "1",
        0.3,
        0.95,
        _laxity,
        _draw_laxity,
        {"share": SAME, "fading": OTHER},
        joints="one",
        one_specimen=True,
    ),
    "preload_stiffening": Entry(
        LAW,
        "per_newton",
        "1/N",
        1e-3,
        0.05,
        _preloaded,
        formulas={"linear": SAME, "saturating": OTHER, "root": OTHER},
    ),
    "hysteresis": Entry(
        PATH,
        "load",
        "N m",
        0.2,
        4.0,
        _friction,
        _draw_friction,
        {"dahl": SAME, "even": OTHER, "bouc_wen": OTHER},
        EVERY,
    ),
    "creep": Entry(
        PATH,
        "fraction",
        "1",
        0.1,
        3.0,
        _creep,
        _draw_creep,
        {"kelvin": SAME, "stretched": OTHER, "logarithmic": OTHER, "power": OTHER},
        EVERY,
    ),
}
