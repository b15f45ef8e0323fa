"""The model of a specimen in a joint pose, as `spinepipe export` writes it."""

from pathlib import Path

import numpy as np

from spinepipe.cohort import Cohort
from spinepipe.cohort.specimen import joint_frames
from spinepipe.effects.contract import Array
from spinepipe.frames import Pose
from spinepipe.model.osim import osim
from spinepipe.problems import InputError, Problem
from spinepipe.status import Status
from spinepipe.studies.joint_pose_sensitivity.inputs import (
    bushing_model,
    sampled_poses,
    start_stiffness,
)
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.tables import read_frame
from spinepipe.units import STIFFNESS_COLUMNS


def exported(
    study: JointPoseSensitivity, cohort: Cohort, specimen: str, pose: int | None, results: Path
) -> tuple[str, str]:
    """OpenSim's document of the model, and in words which frames and which stiffness it has.

    Parameters
    ----------
    pose : number of a sampled joint pose; None for the nominal one. results : of the study.

    Raises
    ------
    InputError
        Where there is no such pose.
    """
    stiffness, origin = start_stiffness(study), "start of the study"
    if pose is None:
        frames, name = joint_frames(cohort, specimen), "nominal"
    else:
        frames, name = _sampled(results, specimen, pose), f"{pose:04d}"
        calibrated = _calibrated(results, specimen, pose)
        if calibrated is not None:
            stiffness, origin = calibrated, "calibrated for this pose"
    model = bushing_model(study, cohort, specimen, frames, stiffness)
    return osim(model), f"joint pose {name}, stiffness: {origin}"


def _sampled(results: Path, specimen: str, pose: int) -> tuple[Pose, ...]:
    """Joint frames of a sampled pose.

    Raises
    ------
    InputError
        When there are no results yet, no such pose, or its landmarks define no frame.
    """
    path = results / "poses.parquet"
    if not path.is_file():
        remedy = f"run `snakemake {_relative(path)}` first, or leave --pose out"
        raise InputError([_problem("--pose", f"no {_relative(path)}", "a computed study", remedy)])
    poses = sampled_poses(str(path))
    frames, reason = poses.of(specimen, pose)
    if frames is None:
        known = [number for name, number in poses.frames if name == specimen]
        allowed = f"0 to {max(known)}" if known else "none"
        found = f"pose {pose}" + (f", refused: {reason}" if reason else "")
        raise InputError([_problem("--pose", found, allowed, "choose another pose")])
    return frames


def _calibrated(results: Path, specimen: str, pose: int) -> Array | None:
    """(1 or J, 6) stiffness fitted for a pose, or None where there is none to use."""
    whole = results / "calibrations.parquet"
    single = results / "calibrations" / f"specimen={specimen}" / f"pose={pose:04d}.parquet"
    path = next((path for path in (single, whole) if path.is_file()), None)
    if path is None:
        return None
    rows = read_frame(path)
    rows = rows[(rows["specimen"] == specimen) & (rows["pose"] == pose)]
    if not len(rows) or not Status(rows["status"].iloc[0]).usable:
        return None
    values = rows[list(STIFFNESS_COLUMNS)].to_numpy(float)
    return values if np.isfinite(values).all() else None


def _relative(path: Path) -> str:
    return "/".join(path.parts[-3:])


def _problem(column: str, found: str, allowed: str, remedy: str) -> Problem:
    return Problem("command line", None, column, found, allowed, remedy)
