"""Tables of studies of kind cohort_stiffness that are computed from its fits and their errors."""

from spinepipe.tables.cohort_stiffness_columns import (
    COORDINATE,
    FITTED_TO,
    NO_POSE,
    REPRESENTATION,
    SOURCE,
    STAGE,
    TEST,
)
from spinepipe.tables.columns import MESSAGE
from spinepipe.tables.schema import Column, Table

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
        Column("steps", "text", "at the largest load, or the mean over all load steps",
               allowed=("peak", "all")),
        Column("specimens", "integer", "specimens with a result", low=0),
        Column("mae_deg", "number", "median over specimens", "deg", null=NO_POSE, low=0.0),
        Column("low_quartile_deg", "number", "lower quartile over specimens", "deg",
               null=NO_POSE, low=0.0),
        Column("high_quartile_deg", "number", "upper quartile over specimens", "deg",
               null=NO_POSE, low=0.0),
        Column("largest_motion_deg", "number",
               "largest over specimens of the mean measured motion over joints", "deg",
               null="not measured", low=0.0),
        Column("mae_percent", "number", "median as a percentage of the largest motion", "percent",
               null=NO_POSE, low=0.0),
    ),
)  # fmt: skip

CRITERIA = ("fitted", "left_out_specimen", "left_out_case", "aicc", "bic")

RANKING = Table(
    "ranking",
    "Representations in order: by error of what they were fitted to, by error of what was held "
    "out, and by information criteria. Less is better in all of them. Stiffness from the "
    "literature, which is never fitted, stands beside in every error.",
    ("criterion", "representation", "source"),
    (
        Column("criterion", "text",
               "fitted, left_out_specimen, left_out_case: root mean square error of all measured "
               "rotations of a specimen, mean over specimens; left_out_case: each load case by the "
               "fit to all others, else fits to all load cases; aicc, bic: sums over specimens, "
               "fits to all load cases, the spreads of a pooled fit counted once",
               allowed=CRITERIA),
        REPRESENTATION,
        SOURCE,
        Column("rank", "integer", "1 is best", null="no result", low=1),
        Column("unit", "text", "unit of the values; none for information criteria",
               allowed=("deg", "")),
        Column("value", "number", "the criterion", null="no result"),
        Column("standard_error", "number", "standard error over specimens",
               null="no result, or fewer than two specimens", low=0.0),
        Column("worse_than_best", "number", "value less that of the best", null="no result",
               low=0.0),
        Column("worse_standard_error", "number",
               "standard error of worse_than_best, over the differences of the specimens",
               null="the best itself, no result, or fewer than two specimens", low=0.0),
        Column("p", "number",
               "Wilcoxon's signed rank test of the specimens' values against the best's, "
               "uncorrected", null="the best itself, an information criterion, no result, or "
               "too few specimens", low=0.0, high=1.0),
        Column("specimens", "integer", "specimens with a result in every representation, which "
               "alone are compared", low=0),
        MESSAGE,
    ),
)  # fmt: skip

FINDINGS = Table(
    "findings",
    "What the study says to the findings of Gould et al. 2024b, and to those hoped for here, each "
    "with its number. Decided test by test: p values are not corrected for their number.",
    ("finding",),
    (
        Column("finding", "text", "short name"),
        Column("statement", "text", "what is claimed, as a sentence"),
        Column("quantity", "text", "what the value is, and what kind its interval is of"),
        Column("value", "number", "value", null="there is no result"),
        Column("low", "number", "lower end of its 95 % interval", null="there is none"),
        Column("high", "number", "upper end of its 95 % interval", null="there is none"),
        Column("unit", "text", "unit of the value; none for shares and ratios"),
        Column("p", "number", "p value of the test that decides", null="there is none", low=0.0,
               high=1.0),
        Column("holds", "text",
               "yes: p below the study's significance, on the claimed side; no: as sure, on the "
               "other side, or surely too little to matter; undecided: this cohort cannot tell",
               allowed=("yes", "no", "undecided")),
        MESSAGE,
    ),
)  # fmt: skip
