"""Tables of studies of kind scoliosis."""

from spinepipe.statics.prescribed import Ended
from spinepipe.studies.scoliosis.settings import MODELS
from spinepipe.tables.schema import JOINT, MESSAGE, SPECIMEN, Column, Table
from spinepipe.tables.shared import against_paper

MODEL = Column("model", "text", "model of the spine", allowed=MODELS)
POSITION = Column("position", "text", "position that the patient was filmed in")
SCALE_FROM = Column(
    "scale_from",
    "text",
    "what the size of the stiffness was taken from: films tell ratios between segments only",
    allowed=("apical_moment", "mean_stiffness"),
)
FREE = Column("free_parameters", "integer", "parameters taken from the patient's films", low=0)
DECIDED = Column(
    "decided_parameters",
    "number",
    "how many of the free parameters the films decided; the others stay as the population has them",
    low=0.0,
)
FITTED = Column("fitted", "flag", "whether the film took part in personalising the models")
STATUS = Column("status", "text", "how the solve ended", allowed=tuple(Ended))

_NO_POSE = "the solve found no pose"
_LINEAR = "the law is linear"
_NO_INTERVAL = "the model gives none"


def _angle(name: str, meaning: str, null: str | None = None) -> Column:
    return Column(name, "number", meaning, "deg", null=null)


LAWS = Table(
    "laws",
    "Lateral stiffness of every segment: one row per patient, model and joint.",
    ("specimen", "model", "joint"),
    (
        SPECIMEN,
        MODEL,
        JOINT,
        Column("at_rest_nm_per_rad", "number", "stiffness at the erect pose", "N m/rad", low=0.0),
        Column(
            "ratio",
            "number",
            "stiffness at the erect pose over the geometric mean of the patient's segments",
            low=0.0,
        ),
        Column("ratio_low", "number", "lower end of its 95 % interval", null=_NO_INTERVAL, low=0.0),
        Column("ratio_high", "number", "upper end of it", null=_NO_INTERVAL, low=0.0),
        _angle("lower_end_deg", "end of the tangent to the left, negative", _LINEAR),
        _angle("upper_end_deg", "end of the tangent to the right", _LINEAR),
        Column("opposite", "flag", "whether it turns against a bend, or not at all"),
        Column("constrained", "flag", "whether the films asked for less stiffness than is allowed"),
        FREE,
        DECIDED,
        SCALE_FROM,
    ),
)

DISPLACEMENTS = Table(
    "displacements",
    "Lateral rotation of every segment since the erect film, right positive: one row per patient, "
    "model, position and joint.",
    ("specimen", "model", "position", "joint"),
    (
        SPECIMEN,
        MODEL,
        POSITION,
        FITTED,
        JOINT,
        _angle("measured_deg", "rotation on the film"),
        _angle("simulated_deg", "rotation of the model", _NO_POSE),
        Column(
            "share_of_range",
            "number",
            "size of the measured rotation over the published end of its side",
            low=0.0,
        ),
        Column("opposite", "flag", "whether the segment turns against a bend, or not at all"),
        STATUS,
    ),
)

POSITIONS = Table(
    "positions",
    "How well a model reproduces a film: one row per patient, model and position. The uppermost "
    "vertebra is put where the film has it.",
    ("specimen", "model", "position"),
    (
        SPECIMEN,
        MODEL,
        POSITION,
        FITTED,
        _angle("rotation_rmse_deg", "root mean square error of the segments' rotations", _NO_POSE),
        Column(
            "place_rmse_mm",
            "number",
            "root mean square distance of the vertebrae from their places on the film",
            "mm",
            null=_NO_POSE,
            low=0.0,
        ),
        _angle("tilt_rmse_deg", "root mean square error of the vertebrae's tilts", _NO_POSE),
        Column("push_right_n", "number", "push to the right at the top", "N", null=_NO_POSE),
        Column("push_up_n", "number", "push up at the top", "N", null=_NO_POSE),
        Column(
            "push_right_bending_nm",
            "number",
            "moment to the right at the top",
            "N m",
            null=_NO_POSE,
        ),
        Column("missed_mm", "number", "distance by which the top misses its place", "mm", low=0.0),
        _angle("missed_deg", "angle by which the top misses its tilt"),
        Column("chord_ratio", "number", "length of the film's spine over the erect one", low=0.0),
        Column("film_scale", "number", "what the film was multiplied by; 1 without corners"),
        FREE,
        DECIDED,
        SCALE_FROM,
        STATUS,
        MESSAGE,
    ),
)

CURVES = Table(
    "curves",
    "Cobb and Ferguson angles of every curve of the erect film, on every film and in every model: "
    "one row per patient, model, position and curve. End vertebrae and apex stay those of the "
    "erect film; angles are positive to the side of the erect bulge.",
    ("specimen", "model", "position", "curve"),
    (
        SPECIMEN,
        MODEL,
        POSITION,
        FITTED,
        Column("curve", "integer", "number of the curve, from the lowest", low=0),
        Column("side", "text", "side of its bulge", allowed=("right", "left")),
        Column("lower_vertebra", "text", "lower end vertebra"),
        Column("apex_vertebra", "text", "apex"),
        Column("upper_vertebra", "text", "upper end vertebra"),
        _angle("cobb_measured_deg", "Cobb angle on the film"),
        _angle("cobb_simulated_deg", "Cobb angle of the model", _NO_POSE),
        _angle("ferguson_measured_deg", "Ferguson angle on the film"),
        _angle("ferguson_simulated_deg", "Ferguson angle of the model", _NO_POSE),
        STATUS,
    ),
)

GROUPS = ("fitted", "held_out")
MEASURES = {
    "rotation": ("deg", "rotations of segments since the erect film"),
    "place": ("mm", "distance of vertebrae from their places on the film"),
    "tilt": ("deg", "tilts of vertebrae"),
    "cobb": ("deg", "Cobb angles of the curves"),
    "ferguson": ("deg", "Ferguson angles of the curves"),
}
"""What models and films are compared by."""

ACCURACY = Table(
    "accuracy",
    "Errors of every model over all patients: one row per group of films, measure and model. "
    "Fitted films took part in personalising, held-out films did not; they are never mixed.",
    ("films", "measure", "model"),
    (
        Column("films", "text", "group of films", allowed=GROUPS),
        Column("measure", "text", "what is compared", allowed=tuple(MEASURES)),
        MODEL,
        Column("unit", "text", "unit of the errors", allowed=("mm", "deg")),
        Column("n_patients", "integer", "patients with a pose in every film of the group", low=0),
        Column("n", "integer", "errors that are pooled", low=0),
        Column(
            "rmse", "number", "root mean square of all errors", "see unit", null="nobody has a pose"
        ),
        Column(
            "mean_of_patients",
            "number",
            "mean over patients of their root mean square errors",
            "see unit",
            null="nobody has a pose",
        ),
        Column(
            "sd_of_patients",
            "number",
            "SD over patients of the same",
            "see unit",
            null="fewer than two patients",
        ),
        Column(
            "reading_noise",
            "number",
            "root mean square error that reading the films alone makes",
            "see unit",
            null="neither repeats nor the study tell how films are read",
        ),
        Column(
            "reduction_percent",
            "number",
            "by how much less than the root mean square error of linear_regions",
            "%",
            null="there is no such model",
        ),
        FREE,
        DECIDED,
        SCALE_FROM,
    ),
)

RANGES = {"below_0.2": (0.0, 0.2), "0.2_to_0.8": (0.2, 0.8), "0.8_to_1": (0.8, 1.0)}
"""Classes of the size of a rotation over the published end of its side (Jalalian 2017 Fig. 7)."""
BEYOND, EVERY = "beyond", "all"

BY_RANGE = Table(
    "by_range",
    "Errors of segments' rotations by how near they come to the published ends: one row per group "
    "of films, class and model, segments that turn against a bend apart.",
    ("films", "opposite", "range", "model"),
    (
        Column("films", "text", "group of films", allowed=GROUPS),
        Column("opposite", "flag", "whether the segments turn against a bend, or not at all"),
        Column(
            "range",
            "text",
            "size of the measured rotation over the published end of its side; beyond: the film "
            "has the segment where the published law has no load",
            allowed=(*RANGES, BEYOND, EVERY),
        ),
        MODEL,
        Column("n", "integer", "rotations", low=0),
        _angle("rmse_deg", "root mean square error", "there is no such rotation"),
        Column(
            "reduction_percent",
            "number",
            "by how much less than that of linear_regions",
            "%",
            null="there is no such model or rotation",
        ),
    ),
)

VARIED = {
    "enlargement": "ends of the published tangent beyond the rotations of the bending films, in %",
    "scale": "factor of the lateral stiffness of all segments, other rotations unchanged",
}
VARIANT = (
    Column(
        "varied",
        "text",
        "; ".join(f"{name}: {what}" for name, what in VARIED.items()),
        allowed=tuple(VARIED),
    ),
    Column("value", "number", "its value", "see varied", low=0.0),
)
SINGULAR = "singular"

VARIANTS = Table(
    "variants",
    "The published tangent model with one choice changed: one row per patient, choice, value and "
    "position.",
    ("specimen", "varied", "value", "position"),
    (
        SPECIMEN,
        *VARIANT,
        POSITION,
        FITTED,
        _angle(
            "law_rmse_deg",
            "root mean square over both bending films of the laws' rotations under the two forces "
            "less those of the film",
            "scale changes no rotation of the laws; or singular",
        ),
        _angle("rotation_rmse_deg", "root mean square error of the segments' rotations", _NO_POSE),
        Column(
            "place_rmse_mm",
            "number",
            "root mean square distance of the vertebrae from their places on the film",
            "mm",
            null=_NO_POSE,
            low=0.0,
        ),
        _angle(
            "moved_deg",
            "largest change of a segment's rotation from the model as the study has it",
            _NO_POSE,
        ),
        Column(
            "status",
            "text",
            "how the solve ended; singular: the films lie on the ends, where loads are infinite",
            allowed=(*Ended, SINGULAR),
        ),
        MESSAGE,
    ),
)

VARIATION = Table(
    "variation",
    "The published tangent model with one choice changed, over all patients: one row per choice, "
    "value and group of films.",
    ("varied", "value", "films"),
    (
        *VARIANT,
        Column("films", "text", "group of films", allowed=GROUPS),
        Column("n_patients", "integer", "patients with a pose in every film of the group", low=0),
        *(
            Column(name, "number", meaning, unit, null="nobody has a pose", low=0.0)
            for name, unit, meaning in (
                ("rotation_rmse_deg", "deg", "root mean square error of all rotations"),
                ("place_rmse_mm", "mm", "root mean square distance of all vertebrae"),
                ("moved_deg", "deg", "largest change of a rotation from the model as studied"),
            )
        ),
    ),
)

AGAINST_JALALIAN_2017 = against_paper("against_jalalian_2017")
