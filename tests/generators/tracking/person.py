"""A person: where the joints are, what bodies weigh, how joints resist. All of it is drawn."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]

BODIES = ("S1", "L5", "L4", "L3", "L2", "L1", *(f"T{k}" for k in range(12, 0, -1)))
JOINTS = tuple(f"{BODIES[k + 1]}{BODIES[k]}" for k in range(17))

# Height of a vertebra with its disc, mm, and tilt of the joint below it (forwards negative), deg,
# from L5 up, in a man of 1750 mm: round numbers.
HEIGHTS_MM = (36, 37, 37, 36, 35, 33, 32, 30, 28, 27, 26, 25, 24, 23, 22, 21, 20)
TILTS_DEG = (-20, -8, 3, 11, 16, 18, 17, 15, 11, 7, 2, -3, -8, -13, -17, -21, -25)

# Moment that turns a joint to the end of its range, N m, and the range, deg: forwards, backwards,
# to a side, about its length; from L5S1 up.
RANGE_DEG = {
    "forwards": (9, 10, 9, 8, 7, 6, 4, 3, 3, 3, 3, 3, 2.5, 2.5, 2.5, 2.5, 3),
    "backwards": (5, 4, 3, 3, 4, 3, 3, 2, 2, 2, 2, 2, 2, 2, 2, 2, 2),
    "aside": (3, 5, 7, 7, 5, 5, 5, 5, 4, 4, 4, 4, 4, 4, 4, 4, 4),
    "about": (2, 2, 2, 2, 2, 2, 3, 4, 5, 5, 5, 5, 5, 5, 5, 5, 5),
}
AT_RANGE_NM = 12.0
TRANSLATION_N_PER_M = (2.5e5, 8e5, 2.5e5)


@dataclass(frozen=True, eq=False)
class Person:
    """As they are.

    Attributes
    ----------
    steps : (17, 3) m, from a body's origin to the joint above it. turns : (17, 3, 3) of that joint
        in the body. kg : (18,), com : (18, 3) m, about : (18, 3) kg m2, in the body's axes; head
        and arms hang on T1. knots_rad : (X,), curves_nm : (17, 3, X) resisting moments about z, x, y.
    """

    sex: str
    age_years: float
    height_m: float
    mass_kg: float
    steps: Array
    turns: Array
    kg: Array
    com: Array
    about: Array
    knots_rad: Array
    curves_nm: Array


def drawn(rng: np.random.Generator, male: bool, arms: str, plain: bool = False) -> Person:
    """A person.

    Parameters
    ----------
    arms : hanging or behind_head; none: T1 without what hangs on it. plain : joints resist by exponentials, the same at all levels of
        a region (see `plain_curves`).
    """
    height = rng.normal(1.72 if male else 1.60, 0.05)
    mass = height**2 * rng.uniform(20.0, 27.0)
    scale = height / 1.75
    steps = np.zeros((17, 3))
    steps[1:, 1] = scale * 1e-3 * np.array(HEIGHTS_MM[:-1]) * rng.normal(1.0, 0.02, 16)
    steps[1:, 0] = scale * rng.normal(0.0, 1e-3, 16)
    steps[0] = 0.0
    tilts = np.array(TILTS_DEG) * rng.normal(1.0, 0.12) + rng.normal(0.0, 1.5, 17)
    each = np.diff(np.concatenate([[0.0], tilts]))
    turns = Rotation.from_euler("z", each[:, None], degrees=True).as_matrix()
    kg, com, about = _bodies(mass, scale, tilts, arms)
    knots = np.deg2rad(np.linspace(-30.0, 30.0, 241))
    curves = plain_curves(rng, knots) if plain else _curves(rng, knots)
    return Person(
        *("male" if male else "female", float(rng.uniform(58.0, 76.0)), height, mass),
        *(steps, turns, kg, com, about, knots, curves),
    )


def _bodies(mass: float, scale: float, tilts: Array, arms: str) -> tuple[Array, Array, Array]:
    """Slices of a trunk, ahead of the spine; pelvis, head and arms."""
    kg = mass * np.array([0.15, *[0.026] * 6, *[0.0215] * 11])
    ahead = np.array([0.0, *[0.02] * 6, *np.linspace(0.03, 0.05, 11)]) * scale
    high = np.array([-0.05, *[0.016] * 17]) * scale
    upright = Rotation.from_euler("z", np.concatenate([[0.0], -tilts])[:, None], degrees=True)
    com = upright.apply(np.stack([ahead, high, np.zeros(18)], axis=1))
    about = kg[:, None] * np.array([0.012, 0.015, 0.007]) * scale**2
    if arms == "none":
        return kg, com, about
    forward = {"hanging": 0.02, "behind_head": -0.01}[arms]
    up = {"hanging": -0.22, "behind_head": 0.12}[arms]
    extra = [(0.07 * mass, 0.04, 0.20, 0.010), (0.10 * mass, forward, up, 0.030)]
    for more, x, y, spread in extra:
        at = upright[-1].apply(scale * np.array([x, y, 0.0]))
        whole = kg[-1] + more
        apart = at - com[-1]
        joined = (kg[-1] * com[-1] + more * at) / whole
        reduced = kg[-1] * more / whole
        about[-1] += more * spread * scale**2 + reduced * (apart @ apart - apart**2)
        kg[-1], com[-1] = whole, joined
    return kg, com, about


def _curves(rng: np.random.Generator, knots: Array) -> Array:
    """(17, 3, X) N m: hardly anything near the middle, more and more towards the end of a range.

    Where it begins, how suddenly, how strong: drawn by person, by level and by direction.
    """
    strong, loose = rng.lognormal(0.0, 0.35), rng.uniform(0.15, 0.45)
    found = np.zeros((17, 3, len(knots)))
    pairs = (("backwards", "forwards"), ("aside", "aside"), ("about", "about"))
    for level in range(17):
        own = strong * rng.lognormal(0.0, 0.3)
        for axis, names in enumerate(pairs):
            moments = np.zeros(len(knots))
            for name, sign in zip(names, (1.0, -1.0), strict=True):
                end = np.deg2rad(RANGE_DEG[name][level]) * rng.lognormal(0.0, 0.15)
                slack = loose * rng.uniform(0.7, 1.3)
                at = end * np.array([0.0, slack, 0.5 * (1.0 + slack), 1.0, 1.6, 40.0])
                share = np.array([0.0, 0.06 + 0.1 * slack, 0.38, 1.0, 3.2, 3.2 + 38.4 * 4.5])
                curve = PchipInterpolator(at, own * AT_RANGE_NM * share)
                side = sign * knots > 0.0
                moments[side] = sign * curve(np.abs(knots[side]))
            found[level, axis] = moments
    return found


def plain_curves(rng: np.random.Generator, knots: Array) -> Array:
    """(17, 3, X) N m of the control: exponentials, stiffer or softer by region."""
    found = np.zeros((17, 3, len(knots)))
    region = np.repeat(rng.lognormal(0.0, 0.4, 3), (6, 6, 5))
    for level in range(17):
        for axis, slope in enumerate((70.0, 70.0, 120.0)):
            stiff = slope * (1.0 if level < 6 else 1.8) * region[level]
            rate = 18.0
            grown = np.exp(rate * np.abs(knots)) - 1.0
            found[level, axis] = np.sign(knots) * stiff / rate * grown
    return found
