"""Functions of the unit cube whose Sobol indices are known in closed form."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

Array = NDArray[np.float64]


@dataclass(frozen=True)
class KnownFunction:
    """A function of (n, D) points and its true indices by (index, factor, other)."""

    factors: tuple[str, ...]
    values: Callable[[Array], Array]
    truth: dict[tuple[str, str, str], float]


def from_parts(
    values: Callable[[Array], Array], inputs: int, parts: dict[tuple[int, ...], float]
) -> KnownFunction:
    """From the variance of each interaction (positions of its factors)."""
    names = tuple(f"x{at + 1}" for at in range(inputs))
    whole = sum(parts.values())
    truth = {}
    for at, name in enumerate(names):
        truth["S1", name, ""] = parts.get((at,), 0.0) / whole
        truth["ST", name, ""] = sum(v for key, v in parts.items() if at in key) / whole
    for pair in combinations(range(inputs), 2):
        truth["S2", names[pair[0]], names[pair[1]]] = parts.get(pair, 0.0) / whole
    return KnownFunction(names, values, truth)


def ishigami() -> KnownFunction:
    """Ishigami & Homma 1990 with a = 7, b = 0.1; doi:10.1109/ISUMA.1990.151285."""
    a, b = 7.0, 0.1

    def values(unit: Array) -> Array:
        x = np.pi * (2.0 * unit - 1.0)
        return np.sin(x[:, 0]) * (1.0 + b * x[:, 2] ** 4) + a * np.sin(x[:, 1]) ** 2

    parts = {
        (0,): 0.5 * (1.0 + b * np.pi**4 / 5.0) ** 2,
        (1,): a**2 / 8.0,
        (0, 2): b**2 * np.pi**8 * (1.0 / 18.0 - 1.0 / 50.0),
    }
    return from_parts(values, 3, parts)


def linear_gaussian(slopes: tuple[float, ...] = (4.0, 2.0, 1.0, 0.5, 0.0)) -> KnownFunction:
    """Sum of independent standard normals times slopes: indices are squares of slopes."""

    def values(unit: Array) -> Array:
        return norm.ppf(np.clip(unit, 2.0**-31, 1.0 - 2.0**-31)) @ np.array(slopes)

    return from_parts(values, len(slopes), {(at,): a**2 for at, a in enumerate(slopes)})


def g_function(a: tuple[float, ...] = (0.0, 1.0, 4.5, 9.0, 99.0, 99.0)) -> KnownFunction:
    """Product of (|4 x - 2| + a) / (1 + a); Saltelli & Sobol' 1995."""
    own = [1.0 / (3.0 * (1.0 + each) ** 2) for each in a]

    def values(unit: Array) -> Array:
        return np.prod((np.abs(4.0 * unit - 2.0) + a) / (1.0 + np.array(a)), axis=1)

    keys = [key for size in range(1, len(a) + 1) for key in combinations(range(len(a)), size)]
    return from_parts(
        values, len(a), {key: float(np.prod([own[at] for at in key])) for key in keys}
    )


FUNCTIONS = {"ishigami": ishigami(), "linear_gaussian": linear_gaussian(), "g": g_function()}


def morris_truth(function: KnownFunction, levels: int = 4) -> dict[tuple[str, str, str], float]:
    """Mean, mean size and SD of elementary effects, by going through the whole grid of levels.

    A step goes over half the levels, up or down; the other factors are at any level alike.
    """
    inputs = len(function.factors)
    places = np.indices((levels,) * inputs).reshape(inputs, -1).T / (levels - 1)
    grid = function.values(places).reshape((levels,) * inputs)
    half = levels // 2
    truth = {}
    for at, name in enumerate(function.factors):
        upper, lower = np.split(grid, [half], axis=at)[::-1]
        effects = (upper - lower).ravel() * (levels - 1) / half
        truth["mu", name, ""] = float(effects.mean())
        truth["mu_star", name, ""] = float(np.abs(effects).mean())
        truth["sigma", name, ""] = float(effects.std())
    return truth
