"""A learned population as rows of a table, and back."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from scipy.stats import norm

from spinepipe.effects.contract import Array
from spinepipe.status import Status, joined
from spinepipe.studies.scoliosis.population import PER_SEGMENT, Population
from spinepipe.units import DEG_PER_RAD, MM_PER_M


@dataclass(frozen=True)
class PopulationEstimate:
    """A population, and how it was come by.

    Attributes
    ----------
    change : of the last round. unfitted : patients without a fit, which have no part in it.
    settled : whether that is little enough.
    """

    population: Population
    rounds: int
    change: float
    patients: int
    unfitted: tuple[str, ...]
    settled: bool


def population_rows(
    found: PopulationEstimate, joints: Sequence[str], sd: Array
) -> Iterator[dict[str, Any]]:
    """A row for each quantity and joint."""
    population = found.population
    means = population.mean.reshape(len(PER_SEGMENT), -1)
    spreads = population.sd.reshape(len(PER_SEGMENT), -1)
    reach_95 = float(norm.ppf(0.975))
    own = (population.ratio_sd, population.end_sd, population.end_sd)
    for quantity, mean, spread, sd_log in zip(PER_SEGMENT, means, spreads, own, strict=True):
        unit = DEG_PER_RAD if quantity != "ratio" else 1.0
        for joint, middle, reach in zip(joints, mean, reach_95 * spread, strict=True):
            yield {
                "quantity": quantity,
                "joint": joint,
                "unit": "deg" if quantity != "ratio" else "",
                "mean": unit * float(np.exp(middle)),
                "low": unit * float(np.exp(middle - reach)),
                "high": unit * float(np.exp(middle + reach)),
                "sd_log": sd_log,
                "n_patients": found.patients,
                "rounds": found.rounds,
                "last_change": found.change if np.isfinite(found.change) else None,
                "place_sd_mm": MM_PER_M * float(sd[0]),
                "tilt_sd_deg": DEG_PER_RAD * float(sd[2]),
                "message": joined(
                    _without(found.unfitted), "" if found.settled else _moving(found)
                ),
                "status": (Status.CONVERGED if found.settled else Status.NOT_CONVERGED).value,
            }


def _moving(found: PopulationEstimate) -> str:
    if not found.patients:
        return ""
    return f"after {found.rounds} rounds a logarithm still changed by {found.change:.2g}"


def _without(names: tuple[str, ...]) -> str:
    return f"without {', '.join(names)}: no fit" if names else ""


def population_of(rows: pd.DataFrame) -> tuple[Population, Array]:
    """The population of a table's rows, and (3,) m, m and rad: SD that films were weighed with."""
    parts, spreads = [], []
    for quantity in PER_SEGMENT:
        chosen = rows[rows["quantity"] == quantity]
        unit = 1.0 if quantity == "ratio" else DEG_PER_RAD
        parts.append(np.log(chosen["mean"].to_numpy(float) / unit))
        spreads.append(float(chosen["sd_log"].iloc[0]))
    place = float(rows["place_sd_mm"].iloc[0]) / MM_PER_M
    sd = np.array([place, place, float(rows["tilt_sd_deg"].iloc[0]) / DEG_PER_RAD])
    return Population(np.concatenate(parts), spreads[0], spreads[1]), sd
