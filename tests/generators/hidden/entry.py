"""What the generator knows of one effect: how it is drawn, built and told of."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from .anatomy import COORDINATES, ROTATIONAL_NM_PER_RAD
from .recipe import Hidden, Recipe, Shape
from .scope import Scope, scope
from .world import World

ROTATIONS = COORDINATES[3:]

Build = Callable[[World, Hidden, float], World]
Draw = Callable[[np.random.Generator, Recipe, str | None], Shape]


def no_shape(rng: np.random.Generator, recipe: Recipe, coordinate: str | None) -> Shape:
    """Nothing but a strength."""
    return {}


@dataclass(frozen=True)
class Entry:
    """One effect.

    Attributes
    ----------
    kind : as in the vocabulary. strength, unit : name and SI unit of what is scaled to the gap.
    start, top : SI: where scaling starts, and the largest value that is still plausible.
    build : puts the effect into a world at a strength.
    draw : its shape, from a stream, for a coordinate.
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
    coordinates: tuple[str, ...] = ROTATIONS
    known: bool = True
    joints: str = "all or one"
    one_specimen: bool = False


def scope_of(world: World, hidden: Hidden) -> Scope:
    """The joints and the coordinate of an effect."""
    return scope(hidden.coordinate, hidden.joint, len(world.stiffness))


def joints_of(world: World, hidden: Hidden) -> np.ndarray:
    """(J,) mask of the joints of an effect."""
    return scope_of(world, hidden).joints


def reach_rad(coordinate: str | None, recipe: Recipe) -> float:
    """About how far a joint turns at the peak moment, rad."""
    medians = dict(zip(ROTATIONS, ROTATIONAL_NM_PER_RAD, strict=True))
    return recipe.peak_nm / medians[coordinate or "extension"]


def sign(rng: np.random.Generator) -> int:
    """+1 or -1."""
    return int(rng.choice([-1, 1]))


def value(hidden: Hidden, key: str) -> Any:
    """A shape parameter that must have been given or drawn."""
    if key not in hidden.shape:
        raise KeyError(f"{hidden.name}: shape lacks '{key}'; draw it with draw_hidden")
    return hidden.shape[key]
