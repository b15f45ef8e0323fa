"""A person: where the joints are, what bodies weigh, how joints resist. All of it is drawn."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from tests.generators.tracking.laws import Array, curves

BODIES = ("S1", "L5", "L4", "L3", "L2", "L1", *(f"T{k}" for k in range(12, 0, -1)))
JOINTS = tuple(f"{BODIES[k + 1]}{BODIES[k]}" for k in range(17))

# Height of a vertebra with its disc, mm, and tilt of the joint below it (forwards negative), deg,
# from L5 up, in a man of 1750 mm: round numbers.
HEIGHTS_MM = (36, 37, 37, 36, 35, 33, 32, 30, 28, 27, 26, 25, 24, 23, 22, 21, 20)
TILTS_DEG = (-20, -8, 3, 11, 16, 18, 17, 15, 11, 7, 2, -3, -8, -13, -17, -21, -25)


@dataclass(frozen=True, eq=False)
class Person:
    """As they are.

    Attributes
    ----------
    steps : (17, 3) m, from a body's origin to the joint above it. turns : (17, 3, 3) of that joint
        in the body. kg : (18,), com : (18, 3) m, about : (18, 3) kg m2, in the body's axes; head
        and arms hang on T1. curves_nm : (17, 3, X) resisting moments about z, x, y (`laws`).
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
    curves_nm: Array


def drawn(rng: np.random.Generator, male: bool, arms: str, plain: Array | None = None) -> Person:
    """A person.

    Parameters
    ----------
    arms : hanging or behind_head; none: T1 without what hangs on it. plain : (17, 3, X) N m, how
        joints resist in place of curves of the person's own.
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
    own = curves(rng) if plain is None else plain
    return Person(
        *("male" if male else "female", float(rng.uniform(58.0, 76.0)), height, mass),
        *(steps, turns, kg, com, about, own),
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
