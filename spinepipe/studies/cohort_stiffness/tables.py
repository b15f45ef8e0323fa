"""Tables of studies of kind cohort_stiffness: fits, their errors, and what follows from them."""

from spinepipe.studies.cohort_stiffness.claims import HOLDS
from spinepipe.studies.cohort_stiffness.representations import EVERY, NAMES, POOLED
from spinepipe.studies.cohort_stiffness.tables_of_covariates import COVARIATES_TABLE
from spinepipe.studies.cohort_stiffness.tables_of_laws import GROWTH, GROWTH_SPREADS
from spinepipe.tables.schema import JOINT, MESSAGE, SPECIMEN, Column, Table, status
from spinepipe.tables.shared import STATISTICS, against_paper
from spinepipe.units import COORDINATES

SOURCES = ("literature", "own", "others_median", "others_pooled")
STAGES = ("literature", "fitted", "left_out_case", "left_out_specimen")
NO_POSE = "not measured, or no pose was found"

REPRESENTATION = Column(
    "representation",
    "text",
    "; ".join(f"{one.name}: {one.about}" for one in EVERY),
    allowed=NAMES,
)
FITTED_TO = Column(
    "fitted_to",
    "text",
    "load cases it was fitted to: a test, all, all_but_<test>, or nothing (literature)",
)
SOURCE = Column(
    "source",
    "text",
    "whose motion it was fitted to: own, others_median (median of the other specimens' own fits), "
    "others_pooled (what the hierarchical fit of the others expects of a new specimen), literature",
    allowed=SOURCES,
)
STAGE = Column(
    "stage",
    "text",
    "literature: not fitted at all; fitted: to these readings; left_out_case: to other load cases "
    "of this specimen; left_out_specimen: to other specimens",
    allowed=STAGES,
)
TEST = Column("test", "text", "load case")
COORDINATE = Column("coordinate", "text", "coordinate of the joint", allowed=COORDINATES)


NO_FIT = "no stiffness was found"
LITERATURE = "taken from the literature or from other specimens, not fitted"
CORRELATED = "readings zeroed at step 0 in the published cost, which takes them for independent"

_STIFFNESS_UNIT = Column("unit", "text", "unit of the stiffness", allowed=("N/m", "N m/rad"))
_MOTION_UNIT = Column("unit", "text", "unit of the motion", allowed=("mm", "deg"))


def _stiffness(name: str, meaning: str, null: str | None) -> Column:
    return Column(name, "number", meaning, "N/m or N m/rad, see unit", null, low=0.0)


_OPEN = "the region is open there, or there is no standard error"

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
        _stiffness(
            "low",
            "lower end of the 95 % region: all other unknowns fitted anew (profile likelihood); "
            "of pooled fits and new specimens an interval of the logarithm",
            _OPEN,
        ),
        _stiffness("high", "upper end of the 95 % region", _OPEN),
        *(
            Column(
                f"open_{side}",
                "flag",
                f"whether the region reaches the {which} bound of the fit",
                null="no region was looked for",
            )
            for side, which in (("below", "lower"), ("above", "upper"))
        ),
        Column(
            "identifiable",
            "flag",
            "whether the data hold this stiffness: its standard error is small and its region "
            "open at neither bound; where false do not believe it. Of a "
            "pooled fit: whether its own readings do, more than the cohort",
            null=LITERATURE,
        ),
        Column(
            "at_bound", "text", "whether the fit ended at a bound", allowed=("no", "lower", "upper")
        ),
        *GROWTH,
        status("fit"),
        MESSAGE,
    ),
)


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
        Column(
            "effective_unknowns",
            "number",
            "unknowns that the data decide about: all of a plain fit, fewer of a pooled one, or of "
            "one with nuisances that their priors hold",
            null=NO_FIT,
            low=0.0,
        ),
        Column(
            "cost",
            "number",
            "sum of squared errors in SDs of one reading, or in deg2 for the published cost; of "
            "readings alone, without priors",
            null=NO_FIT,
            low=0.0,
        ),
        Column(
            "scatter",
            "number",
            "root of cost over readings less unknowns inside their bounds (effective ones of a "
            "pooled fit), each prior one reading more: 1 where errors are as large as declared",
            null=f"{NO_FIT}, or no more readings than unknowns",
            low=0.0,
        ),
        _criterion("log_likelihood", "logarithm of the likelihood, scatter estimated"),
        _criterion("aicc", "Akaike's criterion, corrected for few readings; less is better"),
        _criterion("bic", "Schwarz's criterion; less is better"),
        Column("iterations", "integer", "iterations of the best start", low=0),
        Column("evaluations", "integer", "evaluations of all starts", low=0),
        Column("n_optima", "integer", "distinct optima found from all starts", low=0),
        status("fit"),
        MESSAGE,
        Column(
            "degrees_of_freedom",
            "integer",
            "readings, and priors, less unknowns inside their bounds",
            null=f"{NO_FIT}, or a pooled one",
        ),
    ),
)


def _motion(name: str, meaning: str, low: float | None = 0.0, null: str | None = NO_POSE) -> Column:
    return Column(name, "number", meaning, "mm or deg, see unit", null, low=low)


MAE_IN_DEG = ("mae", "low_quartile", "high_quartile", "largest_motion")
"""Columns of `MAE` that stand there in deg as well, under the names that they had at first."""


def _in_deg(name: str) -> Column:
    null = "a translation, or no result"
    return Column(f"{name}_deg", "number", f"{name}, of rotations", "deg", null, low=0.0)


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
        Column(
            "loaded",
            "flag",
            "whether the test's main moment drives this coordinate; its main "
            "force where that of the moment is not read",
        ),
        _MOTION_UNIT,
        Column("readings", "integer", "readings compared", low=0),
        _motion("bias", "mean error", low=None),
        _motion("mae", "mean absolute error"),
        _motion("rmse", "root mean square error"),
        _motion("peak_error", "mean error at the largest load", low=None),
        _motion("measured", "mean size of the measured motion", null=None),
        _motion(
            "measured_peak", "mean measured motion at the largest load", None, "not measured there"
        ),
        status("solve"),
        MESSAGE,
    ),
)


def _spread(name: str, meaning: str) -> Column:
    return Column(name, "number", meaning, null="cannot be told apart with this cohort", low=0.0)


POOLING = Table(
    "pooling",
    "Partial pooling: what the hierarchical fit found out about the cohort, one row per "
    "representation, load cases fitted to, specimen left out and coordinate. Spreads are SDs of "
    "the logarithm of stiffness.",
    ("representation", "fitted_to", "without", "coordinate"),
    (
        Column("representation", "text", "see stiffness", allowed=POOLED),
        FITTED_TO,
        Column("without", "text", "specimen left out, or nobody"),
        COORDINATE,
        _STIFFNESS_UNIT,
        _stiffness("centre", "stiffness in the middle of the cohort", NO_FIT),
        _spread("between_levels", "SD between levels, the same in all specimens"),
        _spread("between_specimens", "SD between specimens, the same at all levels"),
        _spread("between_joints", "SD of what is left: each joint for itself"),
        *GROWTH_SPREADS,
        Column("specimens", "integer", "specimens it was fitted to", low=0),
        Column("scatter", "number", "scatter of readings, see fits", null=NO_FIT, low=0.0),
        Column(
            "effective_unknowns",
            "number",
            "unknowns that the data decide about, all coordinates and specimens",
            null=NO_FIT,
            low=0.0,
        ),
        Column(
            "log_likelihood",
            "number",
            "logarithm of the marginal likelihood",
            null=f"{NO_FIT}, or {CORRELATED}",
        ),
        Column("iterations", "integer", "iterations", low=0),
        status("fit"),
        MESSAGE,
    ),
)

SIGN_CHECKS = Table(
    "sign_checks",
    "Does each joint move with the load, and as far as a joint can? One row per specimen, test and "
    "joint, in the loaded coordinate; a flipped sign and a wrong unit show here.",
    ("specimen", "test", "joint"),
    (
        SPECIMEN,
        TEST,
        JOINT,
        COORDINATE,
        Column("readings", "integer", "readings compared", low=0),
        Column(
            "measured_over_expected",
            "number",
            "slope of the measured on the expected motion (published stiffness): 1 as "
            "expected, negative against the load",
            null="not measured, or no pose was found",
        ),
        Column(
            "standard_error",
            "number",
            "standard error of the slope, all cycles together",
            null="not measured, or too few readings",
            low=0.0,
        ),
        Column(
            "verdict",
            "text",
            "what it looks like; flipped: in all readings together, or in a "
            "cycle that message names; implausible: more than five times, or less than a fifth, of "
            "what published stiffness gives",
            allowed=("as_expected", "flipped", "implausible", "undecided"),
        ),
        MESSAGE,
    ),
)


MAE = Table(
    "mae",
    "Mean absolute error in the loaded coordinate, over the joints of each specimen: median and "
    "quartiles over specimens, and as a percentage of the largest mean motion of a specimen.",
    ("representation", "fitted_to", "source", "test", "coordinate", "steps"),
    (
        REPRESENTATION,
        FITTED_TO,
        SOURCE,
        STAGE,
        TEST,
        COORDINATE,
        Column(
            "steps",
            "text",
            "at the largest load, or the mean over all load steps",
            allowed=("peak", "all"),
        ),
        Column("specimens", "integer", "specimens with a result", low=0),
        _MOTION_UNIT,
        _motion("mae", "median over specimens"),
        _motion("low_quartile", "lower quartile over specimens"),
        _motion("high_quartile", "upper quartile over specimens"),
        _motion(
            "largest_motion",
            "largest over specimens of the mean measured motion over joints",
            null="not measured",
        ),
        *(_in_deg(name) for name in MAE_IN_DEG),
        Column(
            "mae_percent",
            "number",
            "median as a percentage of the largest motion",
            "percent",
            null=NO_POSE,
            low=0.0,
        ),
    ),
)

CRITERIA = ("fitted", "left_out_specimen", "left_out_case", "aicc", "bic")

RANKING = Table(
    "ranking",
    "Representations in order: by error of what they were fitted to, by error of what was held "
    "out, and by information criteria. Less is better in all of them. Stiffness from the "
    "literature, which is never fitted, stands beside in every error.",
    ("criterion", "representation", "source"),
    (
        Column(
            "criterion",
            "text",
            "fitted, left_out_specimen, left_out_case: root mean square error of all measured "
            "rotations of a specimen (of its translations where forces drive these and no load "
            "drives a rotation), mean over specimens; left_out_case: each load case by the "
            "fit to all others, else fits to all load cases; aicc, bic: sums over specimens, "
            "fits to all load cases, the spreads of a pooled fit counted once",
            allowed=CRITERIA,
        ),
        REPRESENTATION,
        SOURCE,
        Column("rank", "integer", "1 is best", null="no result", low=1),
        Column(
            "unit",
            "text",
            "unit of the values; none for information criteria",
            allowed=("deg", "mm", ""),
        ),
        Column("value", "number", "the criterion", null="no result"),
        Column(
            "standard_error",
            "number",
            "standard error over specimens",
            null="no result, or fewer than two specimens",
            low=0.0,
        ),
        Column(
            "worse_than_best", "number", "value less that of the best", null="no result", low=0.0
        ),
        Column(
            "worse_standard_error",
            "number",
            "standard error of worse_than_best, over the differences of the specimens",
            null="the best itself, no result, or fewer than two specimens",
            low=0.0,
        ),
        Column(
            "p",
            "number",
            "Wilcoxon's signed rank test of the specimens' values against the best's. The best was "
            "chosen after looking, by these very values, and nothing is corrected for that: p is "
            "too small, and a small one is no proof that the best is better",
            null="the best itself, an information criterion, no result, or too few specimens",
            low=0.0,
            high=1.0,
        ),
        Column(
            "specimens",
            "integer",
            "specimens with a result in every representation, which alone are compared",
            low=0,
        ),
        MESSAGE,
    ),
)

FINDINGS = Table(
    "findings",
    "What the study says to the findings of Gould et al. 2024b, and to those hoped for here, each "
    "with its number. Decided beside each other: p is corrected for their number.",
    ("finding",),
    (
        Column("finding", "text", "short name"),
        Column("statement", "text", "what is claimed, as a sentence"),
        Column("quantity", "text", "what the value is, and what kind its interval is of"),
        Column("value", "number", "value", null="there is no result"),
        Column("low", "number", "lower end of its 95 % interval", null="there is none"),
        Column("high", "number", "upper end of its 95 % interval", null="there is none"),
        Column("unit", "text", "unit of the value; none for shares and ratios"),
        Column(
            "p",
            "number",
            "p value of its own test, of no effect",
            null="there is none",
            low=0.0,
            high=1.0,
        ),
        Column(
            "p_no",
            "number",
            "p value that the effect matters, against one too little to matter (a share below "
            "0.1, a ratio within 1.1 of 1): below 0.05 where the whole 95 % interval is so little",
            null="there is no such test",
            low=0.0,
            high=1.0,
        ),
        Column(
            "p_holm",
            "number",
            "p, or p_no of a no by it and where it is the smaller one of an undecided claim, "
            "corrected for all findings of the study that have one (Holm, Shaffer); it decides",
            null="there is none",
            low=0.0,
            high=1.0,
        ),
        Column(
            "specimens",
            "integer",
            "specimens that the value is of",
            null="all of the study, joint by joint or in tests of their own",
            low=0,
        ),
        Column(
            "holds",
            "text",
            "yes: p_holm below the study's significance, on the claimed side; no: as sure, on the "
            "other side, or surely too little to matter (of load cases by size alone, see "
            "message); undecided: this cohort cannot tell, as with fewer than 3 "
            "specimens; circular: true by construction, fitted to the readings it is judged by, or "
            "put into a made-up cohort; not_asked: the study leaves it out",
            allowed=HOLDS,
        ),
        MESSAGE,
    ),
)

AGAINST_GOULD_2024B = against_paper("against_gould_2024b")

IN_FOLDERS = ("specimen", "representation", "fitted_to")
"""Columns that the folders of a file of one fit carry."""

TABLES = (
    *(STIFFNESS, FITS, ERRORS, POOLING, SIGN_CHECKS),
    *(MAE, RANKING, STATISTICS, FINDINGS, AGAINST_GOULD_2024B),
    COVARIATES_TABLE,
)
"""All tables of the kind."""
