"""How the cohorts that are scored are tested: drawn by seed, apart from what is hidden in them."""

from dataclasses import replace
from typing import Any

import numpy as np

from tests.generators.hidden import USUAL, Recipe, draw_hidden

STREAM = 7
TOLD_BY_TRANSLATIONS = ("joint_centre_offset", "joint_centre_migration", "follower_load")
"""With pure moments and rotations alone these leave little or no trace."""

PRELOAD_N, STRONG_PRELOAD_N = 200.0, 400.0


def plain(seed: int, **given: Any) -> Recipe:
    """A recipe without any effect, in a drawn design; given fields are kept."""
    rng = np.random.default_rng([seed, STREAM])
    drawn: dict[str, Any] = {
        "unloading": bool(rng.random() < 0.35),
        "translations": bool(rng.random() < 0.25),
        "zeroed": bool(rng.random() < 0.25),
        "preload_n": PRELOAD_N if rng.random() < 0.15 else 0.0,
        "noise": str(rng.choice(["white", "serial", "outliers"], p=[0.6, 0.2, 0.2])),
        "design": "directions" if rng.random() < 0.1 else "sweeps",
    }
    drawn |= given
    if drawn["design"] == "directions":
        drawn |= {"steps": 5, "preload_n": 0.0}
    return Recipe(seed=seed, **(drawn | given))


def soiled(recipe: Recipe, share: float) -> Recipe:
    """With the usual dirt in that share of recipes: all of it, or one kind."""
    rng = np.random.default_rng([recipe.seed, STREAM + 1])
    if rng.random() >= share:
        return recipe
    one = str(rng.choice(list(USUAL)))
    return replace(recipe, dirt=dict(USUAL) if rng.random() < 0.5 else {one: USUAL[one]})


def with_effects(recipe: Recipe, *names: str) -> Recipe:
    """With effects drawn for the recipe's seed."""
    hidden = tuple(draw_hidden(name, recipe, number) for number, name in enumerate(names))
    return replace(recipe, hidden=hidden)


def suited(seed: int, share: float, *names: str) -> dict[str, Any]:
    """Fields of a design that shows these effects, in that share of designs."""
    rng = np.random.default_rng([seed, STREAM + 2])
    fields: dict[str, Any] = {}
    if set(names) & set(TOLD_BY_TRANSLATIONS) and rng.random() < share:
        fields["translations"] = True
    if "preload_stiffening" in names:
        fields["preload_n"] = STRONG_PRELOAD_N if rng.random() < share else 0.0
    if "hysteresis" in names and rng.random() < share:
        fields["unloading"] = True
    return fields
