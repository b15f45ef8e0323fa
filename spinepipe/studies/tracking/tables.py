"""Tables of studies of kind tracking: one person, one motion, one approach."""

from spinepipe.motion.scaling import SEGMENTS
from spinepipe.status import Status
from spinepipe.studies.tracking.settings import APPROACHES, CONSTRAINED
from spinepipe.tables.schema import MESSAGE, SPECIMEN, Column, Table, length_or_angle
from spinepipe.units import COORDINATES, TRANSLATIONS

PELVIS = "pelvis"
MARKER_OFF = "marker_off"
"""Status of a fit that settled and leaves a marker further off than the study allows."""

NO_POSTURE = "the approach found no posture"
ONE_FRAME = "the trial is one frame, which has no acceleration"
NO_LOADS = "the approach does not ask for loads"
SIDES = ("positive", "negative")
VERDICTS = ("told", "one_sided", "not_told")
LIMIT = 3.84
"""Rise of a sum of squares, each over its variance, up to which a value is not excluded (95 %)."""

TRIAL = Column("trial", "text", "motion, as in trials.csv")
APPROACH = Column(
    "approach",
    "text",
    f"how postures were found: {', '.join(APPROACHES)}, or {CONSTRAINED} and a set of the cohort's",
)
LAW = Column(
    "law", "text", "passive elements: the approach that takes them over, or the kind of motion"
)
FRAME = Column("frame", "integer", "number of the frame in the trial, from 0", low=0)
TIME = Column("time_s", "number", "time of the frame", "s")
LEVEL = Column("joint", "text", "joint, upper vertebra first")
COORDINATE = Column("coordinate", "text", "coordinate of the joint", allowed=COORDINATES)
SIDE = Column("side", "text", "for positive or for negative coordinates", allowed=SIDES)
REGION = Column("region", "text", "joints whose stiffness is scaled together")
FIT_STATUS = Column(
    "status",
    "text",
    "how the fit ended; marker_off: it settled, and a marker is further off than the study allows",
    allowed=(*Status, MARKER_OFF),
)

_TURNED = {
    "anterior": "forwards",
    "superior": "upwards",
    "right": "to the right",
    "extension": "in extension",
    "right_bending": "in bending to the right",
    "left_rotation": "in rotation to the left",
}


def length(name: str, meaning: str, null: str | None = None) -> Column:
    """A column of lengths without sign."""
    return Column(f"{name}_mm", "number", meaning, "mm", null=null, low=0.0)


def _coordinate(name: str) -> Column:
    unit = length_or_angle(name)
    moved = "moved" if name in TRANSLATIONS else "turned"
    return Column(f"{name}_{unit}", "number", f"how far it is {moved} {_TURNED[name]}", unit)


TRACKED = Table(
    "tracked",
    "Motion of every joint: one row per person, trial, approach, frame and joint. Coordinates are "
    "those of the upper vertebra in the joint's frame, zero in the cohort's neutral pose; those of "
    "the pelvis are in ground.",
    ("specimen", "trial", "approach", "frame", "joint"),
    (
        SPECIMEN,
        TRIAL,
        APPROACH,
        FRAME,
        Column("joint", "text", "joint, upper vertebra first, or pelvis"),
        TIME,
        *(_coordinate(name) for name in COORDINATES),
    ),
)

FITS = Table(
    "fits",
    "How every fit ended and what it left: one row per person, trial and approach.",
    ("specimen", "trial", "approach"),
    (
        SPECIMEN,
        TRIAL,
        APPROACH,
        FIT_STATUS,
        MESSAGE,
        Column("iterations", "integer", "steps of the search", null=NO_POSTURE, low=0),
        Column("unknowns", "integer", "numbers that were searched for", null=NO_POSTURE, low=0),
        length(
            "marker_rmse", "root mean square distance of model and measured markers", NO_POSTURE
        ),
        length("largest_deviation", "largest of these distances", NO_POSTURE),
        Column(
            "markers_cost",
            "number",
            "sum of squares of markers, each over its scale",
            null=NO_POSTURE,
            low=0.0,
        ),
        Column(
            "loads_cost",
            "number",
            "sum of squares of what muscles have to do, each over its scale",
            null=NO_LOADS,
            low=0.0,
        ),
        Column(
            "acceleration_rms_deg_per_s2",
            "number",
            "root mean square angular acceleration of all joints: large values are vibration",
            "deg/s2",
            null=ONE_FRAME,
            low=0.0,
        ),
        Column(
            "load_rms_nm",
            "number",
            "root mean square moment that muscles have to make, over joints, axes and frames",
            "N m",
            null=NO_LOADS,
            low=0.0,
        ),
        Column("cpu_s", "number", "processor time", "s", null=NO_POSTURE, low=0.0),
        Column("frames", "integer", "frames that were tracked", low=0),
    ),
)

_NO_LAW = "the calibration ended without"
_UNLOADED = "the side was not loaded, the coordinate is along an axis, or no calibration"

STIFFNESS = Table(
    "stiffness",
    "Passive elements: one row per person, calibration, joint, coordinate and side. A coordinate q "
    "is resisted by A (exp(B q) - 1), so that stiffness is B (load + A).",
    ("specimen", "law", "joint", "coordinate", "side"),
    (
        SPECIMEN,
        LAW,
        LEVEL,
        COORDINATE,
        SIDE,
        Column("a", "number", "size A", "N or N m", null=_NO_LAW, low=0.0),
        Column("b", "number", "shape B", "1/m or 1/rad", null=_NO_LAW, low=0.0),
        *(
            Column(
                name,
                "number",
                meaning,
                "N m/rad",
                null=_UNLOADED,
                low=0.0,
            )
            for name, meaning in (
                ("at_low_moment", "stiffness where 0.1 N m resists"),
                ("at_high_moment", "stiffness where the joint's high moment resists"),
            )
        ),
        Column(
            "high_moment_nm",
            "number",
            "largest passive moment of this side in the motions",
            "N m",
            null=_UNLOADED,
            low=0.0,
        ),
        *(
            Column(
                f"generic_{end}",
                "number",
                f"{meaning} of generic stiffness where the high moment resists",
                "N m/rad",
                null=_UNLOADED,
                low=0.0,
            )
            for end, meaning in (("low", "lower end"), ("high", "upper end"))
        ),
        Column(
            "inside_generic",
            "flag",
            "whether the stiffness at the high moment is inside that range",
            null=_UNLOADED,
        ),
        Column(
            "ratio_to_generic",
            "number",
            "stiffness at the high moment over the generic one",
            null=_UNLOADED,
            low=0.0,
        ),
        Column("status", "text", "how the calibration ended", allowed=tuple(Status)),
        MESSAGE,
    ),
)

_OPEN = "open: nothing that was tried is excluded on this side"

PROFILES = Table(
    "profiles",
    "Whether markers tell stiffness: one row per person, region and coordinate. The stiffness of a "
    "region is held at so many times the generic one, and all else is fitted anew; what raises the "
    f"cost by more than {LIMIT} is excluded (95 %).",
    ("specimen", "region", "coordinate"),
    (
        SPECIMEN,
        REGION,
        COORDINATE,
        Column(
            "best_ratio",
            "number",
            "ratio to the generic stiffness of the least cost",
            null="no fit settled",
            low=0.0,
        ),
        Column("low", "number", "lower end of what is not excluded", null=_OPEN, low=0.0),
        Column("high", "number", "upper end of it", null=_OPEN, low=0.0),
        Column("open_below", "flag", "whether no smaller ratio that was tried is excluded"),
        Column("open_above", "flag", "whether no larger ratio that was tried is excluded"),
        Column(
            "verdict",
            "text",
            "told: both ends are closed; one_sided: one of them; not_told: none, no fit settled, "
            "or the cost falls to the end of what was tried",
            allowed=VERDICTS,
        ),
        MESSAGE,
    ),
)

PROFILE_POINTS = Table(
    "profile_points",
    "What each ratio costs: one row per person, region, coordinate and ratio that was tried.",
    ("specimen", "region", "coordinate", "point"),
    (
        SPECIMEN,
        REGION,
        COORDINATE,
        Column("point", "integer", "number of the ratio, from 0", low=0),
        Column("ratio", "number", "to the generic stiffness", low=0.0),
        Column(
            "cost_over_best",
            "number",
            "least cost with this ratio, less the least of all ratios",
            null="the fit did not settle",
        ),
    ),
)

CLUSTERS = Table(
    "clusters",
    "How rigid clusters of markers are: one row per person, trial and cluster.",
    ("specimen", "trial", "cluster"),
    (
        SPECIMEN,
        TRIAL,
        Column("cluster", "text", "cluster, as in marker_set.csv"),
        length(
            "variability",
            "SD of the distances between its markers over time, their mean",
            "too few frames see the cluster",
        ),
        Column(
            "variability_percent",
            "number",
            "the same as a share of the mean distance",
            "%",
            null="too few frames see the cluster",
            low=0.0,
        ),
        Column("frames", "integer", "frames that see the whole cluster", low=0),
        Column(
            "status",
            "text",
            "not_rigid: distances vary more than those of a rigid cluster do",
            allowed=("rigid", "not_rigid", "too_few"),
        ),
    ),
)

TOLD, NOT_TOLD, NO_STATIC = "told", "not_told", "no_static"

_NO_SIZE = "markers do not tell the size, see status"

SIZES = Table(
    "sizes",
    "How large persons are beside the cohort's skeleton, by pairs of markers in the static trial: "
    "one row per person and part of the skeleton. How well that fits is of all pairs together. "
    "Motions are tracked with it where `scaling` is markers.",
    ("specimen", "segment"),
    (
        SPECIMEN,
        Column("segment", "text", "part of the skeleton", allowed=SEGMENTS),
        Column("factor", "number", "size over the cohort's", null=_NO_SIZE, low=0.0),
        Column("n_pairs", "integer", "pairs of markers that tell it", low=0),
        length("rms", "root mean square of what is left of their distances", _NO_SIZE),
        length("largest", "most that is left of one distance", _NO_SIZE),
        Column("first_marker", "text", "one marker of this pair; may be empty"),
        Column("second_marker", "text", "the other; may be empty"),
        Column(
            "status",
            "text",
            "told; not_told: pairs do not tell it, or it is none of a person; no_static: no trial "
            "is static",
            allowed=(TOLD, NOT_TOLD, NO_STATIC),
        ),
        MESSAGE,
    ),
)

REMARKS = Table(
    "remarks",
    "What a reader must know of recordings though nothing of them is refused: one row per person, "
    "trial and remark.",
    ("specimen", "trial", "remark"),
    (
        SPECIMEN,
        Column("trial", "text", "motion, as in trials.csv; empty where it is of the person"),
        Column("remark", "text", "what is so, or what was put right"),
    ),
)

DRAWN_KINDS = ("body", "measured", "modelled")

DRAWN = Table(
    "drawn",
    "What the animation shows: one row per person, trial, approach, frame, kind and name; bodies, "
    "markers as measured and markers of the model, in ground.",
    ("specimen", "trial", "approach", "frame", "kind", "name"),
    (
        SPECIMEN,
        TRIAL,
        APPROACH,
        FRAME,
        Column("kind", "text", "what is there", allowed=DRAWN_KINDS),
        Column("name", "text", "body or marker"),
        TIME,
        *(
            Column(f"{axis}_mm", "number", f"place {way}", "mm")
            for axis, way in (("x", "forwards"), ("y", "upwards"), ("z", "to the right"))
        ),
        *(
            Column(
                f"{name}_deg",
                "number",
                f"how far the body is turned {_TURNED[name]}, in ground",
                "deg",
                null="a marker has no orientation",
            )
            for name in COORDINATES[3:]
        ),
    ),
)
