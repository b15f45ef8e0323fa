"""Jobs: landmark sets sampled around palpated positions, and the joint poses of each set."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.cohort.specimen import frames_from_landmarks
from spinepipe.designs import sample_landmarks
from spinepipe.frames import zxy_angles
from spinepipe.jobs.digest import mark_of, provenance
from spinepipe.status import Status
from spinepipe.studies.joint_pose_sensitivity.inputs import study_and_cohort
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.studies.joint_pose_sensitivity.tables import LANDMARKS, POSES
from spinepipe.tables import read_frame, to_arrow, write
from spinepipe.units import MM_PER_M, ROTATIONS

_ORIGIN = ("x_mm", "y_mm", "z_mm")

_ANGLES = tuple(f"{name}_deg" for name in ROTATIONS)


def sample(root: str, study: str, specimen: str, output: str) -> None:
    """Write the rows of one specimen."""
    settings, cohort = study_and_cohort(root, study)
    assert cohort.landmarks is not None
    own = cohort.landmarks[cohort.landmarks["specimen"] == specimen]
    frame = _sampled(settings, specimen, own)
    columns = {column.name: frame[column.name].to_list() for column in LANDMARKS.columns}
    made_by = provenance("sample_landmarks", settings, cohort, [specimen])
    write(to_arrow(LANDMARKS, columns), output, made_by)


def _sampled(settings: JointPoseSensitivity, specimen: str, rows: pd.DataFrame) -> pd.DataFrame:
    """Landmark sets of one specimen, pose by pose."""
    points = rows[["x_mm", "y_mm", "z_mm"]].to_numpy(float)
    own = rows["sd_mm"].fillna(0.0).to_numpy(float)
    sd = own if settings.landmark_sd_mm is None else np.full(len(rows), settings.landmark_sd_mm)
    sampled, poses = sample_landmarks(points, sd, settings.poses, settings.seed, specimen)
    flat, n = sampled.reshape(-1, 3), len(rows)
    return pd.DataFrame(
        {
            "specimen": specimen,
            "pose": np.repeat(np.asarray(poses), n),
            "vertebra": np.tile(rows["vertebra"].to_numpy(), len(poses)),
            "landmark": np.tile(rows["landmark"].to_numpy(), len(poses)),
            "x_mm": flat[:, 0],
            "y_mm": flat[:, 1],
            "z_mm": flat[:, 2],
            "sd_mm": np.tile(sd, len(poses)),
        }
    )


def build(root: str, study: str, landmarks: str, specimen: str, output: str) -> None:
    """Write the rows of one specimen."""
    settings, cohort = study_and_cohort(root, study)
    rows = [row for rows in _poses(cohort, read_frame(landmarks)) for row in rows]
    names = [column.name for column in POSES.columns]
    columns = {name: [row[name] for row in rows] for name in names}
    made_by = provenance("build_models", settings, cohort, [specimen], [mark_of(landmarks)])
    write(to_arrow(POSES, columns), output, made_by)


def _poses(cohort: Cohort, landmarks: pd.DataFrame) -> Iterator[list[dict[str, Any]]]:
    """Rows of one specimen and pose at a time."""
    for _, rows in landmarks.groupby(["specimen", "pose"], sort=False):
        specimen, pose = str(rows["specimen"].iloc[0]), int(rows["pose"].iloc[0])
        points: dict[str, dict[str, Any]] = {}
        xyz = rows[["x_mm", "y_mm", "z_mm"]].to_numpy(float) / MM_PER_M
        for vertebra, name, point in zip(rows["vertebra"], rows["landmark"], xyz, strict=True):
            points.setdefault(vertebra, {})[name] = point
        yield _joints(cohort, specimen, pose, points)


def _joints(cohort: Cohort, specimen: str, pose: int, points: Any) -> list[dict[str, Any]]:
    key = {"specimen": specimen, "pose": pose}
    try:
        frames = frames_from_landmarks(cohort.vertebrae, points)
    except ValueError as error:
        nothing = dict.fromkeys((*_ORIGIN, *_ANGLES), np.nan)
        refusal = {"status": Status.REFUSED.value, "message": str(error)}
        return [{**key, "joint": joint, **nothing, **refusal} for joint in cohort.joint_names]
    rows = []
    for joint, frame in zip(cohort.joint_names, frames, strict=True):
        origin = dict(zip(_ORIGIN, frame.origin * MM_PER_M, strict=True))
        angles = dict(zip(_ANGLES, np.rad2deg(zxy_angles(frame.rotation)), strict=True))
        ended = {"status": Status.CONVERGED.value, "message": ""}
        rows.append({**key, "joint": joint, **origin, **angles, **ended})
    return rows
