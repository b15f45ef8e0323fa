"""The design of uncertain inputs, its batches, and quantiles of what samples gave."""

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.sensitivity_analysis.global_indices.design import Design, draw
from spinepipe.sensitivity_analysis.global_indices.spread import Normal, values_of
from spinepipe.studies.trunk_loads.settings import FACTOR_UNITS, NOMINAL, TrunkLoads

LEAST_SAMPLES = 20
"""Below that no interval is given."""

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


def censored_quantile(values: Array, beyond: int, p: float) -> float | None:
    """Quantile of values and of so many of which is known that they are farther from nought.

    None where it lies among those, or where values are fewer than `LEAST_SAMPLES`.
    """
    if len(values) < LEAST_SAMPLES:
        return None
    away = -1.0 if np.median(values) < 0.0 else 1.0
    known = np.sort(values)
    at = p * (len(values) + beyond - 1) - (beyond if away < 0.0 else 0)
    if not 0.0 <= at <= len(values) - 1:
        return None
    return float(np.interp(at, np.arange(len(values)), known))
