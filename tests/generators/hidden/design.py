"""The tests of a recipe: names, directions of moments and forces, and the path of load steps."""

from dataclasses import dataclass

import numpy as np

from .recipe import Recipe

Axis = tuple[float, float, float]
ZERO: Axis = (0.0, 0.0, 0.0)

SWEEPS = {
    "flexion_extension": (ZERO, (0.0, 0.0, 1.0)),
    "lateral_bending": (ZERO, (1.0, 0.0, 0.0)),
    "axial_rotation": (ZERO, (0.0, 1.0, 0.0)),
}
SHEAR = {"anterior_posterior_shear": ((1.0, 0.0, 0.0), ZERO)}
DIRECTIONS = {
    "flexion": (ZERO, (0.0, 0.0, -1.0)),
    "extension": (ZERO, (0.0, 0.0, 1.0)),
    "right_bending": (ZERO, (1.0, 0.0, 0.0)),
    "left_bending": (ZERO, (-1.0, 0.0, 0.0)),
    "left_rotation": (ZERO, (0.0, 1.0, 0.0)),
    "right_rotation": (ZERO, (0.0, -1.0, 0.0)),
}
DESIGNS: dict[str, dict[str, tuple[Axis, Axis]]] = {
    "sweeps": SWEEPS,
    "directions": DIRECTIONS,
    "flexion_extension": {"flexion_extension": SWEEPS["flexion_extension"]},
    "shear": SHEAR,
    "two_shears": SHEAR | {"lateral_shear": ((0.0, 0.0, 1.0), ZERO)},
}
"""Directions of force and moment on the uppermost body in ground: x anterior, y superior, z right.
Sweeps go to both sides, directions to one. Forces act at the uppermost joint's centre."""


@dataclass(frozen=True)
class Test:
    """One load case.

    Attributes
    ----------
    moments, forces : (S, 3) N m and N on the uppermost body, step 0 is zero.
    preload : N, compressive, in every step. seconds : (S,) time at the end of each step.
    """

    name: str
    moments: np.ndarray
    preload: float
    seconds: np.ndarray
    forces: np.ndarray


def tests(recipe: Recipe) -> tuple[Test, ...]:
    """All tests in the order in which they are done."""
    levels = path(recipe.steps, recipe.design != "directions", recipe.unloading)
    seconds = recipe.hold_s * np.arange(len(levels))
    preloads = {"": 0.0, "_preloaded": recipe.preload_n} if recipe.preload_n else {"": 0.0}
    return tuple(
        Test(
            name + suffix,
            _along(recipe.peak_nm * levels, moment),
            preload,
            seconds,
            _along(recipe.peak_n * levels, force),
        )
        for suffix, preload in preloads.items()
        for name, (force, moment) in DESIGNS[recipe.design].items()
    )


def _along(levels: np.ndarray, axis: Axis) -> np.ndarray:
    return np.round(np.outer(levels, axis), 9) + 0.0


def path(steps: int, both_sides: bool, unloading: bool) -> np.ndarray:
    """(S,) shares of the peak, from 0 up, back down if unloading, then the other side.

    Without unloading the other side starts right after the peak: 0, 1/3, 2/3, 1, -1/3, -2/3, -1.
    """
    up = np.arange(1, steps + 1) / steps
    side = np.concatenate([up, up[-2::-1], [0.0]]) if unloading else up
    return np.concatenate([[0.0], side, -side] if both_sides else [[0.0], side])
