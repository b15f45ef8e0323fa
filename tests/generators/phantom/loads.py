"""Moments on T12: three tests, three cycles, ten rising steps, with coupled moments as measured."""

import numpy as np

TESTS = {
    "flexion": (0.0, 0.0, -1.0),
    "left_lateral_bending": (-1.0, 0.0, 0.0),
    "left_axial_rotation": (0.0, 1.0, 0.0),
}
"""Direction of the main moment in ground: x anterior, y superior, z right."""

PEAK_NM = 7.5
CYCLES = 3
STEPS = 11
"""Step 0 carries no moment; the others rise evenly to the peak."""

STEADY, HUMP = 0.06, 0.03
"""Largest coupled moment as a share of the peak: growing with the load, and halfway up."""

FIRST_CYCLE = 1.3
"""How much larger the coupled moments of cycle 1 are: the cycle that labs leave out."""


def draw(rng: np.random.Generator, n_specimens: int) -> np.ndarray:
    """(P, tests, cycles, steps, 3) N m in ground, rounded as in loads.csv."""
    share = np.linspace(0.0, 1.0, STEPS)[:, None]
    main = np.array(list(TESTS.values()))[:, None, None, :]
    shape = (n_specimens, len(TESTS), CYCLES, 1, 3)
    steady, hump = (rng.uniform(-size, size, shape) for size in (STEADY, HUMP))
    coupled = steady * share + hump * 4.0 * share * (1.0 - share)
    coupled[:, :, 0] *= FIRST_CYCLE
    return np.round(PEAK_NM * np.where(main == 0.0, coupled, main * share), 6) + 0.0
