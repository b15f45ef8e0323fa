"""How joints resist: drawn curves, or the control's exponentials; moments over angles."""

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

Array = NDArray[np.float64]

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

KNOTS_RAD: Array = np.deg2rad(np.linspace(-30.0, 30.0, 481))
_SIDES = (("backwards", "forwards"), ("aside", "aside"), ("about", "about"))

AT_REST_NM_PER_RAD = (70.0, 70.0, 120.0)
"""Of the control's lumbar joints; thoracic ones are `_THORAX` times as stiff."""
_THORAX = 1.8
_RATES_PER_RAD = ((22.0, 15.0), (18.0, 18.0), (18.0, 18.0))
"""Of the control, on the positive and on the negative side."""


def curves(rng: np.random.Generator) -> Array:
    """(17, 3, X) N m: hardly anything near the middle, more and more towards the end of a range.

    Where it begins, how suddenly, how strong: drawn by person, by level and by direction.
    """
    strong, loose = rng.lognormal(0.0, 0.35), rng.uniform(0.15, 0.45)
    found = np.zeros((17, 3, len(KNOTS_RAD)))
    for level in range(17):
        own = strong * rng.lognormal(0.0, 0.3)
        for axis, names in enumerate(_SIDES):
            for name, sign in zip(names, (1.0, -1.0), strict=True):
                end = np.deg2rad(RANGE_DEG[name][level]) * rng.lognormal(0.0, 0.15)
                slack = loose * rng.uniform(0.7, 1.3)
                side = sign * KNOTS_RAD > 0.0
                moments = own * AT_RANGE_NM * _share(np.abs(KNOTS_RAD[side]) / end, slack)
                found[level, axis, side] = sign * moments
    return found


def _share(turned: Array, slack: float) -> Array:
    """Of the moment at the end of the range, by share of the range."""
    at = np.array([0.0, slack, 0.5 * (1.0 + slack), 1.0, 1.6, 40.0])
    share = np.array([0.0, 0.06 + 0.1 * slack, 0.38, 1.0, 3.2, 3.2 + 38.4 * 4.5])
    found: Array = PchipInterpolator(at, share)(turned)
    return found


def exponentials(seed: int) -> tuple[Array, Array]:
    """A (17, 3, 2) N m and B (17, 3, 2) 1/rad of the control, all persons alike.

    Regions are stiffer or softer than one another; both sides begin with the same stiffness.
    """
    region = np.repeat(np.random.default_rng([seed, 10**6]).lognormal(0.0, 0.4, 3), (6, 6, 5))
    level = region * np.repeat([1.0, _THORAX], (6, 11))
    rest = level[:, None, None] * np.array(AT_REST_NM_PER_RAD)[:, None]
    rates = np.broadcast_to(np.array(_RATES_PER_RAD), (17, 3, 2)).copy()
    return rest / rates, rates


def plain_curves(seed: int) -> Array:
    """(17, 3, X) N m of the control: A (exp(B q) - 1), A and B of either side."""
    sizes, rates = exponentials(seed)
    side = (KNOTS_RAD < 0.0).astype(int)
    grown = np.exp(rates[..., side] * np.abs(KNOTS_RAD)) - 1.0
    found: Array = np.sign(KNOTS_RAD) * sizes[..., side] * grown
    return found


def resisted(table: Array, angles: Array) -> Array:
    """(17, 3) N m at angles (17, 3) rad."""
    gap = KNOTS_RAD[1] - KNOTS_RAD[0]
    at = np.clip((angles - KNOTS_RAD[0]) / gap, 0.0, len(KNOTS_RAD) - 1.001)
    low = at.astype(int)
    level, axis = np.ogrid[:17, :3]
    before, after = table[level, axis, low], table[level, axis, low + 1]
    found: Array = before + (at - low) * (after - before)
    return found


def stiffness(table: Array, moment_nm: float) -> Array:
    """(17, 3, 2) N m/rad of the curves where positive and negative sides resist with a moment."""
    slopes = np.gradient(table, KNOTS_RAD, axis=-1)
    middle = len(KNOTS_RAD) // 2
    found = np.zeros((17, 3, 2))
    for level, axis, side in np.ndindex(found.shape):
        sign = 1 - 2 * side
        moments = sign * table[level, axis, middle::sign]
        found[level, axis, side] = np.interp(moment_nm, moments, slopes[level, axis, middle::sign])
    return found
