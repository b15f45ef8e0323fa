"""Studies: what is asked of a cohort, validated before anything runs."""

from spinepipe.studies.check import check
from spinepipe.studies.identification import (
    Bootstrap,
    DampingBootstrap,
    LandmarkPrecision,
    Methods,
    StartBootstrap,
    Success,
)
from spinepipe.studies.joint_pose_sensitivity import Calibration, JointPoseSensitivity
from spinepipe.studies.read import KINDS, read
from spinepipe.studies.selection import Selection, read_selection
from spinepipe.studies.study import Study

__all__ = [
    "KINDS",
    "Bootstrap",
    "Calibration",
    "DampingBootstrap",
    "JointPoseSensitivity",
    "LandmarkPrecision",
    "Methods",
    "Selection",
    "StartBootstrap",
    "Study",
    "Success",
    "check",
    "read",
    "read_selection",
]
