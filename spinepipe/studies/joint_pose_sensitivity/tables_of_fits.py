"""Tables of the bootstraps, filters, methods and landmark precision of a joint-pose study."""

from spinepipe.tables.schema import (
    JOINT,
    MESSAGE,
    POSE,
    SPECIMEN,
    Column,
    Table,
    length_or_angle,
    status,
    stiffness_unit,
)
from spinepipe.tables.shared import STATISTICS, against_paper
from spinepipe.units import COORDINATES

NO_FIT = "no stiffness was found"
LOADINGS = ("equilibrium", "quasi_static", "dynamic")
LOADING = Column(
    "loading",
    "text",
    "equilibrium: at rest; quasi_static: a time after the full load; dynamic: at the ramp's end",
    allowed=LOADINGS,
)


def _stiffness(prefix: str, meaning: str, null: str | None) -> tuple[Column, ...]:
    """Six columns ``<prefix><coordinate>_<unit>``."""
    columns = []
    for name in COORDINATES:
        suffix, unit = stiffness_unit(name)
        words = f"{meaning} against {name.replace('_', ' ')}"
        columns.append(Column(f"{prefix}{name}_{suffix}", "number", words, unit, null, low=0.0))
    return tuple(columns)


def _errors(meaning: str) -> tuple[Column, ...]:
    return tuple(
        Column(
            f"{name}_error_{length_or_angle(name)}",
            "number",
            meaning,
            length_or_angle(name),
            null=f"not measured, or {NO_FIT}",
            low=0.0,
        )
        for name in COORDINATES
    )


BOOTSTRAP = Table(
    "bootstrap",
    "Fits in the cohort's own joint poses from sampled start values and with sampled damping: one "
    "row per fit and joint.",
    ("specimen", "bootstrap", "loading", "set", "joint"),
    (
        SPECIMEN,
        Column("bootstrap", "text", "what is sampled", allowed=("start", "damping")),
        LOADING,
        Column("set", "integer", "number of the sampled set, from 0", low=0),
        JOINT,
        *_stiffness("start_", "stiffness the fit started from", None),
        Column(
            "damping_translation_n_s_per_m", "number", "damping of translations", "N s/m", low=0.0
        ),
        Column(
            "damping_rotation_nm_s_per_rad", "number", "damping of rotations", "N m s/rad", low=0.0
        ),
        *_stiffness("", "stiffness of this joint", NO_FIT),
        *_errors(
            "mean absolute error of this joint's motion over the readings of steps that enter "
            "the cost"
        ),
        Column(
            "cost", "number", "sum of weight times squared error", "mm2, deg2", null=NO_FIT, low=0.0
        ),
        Column("evaluations", "integer", "evaluations of the fit", low=0),
        status("fit"),
        MESSAGE,
    ),
)

SUCCESS = Table(
    "success",
    "Which fits the filters of the study keep: one row per specimen and pose.",
    ("specimen", "pose"),
    (
        SPECIMEN,
        POSE,
        Column("solved", "flag", "the fit ended with a stiffness"),
        Column(
            "near_start_any",
            "flag",
            "one free stiffness at least ended near its start (success.near_start_percent)",
        ),
        Column("near_start_all", "flag", "all free stiffnesses ended near their start"),
        Column(
            "failed", "flag", "solved, but near its start by the study's rule (success.failed_when)"
        ),
        Column(
            "outlier",
            "flag",
            "a free stiffness ended far above its start (success.outlier_times_start)",
        ),
        Column("reduced", "flag", "kept in the reduced dataset: solved, not failed, no outlier"),
    ),
)

COUNTS = Table(
    "counts",
    "How many fits each filter takes: one row per specimen, part of the study and loading.",
    ("specimen", "part", "loading"),
    (
        SPECIMEN,
        Column(
            "part",
            "text",
            "part of the study",
            allowed=("poses", "start_bootstrap", "damping_bootstrap"),
        ),
        LOADING,
        *(
            Column(name, "integer", meaning, low=0)
            for name, meaning in (
                ("fits", "fits tried"),
                ("solved", "fits that ended with a stiffness"),
                ("near_start_any", "of these: one free stiffness or more near its start"),
                ("near_start_all", "of these: all free stiffnesses near their start"),
                ("outliers", "of these: a free stiffness far above its start"),
                ("reduced", "fits in the reduced dataset"),
            )
        ),
    ),
)

NO_VALUE = "nothing is in this dataset"


def _value(name: str, meaning: str) -> Column:
    return Column(name, "number", meaning, "see unit", null=NO_VALUE)


LOWER_ENDS = ("lower_end_low_quartile", "lower_end_median", "lower_end_high_quartile")
_NO_REGION = "not a stiffness, or fits of a bootstrap, whose regions are not looked for"
_NO_ENDS = f"{_NO_REGION}, or more than one fit in ten is open below"

SUMMARY = Table(
    "summary",
    "Medians and spreads as papers print them: one row per part of the study, loading, dataset, "
    "quantity, joint and coordinate.",
    ("specimen", "part", "loading", "dataset", "quantity", "joint", "coordinate"),
    (
        SPECIMEN,
        Column(
            "part",
            "text",
            "part of the study",
            allowed=("poses", "start_bootstrap", "damping_bootstrap"),
        ),
        LOADING,
        Column(
            "dataset",
            "text",
            "all: with a result; reduced: kept by the filters; best: the best stiffness sets' "
            "own poses",
            allowed=("all", "reduced", "best"),
        ),
        Column(
            "quantity",
            "text",
            "stiffness; error: absolute error of predicted motion, mean over readings; origin, "
            "orientation: of the joint frame in ground",
            allowed=("stiffness", "error", "origin", "orientation"),
        ),
        Column("joint", "text", "joint, or * where all joints share the value"),
        Column("coordinate", "text", "coordinate or axis", allowed=COORDINATES),
        Column("unit", "text", "unit of the values"),
        Column("n", "integer", "values", low=0),
        _value("median", "median"),
        _value("low_quartile", "25th percentile"),
        _value("high_quartile", "75th percentile"),
        _value("iqr", "interquartile range"),
        _value("minimum", "smallest"),
        _value("maximum", "largest"),
        _value("range", "largest less smallest"),
        Column(
            "percent_of_measured",
            "number",
            "median error as a share of the median size of the measured motion",
            "%",
            null="not an error, or nothing was measured",
            low=0.0,
        ),
        Column(
            "open_share",
            "number",
            "share of the fits whose region is open at a bound: their value is no more than a "
            "value that the data do not exclude",
            null=_NO_REGION,
            low=0.0,
            high=1.0,
        ),
        *(
            Column(name, "number", f"{which} of the lower ends of regions", "see unit", _NO_ENDS)
            for name, which in zip(
                LOWER_ENDS, ("25th percentile", "median", "75th percentile"), strict=True
            )
        ),
    ),
)

METHOD_FITS = Table(
    "method_fits",
    "The same calibrations done in several ways: one row per specimen, pose and method.",
    ("specimen", "pose", "method"),
    (
        SPECIMEN,
        POSE,
        Column("method", "text", "way of fitting, see the study's page"),
        *_stiffness("", "stiffness shared by all joints", NO_FIT),
        Column(
            "cost", "number", "sum of weight times squared error", "mm2, deg2", null=NO_FIT, low=0.0
        ),
        Column("evaluations", "integer", "runs of the model", low=0),
        Column(
            "derivative_error",
            "number",
            "error of the cost's derivative at the start, relative to its size",
            null="it could not be compared",
            low=0.0,
        ),
        Column(
            "near_start_any",
            "flag",
            "one free stiffness at least ended near its start",
            null=NO_FIT,
        ),
        Column(
            "near_start_all", "flag", "all free stiffnesses ended near their start", null=NO_FIT
        ),
        Column("claims_success", "flag", "the optimiser itself says that it found an optimum"),
        status("fit"),
        MESSAGE,
    ),
)

SUCCESS_BY_METHOD = Table(
    "success_by_method",
    "Why fits are lost: what each way of fitting makes of the same poses. One row per specimen "
    "and method.",
    ("specimen", "method"),
    (
        SPECIMEN,
        Column("method", "text", "way of fitting, see the study's page"),
        Column("fits", "integer", "fits tried", low=0),
        Column("solved", "integer", "fits that ended with a usable status", low=0),
        Column(
            "near_start_any",
            "integer",
            "of these: one free stiffness or more near its start",
            low=0,
        ),
        Column("near_start_all", "integer", "of these: all near their start", low=0),
        Column("claimed", "integer", "fits whose optimiser says that it found an optimum", low=0),
        Column(
            "successful", "integer", "solved fits not near the start by the study's rule", low=0
        ),
        Column("success", "number", "share of successful fits", low=0.0, high=1.0),
        Column(
            "success_low", "number", "lower end of its 95 % interval (Wilson)", low=0.0, high=1.0
        ),
        Column(
            "success_high", "number", "upper end of its 95 % interval (Wilson)", low=0.0, high=1.0
        ),
        Column(
            "arrived",
            "integer",
            "fits whose cost is within 1 % of the least that any method found for the pose",
            low=0,
        ),
        Column("evaluations_median", "number", "runs of the model per fit, median", low=0.0),
        Column("evaluations_largest", "integer", "runs of the model per fit, most", low=0),
        Column(
            "derivative_error_median",
            "number",
            "error of the cost's derivative at the start, relative, median",
            null="it could not be compared",
            low=0.0,
        ),
        Column(
            "derivative_error_largest",
            "number",
            "error of the cost's derivative at the start, relative, largest",
            null="it could not be compared",
            low=0.0,
        ),
    ),
)

_WHOSE = Column(
    "stiffness",
    "text",
    "calibrated: the pose's own fit; nominal: that of the cohort's own pose",
    allowed=("calibrated", "nominal"),
)
_SD = Column("sd_mm", "number", "SD of every landmark per axis", "mm", low=0.0)

PRECISION_ERRORS = Table(
    "precision_errors",
    "Errors with landmarks of a given precision: one row per specimen, SD, pose and stiffness.",
    ("specimen", "sd_mm", "pose", "stiffness"),
    (
        SPECIMEN,
        _SD,
        POSE,
        _WHOSE,
        Column(
            "translation_error_mm",
            "number",
            "largest absolute error of a translation",
            "mm",
            null="not measured, or no pose was found",
            low=0.0,
        ),
        Column(
            "rotation_error_deg",
            "number",
            "largest absolute error of a rotation",
            "deg",
            null="not measured, or no pose was found",
            low=0.0,
        ),
        *(
            Column(
                f"nominal_{kind}_error_{unit}",
                "number",
                f"largest absolute error of a {kind} with the landmarks as they are and the "
                "stiffness that fits these; the same in all rows of a specimen",
                unit,
                null="not measured, or no fit",
                low=0.0,
            )
            for kind, unit in (("translation", "mm"), ("rotation", "deg"))
        ),
        status("solve"),
        MESSAGE,
    ),
)

LANDMARK_PRECISION = Table(
    "landmark_precision",
    "How errors grow with the landmarks' SD: one row per specimen, stiffness, kind of motion and "
    "SD. Poses without a result count as above the limit.",
    ("specimen", "stiffness", "motion", "sd_mm"),
    (
        SPECIMEN,
        _WHOSE,
        Column("motion", "text", "kind of motion", allowed=("translation", "rotation")),
        _SD,
        Column("unit", "text", "unit of the errors", allowed=("mm", "deg")),
        Column("n", "integer", "poses", low=0),
        Column("without_result", "integer", "poses without a result", low=0),
        _value("median", "median of the largest error"),
        _value("p90", "90th percentile of the largest error"),
        _value("p95", "95th percentile of the largest error"),
        _value("largest", "largest error"),
        Column("limit", "number", "limit asked for (landmark_precision of the study)", "see unit"),
        Column("below", "number", "share of poses below the limit", low=0.0, high=1.0),
        Column("below_low", "number", "lower end of its 95 % interval (Wilson)", low=0.0, high=1.0),
        Column(
            "below_high", "number", "upper end of its 95 % interval (Wilson)", low=0.0, high=1.0
        ),
    ),
)

REQUIRED_PRECISION = Table(
    "required_precision",
    "The largest landmark SD at which the asked share of poses stays below the limit, straight "
    "between the sampled SDs: one row per specimen, stiffness and kind of motion.",
    ("specimen", "stiffness", "motion"),
    (
        SPECIMEN,
        _WHOSE,
        Column(
            "motion",
            "text",
            "kind of motion; both: below both limits",
            allowed=("translation", "rotation", "both"),
        ),
        Column("share", "number", "share of poses asked for", low=0.0, high=1.0),
        Column("n", "integer", "poses per SD", low=0),
        *(
            Column(
                name,
                "number",
                meaning,
                "mm",
                low=0.0,
                null="outside the sampled SDs, or not told, see message",
            )
            for name, meaning in (
                ("sd_mm", "largest SD that will do"),
                ("sd_low_mm", "lower end of its 95 % interval (bootstrap over poses)"),
                ("sd_high_mm", "upper end of its 95 % interval"),
            )
        ),
        Column(
            "nominal_share",
            "number",
            "largest error with the landmarks as they are, fitted, over its limit; from 1 on the "
            "model misses the limit whatever the landmarks, and no SD is given",
            null="no fit in the cohort's own joint pose: no SD is given",
            low=0.0,
        ),
        MESSAGE,
    ),
)

AGAINST_GOULD_2024A = against_paper("against_gould_2024a")

TABLES = (
    *(BOOTSTRAP, SUCCESS, COUNTS, SUMMARY, METHOD_FITS, SUCCESS_BY_METHOD, PRECISION_ERRORS),
    *(LANDMARK_PRECISION, REQUIRED_PRECISION, STATISTICS, AGAINST_GOULD_2024A),
)
"""Of fits, and what is made of them."""
