"""Errors of readings that repeat themselves never: white, serially correlated, with outliers."""

import numpy as np

from .recipe import Recipe

SERIAL = 0.5
"""Correlation from one load step to the next."""
OUTLIERS, OUTLIER_SD = 0.01, 10.0


def drawn(recipe: Recipe, shape: tuple[int, ...], rng: np.random.Generator) -> np.ndarray:
    """Errors (P, T, C, S, J, 6) in SD of one reading."""
    white = rng.normal(size=shape)
    if recipe.noise == "none":
        return np.zeros(shape)
    if recipe.noise == "white":
        return white
    if recipe.noise == "serial":
        return _serial(white)
    if recipe.noise == "outliers":
        hit = rng.uniform(size=shape) < OUTLIERS
        return white + hit * OUTLIER_SD * rng.choice([-1.0, 1.0], size=shape)
    raise ValueError(f"noise '{recipe.noise}': none, white, serial or outliers")


def _serial(white: np.ndarray) -> np.ndarray:
    """Each step keeps `SERIAL` of the error of the step before; the SD stays one."""
    errors = white.copy()
    for step in range(1, white.shape[3]):
        kept = SERIAL * errors[:, :, :, step - 1]
        errors[:, :, :, step] = kept + np.sqrt(1.0 - SERIAL**2) * white[:, :, :, step]
    return errors
