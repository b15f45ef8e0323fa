"""What segments of many patients have in common, which fills in what the films of one do not tell.

Each segment of a patient has three numbers: the logarithms of its ratio (stiffness at the erect
pose over the patient's geometric mean) and of the sizes of its two ends. In a population each is
normal about the mean of its level; the ends of one patient share a part of their deviation. Means
and spreads are learned from all patients by expectation and maximisation: each round fits every
patient anew (`film_fit`), then takes the means and spreads that the fits have together.

Where patients are few or films are read coarsely, the assumptions below decide, and their numbers
count as so many observations.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pandas as pd
from scipy.stats import norm

from spinepipe.effects.contract import Array
from spinepipe.status import Status, joined
from spinepipe.studies.scoliosis.films import FilmSd
from spinepipe.units import DEG_PER_RAD, MM_PER_M

PER_SEGMENT = ("ratio", "lower_end", "upper_end")
"""The numbers of a segment; those of a patient are in this order, (3 S,)."""

END_RAD, END_FACTOR = float(np.deg2rad(9.0)), 0.25
"""A usual end, and the SD of the logarithm of a population's: Wilke 2017 has thoracic segments turn
4 to 6 deg to a side under 7.5 N m, where they have begun to stiffen."""

RATIO_SPREAD, END_SPREAD = 0.40, 0.35
"""Usual SD between patients, of logarithms; half of them is between 0.76 and 1.3 times."""

ASSUMED_COUNT = 30.0
"""Segments that the usual spreads count for."""

LEVEL_RATIO_SPREAD, LEVEL_END_SPREAD = 0.30, 0.15
"""SD of levels about their common mean, of logarithms."""

PATIENT_SPREAD = 0.15
"""SD of what all ends of one patient share, of logarithms: some spines are more supple."""


@dataclass(frozen=True)
class Population:
    """Means and spreads of logarithms.

    Attributes
    ----------
    mean : (3 S,) of all numbers of a patient. ratio_sd, end_sd : between segments of one level.
    unsure : (3 S,) SD of the means themselves, which few or coarse films leave open; nought where
        they are taken as known.
    """

    mean: Array
    ratio_sd: float
    end_sd: float
    unsure: Array = field(default_factory=lambda: np.zeros(()))

    @property
    def segments(self) -> int:
        """S."""
        return len(self.mean) // len(PER_SEGMENT)

    @property
    def sd(self) -> Array:
        """(3 S,) SD of each number."""
        ends = np.hypot(self.end_sd, PATIENT_SPREAD)
        return np.repeat([self.ratio_sd, ends, ends], self.segments)

    @property
    def precision(self) -> Array:
        """(3 S, 3 S), the inverse of the covariance of a patient's numbers."""
        s = self.segments
        found = np.zeros((3 * s, 3 * s))
        found[:s, :s] = np.eye(s) / self.ratio_sd**2
        # Sherman-Morrison: the ends have covariance sd^2 I plus one shared variance everywhere
        shared = PATIENT_SPREAD**2 / (self.end_sd**2 + 2 * s * PATIENT_SPREAD**2)
        found[s:, s:] = (np.eye(2 * s) - shared) / self.end_sd**2
        return found

    @property
    def root(self) -> Array:
        """(3 S, 3 S) whose square is the precision."""
        s = self.segments
        found = np.zeros((3 * s, 3 * s))
        found[:s, :s] = np.eye(s) / self.ratio_sd
        # eigenvectors of the ends' covariance: their mean, and all that is across it
        whole = np.hypot(self.end_sd, np.sqrt(2 * s) * PATIENT_SPREAD)
        alike = np.full((2 * s, 2 * s), 1.0 / (2 * s))
        found[s:, s:] = (np.eye(2 * s) - alike) / self.end_sd + alike / whole
        return found


def usual_population(segments: int) -> Population:
    """What is taken for granted before any film."""
    mean = np.repeat([0.0, np.log(END_RAD), np.log(END_RAD)], segments)
    return Population(mean, RATIO_SPREAD, END_SPREAD)


@dataclass(frozen=True)
class PatientPrior:
    """What is known of a patient: mean (3 S,) and covariance (3 S, 3 S) of its numbers."""

    mean: Array
    covariance: Array


def update_population(before: Population, patients: Sequence[PatientPrior]) -> Population:
    """The population that patients, known by means of the one before, make likeliest.

    The maximisation of expectation and maximisation: squares of means and what is unsure of them.
    """
    means = np.array([one.mean for one in patients])
    means[:, : before.segments] -= means[:, : before.segments].mean(axis=1, keepdims=True)
    after = replace(before, mean=_level_means(before, means))
    s, count = after.segments, len(patients)
    # expected squares of the levels' ratios about the new mean
    unsure = sum(float(np.trace(one.covariance[:s, :s])) for one in patients)
    ratios = float(((means - after.mean)[:, :s] ** 2).sum()) + unsure
    # of the ends: of what those of one patient do not share
    ends = 0.0
    for mean, one in zip(means, patients, strict=True):
        away = (mean - after.mean)[s:]
        # expected squares of the deviations, less those of their mean, which all ends share
        moment = np.outer(away, away) + one.covariance[s:, s:]
        ends += float(np.trace(moment) - moment.sum() / (2 * s))
    return replace(
        after,
        ratio_sd=_spread(ratios, count * s, RATIO_SPREAD),
        end_sd=_spread(ends, count * (2 * s - 1), END_SPREAD),
    )


def _level_means(before: Population, means: Array) -> Array:
    """(3 S,): levels are drawn towards their common mean, the ends' one towards the usual end."""
    count, s = means.shape[0], before.segments
    # shrinkage of normal means: prior variance over prior variance and that of the mean of patients
    kept = LEVEL_RATIO_SPREAD**2 / (LEVEL_RATIO_SPREAD**2 + before.ratio_sd**2 / count)
    ratios = kept * means[:, :s].mean(axis=0)
    ends = means[:, s:].mean(axis=0)
    variance = (PATIENT_SPREAD**2 + before.end_sd**2 / (2 * s)) / count
    weight = END_FACTOR**2 / (END_FACTOR**2 + variance)
    common = weight * ends.mean() + (1.0 - weight) * np.log(END_RAD)
    kept = LEVEL_END_SPREAD**2 / (LEVEL_END_SPREAD**2 + before.end_sd**2 / count)
    return np.concatenate([ratios, common + kept * (ends - ends.mean())])


def unsure_means(population: Population, films: Sequence[Array]) -> Array:
    """(3 S,) SD of the means, by what the films of each patient say of its numbers (3 S, 3 S).

    A patient with films of precision M from a population of covariance C tells of its mean with
    the precision (M^-1 + C)^-1; the assumptions about levels are there before any patient.
    """
    s, covariance = population.segments, np.linalg.inv(population.precision)
    before = np.diag(np.repeat([LEVEL_RATIO_SPREAD, LEVEL_END_SPREAD], [s, 2 * s]) ** 2)
    before[s:, s:] += END_FACTOR**2
    told = np.linalg.inv(before)
    for one in films:
        told += np.linalg.solve(np.eye(3 * s) + one @ covariance, one)
    found: Array = np.sqrt(np.diag(np.linalg.inv(told)))
    return found


def _spread(squares: float, count: int, usual: float) -> float:
    return float(np.sqrt((squares + ASSUMED_COUNT * usual**2) / (count + ASSUMED_COUNT)))


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
    found: PopulationEstimate, joints: Sequence[str], sd: FilmSd
) -> Iterator[dict[str, Any]]:
    """A row for each quantity and joint, beside the SD with which films were weighed."""
    population = found.population
    means = population.mean.reshape(len(PER_SEGMENT), -1)
    spreads = population.sd.reshape(len(PER_SEGMENT), -1)
    unsure = np.broadcast_to(population.unsure, len(population.mean)).reshape(means.shape)
    reach_95 = float(norm.ppf(0.975))
    own = (population.ratio_sd, population.end_sd, population.end_sd)
    without = f"without {', '.join(found.unfitted)}: no fit" if found.unfitted else ""
    moving = f"after {found.rounds} rounds a logarithm still changed by {found.change:.2g}"
    if found.settled or not found.patients:
        moving = ""
    for quantity, mean, spread, sd_log, open_ in zip(
        PER_SEGMENT, means, spreads, own, unsure, strict=True
    ):
        unit = DEG_PER_RAD if quantity != "ratio" else 1.0
        for joint, middle, reach, mean_sd in zip(
            joints, mean, reach_95 * spread, open_, strict=True
        ):
            yield {
                "quantity": quantity,
                "joint": joint,
                "unit": "deg" if quantity != "ratio" else "",
                "mean": unit * float(np.exp(middle)),
                "low": unit * float(np.exp(middle - reach)),
                "high": unit * float(np.exp(middle + reach)),
                "sd_log": sd_log,
                "mean_sd_log": float(mean_sd),
                "n_patients": found.patients,
                "rounds": found.rounds,
                "last_change": found.change if np.isfinite(found.change) else None,
                "place_sd_mm": MM_PER_M * float(sd.vertebra[0]),
                "tilt_sd_deg": DEG_PER_RAD * float(sd.vertebra[2]),
                "frame_place_sd_mm": MM_PER_M * float(sd.frame[0]),
                "frame_tilt_sd_deg": DEG_PER_RAD * float(sd.frame[2]),
                "message": joined(without, moving),
                "status": (Status.CONVERGED if found.settled else Status.NOT_CONVERGED).value,
            }


def population_of(rows: pd.DataFrame) -> tuple[Population, FilmSd]:
    """The population of a table's rows, and the SD with which films were weighed."""
    parts, spreads, unsure = [], [], []
    for quantity in PER_SEGMENT:
        chosen = rows[rows["quantity"] == quantity]
        unit = 1.0 if quantity == "ratio" else DEG_PER_RAD
        parts.append(np.log(chosen["mean"].to_numpy(float) / unit))
        unsure.append(chosen["mean_sd_log"].to_numpy(float))
        spreads.append(float(chosen["sd_log"].iloc[0]))
    first = rows.iloc[0].to_dict()
    sd = (
        np.array([float(first[f"{name}place_sd_mm"])] * 2 + [float(first[f"{name}tilt_sd_deg"])])
        / [MM_PER_M, MM_PER_M, DEG_PER_RAD]
        for name in ("", "frame_")
    )
    means = np.concatenate(parts)
    return Population(means, spreads[0], spreads[1], np.concatenate(unsure)), FilmSd(*sd)
