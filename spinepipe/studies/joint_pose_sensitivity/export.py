"""The model of a specimen in a joint pose, as `spinepipe export` writes it."""

from pathlib import Path

import numpy as np

from spinepipe.calibration import fit
from spinepipe.cohort import Cohort
from spinepipe.cohort.specimen import joint_frames
from spinepipe.effects.contract import Array
from spinepipe.frames import Pose
from spinepipe.problems import InputError
from spinepipe.status import Status
from spinepipe.studies.exports import Exported, problem, refuse, required_result
from spinepipe.studies.joint_pose_sensitivity.inputs import (
    bushing_model,
    sampled_poses,
    specimen_inputs,
    start_stiffness,
)
from spinepipe.studies.joint_pose_sensitivity.problem import calibration_problem, fitted_stiffness
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.studies.kind import WantedFiles
from spinepipe.studies.opensim_files import opensim_document
from spinepipe.tables import read_frame
from spinepipe.units import STIFFNESS_COLUMNS


def exported(study: JointPoseSensitivity, cohort: Cohort, wanted: WantedFiles) -> Exported:
    """OpenSim's document of the model, and in words which frames and which stiffness it has.

    Of the cohort's own pose the fit is made here; those of sampled poses are results.

    Raises
    ------
    InputError
        Where there is no such pose, or no stiffness that fits it.
    """
    refuse(wanted, "pose", "test")
    specimen, pose = wanted.specimen, wanted.pose
    if pose is None:
        frames, name = joint_frames(cohort, specimen), "nominal"
    else:
        frames, name = _sampled(wanted.results, specimen, pose), f"{pose:04d}"
    if wanted.start:
        stiffness, origin = start_stiffness(study), "start of the study"
    elif pose is None:
        stiffness, origin = _fitted(study, wanted), "fitted in this pose"
    else:
        stiffness, origin = _calibrated(wanted.results, specimen, pose), "calibrated for this pose"
    model = bushing_model(study, cohort, specimen, frames, stiffness)
    words = f"joint pose {name}, stiffness: {origin}"
    tested = specimen_inputs(str(wanted.root), study.study, specimen, cohort.digest)
    return opensim_document(model, words, cohort, wanted, tested.cases)


def _fitted(study: JointPoseSensitivity, wanted: WantedFiles) -> Array:
    """(J, 6) stiffness fitted in the cohort's own joint pose, as the study fits.

    Raises
    ------
    InputError
        Where there is no fit to use.
    """
    asked = calibration_problem(str(wanted.root), study, wanted.specimen)
    found = fit(asked, study.calibration.starts, study.seed)
    if not found.status.usable:
        allowed, remedy = "a fit in the cohort's own joint pose", "add --start for the start"
        raise InputError([problem("SPECIMEN", f"no fit: {found.message}", allowed, remedy)])
    return fitted_stiffness(asked, found.x)


def _sampled(results: Path, specimen: str, pose: int) -> tuple[Pose, ...]:
    """Joint frames of a sampled pose.

    Raises
    ------
    InputError
        When there are no results yet, no such pose, or its landmarks define no frame.
    """
    path = required_result(results / "poses.parquet", "leave --pose out")
    poses = sampled_poses(str(path))
    frames, reason = poses.of(specimen, pose)
    if frames is None:
        known = [number for name, number in poses.frames if name == specimen]
        allowed = f"0 to {max(known)}" if known else "none"
        found = f"pose {pose}" + (f", refused: {reason}" if reason else "")
        raise InputError([problem("--pose", found, allowed, "choose another pose")])
    return frames


def _calibrated(results: Path, specimen: str, pose: int) -> Array:
    """(1 or J, 6) stiffness fitted for a pose.

    Raises
    ------
    InputError
        Where there is none to use.
    """
    whole = results / "calibrations.parquet"
    single = results / "calibrations" / f"specimen-{specimen}" / f"pose-{pose:04d}.parquet"
    path = single if single.is_file() else required_result(whole)
    rows = read_frame(path)
    rows = rows[(rows["specimen"] == specimen) & (rows["pose"] == pose)]
    values = rows[list(STIFFNESS_COLUMNS)].to_numpy(float)
    usable = len(rows) and Status(rows["status"].iloc[0]).usable and np.isfinite(values).all()
    if not usable:
        found = f"no stiffness: {rows['message'].iloc[0]}" if len(rows) else "no fit of it"
        remedy = "choose another pose, or add --start for the start"
        raise InputError([problem("--pose", found, "a pose whose fit ended", remedy)])
    return values
