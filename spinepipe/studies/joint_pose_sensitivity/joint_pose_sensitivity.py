"""Tables of studies of kind joint_pose_sensitivity."""

from spinepipe.tables.columns import (
    JOINT,
    MESSAGE,
    POSE,
    SPECIMEN,
    coordinates,
    length_or_angle,
    status,
    stiffness_unit,
)
from spinepipe.tables.schema import Column, Table
from spinepipe.units import COORDINATES

NOT_MEASURED = "not measured"
NO_EQUILIBRIUM = "no pose was found"

LANDMARKS = Table(
    "landmarks",
    "Sampled landmark sets: one row per specimen, pose, vertebra and landmark, in ground axes.",
    ("specimen", "pose", "vertebra", "landmark"),
    (
        SPECIMEN,
        POSE,
        Column("vertebra", "text", "vertebra"),
        Column("landmark", "text", "landmark, as in the cohort's landmarks.csv"),
        *(
            Column(f"{axis}_mm", "number", f"position along {axis} ({way})", unit="mm")
            for axis, way in (("x", "anterior"), ("y", "superior"), ("z", "right"))
        ),
        Column("sd_mm", "number", "standard deviation per axis it was drawn with", "mm", low=0.0),
    ),
)

POSES = Table(
    "poses",
    "Joint frames in ground at the neutral pose: one row per specimen, pose and joint. "
    "Orientations are intrinsic Z, X', Y'' rotations.",
    ("specimen", "pose", "joint"),
    (
        SPECIMEN,
        POSE,
        JOINT,
        *(
            Column(f"{axis}_mm", "number", f"origin along {axis}", "mm", null="no frame is defined")
            for axis in "xyz"
        ),
        *(
            Column(
                f"{name}_deg", "number", "orientation of the frame", "deg", "no frame is defined"
            )
            for name in COORDINATES[3:]
        ),
        status("building of the frame"),
        MESSAGE,
    ),
)


def _calibration_columns() -> tuple[Column, ...]:
    columns = []
    for name in COORDINATES:
        suffix, unit = stiffness_unit(name)
        words = name.replace("_", " ")
        columns += [
            Column(f"{name}_{suffix}", "number", f"stiffness against {words}", unit,
                   null="no stiffness was found", low=0.0),
            Column(f"{name}_se_{suffix}", "number",
                   f"standard error of the stiffness against {words}, to first order", unit,
                   null="held fixed, at a bound, or not constrained by the data", low=0.0),
            Column(f"{name}_identifiable", "flag",
                   "whether the data constrain this stiffness; where false do not believe it",
                   null="held fixed"),
        ]  # fmt: skip
    return tuple(columns)


CALIBRATIONS = Table(
    "calibrations",
    "Identified stiffness: one row per specimen and pose, and per joint where stiffness is "
    "per_joint (joint is * where all joints share it).",
    ("specimen", "pose", "joint"),
    (
        SPECIMEN,
        POSE,
        Column("joint", "text", "joint, or * for a stiffness shared by all"),
        *_calibration_columns(),
        *(
            Column(
                f"{name}_error_{length_or_angle(name)}",
                "number",
                "mean absolute error of the predicted motion over the readings of steps that enter "
                "the cost",
                length_or_angle(name),
                null="not measured, or no pose was found",
                low=0.0,
            )
            for name in COORDINATES
        ),
        Column("cost", "number", "sum of weight times squared error", "mm2, deg2",
               null="no stiffness was found", low=0.0),
        Column("degrees_of_freedom", "integer", "readings in the cost less unknowns"),
        Column("iterations", "integer", "iterations of the best start", low=0),
        Column("evaluations", "integer", "evaluations of all starts", low=0),
        Column("n_optima", "integer", "distinct optima found from all starts", low=0),
        Column("start_stiffened", "integer",
               "times the start was doubled in stiffness before it stood", low=0),
        status("fit"),
        MESSAGE,
    ),
)  # fmt: skip

SIMULATIONS = Table(
    "simulations",
    "Predicted and measured motion: one row per specimen, pose, stiffness, test, cycle, load step "
    "and joint. Errors are predicted less measured.",
    ("specimen", "pose", "stiffness", "test", "cycle", "step", "joint"),
    (
        SPECIMEN,
        POSE,
        Column("stiffness", "text", "calibrated (this pose's own) or best01, best02 ..."),
        Column("test", "text", "load case"),
        Column("cycle", "integer", "repeat of the test", low=1),
        Column("step", "integer", "load step; 0 is the reference", low=0),
        JOINT,
        *coordinates("predicted", "predicted (from step 0 where the cohort is zeroed there)",
                     NO_EQUILIBRIUM),
        *coordinates("measured", "measured, in this pose's joint frame", NOT_MEASURED),
        *coordinates("error", "predicted less measured", f"{NOT_MEASURED}, or {NO_EQUILIBRIUM}"),
        Column("unmeasured_taken_as_zero", "flag",
               "measured motion was brought into this frame with unmeasured components as zero"),
        Column("remaining_mm", "number", "largest translation still to go to equilibrium", "mm",
               null="equilibrium loading, or there is no equilibrium", low=0.0),
        Column("remaining_deg", "number", "largest rotation still to go to equilibrium", "deg",
               null="equilibrium loading, or there is no equilibrium", low=0.0),
        status("solve"),
        MESSAGE,
    ),
)  # fmt: skip
