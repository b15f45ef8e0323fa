"""Tables of studies of kind joint_pose_sensitivity; what their columns are stands in tables.csv."""

from spinepipe.schema import declared
from spinepipe.units import TRANSLATIONS

LANDMARKS = declared(__file__, "landmarks")
POSES = declared(__file__, "poses")
CALIBRATIONS = declared(__file__, "calibrations")
SIMULATIONS = declared(__file__, "simulations")
AGREEMENT = declared(__file__, "agreement")
VARIANCE_SHARES = declared(__file__, "variance_shares")
IMPORTANCE = declared(__file__, "importance")
BOOTSTRAP = declared(__file__, "bootstrap")
SUCCESS = declared(__file__, "success")
COUNTS = declared(__file__, "counts")
SUMMARY = declared(__file__, "summary")
METHOD_FITS = declared(__file__, "method_fits")
SUCCESS_BY_METHOD = declared(__file__, "success_by_method")
PRECISION_ERRORS = declared(__file__, "precision_errors")
LANDMARK_PRECISION = declared(__file__, "landmark_precision")
REQUIRED_PRECISION = declared(__file__, "required_precision")
STATISTICS = declared(__file__, "statistics")
AGAINST_GOULD_2024A = declared(__file__, "against_gould_2024a")
STIFFNESS_OVER_LOAD_POINT = declared(__file__, "stiffness_over_load_point")
LOAD_POINT_EFFECT = declared(__file__, "load_point_effect")
SPREAD_OVER_LANDMARK_SD = declared(__file__, "spread_over_landmark_sd")
POSTERIOR = declared(__file__, "posterior")
POSTERIOR_MOTION = declared(__file__, "posterior_motion")
POSE_WEIGHTS = declared(__file__, "pose_weights")

LOADINGS = COUNTS.column("loading").allowed

LOWER_ENDS = ("lower_end_low_quartile", "lower_end_median", "lower_end_high_quartile")

TOLD, NOT_MEANINGFUL, NOTHING_TO_TELL = "told", "not_meaningful", "no_result"
"""What may be said of a correlation of difference and mean."""


def region_columns(name: str) -> tuple[str, ...]:
    """Columns of what is known of a stiffness beside its value, in the order of the table."""
    suffix = "n_per_m" if name in TRANSLATIONS else "nm_per_rad"
    numbers = tuple(f"{name}_{what}_{suffix}" for what in ("se", "low", "high"))
    return (*numbers, *(f"{name}_{flag}" for flag in ("open_below", "open_above", "identifiable")))
