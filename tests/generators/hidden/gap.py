"""How large a discrepancy is: what the base model cannot follow, in SD of one reading.

The base model is what a study starts from: linear springs, one set per specimen, equal at all
levels. It is refitted to the noiseless motion by Gauss-Newton with exact derivatives. The gap is
the root mean square of what is left over all readings, specimens, tests, steps and joints.
"""

from dataclasses import dataclass

import numpy as np

from .anatomy import COORDINATES
from .recipe import Hidden, Recipe
from .rigid import Spine
from .scene import Scene, with_effect
from .solve import NoEquilibriumError, solve
from .world import World

MOST_REFITS = 6
SMALL_STEP = 0.02
"""Of log stiffness: the motion's curvature over such a step is 1e-4 of the motion."""
LOG_SD = 3.0
"""A loose prior on log stiffness, so that one that nothing tells of stays where it is."""


def readings(q: np.ndarray, recipe: Recipe) -> np.ndarray:
    """(..., S, J, coordinates read) in noise SD, of motion in SI; step 0 off if zeroed."""
    sd = np.array([recipe.noise_sd_mm / 1000.0] * 3 + [np.deg2rad(recipe.noise_sd_deg)] * 3)
    told = (q / sd)[..., read_columns(recipe)]
    return told[..., 1:, :, :] - told[..., :1, :, :] if recipe.zeroed else told


def read_columns(recipe: Recipe) -> np.ndarray:
    """Indices of the coordinates that are read."""
    return np.array([COORDINATES.index(name) for name in recipe.read])


@dataclass
class Base:
    """The base model of one specimen, with the last refit as the next one's start."""

    scene: Scene
    recipe: Recipe
    number: int
    spine: Spine
    log_factors: np.ndarray
    q: np.ndarray

    def left(self, target: np.ndarray) -> np.ndarray:
        """Readings that the refitted base does not follow; ``target`` as `readings` gives it.

        Ends when a linear step changes little: what it would leave is what the refit leaves.
        """
        for _ in range(MOST_REFITS):
            error, by_log = self._predict(target)
            step = self._step(error, by_log)
            left = error - by_log @ step
            if np.abs(step).max() < SMALL_STEP:
                break
            self.log_factors = self.log_factors + step
        return left

    def _predict(self, target):
        """Errors and their derivative by the free log stiffnesses."""
        stiffness = self.scene.stiffness[self.number] * np.exp(self.log_factors)
        world = self.scene.plain(self.number, stiffness)
        solved = solve(world, self.spine, self.q)
        self.q = solved.q
        loads = np.einsum("tsjc,c,cd->tsjcd", solved.q, stiffness, np.eye(6))
        shape = solved.q.shape
        by_log = -np.linalg.solve(solved.tangents, loads.reshape(*shape[:2], -1, 6))
        columns = np.moveaxis(by_log, -1, 0).reshape(6, *shape)
        told = np.stack([readings(column, self.recipe) for column in columns], axis=-1)
        return target - readings(solved.q, self.recipe), told

    def _step(self, error, by_log):
        free = read_columns(self.recipe)
        matrix = by_log.reshape(-1, 6)[:, free]
        pull = np.eye(len(free)) / LOG_SD
        rows = np.vstack([matrix, pull])
        right = np.concatenate([error.ravel(), -pull @ self.log_factors[free]])
        step = np.zeros(6)
        step[free] = np.clip(np.linalg.lstsq(rows, right, rcond=None)[0], -0.5, 0.5)
        return step


class Meter:
    """Measures the gap of effects on a scene; keeps models and poses warm."""

    def __init__(self, scene: Scene, recipe: Recipe) -> None:
        self.scene, self.recipe = scene, recipe
        numbers = range(len(scene.bones))
        steps = len(scene.tests[0].moments)
        self.rest = np.zeros((len(scene.tests), steps, recipe.joints, 6))
        self.spines = [Spine(bones) for bones in scene.bones]
        self.plain = [self._plain(number) for number in numbers]
        self.bases = [self._base(number) for number in numbers]

    def gap(self, effects: list[tuple[Hidden, float]]) -> float:
        """Root mean square over all readings, SD of one reading."""
        left = [self._left(number, effects) for number in range(len(self.scene.bones))]
        return float(np.sqrt(np.mean(np.square(left))))

    def motion(self, world: World) -> np.ndarray:
        """(T, S, J, 6) reported without noise.

        Each test from rest and each step from the one before, as the loads were applied: a start
        from elsewhere might find another branch of a law that snaps.
        """
        same = world.bones is self.scene.bones[world.number]
        spine = self.spines[world.number] if same else Spine(world.bones)
        return world.reported(solve(world, spine, self.rest).q)

    def _left(self, number, effects):
        world = self.scene.plain(number)
        for hidden, strength in effects:
            world = with_effect(world, hidden, strength)
        if not effects_here(effects, number):
            return np.zeros_like(readings(self.plain[number], self.recipe))
        target = readings(self.motion(world), self.recipe)
        try:
            return self.bases[number].left(target)
        except NoEquilibriumError:
            self.bases[number] = self._base(number)  # the next refit must not start where this fell
            raise

    def _plain(self, number):
        return solve(self.scene.plain(number), self.spines[number], self.rest).q

    def _base(self, number):
        spine, q = self.spines[number], self.plain[number]
        return Base(self.scene, self.recipe, number, spine, np.zeros(6), q)


def effects_here(effects: list[tuple[Hidden, float]], number: int) -> bool:
    """Whether any effect has this specimen in its scope."""
    return any(hidden.specimen in (None, number) for hidden, _ in effects)
