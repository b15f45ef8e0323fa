"""What many jobs of one worker read again and again, kept as long as the files are the same."""

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from spinepipe.cohort import Cohort
from spinepipe.cohort.specimen import (
    MeasuredMotion,
    joint_frames,
    load_cases,
    measured_motion,
    spine_model,
)
from spinepipe.effects import create
from spinepipe.effects.contract import Array
from spinepipe.frames import Pose, rotation_zxy
from spinepipe.marks import without_mark
from spinepipe.model import LoadCase, ScopedEffect, SpineModel
from spinepipe.status import Status
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.studies.parts import LevelStiffness, Stiffness
from spinepipe.studies.read import check, read
from spinepipe.studies.study import Study
from spinepipe.tables import read_frame
from spinepipe.units import MM_PER_M, ROTATIONS, TRANSLATIONS

Stamp = tuple[str, int, int]
_SPECIMENS = 128
"""Whose poses are kept: jobs of different specimens come in any order."""

AnyStudy = TypeVar("AnyStudy", bound=Study)


def stamp(path: str | Path) -> Stamp:
    """Name, size and time of change of a file: a key that a change of the file changes."""
    status = Path(path).stat()
    return str(path), status.st_size, status.st_mtime_ns


@dataclass(frozen=True)
class Poses:
    """Sampled joint frames: (specimen, pose) to frames or the reason for none."""

    frames: dict[tuple[str, int], tuple[Pose, ...]]
    refused: dict[tuple[str, int], str]

    def of(self, specimen: str, pose: int) -> tuple[tuple[Pose, ...] | None, str]:
        """Frames of one pose, or None and the reason."""
        key = (specimen, pose)
        return self.frames.get(key), self.refused.get(key, "")


@lru_cache(maxsize=8)
def _folder(name: str, root: str, _study_file: Stamp) -> Path:
    return read(Path(root) / "config" / "studies" / f"{name}.yaml", Path(root)).cohort_folder(
        Path(root)
    )


@lru_cache(maxsize=8)
def _study(
    name: str, root: str, _study_file: Stamp, _cohort_files: tuple[Stamp, ...]
) -> tuple[Study, Cohort]:
    return check(Path(root), name, starting=False)


def study_and_cohort(root: str, name: str) -> tuple[JointPoseSensitivity, Cohort]:
    """A validated joint-pose study and its cohort, see `study_of_kind`."""
    return study_of_kind(JointPoseSensitivity, root, name)


def study_of_kind(kind: type[AnyStudy], root: str, name: str) -> tuple[AnyStudy, Cohort]:
    """The validated study and its cohort; read once per worker and state of the files."""
    study_file = stamp(os.path.join(root, "config", "studies", f"{name}.yaml"))
    with os.scandir(_folder(name, root, study_file)) as entries:
        files = sorted((e.path, e.stat().st_size, e.stat().st_mtime_ns) for e in entries)
    study, cohort = _study(name, root, study_file, tuple(files))
    assert isinstance(study, kind)
    return study, cohort


@lru_cache(maxsize=4)
def _ranking(where: Stamp) -> dict[str, list[dict[str, Any]]]:
    return without_mark(json.loads(Path(where[0]).read_text("utf-8")))


def ranking(path: str) -> dict[str, list[dict[str, Any]]]:
    """Specimen to its best stiffness sets, from ``best.json``."""
    return _ranking(stamp(path))


def ranked_set(path: str, specimen: str, name: str) -> str:
    """Stiffness (J or 1, 6) of a ranked set as JSON; empty where the specimen has none so named."""
    for ranked in ranking(path).get(specimen, []):
        if ranked["name"] == name:
            return json.dumps(ranked["stiffness"])
    return ""


@lru_cache(maxsize=_SPECIMENS)
def _poses(where: Stamp) -> Poses:
    frame = read_frame(where[0])
    origins = frame[["x_mm", "y_mm", "z_mm"]].to_numpy(float) / MM_PER_M
    angles = np.deg2rad(frame[[f"{name}_deg" for name in ROTATIONS]].to_numpy(float))
    frames: dict[tuple[str, int], tuple[Pose, ...]] = {}
    refused: dict[tuple[str, int], str] = {}
    rows = zip(
        frame["specimen"],
        frame["pose"],
        frame["status"],
        frame["message"],
        origins,
        angles,
        strict=True,
    )
    for specimen, pose, status, message, origin, angle in rows:
        key = (specimen, int(pose))
        if status == Status.REFUSED:
            refused[key] = message
        else:
            placed = Pose(rotation_zxy(*angle), origin)
            frames[key] = (*frames.get(key, ()), placed)
    return Poses(frames, refused)


def sampled_poses(path: str) -> Poses:
    """Sampled joint frames of a specimen, from the file that `build_models` wrote."""
    return _poses(stamp(path))


@dataclass(frozen=True)
class SpecimenInputs:
    """What the jobs of one specimen share: its tests, its motion and its nominal frames."""

    nominal: tuple[Pose, ...]
    cases: tuple[LoadCase, ...]
    motions: tuple[MeasuredMotion, ...]


@lru_cache(maxsize=16)
def specimen_inputs(root: str, name: str, specimen: str, _digest: str) -> SpecimenInputs:
    """Tests and motion of a specimen; ``_digest`` is that of its cohort."""
    study, cohort = study_and_cohort(root, name)
    chosen = study.tests or cohort.tests
    shift = np.array(study.load_point_shift_mm.in_order()) / MM_PER_M
    cases = load_cases(cohort, specimen, chosen, shift)
    motions = measured_motion(cohort, specimen, cases)
    return SpecimenInputs(joint_frames(cohort, specimen), cases, motions)


def start_stiffness(study: JointPoseSensitivity) -> Array:
    """(6,) stiffness a study starts from, SI."""
    return np.array(study.stiffness.in_order(), dtype=float)


def stiffness_of_joints(
    cohort: Cohort, every: Stiffness, levels: Mapping[str, LevelStiffness]
) -> Array:
    """(J, 6) SI: one stiffness of all joints, with the rotations of levels that have their own."""
    values = np.tile(np.array(every.in_order(), dtype=float), (len(cohort.joint_names), 1))
    for joint, level in levels.items():
        values[cohort.joint_names.index(joint), len(TRANSLATIONS) :] = level.in_order()
    return values


def bushing_model(
    study: JointPoseSensitivity,
    cohort: Cohort,
    specimen: str,
    frames: tuple[Pose, ...],
    stiffness: Array,
) -> SpineModel:
    """Model of a specimen with the study's damping, see `on_bushings`."""
    damping = np.array(study.damping.in_order(), dtype=float)
    return on_bushings(cohort, specimen, frames, stiffness, damping)


def on_bushings(
    cohort: Cohort,
    specimen: str,
    frames: tuple[Pose, ...],
    stiffness: Array,
    damping: Array,
    others: tuple[ScopedEffect, ...] = (),
) -> SpineModel:
    """Model of a specimen on linear bushings; stiffness (6,) for all joints or (J, 6).

    The bushings are its first effect, ``others`` come after them.
    """
    n = len(cohort.joint_names)
    values = np.broadcast_to(stiffness, (n, 6)).copy()
    bushing = ScopedEffect(create("linear_bushing"), tuple(range(n)), values)
    return spine_model(cohort, specimen, frames, (bushing, *others), damping)
