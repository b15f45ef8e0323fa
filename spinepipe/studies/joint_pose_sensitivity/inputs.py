"""What many jobs of one worker read again and again of a joint-pose study."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from spinepipe.cohort import Cohort
from spinepipe.cohort.measured import MeasuredSpecimen, measured_specimen
from spinepipe.cohort.specimen import on_bushings
from spinepipe.effects.contract import Array
from spinepipe.files import Stamp, stamp
from spinepipe.frames import Pose, rotation_zxy
from spinepipe.jobs.inputs import KEPT_SPECIMENS, study_of_kind
from spinepipe.model import SpineModel
from spinepipe.status import Status
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.tables import read_frame
from spinepipe.units import MM_PER_M, ROTATIONS


@dataclass(frozen=True)
class SampledPoses:
    """Sampled joint frames: (specimen, pose) to frames or the reason for none."""

    frames: dict[tuple[str, int], tuple[Pose, ...]]
    refused: dict[tuple[str, int], str]

    def of(self, specimen: str, pose: int) -> tuple[tuple[Pose, ...] | None, str]:
        """Frames of one pose, or None and the reason."""
        key = (specimen, pose)
        return self.frames.get(key), self.refused.get(key, "")


def study_and_cohort(root: str, name: str) -> tuple[JointPoseSensitivity, Cohort]:
    """A validated joint-pose study and its cohort, see `study_of_kind`."""
    return study_of_kind(JointPoseSensitivity, root, name)


@lru_cache(maxsize=KEPT_SPECIMENS)
def _poses(where: Stamp) -> SampledPoses:
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
    return SampledPoses(frames, refused)


def sampled_poses(path: str) -> SampledPoses:
    """Sampled joint frames of a specimen, from the file that `build_models` wrote."""
    return _poses(stamp(path))


@lru_cache(maxsize=16)
def specimen_inputs(root: str, name: str, specimen: str, _digest: str) -> MeasuredSpecimen:
    """Tests and motion of a specimen; ``_digest`` is that of its cohort."""
    study, cohort = study_and_cohort(root, name)
    chosen = study.tests or cohort.tests
    shift = np.array(study.load_point_shift_mm.in_order()) / MM_PER_M
    return measured_specimen(cohort, specimen, chosen, shift)


def start_stiffness(study: JointPoseSensitivity) -> Array:
    """(6,) stiffness a study starts from, SI."""
    return np.array(study.stiffness.in_order(), dtype=float)


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
