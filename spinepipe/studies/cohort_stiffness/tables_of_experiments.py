"""Tables of what laboratories report of an experiment, measured and simulated."""

from spinepipe.experiment.double_sigmoid import Zone
from spinepipe.studies.cohort_stiffness.representations import NAMES
from spinepipe.tables.schema import JOINT, MESSAGE, SPECIMEN, Column, Table, status
from spinepipe.units import ROTATIONS, TRANSLATIONS

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

_TEST = Column("test", "text", "load case; two that load opposite sides are one, joined by +")
_CYCLE = Column("cycle", "integer", "repeat of the test", low=1)
_SOURCE = Column(
    "source",
    "text",
    "measured: readings; simulated: the model with stiffness fitted to all load cases, under the "
    "same loads",
    allowed=(MEASURED, SIMULATED),
)
_REPRESENTATION = Column(
    "representation",
    "text",
    "how the simulated stiffness is described; empty where measured",
    allowed=("", *NAMES),
)
_NO_LOOP = "not determined, see message"
_NO_ENDS = "no noise is declared, an end is open, or there is no value"


def _with_ends(
    name: str, meaning: str, unit: str, suffix: str, low: float | None = None
) -> tuple[Column, ...]:
    """A number and the ends of its 95 % interval."""
    ends = (("low", "lower"), ("high", "upper"))
    return (
        Column(f"{name}_{suffix}", "number", meaning, unit, _NO_LOOP, low=low),
        *(
            Column(
                f"{name}_{end}_{suffix}",
                "number",
                f"{which} end of its 95 % interval",
                unit,
                _NO_ENDS,
            )
            for end, which in ends
        ),
    )


_NM_PER_RAD = ("N m/rad", "nm_per_rad", 0.0)

LOAD_DISPLACEMENT = Table(
    "load_displacement",
    "What laboratories report of a load-displacement curve: one row per specimen, joint, test, "
    "cycle and source. Load is the applied moment, rotation that of the joint about it. Intervals: "
    "of measured rows from the SD of a reading, of simulated ones from that of the stiffness.",
    ("specimen", "joint", "test", "cycle", "source"),
    (
        SPECIMEN,
        JOINT,
        _TEST,
        _CYCLE,
        _SOURCE,
        _REPRESENTATION,
        Column(
            "coordinate",
            "text",
            "rotation that the moment drives",
            null="no moment drives what was read",
            allowed=ROTATIONS,
        ),
        Column("readings", "integer", "load steps with a reading", low=0),
        Column("least_load_nm", "number", "least moment read", "N m", "nothing was read"),
        Column("largest_load_nm", "number", "largest moment read", "N m", "nothing was read"),
        *_with_ends(
            "range_of_motion",
            "rotation at the largest moment less that at the least; negative against the load. Of "
            "a test to one side: from the first reading",
            "deg",
            "deg",
        ),
        Column(
            "neutral_zone",
            "text",
            "whether there is one: not_meaningful: no S-shaped curve fits better than a straight "
            "line, or it softens nowhere between the ends; not_described: softer in the middle, "
            "but sigmoids leave more than noise, so that they tell no ends; too_few: loads from "
            "side to side; one_side: only one side was loaded; not_read: no rotation",
            allowed=tuple(Zone),
        ),
        *_with_ends(
            "neutral_zone",
            "rotation between the bends of a curve of one or two sigmoids (Smit et al. 2011), mean "
            "of both directions where both were read",
            "deg",
            "deg",
        ),
        Column("neutral_zone_from_nm", "number", "moment where it begins", "N m", _NO_LOOP),
        Column("neutral_zone_to_nm", "number", "moment where it ends", "N m", _NO_LOOP),
        *_with_ends(
            "neutral_zone_stiffness",
            "moment over rotation between its ends",
            *_NM_PER_RAD,
        ),
        Column(
            "elastic_zone",
            "text",
            "where elastic zones begin: beyond_neutral_zone; upper_half: at half the largest "
            "moment of the side, where there is no neutral zone; none: none was read",
            allowed=(BEYOND, UPPER_HALF, NOWHERE),
        ),
        *(
            column
            for side in ("positive", "negative")
            for column in _with_ends(
                f"elastic_zone_stiffness_{side}",
                f"moment over rotation while the {side} moment grows, median slope",
                *_NM_PER_RAD,
            )
        ),
        *_with_ends(
            "hysteresis_area",
            "work lost in a closed cycle; negative where unloading gives back more",
            "J",
            "j",
        ),
        status("solve"),
        MESSAGE,
    ),
)

_NO_AXIS = "no axis, see status"
_NO_CENTRE = "no axis, or translations were not read, see status"
_NO_SD = "no SD of a reading is declared, the stiffness is not identifiable, or there is no value"


def _with_sd(name: str, meaning: str, unit: str, null: str) -> tuple[Column, ...]:
    suffix = f"_{unit}" if unit else ""
    return (
        Column(f"{name}{suffix}", "number", meaning, unit, null),
        Column(f"{name}_sd{suffix}", "number", "its propagated SD", unit, _NO_SD, low=0.0),
    )


HELICAL_AXES = Table(
    "helical_axes",
    "Finite helical axis of each joint from the least to the largest moment of a cycle, in the "
    "joint frame fixed in the lower vertebra: one row per specimen, joint, test, cycle and source. "
    "SDs are propagated to first order; below 2 degrees there is no axis.",
    ("specimen", "joint", "test", "cycle", "source"),
    (
        SPECIMEN,
        JOINT,
        _TEST,
        _CYCLE,
        _SOURCE,
        _REPRESENTATION,
        Column("from_nm", "number", "moment of the first pose", "N m"),
        Column("to_nm", "number", "moment of the second pose", "N m", ""),
        *_with_sd("angle", "rotation about the axis, not negative", "deg", "no pose"),
        *(
            column
            for axis in TRANSLATIONS
            for column in _with_sd(
                f"direction_{axis}",
                f"direction of the axis along {axis}; the turn about it is right-handed",
                "",
                _NO_AXIS,
            )
        ),
        *(
            column
            for axis in TRANSLATIONS
            for column in _with_sd(
                f"centre_{axis}",
                "centre of rotation: the point of the axis nearest to the origin of the joint "
                f"frame, {axis}",
                "mm",
                _NO_CENTRE,
            )
        ),
        *_with_sd("along", "translation along the axis", "mm", _NO_CENTRE),
        Column(
            "status",
            "text",
            "what is known: found; direction_only: translations were not read; too_small: a "
            "rotation below 2 degrees; not_read: not all three rotations were; no_pose: the model "
            "has none",
            allowed=(WHOLE, DIRECTION, SMALL, NOT_READ, NO_POSE),
        ),
        MESSAGE,
    ),
)

TABLES = (LOAD_DISPLACEMENT, HELICAL_AXES)
"""Tables of experiments."""
