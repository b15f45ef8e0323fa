"""Chains whose joint centres are not where they are said to be, by the algebra of rigid bodies.

A joint that turns by R about a centre at c from the one that is told moves the told one by
``c - R c``. Pure moments turn the joints of `spring_chain_cases` about one axis by what their
springs yield; nothing of spinepipe makes the motion.
"""

from collections.abc import Mapping

import numpy as np
import spring_chain_cases as chains
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from spinepipe.studies.discrepancy.search.baseline import BaselineFit, fit_baseline
from spinepipe.studies.discrepancy.search.noise import estimated_noise
from spinepipe.studies.discrepancy.search.nuisance import NuisancePriors
from spinepipe.studies.discrepancy.search.readings import SpecimenReadings
from spinepipe.studies.discrepancy.store import at_once

Array = NDArray[np.float64]

JOINTS = chains.JOINTS[:3]
SPECIMENS = ("a", "b", "c")
SD_M = 1e-4


def off_centre(
    centres: Mapping[str, Array], seed: int = 1, sd_m: float = SD_M
) -> list[SpecimenReadings]:
    """Readings of all six coordinates in three cycles; ``centres`` (J, 3) m by specimen."""
    rng = np.random.default_rng([seed, 1])
    given = chains.readings(seed, specimens=SPECIMENS, joints=len(JOINTS))

    def moved(specimen: str, test: str, cycles: Array) -> Array:
        axis, driven = chains.AXES[test]
        angles = cycles[..., driven]
        found = cycles.copy()
        for joint, centre in enumerate(centres[specimen]):
            turns = Rotation.from_rotvec(angles[..., joint].reshape(-1, 1) * np.eye(3)[axis])
            away = centre - turns.apply(centre)
            found[..., joint, :3] = away.reshape(*angles.shape[:2], 3)
        noise: Array = sd_m * rng.standard_normal(found[..., :3].shape)
        found[..., :3] += noise
        return found

    return chains.changed(given, moved)


def alike(centre_m: Array) -> dict[str, Array]:
    """The same error of all centres."""
    return {name: np.tile(centre_m, (len(JOINTS), 1)) for name in SPECIMENS}


def grounds_of(given: list[SpecimenReadings], priors: NuisancePriors | None = None) -> BaselineFit:
    """The base fitted, noise from the repeats."""
    noise = estimated_noise(given, None, zeroed=False, outliers=0, accuracy=np.zeros(6))
    assert noise is not None
    return fit_baseline(given, noise, priors or NuisancePriors(), chains.start(given), at_once)
