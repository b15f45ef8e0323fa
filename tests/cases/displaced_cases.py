"""Straight chains whose joints are not where they are said to be, with motion by another mechanics.

Centres and axes of the joints are displaced by known amounts; the poses are those of the phantom's
generator (free bodies, fixed-point iteration), told in the frames that are stated.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from chain_cases import DEGREES, JOINTS, MOMENT_OF, ROTATIONS, TOP, WRENCH, Chains, by_joint
from scipy.spatial.transform import Rotation

from tests.generators.phantom import mechanics

PUSHED = "compression"
MOMENTS = tuple(MOMENT_OF)
POINT_MM = np.array([25.0, 90.0, 0.0])
"""Where the top vertebra is pushed down, in front of the joints."""

LEVEL_MM = 36.0
TRANSLATIONAL = (149000.0, 1890000.0, 135000.0)
"""N/m, published and not fitted."""


@dataclass(frozen=True)
class Displaced:
    """One specimen: stiffness (3, 3) N m/rad, and where its joints are from where they are stated.

    Attributes
    ----------
    centres_mm, tilts_deg : (3, 3), joint by joint along and about its stated axes (Z-X'-Y'').
    """

    stiffness: Any
    centres_mm: Any
    tilts_deg: Any

    @property
    def axes(self) -> np.ndarray:
        """(3, 3, 3) true axes of each joint in its stated ones."""
        angles = np.asarray(self.tilts_deg, dtype=float)
        return Rotation.from_euler("ZXY", angles, degrees=True).as_matrix()


def drawn(
    rng: np.random.Generator, centre_mm: float, axes_deg: float, levels: Any = (50.0, 60.0, 200.0)
) -> Displaced:
    """A specimen whose joints are off by draws of these SDs, stiffness spread by a fifth."""
    spread = np.exp(0.2 * rng.normal(size=(3, 3)))
    centres, tilts = centre_mm * rng.normal(size=(3, 3)), axes_deg * rng.normal(size=(3, 3))
    return Displaced(np.asarray(levels) * spread, centres, tilts)


def cohort(
    specimens: Mapping[str, Displaced],
    study: str,
    noise_deg: float = 0.1,
    seed: int = 1,
    tests: Sequence[str] = (*MOMENTS, PUSHED),
    steps: int = 4,
    step_nm: float = 2.0,
    step_n: float = 60.0,
) -> Chains:
    """The cohort as its files tell it: frames as stated, motion as the true joints move."""
    made = Chains({name: one.stiffness for name, one in specimens.items()}, study=study)
    rng, loads, motion = np.random.default_rng(seed), [], []
    for name, one in specimens.items():
        for test in tests:
            for step in range(steps):
                moment, push_n = np.zeros(3), step_n * step if test == PUSHED else 0.0
                if test != PUSHED:
                    column, sign, _ = MOMENT_OF[test]
                    moment["xyz".index(column[1])] = sign * step_nm * step
                key = {"specimen": name, "test": test, "cycle": 1, "step": step}
                wrench = dict(zip(WRENCH, (0.0, -push_n, 0.0, *moment), strict=True))
                point = dict(zip(("px_mm", "py_mm", "pz_mm"), POINT_MM, strict=True))
                loads.append({**key, "vertebra": TOP, **wrench, **point})
                read = turned_deg(one, moment, push_n) + noise_deg * rng.normal(size=(3, 3))
                for joint, degrees in zip(JOINTS, read, strict=True):
                    motion.append(
                        {**key, "joint": joint, **dict(zip(DEGREES, degrees, strict=True))}
                    )
    made.loads, made.motion = pd.DataFrame(loads), pd.DataFrame(motion)
    return made


def turned_deg(one: Displaced, moment: np.ndarray, push_n: float) -> np.ndarray:
    """(3, 3) extension, right bending, left rotation of each joint in its stated axes."""
    stated = np.array([[0.0, LEVEL_MM * level, 0.0] for level in range(3)])
    origins = (stated + np.asarray(one.centres_mm)) / 1000.0
    masses = np.array([0.0, 0.0, push_n / mechanics.GRAVITY_M_PER_S2])
    stiffness = np.hstack([np.tile(TRANSLATIONAL, (3, 1)), one.stiffness])
    bodies = np.tile(POINT_MM / 1000.0, (3, 1))
    parts = (origins, one.axes, masses, bodies, stiffness)
    chain = mechanics.Chains(*(np.asarray(part, dtype=float)[None] for part in parts))
    q = mechanics.equilibrium(chain, moment[None, None])[0, 0]
    rotations = one.axes @ mechanics.turned(q)[2] @ np.swapaxes(one.axes, -1, -2)
    return Rotation.from_matrix(rotations).as_euler("ZXY", degrees=True)


def true_values(one: Displaced, stiffness: pd.DataFrame) -> np.ndarray:
    """The true stiffness of each row of a table ``stiffness``."""
    k = pd.DataFrame(one.stiffness, index=list(JOINTS), columns=list(ROTATIONS))
    return np.array([k.loc[row.joint, row.coordinate] for row in stiffness.itertuples()])


def as_found(stiffness: pd.DataFrame, nuisances: pd.DataFrame) -> Displaced:
    """The specimen that a fit says there is, for the other mechanics to move."""
    table = nuisances.pivot(index="joint", columns="parameter", values="value").loc[list(JOINTS)]
    centres = table.reindex(columns=list(CENTRES), fill_value=0.0).to_numpy(float)
    tilts = table.reindex(columns=list(TILTS), fill_value=0.0).to_numpy(float)
    return Displaced(by_joint(stiffness)[list(ROTATIONS)].to_numpy(float), centres, tilts)


CENTRES = ("centre_anterior", "centre_superior", "centre_right")
TILTS = ("tilt_extension", "tilt_right_bending", "tilt_left_rotation")
"""Names of the table ``nuisances``, in the order of `Displaced`."""
