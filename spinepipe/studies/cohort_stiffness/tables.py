"""Tables of studies of kind cohort_stiffness that are made of job files: fits and their errors."""

from spinepipe.tables.cohort_stiffness_columns import (
    COORDINATE,
    FITTED_TO,
    NO_POSE,
    REPRESENTATION,
    SOURCE,
    STAGE,
    TEST,
)
from spinepipe.tables.columns import JOINT, MESSAGE, SPECIMEN, status
from spinepipe.tables.schema import Column, Table

NO_FIT = "no stiffness was found"
LITERATURE = "taken from the literature or from other specimens, not fitted"
CORRELATED = "readings zeroed at step 0 in the published cost, which takes them for independent"

_STIFFNESS_UNIT = Column("unit", "text", "unit of the stiffness", allowed=("N/m", "N m/rad"))
_MOTION_UNIT = Column("unit", "text", "unit of the motion", allowed=("mm", "deg"))


def _stiffness(name: str, meaning: str, null: str | None) -> Column:
    return Column(name, "number", meaning, "N/m or N m/rad, see unit", null, low=0.0)


STIFFNESS = Table(
    "stiffness",
    "Stiffness: one row per specimen, representation, load cases fitted to, source, joint and "
    "fitted coordinate.",
    ("specimen", "representation", "fitted_to", "source", "joint", "coordinate"),
    (
        SPECIMEN,
        REPRESENTATION,
        FITTED_TO,
        SOURCE,
        JOINT,
        COORDINATE,
        _STIFFNESS_UNIT,
        _stiffness("stiffness", "stiffness of this joint against this coordinate", NO_FIT),
        _stiffness(
            "standard_error",
            "standard error of the stiffness, to first order; of a prediction for a new specimen "
            "its standard deviation",
            "not fitted, at a bound, not constrained by the data, or expected from one specimen",
        ),
        _stiffness("low", "lower end of the 95 % interval, of the logarithm: Student's t for fits "
                   "of one specimen and for new specimens, normal for specimens of a pooled fit",
                   "no standard error"),
        _stiffness("high", "upper end of the 95 % interval", "no standard error"),
        Column("identifiable", "flag",
               "whether the data constrain this stiffness; where false do not believe it. Of a "
               "pooled fit: whether its own readings do, more than the cohort",
               null=LITERATURE),
        Column("at_bound", "text", "whether the fit ended at a bound",
               allowed=("no", "lower", "upper")),
        status("fit"),
        MESSAGE,
    ),
)  # fmt: skip


def _criterion(name: str, meaning: str) -> Column:
    return Column(name, "number", meaning, null=f"{NO_FIT}, too few readings, or {CORRELATED}")


FITS = Table(
    "fits",
    "Fits: one row per specimen, representation and load cases fitted to.",
    ("specimen", "representation", "fitted_to"),
    (
        SPECIMEN,
        REPRESENTATION,
        FITTED_TO,
        Column("readings", "integer", "readings in the cost", low=0),
        Column("unknowns", "integer", "unknowns of the fit", low=0),
        Column("effective_unknowns", "number",
               "unknowns that the data decide about: all of a plain fit, fewer of a pooled one",
               null=NO_FIT, low=0.0),
        Column("cost", "number",
               "sum of squared errors in SDs of one reading, or in deg2 for the published cost",
               null=NO_FIT, low=0.0),
        Column("scatter", "number",
               "root of cost over readings less unknowns inside their bounds (effective ones of a "
               "pooled fit): 1 where errors are as large as declared",
               null=f"{NO_FIT}, or no more readings than unknowns", low=0.0),
        _criterion("log_likelihood", "logarithm of the likelihood, scatter estimated"),
        _criterion("aicc", "Akaike's criterion, corrected for few readings; less is better"),
        _criterion("bic", "Schwarz's criterion; less is better"),
        Column("iterations", "integer", "iterations of the best start", low=0),
        Column("evaluations", "integer", "evaluations of all starts", low=0),
        Column("n_optima", "integer", "distinct optima found from all starts", low=0),
        status("fit"),
        MESSAGE,
    ),
)  # fmt: skip


def _motion(name: str, meaning: str, low: float | None = 0.0, null: str | None = NO_POSE) -> Column:
    return Column(name, "number", meaning, "mm or deg, see unit", null, low=low)


ERRORS = Table(
    "errors",
    "Errors of predicted motion, predicted less measured: one row per specimen, stiffness, test, "
    "joint and measured coordinate. Means are over load steps and cycles.",
    ("specimen", "representation", "fitted_to", "source", "test", "joint", "coordinate"),
    (
        SPECIMEN,
        REPRESENTATION,
        FITTED_TO,
        SOURCE,
        STAGE,
        TEST,
        JOINT,
        COORDINATE,
        Column("loaded", "flag", "whether the test's main moment drives this coordinate"),
        _MOTION_UNIT,
        Column("readings", "integer", "readings compared", low=0),
        _motion("bias", "mean error", low=None),
        _motion("mae", "mean absolute error"),
        _motion("rmse", "root mean square error"),
        _motion("peak_error", "mean error at the largest load", low=None),
        _motion("measured", "mean size of the measured motion", null=None),
        _motion("measured_peak", "mean measured motion at the largest load", None,
                "not measured there"),
        status("solve"),
        MESSAGE,
    ),
)  # fmt: skip


def _spread(name: str, meaning: str) -> Column:
    return Column(name, "number", meaning, null="cannot be told apart with this cohort", low=0.0)


POOLING = Table(
    "pooling",
    "Partial pooling: what the hierarchical fit found out about the cohort, one row per load cases "
    "fitted to, specimen left out and coordinate. Spreads are SDs of the logarithm of stiffness.",
    ("fitted_to", "without", "coordinate"),
    (
        FITTED_TO,
        Column("without", "text", "specimen left out, or nobody"),
        COORDINATE,
        _STIFFNESS_UNIT,
        _stiffness("centre", "stiffness in the middle of the cohort", NO_FIT),
        _spread("between_levels", "SD between levels, the same in all specimens"),
        _spread("between_specimens", "SD between specimens, the same at all levels"),
        _spread("between_joints", "SD of what is left: each joint for itself"),
        Column("specimens", "integer", "specimens it was fitted to", low=0),
        Column("scatter", "number", "scatter of readings, see fits", null=NO_FIT, low=0.0),
        Column("effective_unknowns", "number", "unknowns that the data decide about, all "
               "coordinates and specimens", null=NO_FIT, low=0.0),
        Column("log_likelihood", "number", "logarithm of the marginal likelihood",
               null=f"{NO_FIT}, or {CORRELATED}"),
        Column("iterations", "integer", "iterations", low=0),
        status("fit"),
        MESSAGE,
    ),
)  # fmt: skip

SIGN_CHECKS = Table(
    "sign_checks",
    "Does each joint move with the load? One row per specimen, test and joint, in the loaded "
    "coordinate; a sign flipped in the measurement shows here.",
    ("specimen", "test", "joint"),
    (
        SPECIMEN,
        TEST,
        JOINT,
        COORDINATE,
        Column("readings", "integer", "readings compared", low=0),
        Column("measured_over_expected", "number",
               "slope of the measured on the expected motion (published stiffness): 1 as "
               "expected, negative against the load", null="not measured, or no pose was found"),
        Column("standard_error", "number", "standard error of the slope, all cycles together",
               null="not measured, or too few readings", low=0.0),
        Column("verdict", "text", "what it looks like; flipped: in all readings together, or in a "
               "cycle that message names",
               allowed=("as_expected", "flipped", "undecided")),
        MESSAGE,
    ),
)  # fmt: skip
