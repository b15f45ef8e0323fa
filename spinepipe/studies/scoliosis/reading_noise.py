"""How well the films of a cohort are read."""

import numpy as np

from spinepipe.cohort import Cohort
from spinepipe.effects.contract import Array
from spinepipe.studies.scoliosis.films import read_films
from spinepipe.studies.scoliosis.settings import Scoliosis
from spinepipe.units import DEG_PER_RAD, MM_PER_M


def reading_noise(settings: Scoliosis, cohort: Cohort) -> Array:
    """(2,) SD of what is taken for a place seen from the lowest vertebra (mm, each way) and for a
    vertebra's own tilt (deg); NaN where nothing tells.

    Repeated readings tell; where there are none, the study may state it. A mean of readings has
    less than one: by the mean over all films of one over their readings.
    """
    patients = [read_films(cohort, name) for name in cohort.specimen_names]
    known = [one.sd for one in patients if np.isfinite(one.sd).all()]
    if known:
        share = np.mean([1.0 / count for one in patients for count in one.readings.values()])
        right, up, tilt = np.sqrt(share * np.mean(np.square(known), axis=0))
        return np.array([MM_PER_M * np.sqrt(0.5 * (right**2 + up**2)), DEG_PER_RAD * tilt])
    stated = (settings.place_sd_mm, settings.tilt_sd_deg)
    return np.array([np.nan if one is None else one for one in stated])
