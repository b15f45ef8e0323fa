"""Files of a cohort that bring their own muscles: points, sizes, and frames of bodies.

Joints are those of every cohort. Points are in the frames of `body_frames`, or in ground where that
file is absent. Further columns are carried and not read.
"""

from spinepipe.cohort.columns import Column, TableForm

_FARTHEST_MM = 2000.0
_LARGEST_DEG = 180.0

_MUSCLE = Column("muscle", "name of the fascicle, each side its own", "text", required=True)
_AXES = (("x_mm", "forwards"), ("y_mm", "up"), ("z_mm", "to the right"))


def _point(what: str) -> tuple[Column, ...]:
    return tuple(
        Column(name, f"{what}, {way}", required=True, low=-_FARTHEST_MM, high=_FARTHEST_MM)
        for name, way in _AXES
    )


MUSCLES = TableForm(
    "muscles",
    "muscle x point",
    (
        _MUSCLE,
        Column("point", "number along the path, from 0", "integer", True, 0, 1000),
        Column(
            "body",
            "what the point moves with: a vertebra, pelvis, Abdomen for the rectus sheath, or "
            "a body of body_frames",
            "text",
            required=True,
        ),
        *_point("point, in the frame of its body"),
    ),
    keys=("muscle", "point"),
    carries=True,
)

MUSCLE_PARAMETERS = TableForm(
    "muscle_parameters",
    "muscle",
    (
        _MUSCLE,
        Column("group", "psoas, multifidus, longissimus_thoracis, ...", "text", True, names=True),
        Column("side", "right or left", "text", required=True),
        Column("pcsa_mm2", "physiological cross-section; empty: from the force", low=0, high=1e5),
        Column("max_isometric_force_n", "largest force, where pcsa_mm2 is empty", low=0, high=1e5),
        Column(
            "source_stress_mpa",
            "force over cross-section in the source; empty: the study's",
            low=0,
            open_low=True,
        ),
        Column("optimal_fibre_length_mm", "fibres at rest; empty: not known", low=0, high=1000),
    ),
    keys=("muscle",),
    carries=True,
)

BODY_FRAMES = TableForm(
    "body_frames",
    "specimen x body",
    (
        Column("specimen", "specimen", "text", required=True),
        Column("body", "vertebra, rib, pelvis, ...", "text", required=True),
        Column("carried_by", "vertebra that it moves with", "text", required=True),
        *_point("origin of its frame in ground"),
        *(
            Column(name, what, required=True, low=-_LARGEST_DEG, high=_LARGEST_DEG)
            for name, what in (
                ("extension_deg", "frame in ground, about +z"),
                ("right_bending_deg", "about +x'"),
                ("left_rotation_deg", "about +y''"),
            )
        ),
    ),
    keys=("specimen", "body"),
    carries=True,
)

GEOMETRY_FORMS = (MUSCLES, MUSCLE_PARAMETERS, BODY_FRAMES)
