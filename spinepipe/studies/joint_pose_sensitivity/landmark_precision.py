"""Job: how errors grow with the landmarks' SD, and the largest SD that will do."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from statsmodels.stats.proportion import proportion_confint

from spinepipe.designs import specimen_seed
from spinepipe.effects.contract import Array
from spinepipe.jobs.digest import provenance
from spinepipe.studies.joint_pose_sensitivity.inputs import study_and_cohort
from spinepipe.studies.joint_pose_sensitivity.settings import LandmarkPrecision
from spinepipe.studies.joint_pose_sensitivity.tables import (
    LANDMARK_PRECISION,
    REQUIRED_PRECISION,
)
from spinepipe.tables import from_rows, read_frames, write

CONFIDENCE = (2.5, 97.5)
"""Percentiles of the bootstrap that make a 95 % interval."""

BOOTSTRAPS = 1000
QUANTILES = {"median": 50, "p90": 90, "p95": 95, "largest": 100}
COLUMNS = {"translation": "translation_error_mm", "rotation": "rotation_error_deg"}


@dataclass(frozen=True)
class RequiredPrecision:
    """The largest SD that will do, with its 95 % interval.

    None where one lies outside the sampled SDs; the message says on which side.
    """

    sd: float | None
    low: float | None
    high: float | None
    message: str


def run(
    root: str, study: str, tables: list[str], landmark_precision: str, required_precision: str
) -> None:
    """Write both tables from ``precision_errors``."""
    settings, cohort = study_and_cohort(root, study)
    asked = settings.landmark_precision
    spread: list[dict[str, Any]] = []
    needed: list[dict[str, Any]] = []
    for (specimen, stiffness), rows in read_frames(tables)["precision_errors"].groupby(
        ["specimen", "stiffness"], sort=False
    ):
        key = {"specimen": specimen, "stiffness": stiffness}
        found = measured_errors(rows)
        spread += [{**key, **row} for row in _spread(asked, found)]
        seed = specimen_seed(settings.seed, f"required/{specimen}/{stiffness}")
        shares = nominal_shares(asked, rows, found)
        needed += [{**key, **row} for row in _required(asked, found, shares, seed)]
    origin = provenance("landmark_precision", settings, cohort)
    write(from_rows(LANDMARK_PRECISION, spread), landmark_precision, origin)
    write(from_rows(REQUIRED_PRECISION, needed), required_precision, origin)


def measured_errors(rows: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """Largest errors by kind of motion: a row per SD, a column per pose; infinite without result.

    Kinds of motion that were not measured are left out; where no pose has a result, none is.
    """
    grids = {
        kind: rows.pivot(index="sd_mm", columns="pose", values=column)
        for kind, column in COLUMNS.items()
    }
    measured = {kind: grid for kind, grid in grids.items() if grid.notna().any(axis=None)}
    return {kind: grid.fillna(np.inf) for kind, grid in (measured or grids).items()}


def _spread(
    asked: LandmarkPrecision, errors: Mapping[str, pd.DataFrame]
) -> Iterator[dict[str, Any]]:
    for kind, grid in errors.items():
        limit, unit = _limits(asked)[kind]
        for sd, values in zip(grid.index, grid.to_numpy(float), strict=True):
            below = int((values < limit).sum())
            low, high = proportion_confint(below, len(values), method="wilson")
            key = {"motion": kind, "sd_mm": float(sd), "unit": unit, "n": len(values)}
            shares = {"below": below / len(values), "below_low": low, "below_high": high}
            known = values[np.isfinite(values)]
            ends = np.percentile(known, [*QUANTILES.values()]) if len(known) else [None] * 4
            quantiles = dict(zip(QUANTILES, ends, strict=True))
            lost = {"without_result": len(values) - len(known)}
            yield {**key, "limit": limit, **shares, **lost, **quantiles}


def _required(
    asked: LandmarkPrecision,
    errors: Mapping[str, pd.DataFrame],
    shares: Mapping[str, float | None],
    seed: int,
) -> Iterator[dict[str, Any]]:
    relative = {kind: grid / _limits(asked)[kind][0] for kind, grid in errors.items()}
    if len(relative) > 1:
        relative["both"] = pd.concat(relative.values()).groupby(level="sd_mm").max()
    for kind, grid in relative.items():
        sds, n = grid.index.to_numpy(float), grid.shape[1]
        why = _not_of_landmarks(shares[kind])
        found = (
            RequiredPrecision(None, None, None, why)
            if why
            else required_precision(sds, grid.to_numpy(float), 1.0, asked.share, BOOTSTRAPS, seed)
        )
        too_few = ""
        if not why and proportion_confint(n, n, method="wilson")[0] < asked.share:
            too_few = f"{n} poses cannot show a share of {asked.share:g}: take more"
        yield {
            **{"motion": kind, "share": asked.share, "n": n},
            **{"sd_mm": found.sd, "sd_low_mm": found.low, "sd_high_mm": found.high},
            "message": "; ".join(filter(None, (found.message, too_few))),
            "nominal_share": shares[kind],
        }


def nominal_shares(
    asked: LandmarkPrecision, rows: pd.DataFrame, kinds: Iterable[str]
) -> dict[str, float | None]:
    """Error over its limit with the landmarks as they are, by kind of motion and of both.

    Parameters
    ----------
    rows : of one specimen. kinds : of motion that were measured.
    """
    found: dict[str, float | None] = {}
    for kind in kinds:
        error = float(rows[f"nominal_{COLUMNS[kind]}"].iloc[0])
        found[kind] = error / _limits(asked)[kind][0] if np.isfinite(error) else None
    known = [share for share in found.values() if share is not None]
    return {**found, "both": max(known) if len(known) == len(found) else None}


def _not_of_landmarks(share: float | None) -> str:
    """Why no precision of landmarks can be told, "" where it can."""
    if share is None:
        return "not told: the cohort's own joint pose has no fit"
    if share < 1.0:
        return ""
    return (
        f"not told: with the landmarks as they are the model misses by {share:.3g} times the "
        "limit, which no landmark mends"
    )


def _limits(asked: LandmarkPrecision) -> dict[str, tuple[float, str]]:
    return {
        "translation": (asked.translation_limit_mm, "mm"),
        "rotation": (asked.rotation_limit_deg, "deg"),
    }


def required_precision(
    sds: Array, errors: Array, limit: float, share: float, bootstraps: int, seed: int
) -> RequiredPrecision:
    """The largest SD at which so large a share of samples has an error below the limit.

    The share is taken as straight between the sampled SDs; the interval is a percentile bootstrap
    over samples, all SDs of a sample together.

    Parameters
    ----------
    sds : (k,) rising. errors : (k, n) of n samples at each SD, infinite where there is no result.
    """
    below = errors < limit
    found = _crossing(sds, below.mean(axis=1), share)
    n = errors.shape[1]
    drawn = np.random.default_rng(seed).integers(0, n, (bootstraps, n))
    # whole samples are drawn again, so that what SDs have in common stays together
    repeated = np.array([_crossing(sds, below[:, row].mean(axis=1), share) for row in drawn])
    low, high = np.percentile(repeated, CONFIDENCE, method="inverted_cdf")
    outside = [f"begins below {sds[0]:g} mm"] if low == -np.inf else []
    outside += [f"ends above {sds[-1]:g} mm"] if high == np.inf else []
    message = f"the interval {' and '.join(outside)}" if outside else ""
    if found == np.inf:
        message = f"{sds[-1]:g} mm will do, the largest that was sampled"
    elif found == -np.inf:
        message = f"{sds[0]:g} mm will not do, the smallest that was sampled"
    sd, *ends = (float(end) if np.isfinite(end) else None for end in (found, low, high))
    return RequiredPrecision(sd, ends[0], ends[1], message)


def _crossing(sds: Array, below: Array, share: float) -> float:
    """SD at which the share of samples below the limit first falls under the asked one.

    Minus infinity where it is under it from the start, infinity where it never is.
    """
    short = np.flatnonzero(below < share)
    if not len(short):
        return np.inf
    after = int(short[0])
    if after == 0:
        return -np.inf
    # straight between the SDs on either side
    fraction = (below[after - 1] - share) / (below[after - 1] - below[after])
    return float(sds[after - 1] + fraction * (sds[after] - sds[after - 1]))
