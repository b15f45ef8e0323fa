"""Tables of what was put in: where the load acts, and how precisely landmarks were palpated."""

from spinepipe.studies.joint_pose_sensitivity.tables import stiffness_columns
from spinepipe.tables.schema import JOINT, MESSAGE, SPECIMEN, Column, Table, status
from spinepipe.units import COORDINATES

_JOINT = Column("joint", "text", "joint, or * for a stiffness shared by all")

STIFFNESS_OVER_LOAD_POINT = Table(
    "stiffness_over_load_point",
    "Stiffness fitted in the cohort's own joint poses with every load point moved: one row per "
    "specimen and load point, and per joint where stiffness is per_joint. A shift of 0, 0 is where "
    "the study puts the load.",
    ("specimen", "anterior_shift_mm", "superior_shift_mm", "joint"),
    (
        SPECIMEN,
        Column("anterior_shift_mm", "number", "load points moved anterior by", "mm"),
        Column("superior_shift_mm", "number", "load points moved superior by", "mm"),
        _JOINT,
        *stiffness_columns(),
        Column(
            "cost",
            "number",
            "sum of weight times squared error",
            "mm2, deg2",
            null="no stiffness was found",
            low=0.0,
        ),
        Column("degrees_of_freedom", "integer", "readings in the cost less unknowns"),
        Column(
            "allowed",
            "flag",
            "whether the readings allow this load point: the cost is not higher than the least of "
            "all points by more than the scatter explains (F limit, 95 %, readings independent)",
            null="no stiffness was found, or no reading is left to tell load points apart",
        ),
        status("fit"),
        MESSAGE,
    ),
)

_NOT_UNCERTAIN = "load points are taken as known (SD 0), or the 95 % range is open there"
_UNIT = "see unit"
_NO_FIT = "no stiffness was found"


def _value(name: str, meaning: str, null: str = _NO_FIT, unit: str = _UNIT) -> Column:
    return Column(name, "number", meaning, unit, null=null)


LOAD_POINT_EFFECT = Table(
    "load_point_effect",
    "What the load point does to each fitted stiffness: how it changes per mm, and its region with "
    "the load point as uncertain as the study says. One row per specimen, joint and coordinate.",
    ("specimen", "joint", "coordinate"),
    (
        SPECIMEN,
        _JOINT,
        Column("coordinate", "text", "coordinate whose stiffness was fitted", allowed=COORDINATES),
        Column("unit", "text", "unit of the stiffness"),
        _value("stated", "stiffness with the load where the study puts it"),
        _value("stated_low", "lower end of its 95 % region", f"{_NO_FIT}, or open"),
        _value("stated_high", "upper end of its 95 % region", f"{_NO_FIT}, or open"),
        *(
            _value(
                f"per_mm_{way}",
                f"change of the stiffness per mm that the load is moved {way}, between the "
                "neighbouring points on both sides",
                f"{_NO_FIT} there, or only one point this way",
                "unit per mm",
            )
            for way in ("anterior", "superior")
        ),
        _value("lowest", "least stiffness over the load points not excluded by the readings"),
        _value("highest", "largest stiffness over the load points not excluded by the readings"),
        _value("cost_lowest", "least cost of all points over that of the stated one", unit="ratio"),
        _value("cost_highest", "largest cost of all over that of the stated one", unit="ratio"),
        Column("points", "integer", "load points tried", low=1),
        Column("fitted", "integer", "of these: with a stiffness", low=0),
        Column(
            "allowed",
            "integer",
            "of these: allowed by the readings",
            null="no reading is left to tell load points apart",
            low=0,
        ),
        Column("anterior_sd_mm", "number", "SD of the load points anterior", "mm", low=0.0),
        Column("superior_sd_mm", "number", "SD of the load points superior", "mm", low=0.0),
        _value(
            "uncertain_median",
            "median of the stiffness with the load point uncertain",
            _NOT_UNCERTAIN,
        ),
        _value("uncertain_low", "lower end of its 95 % range then", _NOT_UNCERTAIN),
        _value("uncertain_high", "upper end of its 95 % range then", _NOT_UNCERTAIN),
        MESSAGE,
    ),
)

SPREAD_OVER_LANDMARK_SD = Table(
    "spread_over_landmark_sd",
    "How far joint frames scatter with landmarks of a given SD, nothing fitted: one row per "
    "specimen, SD, joint, quantity and coordinate.",
    ("specimen", "sd_mm", "joint", "quantity", "coordinate"),
    (
        SPECIMEN,
        Column("sd_mm", "number", "SD of every landmark per axis", "mm", low=0.0),
        JOINT,
        Column(
            "quantity",
            "text",
            "origin or orientation of the joint frame in ground",
            allowed=("origin", "orientation"),
        ),
        Column("coordinate", "text", "axis", allowed=COORDINATES),
        Column("unit", "text", "unit of the range", allowed=("mm", "deg")),
        Column("n", "integer", "landmark sets that define a frame", low=0),
        *(
            Column(name, "number", meaning, _UNIT, null="fewer than two frames", low=0.0)
            for name, meaning in (
                ("iqr", "interquartile range"),
                ("iqr_low", "lower end of its 95 % interval (bootstrap over landmark sets)"),
                ("iqr_high", "upper end of its 95 % interval"),
            )
        ),
    ),
)

TABLES = (STIFFNESS_OVER_LOAD_POINT, LOAD_POINT_EFFECT, SPREAD_OVER_LANDMARK_SD)
"""Of what was put in."""
