"""What a cohort of tracked persons brings besides joints and bodies: trials, markers, their truth.

Markers are in the frames of their bodies: that of a vertebra is the frame of its lower joint, that
of the pelvis has the axes of ground and its origin at L5S1. Passive elements, ratios and bounds
come along with the library; a cohort that has files of its own replaces the rows that they name.
"""

from spinepipe.cohort.columns import Column, TableForm
from spinepipe.motion.hanging import ARMS
from spinepipe.motion.reading import DEFAULT_AXES
from spinepipe.units import ROTATIONS

STANCE = "stance"
MOVING = ("flexion_extension", "lateral_bending", "axial_rotation")
KINDS = (STANCE, *MOVING)
"""Of trials; those that move in the order of the rotation that they are about."""

FLAGS = ("yes", "no")

FARTHEST_MM = 2000.0
LARGEST_WEIGHT = 1e4
LARGEST_DEG = 180.0

AXES = (("x_mm", "forwards"), ("y_mm", "up"), ("z_mm", "to the right"))


def _key(name: str, meaning: str) -> Column:
    return Column(name, meaning, "text", required=True)


def _point(what: str, limit: float = FARTHEST_MM) -> tuple[Column, ...]:
    return tuple(
        Column(name, f"{what}, {way}", required=True, low=-limit, high=limit) for name, way in AXES
    )


_SPECIMEN = _key("specimen", "person, as listed in specimens.csv")
_VERTEBRA = _key("vertebra", "body, S1 for the pelvis")
_TRIAL = _key("trial", "name of the trial")
_JOINT = _key("joint", "joint, upper vertebra then lower")
_COORDINATE = _key("coordinate", "anterior, superior, right, extension, right_bending, ...")
_SOURCE = Column("source", "where the numbers are from", "text", required=True)
_STATUS = Column("status", "how sure they are; empty: given", "text")

TRIALS = TableForm(
    "trials",
    "specimen x trial",
    (
        _SPECIMEN,
        _TRIAL,
        _key("kind", ", ".join(KINDS)),
        _key("file", "motion in this folder: .trc, .c3d or .csv"),
        Column("start_s", "what is before is cut off; empty: nothing", low=-1e6, high=1e6),
        Column("end_s", "what is after is cut off; empty: nothing", low=-1e6, high=1e6),
        Column(
            "axes",
            "what forwards, up and right are in the axes of the file, as in 'x z -y' where z is "
            f"up and y to the left; empty: {DEFAULT_AXES}",
            "text",
        ),
        _key("arms", ", ".join(ARMS)),
        Column("static", "yes: the size is taken from it; empty: the first stance", "text"),
    ),
    keys=("specimen", "trial"),
)

MARKER_SET = TableForm(
    "marker_set",
    "specimen x marker",
    (
        _SPECIMEN,
        _key("marker", "name, as in the files of motion"),
        _VERTEBRA,
        *_point("place in the body's frame"),
        Column("weight", "of its error squared; empty: 1", low=0, high=LARGEST_WEIGHT),
        Column("cluster", "rigid cluster that it belongs to; empty: none", "text", names=True),
    ),
    keys=("specimen", "marker"),
)

PASSIVE = TableForm(
    "passive",
    "joint x coordinate x side",
    (
        _JOINT,
        _COORDINATE,
        _key("side", "positive or negative"),
        Column("a", "load of the law, N or N m", required=True, low=0, open_low=True),
        Column("b", "rate of the law, 1/mm or 1/deg", required=True, low=0, open_low=True),
        Column("lower", "factor of a at the lower end", required=True, low=0, open_low=True),
        Column("upper", "factor of a at the upper end", required=True, low=0, open_low=True),
        _SOURCE,
        _STATUS,
    ),
    keys=("joint", "coordinate", "side"),
)

RATIOS = TableForm(
    "ratios",
    "set x joint x coordinate",
    (
        _key("set", "name of the set"),
        _JOINT,
        _COORDINATE,
        Column("ratio", "share of the whole rotation", required=True, low=0, high=1),
        _SOURCE,
        _STATUS,
    ),
    keys=("set", "joint", "coordinate"),
)

BOUNDS = TableForm(
    "bounds",
    "joint x coordinate",
    (
        _JOINT,
        _COORDINATE,
        Column("low", "mm or deg", required=True, low=-LARGEST_DEG, high=0),
        Column("high", "mm or deg", required=True, low=0, high=LARGEST_DEG),
        _SOURCE,
        _STATUS,
    ),
    keys=("joint", "coordinate"),
)

CENTRES = TableForm(
    "centres",
    "specimen x vertebra",
    (_SPECIMEN, _VERTEBRA, *_point("centre in the body's frame", 200.0)),
    keys=("specimen", "vertebra"),
)

TRUTH_CENTRES = TableForm(
    "truth_centres",
    "specimen x trial x time x vertebra",
    (
        _SPECIMEN,
        _TRIAL,
        Column("time_s", "time, as in the file of the motion", required=True),
        _VERTEBRA,
        *_point("true centre in ground", 1e4),
        *(
            Column(
                f"{axis}_deg",
                "true rotation of the body in ground; all three or none",
                low=-LARGEST_DEG,
                high=LARGEST_DEG,
            )
            for axis in ROTATIONS
        ),
    ),
    keys=("specimen", "trial", "time_s", "vertebra"),
)

FORMS = (TRIALS, MARKER_SET, PASSIVE, RATIOS, BOUNDS, CENTRES, TRUTH_CENTRES)
