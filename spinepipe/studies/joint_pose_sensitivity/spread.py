"""Job: how far the joint frames of one specimen scatter with landmarks of several SDs."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from spinepipe.cohort import Cohort
from spinepipe.cohort.specimen import frames_from_landmarks
from spinepipe.designs import specimen_seed
from spinepipe.effects.contract import Array
from spinepipe.frames import zxy_angles
from spinepipe.jobs.digest import provenance
from spinepipe.studies.joint_pose_sensitivity.inputs import study_and_cohort
from spinepipe.studies.joint_pose_sensitivity.landmarks import landmarks_of
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.studies.joint_pose_sensitivity.tables import SPREAD_OVER_LANDMARK_SD
from spinepipe.tables import from_rows, write
from spinepipe.units import COORDINATE_UNITS, COORDINATES, MM_PER_M, TRANSLATIONS

BOOTSTRAPS = 200
ENDS = (2.5, 97.5)
"""Percentiles of the bootstrap that make a 95 % interval."""


def run(root: str, study: str, specimen: str, output: str) -> None:
    """Write the rows of one specimen."""
    settings, cohort = study_and_cohort(root, study)
    rows = [
        {"specimen": specimen, "sd_mm": sd, **row}
        for sd in settings.landmark_precision.sd_mm
        for row in _rows(settings, cohort, specimen, sd)
    ]
    made_by = provenance("spread_over_landmark_sd", settings, cohort, [specimen])
    write(from_rows(SPREAD_OVER_LANDMARK_SD, rows), output, made_by)


def _rows(
    settings: JointPoseSensitivity, cohort: Cohort, specimen: str, sd_mm: float
) -> Iterator[dict[str, Any]]:
    """One row per joint and coordinate; the directions are those of the study's own poses."""
    marks, found = landmarks_of(cohort, specimen), []
    for points in marks.with_sd(sd_mm, settings.poses, settings.seed, specimen):
        try:
            frames = frames_from_landmarks(cohort.vertebrae, points)
        except ValueError:  # these landmarks define no frame: told by n
            continue
        found.append(
            [[*one.origin * MM_PER_M, *np.rad2deg(zxy_angles(one.rotation))] for one in frames]
        )
    numbers = np.array(found).reshape(len(found), len(cohort.joint_names), 6)
    seed = specimen_seed(settings.seed, f"spread/{specimen}")
    ends = dict(zip(("iqr", "iqr_low", "iqr_high"), iqr_with_ends(numbers, seed), strict=True))
    for joint, name in enumerate(cohort.joint_names):
        for column, coordinate in enumerate(COORDINATES):
            yield {
                "joint": name,
                "quantity": "origin" if coordinate in TRANSLATIONS else "orientation",
                "coordinate": coordinate,
                "unit": COORDINATE_UNITS[coordinate],
                "n": len(found),
                **{end: float(of[joint, column]) for end, of in ends.items()},
            }


def iqr_with_ends(values: Array, seed: int) -> tuple[Array, Array, Array]:
    """Interquartile range along the first axis of values (n, ...) with its 95 % interval.

    A percentile bootstrap over the first axis; NaN of fewer than two.
    """
    n = len(values)
    if n < 2:
        nothing = np.full(values.shape[1:], np.nan)
        return nothing, nothing, nothing

    def iqr(sample: Array) -> Array:
        low, high = np.percentile(sample, (25.0, 75.0), axis=0)
        spread: Array = high - low
        return spread

    drawn = np.random.default_rng(seed).integers(0, n, (BOOTSTRAPS, n))
    repeated = np.array([iqr(values[row]) for row in drawn])
    low, high = np.percentile(repeated, ENDS, axis=0)
    return iqr(values), low, high
