"""Table of covariates: what of the specimens stiffness goes with."""

from spinepipe.studies.cohort_stiffness.settings import COVARIATES
from spinepipe.tables.schema import MESSAGE, Column, Table
from spinepipe.units import COORDINATES

VERDICTS = ("yes", "undecided", "refused")

_NONE = "refused: too few specimens, or nothing to tell it by; see message"


def _number(name: str, meaning: str, low: float | None = None) -> Column:
    return Column(name, "number", meaning, null=_NONE, low=low)


COVARIATES_TABLE = Table(
    "covariates",
    "Does stiffness go with age, sex or degeneration? One row per coordinate and covariate of one "
    "regression of the logarithm of stiffness, levels taken out, on all covariates together; "
    "specimens are its sample. An association, and no cause.",
    ("coordinate", "covariate"),
    (
        Column("coordinate", "text", "coordinate of the joint", allowed=COORDINATES),
        Column("covariate", "text", "column of specimens.csv", allowed=COVARIATES),
        Column("step", "text", "what factor is the effect of, such as 10 years"),
        Column("representation", "text", "whose fitted stiffness it is of; empty for none"),
        Column("specimens", "integer", "specimens in the regression", low=0),
        Column(
            "needed",
            "integer",
            "specimens that it needs: covariates and four, which leaves three degrees of freedom",
            low=0,
        ),
        _number(
            "factor",
            "stiffness is this many times as large by one step more, the other covariates equal",
            0.0,
        ),
        _number("low", "lower end of its 95 % interval (Student's t)", 0.0),
        _number("high", "upper end of its 95 % interval", 0.0),
        _number("log_effect", "logarithm of factor"),
        _number("standard_error", "standard error of log_effect", 0.0),
        _number("degrees_of_freedom", "specimens less covariates less 1", 0.0),
        _number(
            "inflation",
            "by how much the variance of the effect is larger because covariates go together",
            1.0,
        ),
        _number("unexplained", "SD between specimens of the logarithm that none tells", 0.0),
        Column("p", "number", "p value of the t test", null=_NONE, low=0.0, high=1.0),
        Column(
            "p_holm",
            "number",
            "p corrected for all rows of this table that have one (Holm); it decides",
            null=_NONE,
            low=0.0,
            high=1.0,
        ),
        Column(
            "holds",
            "text",
            "whether stiffness goes with it: yes where p_holm is below the study's significance; "
            "undecided: this cohort cannot tell; refused: not to be asked of it",
            allowed=VERDICTS,
        ),
        MESSAGE,
    ),
)
