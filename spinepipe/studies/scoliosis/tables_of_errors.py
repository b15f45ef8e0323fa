"""Tables that are made of the tables of patients: errors over a cohort, and what they hang on."""

from spinepipe.status import Ended
from spinepipe.studies.scoliosis.tables import (
    DECIDED,
    FITTED,
    FREE,
    MODEL,
    NO_POSE,
    POSITION,
    SCALE_FROM,
    angle,
)
from spinepipe.tables.schema import MESSAGE, SPECIMEN, Column, Table
from spinepipe.tables.shared import against_paper

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
        angle("rmse_deg", "root mean square error", "there is no such rotation"),
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
        angle(
            "law_rmse_deg",
            "root mean square over both bending films of the laws' rotations under the two forces "
            "less those of the film",
            "scale changes no rotation of the laws; or singular",
        ),
        angle("rotation_rmse_deg", "root mean square error of the segments' rotations", NO_POSE),
        Column(
            "place_rmse_mm",
            "number",
            "root mean square distance of the vertebrae from their places on the film",
            "mm",
            null=NO_POSE,
            low=0.0,
        ),
        angle(
            "moved_deg",
            "largest change of a segment's rotation from the model as the study has it",
            NO_POSE,
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
