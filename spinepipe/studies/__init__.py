"""Studies: what is asked of a cohort, validated before anything runs."""

from spinepipe.studies.check import check
from spinepipe.studies.cohort_stiffness import CohortStiffness, CrossValidation
from spinepipe.studies.discrepancy import Discrepancy, DiscrepancyBase, HeldOut, Nuisance
from spinepipe.studies.global_sensitivity import GlobalSensitivity, Outputs, SensitivityDesign
from spinepipe.studies.identification import (
    Bootstrap,
    DampingBootstrap,
    LandmarkPrecision,
    Methods,
    StartBootstrap,
    Success,
)
from spinepipe.studies.joint_pose_sensitivity import Calibration, JointPoseSensitivity
from spinepipe.studies.published_stiffness import LevelStiffness
from spinepipe.studies.range_of_motion import PoseSd, RangeOfMotion, VirtualTests
from spinepipe.studies.read import KINDS, read
from spinepipe.studies.selection import Selection, names_of_kind, read_selection
from spinepipe.studies.study import Study

__all__ = [
    "KINDS",
    "Bootstrap",
    "Calibration",
    "CohortStiffness",
    "CrossValidation",
    "DampingBootstrap",
    "Discrepancy",
    "DiscrepancyBase",
    "GlobalSensitivity",
    "HeldOut",
    "JointPoseSensitivity",
    "LandmarkPrecision",
    "LevelStiffness",
    "Methods",
    "Nuisance",
    "Outputs",
    "PoseSd",
    "RangeOfMotion",
    "Selection",
    "SensitivityDesign",
    "StartBootstrap",
    "Study",
    "Success",
    "VirtualTests",
    "check",
    "names_of_kind",
    "read",
    "read_selection",
]
