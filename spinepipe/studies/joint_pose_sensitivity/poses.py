"""Job: joint poses of every sampled landmark set, and the study's base model file."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.cohort.specimen import frames_from_landmarks
from spinepipe.frames import zxy_angles
from spinepipe.jobs.inputs import start_stiffness, study_and_cohort
from spinepipe.jobs.provenance import provenance
from spinepipe.model.file import EffectEntry, ModelFile, Scope, Values, write_model
from spinepipe.statics.status import Status
from spinepipe.studies import JointPoseSensitivity
from spinepipe.tables import POSES, read_frame, to_arrow, write
from spinepipe.units import MM_PER_M, ROTATIONS, STIFFNESS_COLUMNS


def run(root: str, study: str, landmarks: str, output: str, model: str) -> None:
    """Write ``poses.parquet`` and ``model.yaml``."""
    settings, cohort = study_and_cohort(root, study)
    rows = [row for rows in _poses(cohort, read_frame(landmarks)) for row in rows]
    names = [column.name for column in POSES.columns]
    columns = {name: [row[name] for row in rows] for name in names}
    write(to_arrow(POSES, columns), output, provenance("build_models", settings, cohort))
    write_model(base_model(settings), model)


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


_ORIGIN = ("x_mm", "y_mm", "z_mm")
_ANGLES = tuple(f"{name}_deg" for name in ROTATIONS)


def base_model(study: JointPoseSensitivity) -> ModelFile:
    """The model every calibration of the study starts from."""
    values = dict(zip(STIFFNESS_COLUMNS, start_stiffness(study).tolist(), strict=True))
    entry = EffectEntry(
        effect="linear_bushing", scope=Scope(), values=(Values(specimen="*", joint="*", **values),)
    )
    return ModelFile(model=study.study, cohort=study.cohort, effects=(entry,))
