"""Tables of studies of kind tracking; what their columns are stands in tables.csv."""

from spinepipe.schema import declared

TRACKED = declared(__file__, "tracked")
FITS = declared(__file__, "fits")
STIFFNESS = declared(__file__, "stiffness")
PROFILES = declared(__file__, "profiles")
PROFILE_POINTS = declared(__file__, "profile_points")
CLUSTERS = declared(__file__, "clusters")
SIZES = declared(__file__, "sizes")
REMARKS = declared(__file__, "remarks")
DRAWN = declared(__file__, "drawn")
RANGES = declared(__file__, "ranges")
SHARING = declared(__file__, "sharing")
SIMILARITY = declared(__file__, "similarity")
ERRORS = declared(__file__, "errors")
ACCURACY = declared(__file__, "accuracy")
WEIGHTS = declared(__file__, "weights")
JOINT_MOMENTS = declared(__file__, "joint_moments")
MOMENT_AGREEMENT = declared(__file__, "moment_agreement")
AGAINST_WANG_2021 = declared(__file__, "against_wang_2021")

PELVIS = "pelvis"

MARKER_OFF = "marker_off"
"""Status of a fit that settled and leaves a marker further off than the study allows."""

VERDICTS = PROFILES.column("verdict").allowed

LIMIT = 3.84
"""Rise of a sum of squares, each over its variance, up to which a value is not excluded (95 %)."""

TOLD, NOT_TOLD, NO_STATIC = "told", "not_told", "no_static"

WINDOW = "20-80"
"""The part of a motion's cycle that figures and sentences tell of."""

WINDOWS = {
    WINDOW: (0.2, 0.8),
    "20-40": (0.2, 0.4),
    "40-60": (0.4, 0.6),
    "60-80": (0.6, 0.8),
}
"""Parts of a motion's cycle in which sharing is looked at (Wang 2021)."""

INSTANTS = 101
"""Of a motion's cycle, one per percent, ends included."""

MEASURES = {
    "centre_mm": ("mm", "vertebral centres"),
    "angle_deg": ("deg", "sagittal angles"),
    "joint_angle_deg": ("deg", "joint rotations"),
}
"""Unit of each measure of error, and a few words."""

DONE, TOO_SMALL, TOO_FEW, UNDEFINED = "done", "too_small", "too_few", "undefined"
