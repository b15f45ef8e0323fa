"""Studies: what is asked of a cohort, validated before anything runs."""

from spinepipe.studies.check import check
from spinepipe.studies.joint_pose_sensitivity import Calibration, JointPoseSensitivity
from spinepipe.studies.read import KINDS, read
from spinepipe.studies.selection import Selection, read_selection
from spinepipe.studies.study import Study

__all__ = [
    "KINDS",
    "Calibration",
    "JointPoseSensitivity",
    "Selection",
    "Study",
    "check",
    "read",
    "read_selection",
]
