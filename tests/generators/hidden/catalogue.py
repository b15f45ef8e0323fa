"""All effects by name, and how one is drawn."""

from dataclasses import replace
from zlib import crc32

import numpy as np

from . import known_laws, known_others, unknown
from .entry import OTHER, SAME, Entry
from .recipe import Hidden, Recipe

CATALOGUE: dict[str, Entry] = {**known_laws.ENTRIES, **known_others.ENTRIES, **unknown.ENTRIES}
KNOWN = tuple(name for name, entry in CATALOGUE.items() if entry.known)
"""The vocabulary."""
UNKNOWN = tuple(name for name, entry in CATALOGUE.items() if not entry.known)

ONE_JOINT_CHANCE = 0.2
_STREAM = 100


def draw_hidden(
    name: str, recipe: Recipe, number: int = 0, other: bool | None = None, **given: object
) -> Hidden:
    """An effect with a drawn coordinate, scope, formula and shape.

    ``number`` tells the effects of one recipe apart; ``given`` fields of `Hidden` are kept.
    ``other`` : a formula that the library does not have, where there is one; None: the entry's
    first formula.
    """
    entry = CATALOGUE[name]
    rng = np.random.default_rng([recipe.seed, _STREAM + number, crc32(name.encode())])
    drawn = Hidden(
        name,
        coordinate=_coordinate(entry, recipe, rng),
        joint=_joint(entry, recipe, rng),
        specimen=int(rng.integers(recipe.n_specimens)) if entry.one_specimen else None,
    )
    drawn = replace(drawn, **given)
    shape = entry.draw(rng, recipe, drawn.coordinate)
    shape["formula"] = str(rng.choice(_formulas(entry, other)))
    return replace(drawn, shape=shape | drawn.shape)


def is_other(hidden: Hidden) -> bool:
    """Whether the library lacks the formula, as it is written."""
    formulas = CATALOGUE[hidden.name].formulas
    return formulas.get(hidden.shape.get("formula", next(iter(formulas))), OTHER) == OTHER


def _formulas(entry: Entry, other: bool | None) -> list[str]:
    if other is None:
        return [next(iter(entry.formulas))]
    wanted = OTHER if other else SAME
    found = [name for name, which in entry.formulas.items() if which == wanted]
    return found or list(entry.formulas)


def _coordinate(entry: Entry, recipe: Recipe, rng: np.random.Generator) -> str | None:
    """One that is loaded and read: rotations of moments; the axis of a force."""
    if not entry.coordinates:
        return None
    loaded = LOADED.get(recipe.design, ROTATED)
    found = [one for one in entry.coordinates if one in loaded and one in recipe.read]
    return str(rng.choice(found or list(entry.coordinates)))


ROTATED = ("extension", "right_bending", "left_rotation")
LOADED = {
    "flexion_extension": ("extension",),
    "shear": ("anterior",),
    "two_shears": ("anterior", "right"),
}
"""Coordinates that a design loads by itself."""


def _joint(entry: Entry, recipe: Recipe, rng: np.random.Generator) -> int | None:
    joint, chance = int(rng.integers(recipe.joints)), rng.uniform()
    one = {"one": True, "all": False, "all or one": chance < ONE_JOINT_CHANCE}[entry.joints]
    return joint if one and recipe.joints > 1 else None
