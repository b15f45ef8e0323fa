"""The tests of a recipe: names, moment directions and the path of load steps."""

from dataclasses import dataclass

import numpy as np

from .recipe import Recipe

SWEEPS = {
    "flexion_extension": (0.0, 0.0, 1.0),
    "lateral_bending": (1.0, 0.0, 0.0),
    "axial_rotation": (0.0, 1.0, 0.0),
}
DIRECTIONS = {
    "flexion": (0.0, 0.0, -1.0),
    "extension": (0.0, 0.0, 1.0),
    "right_bending": (1.0, 0.0, 0.0),
    "left_bending": (-1.0, 0.0, 0.0),
    "left_rotation": (0.0, 1.0, 0.0),
    "right_rotation": (0.0, -1.0, 0.0),
}
"""Direction of the moment in ground: x anterior, y superior, z right."""


@dataclass(frozen=True)
class Test:
    """One load case.

    Attributes
    ----------
    moments : (S, 3) N m on T12, step 0 is zero. preload : N, compressive, in every step.
    seconds : (S,) time at the end of each step.
    """

    name: str
    moments: np.ndarray
    preload: float
    seconds: np.ndarray


def tests(recipe: Recipe) -> tuple[Test, ...]:
    """All tests in the order in which they are done."""
    directions = {"sweeps": SWEEPS, "directions": DIRECTIONS}[recipe.design]
    levels = recipe.peak_nm * path(recipe.steps, recipe.design == "sweeps", recipe.unloading)
    seconds = recipe.hold_s * np.arange(len(levels))
    preloads = {"": 0.0, "_preloaded": recipe.preload_n} if recipe.preload_n else {"": 0.0}
    return tuple(
        Test(name + suffix, np.round(np.outer(levels, axis), 9) + 0.0, preload, seconds)
        for suffix, preload in preloads.items()
        for name, axis in directions.items()
    )


def path(steps: int, both_sides: bool, unloading: bool) -> np.ndarray:
    """(S,) shares of the peak, from 0 up, back down if unloading, then the other side.

    Without unloading the other side starts right after the peak: 0, 1/3, 2/3, 1, -1/3, -2/3, -1.
    """
    up = np.arange(1, steps + 1) / steps
    side = np.concatenate([up, up[-2::-1], [0.0]]) if unloading else up
    return np.concatenate([[0.0], side, -side] if both_sides else [[0.0], side])
