"""The design of uncertain inputs of a study, and how its samples are cut into batches."""

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.sensitivity_analysis.global_indices.design import Design, draw
from spinepipe.sensitivity_analysis.global_indices.spread import Normal, values_of
from spinepipe.studies.trunk_loads.settings import FACTOR_UNITS, NOMINAL, TrunkLoads

SMALLEST_FACTOR = 0.3
"""Of a factor that is drawn: below that the model is another."""


def design_of(settings: TrunkLoads) -> Design:
    """Sobol's design of the study's inputs."""
    uncertain = settings.uncertain
    return draw(
        "sobol", list(uncertain.factors), uncertain.samples, uncertain.seed, second_order=False
    )


def values_of_design(settings: TrunkLoads) -> Array:
    """(n, D) values of the inputs: what is added, or the factor."""
    return values_at(settings, design_of(settings))


def values_at(settings: TrunkLoads, design: Design) -> Array:
    """The same at the points of another design of the same inputs."""
    spreads = [
        Normal(NOMINAL[name], one.sd, -np.inf if FACTOR_UNITS[name] else SMALLEST_FACTOR)
        for name, one in settings.uncertain.factors.items()
    ]
    return values_of(design, spreads)


def batches(settings: TrunkLoads) -> int:
    """How many batches the samples are cut into."""
    return -(-settings.uncertain.runs // settings.uncertain.samples_per_target)


def sampled_specimens(settings: TrunkLoads, specimens: tuple[str, ...]) -> tuple[str, ...]:
    """Persons that are sampled."""
    return settings.uncertain.specimens or specimens[:1]
