"""Tables of studies of kind cohort_stiffness; what their columns are stands in tables.csv."""

from spinepipe.schema import declared

STIFFNESS = declared(__file__, "stiffness")
PREDICTED_STIFFNESS = declared(__file__, "predicted_stiffness")
FITS = declared(__file__, "fits")
ERRORS = declared(__file__, "errors")
POOLING = declared(__file__, "pooling")
SIGN_CHECKS = declared(__file__, "sign_checks")
MAE = declared(__file__, "mae")
RANKING = declared(__file__, "ranking")
STATISTICS = declared(__file__, "statistics")
FINDINGS = declared(__file__, "findings")
AGAINST_GOULD_2024B = declared(__file__, "against_gould_2024b")
COVARIATES_TABLE = declared(__file__, "covariates")
NUISANCES = declared(__file__, "nuisances")
LOAD_DISPLACEMENT = declared(__file__, "load_displacement")
HELICAL_AXES = declared(__file__, "helical_axes")

CRITERIA = RANKING.column("criterion").allowed

MAE_IN_DEG = ("mae", "low_quartile", "high_quartile", "largest_motion")
"""Columns of `MAE` that stand there in deg as well, under the names that they had at first."""

GROWTH_CELLS = tuple(name for name in STIFFNESS.names if name.startswith("growth"))
"""Columns of how fast a joint stiffens, which linear laws leave empty."""

SPREAD_CELLS = tuple(name for name in POOLING.names if name.startswith("growth"))
"""Columns of how that spreads in a cohort."""

MEASURED, SIMULATED = "measured", "simulated"

WHOLE, DIRECTION, SMALL, NOT_READ, NO_POSE = (
    "found",
    "direction_only",
    "too_small",
    "not_read",
    "no_pose",
)
"""What is known of a helical axis."""

BEYOND, UPPER_HALF, NOWHERE = "beyond_neutral_zone", "upper_half", "none"
"""Where an elastic zone begins."""
