"""Studies: what is asked of a cohort, validated before anything runs."""

from spinepipe.studies.cohort_stiffness.settings import CohortStiffness, CrossValidation
from spinepipe.studies.discrepancy.settings import Discrepancy, DiscrepancyBase, HeldOut, Nuisance
from spinepipe.studies.global_sensitivity.settings import (
    GlobalSensitivity,
    Outputs,
    SensitivityDesign,
)
from spinepipe.studies.joint_pose_sensitivity.settings import (
    Bootstrap,
    Calibration,
    DampingBootstrap,
    JointPoseSensitivity,
    LandmarkPrecision,
    Methods,
    StartBootstrap,
    Success,
)
from spinepipe.studies.parts import LevelStiffness
from spinepipe.studies.range_of_motion.settings import PoseSd, RangeOfMotion, VirtualTests
from spinepipe.studies.read import KINDS, Selection, check, names_of_kind, read, read_selection
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
