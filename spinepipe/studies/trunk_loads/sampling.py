"""The design of uncertain inputs of a study, and how its samples are cut into batches."""

import numpy as np
import pandas as pd

from spinepipe.effects.contract import Array
from spinepipe.sensitivity.global_indices.design import Design, draw
from spinepipe.sensitivity.global_indices.spread import Normal, values_of
from spinepipe.studies.trunk_loads.persons import NOMINAL
from spinepipe.studies.trunk_loads.settings import TrunkLoads

SMALLEST_FACTOR = 0.3
"""Of a factor that is drawn: below that the model is another."""

UNITS = {
    "height_cm": "cm",
    "bmi": "kg/m2",
    "age_years": "years",
    "hand_anterior_mm": "mm",
    "pelvis_extension_deg": "deg",
    "trunk_extension_deg": "deg",
    "pressure_kpa": "kPa",
    "largest_stress_mpa": "MPa",
}
"""Of the inputs that are added; the others are factors."""


def design_of(settings: TrunkLoads) -> Design:
    """Sobol's design of the study's inputs."""
    uncertain = settings.uncertain
    return draw(
        "sobol", list(uncertain.factors), uncertain.samples, uncertain.seed, second_order=False
    )


def values_of_design(settings: TrunkLoads) -> Array:
    """(n, D) values of the inputs: what is added, or the factor."""
    return values_of(
        design_of(settings), [_spread(settings, f) for f in settings.uncertain.factors]
    )


def _spread(settings: TrunkLoads, factor: str) -> Normal:
    mean = NOMINAL[factor]
    sd = dict(settings.uncertain.factors)[factor].sd  # type: ignore[index]
    low = -np.inf if factor in UNITS else SMALLEST_FACTOR
    return Normal(mean, sd, low)


def batches(settings: TrunkLoads) -> int:
    """How many batches the samples are cut into."""
    runs = settings.uncertain.samples * (len(settings.uncertain.factors) + 2)
    return -(-runs // settings.uncertain.samples_per_target)


def of_batch(settings: TrunkLoads, batch: int) -> range:
    """Numbers of the samples of a batch."""
    size = settings.uncertain.samples_per_target
    runs = settings.uncertain.samples * (len(settings.uncertain.factors) + 2)
    return range(batch * size, min((batch + 1) * size, runs))


def sampled(settings: TrunkLoads, specimens: tuple[str, ...]) -> tuple[str, ...]:
    """Persons that are sampled."""
    return settings.uncertain.specimens or specimens[:1]


def drawn(design: pd.DataFrame, samples: range) -> list[dict[str, float]]:
    """Values of the factors of some samples, from table design."""
    rows = design[design["sample"].isin(list(samples))]
    wide = rows.pivot(index="sample", columns="factor", values="value").sort_index()
    return [{str(k): float(v) for k, v in row.items()} for row in wide.to_dict("records")]
