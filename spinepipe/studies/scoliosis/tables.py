"""Tables of studies of kind scoliosis."""

from spinepipe.status import Ended, Status
from spinepipe.studies.scoliosis.population import PER_SEGMENT
from spinepipe.studies.scoliosis.settings import MODELS
from spinepipe.tables.schema import JOINT, MESSAGE, SPECIMEN, Column, Table

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

NO_POSE = "the solve found no pose"
_LINEAR = "the law is linear"
_NO_INTERVAL = "the model gives none"
_NO_REGION = "no region was looked for"
_NOT_FITTED = "the model is not fitted through the simulator, or was made by an earlier version"
_EARLIER = "made by an earlier version"
_OPEN = "the films leave this end open, or no region was looked for"


def angle(name: str, meaning: str, null: str | None = None) -> Column:
    """A column of angles."""
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
        Column(
            "films_low",
            "number",
            "lower end of the 95 % region that the patient's films leave the ratio: all else is "
            "fitted anew, and the ratio itself is not drawn to the population (profile likelihood)",
            null=_OPEN,
            low=0.0,
        ),
        Column("films_high", "number", "upper end of it", null=_OPEN, low=0.0),
        Column(
            "open_below",
            "flag",
            "whether the films allow every ratio below, down to 5 SD of the population",
            null=_NO_REGION,
        ),
        Column("open_above", "flag", "the same above, up to 5 SD", null=_NO_REGION),
        Column(
            "identifiable",
            "flag",
            "whether the films tell both ends; else the ratio is the population's, and no finding "
            "about the patient",
            null=_NO_REGION,
        ),
        angle("lower_end_deg", "end of the tangent to the left, negative", _LINEAR),
        angle("upper_end_deg", "end of the tangent to the right", _LINEAR),
        Column("opposite", "flag", "whether it turns against a bend, or not at all"),
        Column(
            "constrained",
            "flag",
            "whether the films asked for less or more stiffness than is allowed",
        ),
        FREE,
        DECIDED,
        SCALE_FROM,
        Column(
            "fit_status",
            "text",
            "how the fit to the bending films ended, with the poses that the model takes from the "
            "erect one",
            null=_NOT_FITTED,
            allowed=(Status.CONVERGED, Status.CONVERGED_AT_BOUND, Status.NOT_CONVERGED),
        ),
        Column(
            "n_optima",
            "integer",
            "distinct optima found from all starts",
            null=_NOT_FITTED,
            low=0,
        ),
    ),
)

POPULATION = Table(
    "population",
    "What the segments of all patients have in common, towards which tangent_fitted draws those of "
    "which films tell little: one row per quantity and joint.",
    ("quantity", "joint"),
    (
        Column(
            "quantity",
            "text",
            "ratio: stiffness at the erect pose over the patient's geometric mean; or the size of "
            "an end",
            allowed=PER_SEGMENT,
        ),
        JOINT,
        Column("unit", "text", "unit of mean, low and high; none of a ratio"),
        *(
            Column(name, "number", meaning, "see unit", low=0.0)
            for name, meaning in (
                ("mean", "geometric mean over patients"),
                ("low", "lower end of the range of 95 % of patients"),
                ("high", "upper end of it"),
            )
        ),
        Column("sd_log", "number", "SD between segments of one level, of the logarithm", low=0.0),
        Column("n_patients", "integer", "patients it was learned from", low=0),
        Column("rounds", "integer", "times that all patients were fitted", low=1),
        Column(
            "last_change",
            "number",
            "largest change of a logarithm in the last round",
            null="nobody has a fit",
            low=0.0,
        ),
        Column(
            "place_sd_mm", "number", "SD of a place on a film less the model's, as weighed", "mm"
        ),
        angle("tilt_sd_deg", "SD of a tilt on a film less the model's, as weighed"),
        MESSAGE,
        Column(
            "status",
            "text",
            "whether the population stood still before the rounds were over",
            null=_EARLIER,
            allowed=(Status.CONVERGED, Status.NOT_CONVERGED),
        ),
    ),
)

DISPLACEMENTS = Table(
    "displacements",
    "Lateral rotation of every segment since the erect film, right positive, and where its upper "
    "vertebra is: one row per patient, model, position and joint.",
    ("specimen", "model", "position", "joint"),
    (
        SPECIMEN,
        MODEL,
        POSITION,
        FITTED,
        JOINT,
        angle("measured_deg", "rotation on the film"),
        angle("simulated_deg", "rotation of the model", NO_POSE),
        *(
            Column(
                f"off_{way}_mm",
                "number",
                "place of the segment's upper vertebra in the model less that on the film, "
                f"{where}",
                "mm",
                null=NO_POSE,
            )
            for way, where in (("right", "to the right"), ("up", "up"))
        ),
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
        angle("rotation_rmse_deg", "root mean square error of the segments' rotations", NO_POSE),
        Column(
            "place_rmse_mm",
            "number",
            "root mean square distance of the vertebrae from their places on the film",
            "mm",
            null=NO_POSE,
            low=0.0,
        ),
        angle("tilt_rmse_deg", "root mean square error of the vertebrae's tilts", NO_POSE),
        Column("push_right_n", "number", "push to the right at the top", "N", null=NO_POSE),
        Column("push_up_n", "number", "push up at the top", "N", null=NO_POSE),
        Column(
            "push_right_bending_nm",
            "number",
            "moment to the right at the top",
            "N m",
            null=NO_POSE,
        ),
        Column(
            "push_extension_nm",
            "number",
            "moment at the top that keeps it from tipping to the front or back",
            "N m",
            null="the solve found no pose, or the top may tip",
        ),
        Column("missed_mm", "number", "distance by which the top misses its place", "mm", low=0.0),
        angle("missed_deg", "angle by which the top misses its tilt"),
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
        Column(
            "region",
            "text",
            "PT: proximal thoracic, apex down to T5; MT: main thoracic, down to T11; TL/L: below",
            allowed=("PT", "MT", "TL/L"),
        ),
        Column("side", "text", "side of its bulge", allowed=("right", "left")),
        Column("lower_vertebra", "text", "lower end vertebra"),
        Column("apex_vertebra", "text", "apex"),
        Column("upper_vertebra", "text", "upper end vertebra"),
        angle("cobb_measured_deg", "Cobb angle on the film"),
        angle("cobb_simulated_deg", "Cobb angle of the model", NO_POSE),
        angle("ferguson_measured_deg", "Ferguson angle on the film"),
        angle("ferguson_simulated_deg", "Ferguson angle of the model", NO_POSE),
        STATUS,
    ),
)
