"""Tables that are made of tracked motions: ranges, sharing, errors, weights, and the paper's."""

from spinepipe.studies.tracking.tables import (
    APPROACH,
    COORDINATE,
    FIT_STATUS,
    LEVEL,
    NO_POSTURE,
    TRIAL,
    length,
)
from spinepipe.tables.schema import MESSAGE, SPECIMEN, Column, Table
from spinepipe.tables.shared import against_paper

WINDOWS = {
    "20-80": (0.2, 0.8),
    "20-40": (0.2, 0.4),
    "40-60": (0.4, 0.6),
    "60-80": (0.6, 0.8),
}
"""Parts of a motion's cycle in which sharing is looked at (Wang 2021)."""

MEASURES = {
    "centre_mm": ("mm", "vertebral centres", "distance of a vertebra's centre from the true one"),
    "angle_deg": (
        "deg",
        "sagittal angles",
        "sagittal angle of neighbouring vertebrae off the true one",
    ),
    "joint_angle_deg": (
        "deg",
        "joint rotations",
        "angle between the change of a joint's rotation since the first instant with a truth and "
        "the true change",
    ),
}
"""Unit, a few words and what it is, of each measure of error."""

DONE, TOO_SMALL, TOO_FEW, UNDEFINED = "done", "too_small", "too_few", "undefined"

WINDOW = Column("window", "text", "part of the motion's cycle, percent", allowed=tuple(WINDOWS))
MEASURE = Column(
    "measure",
    "text",
    "; ".join(f"{name}: {what}" for name, (_, _, what) in MEASURES.items()),
    allowed=tuple(MEASURES),
)

RANGES = Table(
    "ranges",
    "How far every joint moves: one row per person, trial, approach, joint and coordinate.",
    ("specimen", "trial", "approach", "joint", "coordinate"),
    (
        SPECIMEN,
        TRIAL,
        APPROACH,
        LEVEL,
        COORDINATE,
        Column("range", "number", "largest less smallest value", "see unit", low=0.0),
        Column("unit", "text", "unit of the range", allowed=("mm", "deg")),
    ),
)

SHARING = Table(
    "sharing",
    "How joints share the motion of the lumbar spine: one row per person, trial, approach, joint "
    "and window.",
    ("specimen", "trial", "approach", "joint", "window"),
    (
        SPECIMEN,
        TRIAL,
        APPROACH,
        LEVEL,
        WINDOW,
        Column(
            "share",
            "number",
            "rotation of the joint over that of all lumbar joints, L5S1 to T12L1, about the axis "
            "that the motion is about, from the neutral pose; mean over the window",
            null="the lumbar spine turns less than 2 deg in every frame, or there is no frame",
        ),
        Column("frames_used", "integer", "frames in which it turns enough", low=0),
        Column(
            "status",
            "text",
            "too_small: the lumbar spine turns too little; too_few: no frame lies in the window",
            allowed=(DONE, TOO_SMALL, TOO_FEW),
        ),
    ),
)

SIMILARITY = Table(
    "similarity",
    "How alike persons share motion among lumbar joints: one row per trial, approach and window.",
    ("trial", "approach", "window"),
    (
        TRIAL,
        APPROACH,
        WINDOW,
        Column(
            "cmc",
            "number",
            "coefficient of multiple correlation over persons, of the shares of all lumbar joints "
            "one after the other: 1, all are alike",
            null="it is not defined, see status",
            low=0.0,
            high=1.0,
        ),
        Column("n_specimens", "integer", "persons with a curve", low=0),
        Column(
            "status",
            "text",
            "undefined: persons differ more than the curve varies; too_few: fewer than two persons",
            allowed=(DONE, UNDEFINED, TOO_FEW),
        ),
        MESSAGE,
    ),
)


def _error(name: str, meaning: str, null: str | None = None) -> Column:
    return Column(name, "number", meaning, "mm or deg, by measure", null=null)


ERRORS = Table(
    "errors",
    "How far postures are from the truth, where it is known (X-ray, made-up motion): one row per "
    "person, trial, approach, measure and level.",
    ("specimen", "trial", "approach", "measure", "level"),
    (
        SPECIMEN,
        TRIAL,
        APPROACH,
        MEASURE,
        Column("level", "text", "vertebra of a centre, joint of an angle"),
        _error("mean", "mean error over frames"),
        _error("p95", "95th percentile of the errors"),
        _error("largest", "largest error"),
        Column("n", "integer", "frames with a truth", low=1),
    ),
)

ACCURACY = Table(
    "accuracy",
    "Errors over all persons: one row per trial, approach and measure.",
    ("trial", "approach", "measure"),
    (
        TRIAL,
        APPROACH,
        MEASURE,
        _error("mean", "mean over persons of their mean error over levels"),
        _error("low", "lower end of its 95 % interval over persons", "fewer than two persons"),
        _error("high", "upper end of it", "fewer than two persons"),
        Column("n_specimens", "integer", "persons with a posture and a truth", low=1),
    ),
)

WEIGHTS = Table(
    "weights",
    "What it does to count loads more or less beside markers: one row per person, trial and ratio.",
    ("specimen", "trial", "ratio"),
    (
        SPECIMEN,
        TRIAL,
        Column("ratio", "number", "weight of loads over that of the study", low=0.0),
        length(
            "marker_rmse", "root mean square distance of model and measured markers", NO_POSTURE
        ),
        Column(
            "load_rms_nm",
            "number",
            "root mean square moment that muscles have to make",
            "N m",
            null=NO_POSTURE,
            low=0.0,
        ),
        length("centre", "mean error of vertebral centres", "no truth is known, or no posture"),
        Column(
            "angle_deg",
            "number",
            "mean error of sagittal angles",
            "deg",
            null="no truth is known, or no posture",
            low=0.0,
        ),
        FIT_STATUS,
    ),
)

AGAINST_WANG_2021 = against_paper("against_wang_2021")
