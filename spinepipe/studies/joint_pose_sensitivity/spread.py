"""Job: how far the joint frames of one specimen scatter with landmarks of several SDs."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from spinepipe.cohort import Cohort
from spinepipe.cohort.specimen import frames_from_landmarks
from spinepipe.designs import sample_landmarks, specimen_seed
from spinepipe.effects.contract import Array
from spinepipe.frames import zxy_angles
from spinepipe.jobs.digest import provenance
from spinepipe.studies.joint_pose_sensitivity.inputs import study_and_cohort
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.studies.joint_pose_sensitivity.tables import SPREAD_OVER_LANDMARK_SD
from spinepipe.tables import from_rows, write
from spinepipe.units import COORDINATE_UNITS, MM_PER_M, ROTATIONS, TRANSLATIONS

BOOTSTRAPS = 200
ENDS = (2.5, 97.5)
QUARTILES = (25.0, 75.0)


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
    frames = _frames(settings, cohort, specimen, sd_mm)
    seed = specimen_seed(settings.seed, f"spread/{specimen}")
    ranges, low, high = iqr_with_ends(frames, seed)
    for joint, name in enumerate(cohort.joint_names):
        for column, coordinate in enumerate((*TRANSLATIONS, *ROTATIONS)):
            known = len(frames) > 1
            at = (joint, column)
            yield {
                "joint": name,
                "quantity": "origin" if coordinate in TRANSLATIONS else "orientation",
                "coordinate": coordinate,
                "unit": COORDINATE_UNITS[coordinate],
                "n": len(frames),
                "iqr": float(ranges[at]) if known else None,
                "iqr_low": float(low[at]) if known else None,
                "iqr_high": float(high[at]) if known else None,
            }


def _frames(settings: JointPoseSensitivity, cohort: Cohort, specimen: str, sd_mm: float) -> Array:
    """(n, J, 6) origins, mm, and angles, deg, of the landmark sets that define frames.

    Every SD draws the same directions as the study's own poses, so that spreads differ by SD alone.
    """
    assert cohort.landmarks is not None
    rows = cohort.landmarks[cohort.landmarks["specimen"] == specimen]
    points = rows[["x_mm", "y_mm", "z_mm"]].to_numpy(float)
    sds = np.full(len(rows), sd_mm)
    drawn, _ = sample_landmarks(points, sds, settings.poses, settings.seed, specimen)
    names = list(zip(rows["vertebra"], rows["landmark"], strict=True))
    found = []
    for one in drawn / MM_PER_M:
        placed: dict[str, dict[str, Array]] = {}
        for (vertebra, landmark), point in zip(names, one, strict=True):
            placed.setdefault(vertebra, {})[landmark] = point
        try:
            frames = frames_from_landmarks(cohort.vertebrae, placed)
        except ValueError:  # these landmarks define no frame: told by n
            continue
        found.append(
            [
                [*frame.origin * MM_PER_M, *np.rad2deg(zxy_angles(frame.rotation))]
                for frame in frames
            ]
        )
    return np.array(found).reshape(len(found), len(cohort.joint_names), 6)


def iqr_with_ends(values: Array, seed: int) -> tuple[Array, Array, Array]:
    """Interquartile range along the first axis of values (n, ...) with its 95 % interval."""
    n = len(values)
    if n < 2:
        nothing = np.full(values.shape[1:], np.nan)
        return nothing, nothing, nothing
    drawn = np.random.default_rng(seed).integers(0, n, (BOOTSTRAPS, n))
    repeated = np.array([_iqr(values[row]) for row in drawn])
    low, high = np.percentile(repeated, ENDS, axis=0)
    return _iqr(values), low, high


def _iqr(values: Array) -> Array:
    low, high = np.percentile(values, QUARTILES, axis=0)
    spread: Array = high - low
    return spread
