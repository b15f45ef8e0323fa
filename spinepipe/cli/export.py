"""`spinepipe export`: a specimen's model as an OpenSim file."""

import argparse
from pathlib import Path

import numpy as np

from spinepipe.cli.find import specimen_of, study_names, unknown
from spinepipe.cohort.specimen import joint_frames
from spinepipe.effects.contract import Array
from spinepipe.frames import Pose
from spinepipe.jobs.inputs import bushing_model, sampled_poses, start_stiffness
from spinepipe.problems import InputError, Problem
from spinepipe.status import Status
from spinepipe.studies import read as studies
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.tables import read_frame
from spinepipe.units import STIFFNESS_COLUMNS


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which model, and where to."""
    parser.add_argument("study", metavar="STUDY", help="name of a study")
    parser.add_argument("specimen", metavar="SPECIMEN", help="name of a specimen of its cohort")
    parser.add_argument(
        "--pose",
        type=int,
        metavar="N",
        help="a sampled joint pose of the study's results (default: the nominal one)",
    )
    parser.add_argument(
        "-o", "--output", type=Path, required=True, metavar="FILE.osim", help="file to write"
    )


def run(options: argparse.Namespace) -> int:
    """Write the file and say which frames and which stiffness are in it."""
    if options.output.suffix != ".osim":
        raise InputError([_problem("-o", options.output.name, "FILE.osim", "rename it")])
    if options.study not in study_names(options.root):
        raise InputError([unknown("study", options.study, study_names(options.root))])
    study, cohort = studies.check(options.root, options.study)
    assert isinstance(study, JointPoseSensitivity)
    specimen = specimen_of(cohort, options.specimen)
    results = options.root / "results" / study.study
    stiffness, origin = start_stiffness(study), "start of the study"
    if options.pose is None:
        frames, pose = joint_frames(cohort, specimen), "nominal"
    else:
        frames, pose = _sampled(results, specimen, options.pose), f"{options.pose:04d}"
        calibrated = _calibrated(results, specimen, options.pose)
        if calibrated is not None:
            stiffness, origin = calibrated, "calibrated for this pose"
    from spinepipe.model.osim import write_osim

    model = bushing_model(study, cohort, specimen, frames, stiffness)
    options.output.parent.mkdir(parents=True, exist_ok=True)
    write_osim(model, options.output)
    print(f"{options.output}: specimen {specimen}, joint pose {pose}, stiffness: {origin}")
    return 0


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
