"""Tables of studies of kind trunk_loads: one person, one task."""

from typing import get_args

from spinepipe.muscles.task import Tone
from spinepipe.muscles.trunk import BODIES, LEVELS
from spinepipe.status import Balanced
from spinepipe.tables.schema import MESSAGE, SPECIMEN, Column, Table

NO_FORCES = "the task could not be posed"
NO_ANSWER = "no muscle forces hold the task, or it could not be posed"

TASK = Column("task", "text", "task, as in tasks.csv")
LEVEL = Column("level", "text", "joint, upper vertebra first", allowed=LEVELS)
STATUS = Column("status", "text", "how finding the forces ended", allowed=tuple(Balanced))
MUSCLE = Column("muscle", "text", "fascicle, as its source names it")
GROUP = Column("group", "text", "muscle that the fascicle belongs to")
SIDE = Column("side", "text", "side of the body", allowed=("right", "left"))


def force(name: str, meaning: str, null: str | None = NO_FORCES) -> Column:
    """A column of forces."""
    return Column(f"{name}_n", "number", meaning, "N", null=null)


def moment(name: str, meaning: str, null: str | None = NO_FORCES) -> tuple[Column, ...]:
    """Three columns of a moment, positive in extension, right bending and left rotation."""
    return tuple(
        Column(
            f"{name}_{way}_nm", "number", f"{meaning}, about the axis of {way}", "N m", null=null
        )
        for way in ("extension", "right_bending", "left_rotation")
    )


def angle(name: str, meaning: str, null: str | None = None) -> Column:
    """A column of angles."""
    return Column(f"{name}_deg", "number", meaning, "deg", null=null)


def pressure(name: str, meaning: str, null: str | None = NO_FORCES) -> Column:
    """A column of pressures."""
    return Column(f"{name}_mpa", "number", meaning, "MPa", null=null)


TASKS = Table(
    "tasks",
    "What a task asks of a person's trunk: one row per person and task.",
    ("specimen", "task"),
    (
        SPECIMEN,
        TASK,
        Column("number", "integer", "of Ghezelbash 2016 Table 1", null="not one of them", low=1),
        angle("trunk_extension", "rotation of T11 from upright, extension positive"),
        angle("trunk_right_bending", "rotation of T11 to the right"),
        angle("pelvis_extension", "rotation of the pelvis from upright, extension positive"),
        Column("hand_load_kg", "number", "load in the hands", "kg", low=0.0),
        Column(
            "carried_kg", "number", "mass above L5S1, load in the hands included", "kg", low=0.0
        ),
        pressure("l4l5_pressure", "pressure in the disc L4L5 (Ghezelbash 2016 Eq 6)"),
        pressure("l4l5_pressure_dreischarf", "the same by Dreischarf 2013, P / 0.77"),
        pressure("l4l5_nominal_pressure", "compression over the area of the disc"),
        angle(
            "l4l5_flexion",
            "flexion of L4 on L5 from the unloaded geometry, flexion positive",
            NO_FORCES,
        ),
        Column(
            "inside_eq_6",
            "flag",
            "whether nominal pressure and flexion lie where Eq 6 was fitted (0-1.86 MPa, 0-10 deg)",
            null=NO_FORCES,
        ),
        force("l4l5_compression", "compression of L4L5"),
        force("l4l5_shear", "shear of L4L5: push of L4 on L5 forwards"),
        force("l5s1_compression", "compression of L5S1"),
        force("l5s1_shear", "shear of L5S1: push of L5 on S1 forwards"),
        Column(
            "largest_slack_nm",
            "number",
            "largest moment that no muscle holds",
            "N m",
            null=NO_FORCES,
            low=0.0,
        ),
        Column(
            "strength_used",
            "number",
            "share of the strength that the task takes: 1 over the factor by which loads could "
            "grow (weight, hands and exertion alike) before no muscle forces hold them",
            null="strength was not asked for, or the task could not be posed",
            low=0.0,
        ),
        pressure("largest_stress", "largest active stress that a muscle may have", None),
        pressure("highest_stress", "highest active stress that a muscle has"),
        Column("tone", "text", "co-activation", allowed=get_args(Tone)),
        Column(
            "tone_share",
            "number",
            "least activation of every muscle, share of its largest",
            null=NO_FORCES,
            low=0.0,
        ),
        Column(
            "stable",
            "flag",
            "whether the spine stands still when pushed a little; muscles stiffen as they pull",
            null="stability was not asked for, or the task could not be posed",
        ),
        Column("iterations", "integer", "rounds of forces and geometry", null=NO_FORCES, low=0),
        STATUS,
        MESSAGE,
    ),
)

LEVELS_TABLE = Table(
    "levels",
    "Load on every joint: one row per person, task and level. Compression is along the axis of the "
    "disc, shear across it; both as the upper vertebra pushes the lower one.",
    ("specimen", "task", "level"),
    (
        SPECIMEN,
        TASK,
        LEVEL,
        force("compression", "compression"),
        force("shear_anterior", "shear forwards"),
        force("shear_right", "shear to the right"),
        angle(
            "extension",
            "rotation of the upper on the lower vertebra since the unloaded geometry: extension",
            NO_FORCES,
        ),
        angle("right_bending", "the same: bending to the right", NO_FORCES),
        angle("left_rotation", "the same: rotation to the left", NO_FORCES),
        *moment("required", "moment that muscles have to make on what is above"),
        *moment("passive", "moment of the joint on what is above"),
        *moment("slack", "required less made"),
        Column(
            "stiffening",
            "number",
            "factor of the bending stiffness by compression",
            null=NO_FORCES,
            low=0.0,
        ),
        Column(
            "capacity_left_nm",
            "number",
            "flexion moment that could be added at this level alone before no forces hold it",
            "N m",
            null="strength was not asked for, or the task is beyond strength",
            low=0.0,
        ),
        *(
            Column(
                f"{axis}_mm",
                "number",
                f"centre of the joint from that of L5S1, {where}",
                "mm",
                null=NO_FORCES,
            )
            for axis, where in (("x", "forwards"), ("y", "up"), ("z", "to the right"))
        ),
        STATUS,
    ),
)

MUSCLES = Table(
    "muscles",
    "Force of every fascicle: one row per person, task and fascicle.",
    ("specimen", "task", "muscle"),
    (
        SPECIMEN,
        TASK,
        MUSCLE,
        GROUP,
        SIDE,
        Column("pcsa_mm2", "number", "physiological cross-section", "mm2", low=0.0),
        force("force", "pull of the fascicle"),
        force("passive", "share of it that comes of being stretched"),
        pressure("stress", "pull over cross-section"),
        Column(
            "activity",
            "number",
            "active force over the largest active force",
            null=NO_FORCES,
            low=0.0,
        ),
        Column("length_mm", "number", "length of the path", "mm", null=NO_FORCES, low=0.0),
        Column(
            "stretch", "number", "length over that of the upright posture", null=NO_FORCES, low=0.0
        ),
        Column("contacts", "integer", "vertebrae that the fascicle lies on", null=NO_FORCES, low=0),
        force("contact", "sum of its pushes on vertebrae that it lies on"),
        STATUS,
    ),
)

PATHS = Table(
    "paths",
    "Where fascicles run, contacts included, of the tasks that are drawn: one row per point.",
    ("specimen", "task", "muscle", "point"),
    (
        SPECIMEN,
        TASK,
        MUSCLE,
        GROUP,
        SIDE,
        Column("point", "integer", "number along the path, from 0", low=0),
        *(
            Column(f"{axis}_mm", "number", f"from the centre of L5S1, {where}", "mm")
            for axis, where in (("x", "forwards"), ("y", "up"), ("z", "to the right"))
        ),
        pressure("stress", "pull over cross-section", None),
    ),
)

ITERATIONS = Table(
    "iterations",
    "How the forces settled: one row per person, task and round.",
    ("specimen", "task", "iteration"),
    (
        SPECIMEN,
        TASK,
        Column("iteration", "integer", "round, from 0", low=0),
        Column(
            "change",
            "number",
            "change of the muscle forces since the round before over their size",
            null="the first round",
            low=0.0,
        ),
        Column(
            "residual_nm",
            "number",
            "largest moment out of balance where the spine has moved to",
            "N m",
            low=0.0,
        ),
        force("l4l5_compression", "compression of L4L5", None),
    ),
)

UPRIGHT = Table(
    "upright",
    "Upright posture of a person (Ghezelbash 2016 Eq 2): one row per person and body.",
    ("specimen", "body"),
    (
        SPECIMEN,
        Column("body", "text", "vertebra", allowed=BODIES),
        angle("start", "rotation at the start, extension positive"),
        angle("upright", "rotation found"),
        Column("bound", "flag", "whether it stands at the end of its range"),
        Column(
            "moment_before_nm",
            "number",
            "extension moment required at the joint below, at the start",
            "N m",
            null="the pelvis has no joint below",
        ),
        Column(
            "moment_after_nm",
            "number",
            "the same upright",
            "N m",
            null="the pelvis has no joint below",
        ),
    ),
)

MASSES = Table(
    "masses",
    "Where every kilogram goes: one row per person and part; parts add up to the body's mass.",
    ("specimen", "part"),
    (
        SPECIMEN,
        Column("part", "text", "part of the body"),
        Column(
            "carried_by", "text", "vertebra that carries it", null="it is not carried by the trunk"
        ),
        Column("mass_kg", "number", "its mass", "kg", low=0.0),
        Column("share", "number", "of the body's mass", low=0.0),
        *(
            Column(
                f"{axis}_mm",
                "number",
                f"centre of mass from L5S1 in the source's pose, {where}",
                "mm",
                null="not carried by the trunk, or it hangs on the arms",
            )
            for axis, where in (("x", "forwards"), ("y", "up"), ("z", "to the right"))
        ),
    ),
)

REMARKS = Table(
    "remarks",
    "What was put right, added or assumed when geometry and muscles were read: one row per person "
    "and remark.",
    ("specimen", "remark"),
    (SPECIMEN, Column("remark", "text", "what was done, and why")),
)

SCALING = Table(
    "scaling",
    "What makes the person differ from the reference person: one row per person and quantity.",
    ("specimen", "quantity", "of"),
    (
        SPECIMEN,
        Column("quantity", "text", "what is scaled"),
        Column("of", "text", "muscle or level, or all"),
        Column("ratio", "number", "the person's over the reference person's", low=0.0),
        Column("source", "text", "where the rule is from"),
    ),
)
