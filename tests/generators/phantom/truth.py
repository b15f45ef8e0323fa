"""True stiffness of six specimens: levels and spread as Gould et al. 2024b found them.

Order of the six: anterior, superior, right (N/m), extension, right bending, left rotation
(N m/rad). Reasons are in docs/decisions/0006-t12s1-phantom.md.
"""

import numpy as np

STIFFNESS_COLUMNS = (
    "anterior_n_per_m",
    "superior_n_per_m",
    "right_n_per_m",
    "extension_nm_per_rad",
    "right_bending_nm_per_rad",
    "left_rotation_nm_per_rad",
)

# Gould et al. 2024b (doi 10.3389/fbioe.2024.1372088), Table 2, uniform row.
TRANSLATIONAL_N_PER_M = (149_000.0, 1_890_000.0, 135_000.0)

# Table 3: optimised stiffness of each specimen in the direction in which it was loaded.
TABLE_3_NM_PER_RAD = {
    "extension": (61.9, 65.2, 60.5, 79.0, 94.2, 102.2),
    "right_bending": (107.0, 63.0, 77.8, 105.5, 68.8, 87.5),
    "left_rotation": (295.1, 282.7, 418.7, 310.9),
}

# Assumed, L5S1 to T12L1: see the decision. Only the ratios count.
LEVEL_PATTERN = {
    "extension": (0.88, 0.92, 1.00, 1.04, 1.08, 1.10),
    "right_bending": (1.15, 1.00, 0.95, 0.92, 1.00, 1.03),
    "left_rotation": (1.15, 1.00, 0.96, 0.95, 0.96, 1.00),
}

RESIDUAL_LOG_SD = 0.15
"""Of one joint's stiffness around its specimen's factor times the level pattern."""


BRIDGED = (3.0, 50.0)
"""Assumed: by how much a joint that bone bridges is stiffer, evenly spread in the logarithm. At the
upper end it turns by less than its readings err."""


def draw(rng: np.random.Generator, n_specimens: int) -> np.ndarray:
    """(P, J, 6) true stiffness, rounded as in truth.csv."""
    rotations = [_direction(name, rng, n_specimens) for name in TABLE_3_NM_PER_RAD]
    shape = (*rotations[0].shape, 3)
    translations = np.broadcast_to(TRANSLATIONAL_N_PER_M, shape)
    return np.round(np.concatenate([translations, np.stack(rotations, axis=-1)], axis=-1), 4)


def bridged(stiffness: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """The same (P, J, 6) with every rotational stiffness times a factor of its own, rounded."""
    found = stiffness.copy()
    found[:, :, 3:] *= np.exp(rng.uniform(*np.log(BRIDGED), found[:, :, 3:].shape))
    return np.round(found, 4)


def _direction(name, rng, n_specimens):
    """(P, J) specimen factor x level pattern x residual of one direction.

    A specimen's geometric mean over its joints is its factor exactly: that is what a uniform
    stiffness such as Table 3's stands for.
    """
    pattern = np.log(LEVEL_PATTERN[name])
    n_joints = len(pattern)
    residual = rng.normal(0.0, RESIDUAL_LOG_SD, (n_specimens, n_joints))
    residual -= residual.mean(axis=1, keepdims=True)
    residual *= np.sqrt(n_joints / (n_joints - 1))
    factors = _specimen_factors(TABLE_3_NM_PER_RAD[name], rng, n_specimens)
    return factors[:, None] * np.exp(pattern - pattern.mean() + residual)


def _specimen_factors(published, rng, n_specimens):
    """(P,) log-normal, shifted and scaled to the median and the SD of the published logarithms."""
    logs = np.log(published)
    drawn = rng.normal(size=n_specimens)
    standard = (drawn - np.median(drawn)) / drawn.std(ddof=1)
    return np.exp(np.median(logs) + logs.std(ddof=1) * standard)
