"""Jobs: what is drawn, joint frames of a specimen around its own, and stiffness sets for all."""

from typing import Any

import numpy as np
import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.cohort.specimen import joint_frames
from spinepipe.designs import sample_factors, sample_joint_frames
from spinepipe.frames import Pose, zxy_angles
from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.status import Status
from spinepipe.studies.parts import stiffness_of_joints
from spinepipe.studies.range_of_motion.settings import RangeOfMotion
from spinepipe.studies.range_of_motion.tables import FRAMES, STIFFNESS_SETS
from spinepipe.tables import to_arrow, write
from spinepipe.units import MM_PER_M, ROTATIONS, STIFFNESS_COLUMNS


def draw_stiffness(root: str, study: str, output: str) -> None:
    """Write ``stiffness_sets.parquet``."""
    settings, cohort = study_of_kind(RangeOfMotion, root, study)
    joints = cohort.joint_names
    factors = sample_factors(settings.stiffness_spread, 6, settings.stiffness_sets, settings.seed)
    own = stiffness_of_joints(cohort, settings.stiffness, settings.level_stiffness)
    # (sets, 1, 6) by (J, 6): one factor for all joints, its own for each coordinate
    values = (factors[:, None, :] * own).reshape(-1, 6)
    columns: dict[str, list[Any]] = {
        "stiffness": np.repeat(np.arange(len(factors)), len(joints)).tolist(),
        "joint": list(joints) * len(factors),
        **dict(zip(STIFFNESS_COLUMNS, values.T.tolist(), strict=True)),
    }
    made_by = provenance("draw_stiffness", settings, cohort, ())
    write(to_arrow(STIFFNESS_SETS, columns), output, made_by)


def sample_frames(root: str, study: str, specimen: str, output: str) -> None:
    """Write the rows of one specimen."""
    settings, cohort = study_of_kind(RangeOfMotion, root, study)
    # SDs of a frame per axis; nothing is drawn with them when there is one pose.
    sd = settings.pose_sd or cohort.measurement_sd
    translation_m = 0.0 if sd is None else sd.translation_mm / MM_PER_M
    rotation_rad = 0.0 if sd is None else float(np.deg2rad(sd.rotation_deg))
    own = joint_frames(cohort, specimen)
    poses = sample_joint_frames(
        own, translation_m, rotation_rad, settings.n_poses, settings.seed, specimen
    )
    frame = _rows(cohort, specimen, poses)
    columns = {column.name: frame[column.name].to_list() for column in FRAMES.columns}
    made_by = provenance("sample_frames", settings, cohort, [specimen])
    write(to_arrow(FRAMES, columns), output, made_by)


def _rows(cohort: Cohort, specimen: str, poses: list[tuple[Pose, ...]]) -> pd.DataFrame:
    """Rows pose by pose, joint by joint."""
    frames = [frame for pose in poses for frame in pose]
    origins = MM_PER_M * np.array([frame.origin for frame in frames])
    angles = np.rad2deg(zxy_angles(np.array([frame.rotation for frame in frames])))
    n = len(cohort.joint_names)
    return pd.DataFrame(
        {
            "specimen": specimen,
            "pose": np.repeat(np.arange(len(poses)), n),
            "joint": np.tile(cohort.joint_names, len(poses)),
            **dict(zip(("x_mm", "y_mm", "z_mm"), origins.T, strict=True)),
            **dict(zip([f"{name}_deg" for name in ROTATIONS], angles.T, strict=True)),
            "status": Status.CONVERGED.value,
            "message": "",
        }
    )
