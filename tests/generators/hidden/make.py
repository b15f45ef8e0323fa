"""From a recipe to a cohort folder and its truth."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from . import noise
from .anatomy import Bones
from .catalogue import CATALOGUE
from .dirt import soiled
from .errors import ERRORS
from .gap import Meter
from .recipe import Hidden, Recipe
from .scale import scaled
from .scene import DIRT, NOISE, Scene, scene, stream, with_effect
from .scene import ERRORS as ERRORS_STREAM
from .world import World
from .write import write_cohort, write_truth

BORDER_PER_SI = np.array([1000.0] * 3 + [180.0 / np.pi] * 3)


@dataclass(frozen=True)
class Truth:
    """What no lab would know.

    Attributes
    ----------
    recipe : with the strengths that were used. gaps : of each effect alone, SD of one reading.
    gap : of all effects together, without dirt; 0 without effects.
    stiffness : (P, 6) base, N/m and N m/rad. bones : true geometry of each specimen.
    reported : (P, T, S, J, 6) as the instruments told it, without noise, not zeroed.
    errors : what went wrong in the files.
    """

    recipe: Recipe
    gaps: tuple[float, ...]
    gap: float
    stiffness: np.ndarray
    bones: tuple[Bones, ...]
    reported: np.ndarray
    errors: dict[str, Any]


def make(recipe: Recipe, folder: str | Path) -> Truth:
    """Write a cohort folder (made if need be) with truth.json in it, which no study reads."""
    truth, stage, table = draw(recipe)
    folder = Path(folder)
    write_cohort(recipe, stage, table, folder)
    write_truth(truth, folder)
    return truth


def draw(recipe: Recipe) -> tuple[Truth, Scene, np.ndarray]:
    """Truth, what the files state, and the readings (P, T, C, S, J, 6) in mm and deg."""
    stage = scene(recipe)
    meter = Meter(stage, recipe)
    scaled = [_scaled(meter, hidden, recipe) for hidden in recipe.hidden]
    effects, gaps = [hidden for hidden, _ in scaled], tuple(gap for _, gap in scaled)
    pairs = [(hidden, float(hidden.strength or 0.0)) for hidden in effects]
    whole = gaps[0] if len(gaps) == 1 else meter.gap(pairs) if gaps else 0.0
    worlds = _worlds(stage, recipe, pairs)
    reported = np.array([meter.motion(world) for world in worlds])
    table, errors = _table(recipe, reported)
    used = replace(recipe, hidden=tuple(effects))
    bones = tuple(world.bones for world in worlds)
    return Truth(used, gaps, whole, stage.stiffness, bones, reported, errors), stage, table


def _scaled(meter: Meter, hidden: Hidden, recipe: Recipe) -> tuple[Hidden, float]:
    """The effect with its strength, and its gap."""
    if hidden.strength is not None:
        return hidden, meter.gap([(hidden, hidden.strength)])
    strength, found = scaled(meter, hidden, recipe.gap, CATALOGUE[hidden.name])
    return replace(hidden, strength=strength), found


def _worlds(stage: Scene, recipe: Recipe, pairs: list[tuple[Hidden, float]]) -> list[World]:
    """The specimens as they truly are: effects first, dirt on top."""
    worlds = []
    streams = stream(recipe, DIRT).spawn(recipe.n_specimens)
    for number, rng in enumerate(streams):
        world = stage.plain(number)
        for hidden, strength in pairs:
            world = with_effect(world, hidden, strength)
        worlds.append(soiled(world, recipe.dirt, rng))
    return worlds


def _table(recipe: Recipe, reported: np.ndarray) -> tuple[np.ndarray, dict[str, Any]]:
    """Readings of all cycles with noise, then mistakes, then zeroing."""
    clean = np.repeat(reported[:, :, None] * BORDER_PER_SI, recipe.cycles, axis=2)
    sd = np.array([recipe.noise_sd_mm] * 3 + [recipe.noise_sd_deg] * 3)
    table = clean + sd * noise.drawn(recipe, clean.shape, stream(recipe, NOISE))
    told: dict[str, Any] = {}
    rng = stream(recipe, ERRORS_STREAM)
    for name, options in recipe.errors.items():
        if name in ERRORS:
            table, told[name] = ERRORS[name](table, clean, rng, options)
        else:
            told[name] = dict(options)
    return (table - table[:, :, :, :1] if recipe.zeroed else table), told
