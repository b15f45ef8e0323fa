"""How well the films of a cohort are read."""

import numpy as np

from spinepipe.cohort import Cohort
from spinepipe.effects.contract import Array
from spinepipe.studies.scoliosis.films import read_films
from spinepipe.studies.scoliosis.settings import Scoliosis
from spinepipe.units import DEG_PER_RAD, MM_PER_M


def reading_noise(settings: Scoliosis, cohort: Cohort) -> Array:
    """(2,) SD of a place (mm, each way) and a tilt (deg) as taken; NaN where nothing tells.

    Repeated readings tell; where there are none, the study may state it.
    """
    told = np.array([read_films(cohort, name).sd for name in cohort.specimen_names])
    known = told[np.isfinite(told).all(axis=1)]
    if len(known):
        right, up, tilt = np.sqrt((known**2).mean(axis=0))
        return np.array([MM_PER_M * np.sqrt(0.5 * (right**2 + up**2)), DEG_PER_RAD * tilt])
    stated = (settings.place_sd_mm, settings.tilt_sd_deg)
    return np.array([np.nan if one is None else one for one in stated])
