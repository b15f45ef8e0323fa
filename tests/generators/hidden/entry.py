"""What the generator knows of one effect: how it is drawn, built and told of."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .anatomy import ROTATIONS, TRANSLATIONS, typical
from .recipe import Hidden, Recipe, Shape
from .scope import Scope, scope
from .world import World

Build = Callable[[World, Hidden, float], World]
Draw = Callable[[np.random.Generator, Recipe, str | None], Shape]

SAME, OTHER = "same", "other"
"""Whether the library has the formula as it is written, or only others of the same physics."""


def no_shape(rng: np.random.Generator, recipe: Recipe, coordinate: str | None) -> Shape:
    """Nothing but a strength."""
    return {}


@dataclass(frozen=True)
class Entry:
    """One effect.

    Attributes
    ----------
    kind : as in the vocabulary. strength, unit : name and SI unit of what is scaled to the gap, for
        a rotation. start, top : where scaling starts, and the largest value that is plausible.
    build : puts the effect into a world at a strength.
    draw : its shape, from a stream, for a coordinate.
    formulas : each with `SAME` or `OTHER`, the library's own first.
    coordinates : those it may act on; empty where it has none.
    known : whether the vocabulary has it. joints, one_specimen : the scope that is drawn.
    """

    kind: str
    strength: str
    unit: str
    start: float
    top: float
    build: Build
    draw: Draw = no_shape
    formulas: Mapping[str, str] = field(default_factory=lambda: {"linear": SAME})
    coordinates: tuple[str, ...] = ROTATIONS
    known: bool = True
    joints: str = "all or one"
    one_specimen: bool = False

    def size(self, coordinate: str | None, recipe: Recipe) -> float:
        """What the strength of a lumbar joint's extension is multiplied by elsewhere, SI."""
        if coordinate is None:
            return 1.0
        stiffer = typical(recipe, coordinate) / typical(LUMBAR_MOMENTS, "extension")
        farther = reach(coordinate, recipe) / reach("extension", LUMBAR_MOMENTS)
        return {"1/rad": 1.0 / farther, "N m/rad": stiffer, "N m": stiffer * farther}.get(
            self.unit, 1.0
        )

    def unit_of(self, coordinate: str | None) -> str:
        """SI unit of the strength on a coordinate."""
        if coordinate not in TRANSLATIONS:
            return self.unit
        return {"1/rad": "1/m", "N m/rad": "N/m", "N m": "N"}.get(self.unit, self.unit)


LUMBAR_MOMENTS = Recipe(seed=0)
"""For which `Entry.start` and `Entry.top` are stated."""


def scope_of(world: World, hidden: Hidden) -> Scope:
    """The joints and the coordinate of an effect."""
    return scope(hidden.coordinate, hidden.joint, len(world.stiffness))


def joints_of(world: World, hidden: Hidden) -> np.ndarray:
    """(J,) mask of the joints of an effect."""
    return scope_of(world, hidden).joints


def reach(coordinate: str | None, recipe: Recipe) -> float:
    """About how far a joint moves at the peak load, rad or m."""
    peak = recipe.peak_n if coordinate in TRANSLATIONS else recipe.peak_nm
    return peak / typical(recipe, coordinate)


def sign(rng: np.random.Generator) -> int:
    """+1 or -1."""
    return int(rng.choice([-1, 1]))


def value(hidden: Hidden, key: str) -> Any:
    """A shape parameter that must have been given or drawn."""
    if key not in hidden.shape:
        raise KeyError(f"{hidden.name}: shape lacks '{key}'; draw it with draw_hidden")
    return hidden.shape[key]


def formula(hidden: Hidden, usual: str = "linear") -> str:
    """The formula of a hidden effect; the first of its entry where none is told."""
    return str(hidden.shape.get("formula", usual))
