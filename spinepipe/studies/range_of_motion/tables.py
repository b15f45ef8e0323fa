"""Tables of studies of kind range_of_motion."""

from spinepipe.tables.schema import (
    JOINT,
    MESSAGE,
    POSE,
    SPECIMEN,
    Column,
    Table,
    coordinates,
    status,
    stiffness_unit,
)
from spinepipe.tables.shared import ENDED, FRAME_COLUMNS, FRAME_KEY, NO_EQUILIBRIUM, NO_RESULT
from spinepipe.units import COORDINATES, ROTATIONS

STIFFNESS_SET = Column(
    "stiffness", "integer", "number of the stiffness set; 0 is the study's own", low=0
)
_TEST = Column("test", "text", "test")
EVERY = "*"
"""Stands for all specimens."""

_SPECIMEN_OR_ALL = Column("specimen", "text", f"name of the specimen, or {EVERY} for all of them")

FRAMES = Table(
    "frames",
    "Joint frames in ground at the neutral pose: one row per specimen, pose and joint. Pose 0 is "
    "the cohort's own, the others are drawn around it. Orientations are intrinsic Z, X', Y'' "
    "rotations.",
    FRAME_KEY,
    FRAME_COLUMNS,
)

STIFFNESS_SETS = Table(
    "stiffness_sets",
    "Stiffness sets that all specimens and poses are moved with: one row per set and joint.",
    ("stiffness", "joint"),
    (
        STIFFNESS_SET,
        JOINT,
        *(
            Column(
                f"{name}_{suffix}",
                "number",
                f"stiffness against {name.replace('_', ' ')}",
                unit,
                low=0.0,
            )
            for name, (suffix, unit) in ((name, stiffness_unit(name)) for name in COORDINATES)
        ),
    ),
)

RANGE_OF_MOTION = Table(
    "range_of_motion",
    "Motion of every joint: one row per specimen, pose, stiffness set, test, load step and joint, "
    "counted from step 0 of the test.",
    ("specimen", "pose", "stiffness", "test", "step", "joint"),
    (
        SPECIMEN,
        POSE,
        STIFFNESS_SET,
        _TEST,
        Column("step", "integer", "load step; 0 is the reference", low=0),
        Column("largest_load", "flag", "whether this is the step of the test's largest load"),
        JOINT,
        *coordinates("predicted", "motion since step 0", NO_EQUILIBRIUM),
        status("solve"),
        MESSAGE,
    ),
)


def _quantile(name: str, meaning: str) -> Column:
    return Column(name, "number", meaning, "mm or deg, see unit", null=NO_RESULT)


ROM_SUMMARY = Table(
    "rom_summary",
    "Motion at the largest load over poses and stiffness sets (and over specimens, where specimen "
    "is *): one row per specimen, test, joint and coordinate. Signs are those of the coordinates.",
    ("specimen", "test", "joint", "coordinate"),
    (
        _SPECIMEN_OR_ALL,
        _TEST,
        JOINT,
        Column("coordinate", "text", "coordinate", allowed=COORDINATES),
        Column(
            "role",
            "text",
            "loaded: the coordinate that the test turns; coupled: any other",
            allowed=("loaded", "coupled"),
        ),
        Column("unit", "text", "unit of the motion", allowed=("mm", "deg")),
        Column("n", "integer", "runs with an equilibrium", low=0),
        Column("n_without", "integer", "runs without an equilibrium; they are in no number", low=0),
        _quantile("median", "median"),
        _quantile("low_quartile", "25th percentile"),
        _quantile("high_quartile", "75th percentile"),
        _quantile("percentile_5", "5th percentile"),
        _quantile("percentile_95", "95th percentile"),
        ENDED,
        MESSAGE,
    ),
)

FACTORS = {
    "specimen": "differences between specimens",
    "pose": "the joint frames drawn for a specimen",
    "stiffness": "the stiffness sets",
    "rest": "what the factors do only together",
}
"""Parts of the variance in `rom_variance`."""


def _share(name: str, meaning: str) -> tuple[Column, ...]:
    null = f"{NO_RESULT}; for a single specimen also: no share of specimens is defined"
    return (
        Column(f"{name}_share", "number", f"share due to {meaning}", null=null, low=0.0, high=1.0),
        Column(
            f"{name}_low", "number", "lower end of its 95 % interval", null=null, low=0.0, high=1.0
        ),
        Column(
            f"{name}_high", "number", "upper end of its 95 % interval", null=null, low=0.0, high=1.0
        ),
    )


ROM_VARIANCE = Table(
    "rom_variance",
    "Shares of the variance of a joint's motion in the loaded coordinate at the largest load: one "
    "row per specimen (* for the whole cohort), test and joint. Drawn poses and sets only: pose 0 "
    "and set 0 are no draws.",
    ("specimen", "test", "joint"),
    (
        _SPECIMEN_OR_ALL,
        _TEST,
        JOINT,
        Column("coordinate", "text", "loaded coordinate", allowed=ROTATIONS),
        Column("n_specimens", "integer", "specimens in the analysis", low=0),
        Column("n_poses", "integer", "poses of each specimen in the analysis", low=0),
        Column("n_stiffness", "integer", "stiffness sets in the analysis", low=0),
        Column(
            "sd",
            "number",
            "standard deviation of the motion in the analysis",
            "deg",
            null=NO_RESULT,
            low=0.0,
        ),
        *(column for name, meaning in FACTORS.items() for column in _share(name, meaning)),
        ENDED,
        MESSAGE,
    ),
)
