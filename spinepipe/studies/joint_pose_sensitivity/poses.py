"""Jobs: landmark sets sampled around palpated positions, and the joint poses of each set."""

from typing import Any

import numpy as np

from spinepipe.cohort import Cohort
from spinepipe.cohort.specimen import frames_from_landmarks
from spinepipe.designs import sample_landmarks
from spinepipe.frames import zxy_angles
from spinepipe.jobs.digest import mark_of, provenance
from spinepipe.status import Status
from spinepipe.studies.joint_pose_sensitivity.inputs import study_and_cohort
from spinepipe.studies.joint_pose_sensitivity.landmarks import (
    LandmarkPoints,
    by_vertebra,
    landmarks_of,
)
from spinepipe.studies.joint_pose_sensitivity.tables import LANDMARKS, POSES
from spinepipe.tables import from_rows, read_frame, to_arrow, write
from spinepipe.units import MM_PER_M, ROTATIONS

_POINT = ["x_mm", "y_mm", "z_mm"]
_ANGLES = [f"{name}_deg" for name in ROTATIONS]


def sample(root: str, study: str, specimen: str, output: str) -> None:
    """Write the landmark sets of one specimen, pose by pose."""
    settings, cohort = study_and_cohort(root, study)
    marks = landmarks_of(cohort, specimen, settings.landmark_sd_mm)
    sampled, poses = sample_landmarks(
        marks.points_mm, marks.sd_mm, settings.poses, settings.seed, specimen
    )
    each, flat = len(marks.names), sampled.reshape(-1, 3)
    columns: dict[str, list[Any]] = {
        "specimen": [specimen] * len(flat),
        "pose": np.repeat(np.asarray(poses), each).tolist(),
        "vertebra": [vertebra for vertebra, _ in marks.names] * len(poses),
        "landmark": [landmark for _, landmark in marks.names] * len(poses),
        **dict(zip(_POINT, flat.T.tolist(), strict=True)),
        "sd_mm": np.tile(marks.sd_mm, len(poses)).tolist(),
    }
    made_by = provenance("sample_landmarks", settings, cohort, [specimen])
    write(to_arrow(LANDMARKS, columns), output, made_by)


def build(root: str, study: str, landmarks: str, specimen: str, output: str) -> None:
    """Write the joint frames of one specimen, pose by pose."""
    settings, cohort = study_and_cohort(root, study)
    rows: list[dict[str, Any]] = []
    for pose, part in read_frame(landmarks).groupby("pose", sort=False):
        names = zip(part["vertebra"], part["landmark"], strict=True)
        points = by_vertebra(names, part[_POINT].to_numpy(float) / MM_PER_M)
        key = {"specimen": specimen, "pose": int(str(pose))}
        rows += [{**key, **row} for row in _joints(cohort, points)]
    made_by = provenance("build_models", settings, cohort, [specimen], [mark_of(landmarks)])
    write(from_rows(POSES, rows), output, made_by)


def _joints(cohort: Cohort, points: LandmarkPoints) -> list[dict[str, Any]]:
    """One row per joint, without numbers where the landmarks define no frame."""
    try:
        frames = frames_from_landmarks(cohort.vertebrae, points)
    except ValueError as error:
        nothing = dict.fromkeys((*_POINT, *_ANGLES), np.nan)
        refused = {"status": Status.REFUSED.value, "message": str(error)}
        return [{"joint": joint, **nothing, **refused} for joint in cohort.joint_names]
    return [
        {
            "joint": joint,
            **dict(zip(_POINT, frame.origin * MM_PER_M, strict=True)),
            **dict(zip(_ANGLES, np.rad2deg(zxy_angles(frame.rotation)), strict=True)),
            "status": Status.CONVERGED.value,
            "message": "",
        }
        for joint, frame in zip(cohort.joint_names, frames, strict=True)
    ]
