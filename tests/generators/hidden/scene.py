"""The specimens of a recipe: as the files state them, and as they truly are."""

from dataclasses import dataclass

import numpy as np

from . import anatomy
from .anatomy import Bones
from .catalogue import CATALOGUE
from .design import Test, tests
from .recipe import Hidden, Recipe
from .world import World

# One stream each, so that no choice changes what the others draw.
ANATOMY, STIFFNESS, NOISE, DIRT, ERRORS = range(5)


def stream(recipe: Recipe, number: int) -> np.random.Generator:
    """Random numbers of one purpose."""
    return np.random.default_rng([recipe.seed, number])


@dataclass(frozen=True)
class Scene:
    """What the files state: bones and base stiffness (P, 6) per specimen, and the tests."""

    bones: tuple[Bones, ...]
    stiffness: np.ndarray
    tests: tuple[Test, ...]
    weight: bool

    def plain(self, number: int, stiffness: np.ndarray | None = None) -> World:
        """Specimen ``number`` with linear springs (6,) and no effect."""
        bones = self.bones[number]
        springs = self.stiffness[number] if stiffness is None else stiffness
        return World(
            number=number,
            bones=bones,
            stiffness=np.tile(springs, (len(bones.masses), 1)),
            tests=self.tests,
            weight=self.weight,
            preload_points=preload_points(bones),
            load_point=np.round(bones.origins[-1], 9),
            turn_load=np.tile(np.eye(3), (len(self.tests), 1, 1)),
            gain=np.ones(len(self.tests)),
        )


def scene(recipe: Recipe) -> Scene:
    """Draw the specimens."""
    shapes, springs = stream(recipe, ANATOMY), stream(recipe, STIFFNESS)
    numbers = range(recipe.n_specimens)
    return Scene(
        bones=tuple(anatomy.bones(shapes, recipe) for _ in numbers),
        stiffness=np.array([anatomy.stiffness(springs, recipe) for _ in numbers]),
        tests=tests(recipe),
        weight=recipe.gravity,
    )


def preload_points(bones: Bones) -> np.ndarray:
    """(J, 3) m: where the vertebrae's shares of the preload act, caudal to cranial.

    Each vertebra carries an equal share on a rod that reaches down to the middle of the joints
    below it. One dead load of hundreds of newtons on top would buckle a spine without muscles;
    shared and hung low it does not, and compresses it nearly without bending, as a follower does.
    """
    counts = np.arange(1, len(bones.origins) + 1)[:, None]
    return np.round(np.cumsum(bones.origins, axis=0) / counts, 9)


def with_effect(world: World, hidden: Hidden, strength: float) -> World:
    """The world with the effect, if this specimen is in its scope."""
    if hidden.specimen not in (None, world.number):
        return world
    return CATALOGUE[hidden.name].build(world, hidden, strength)
