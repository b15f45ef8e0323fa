"""Table of nuisances: how far a fit has moved joint centres and axes from where they are stated."""

from spinepipe.studies.cohort_stiffness.representations import NUISANCE
from spinepipe.studies.cohort_stiffness.tables import FITTED_TO
from spinepipe.tables.schema import JOINT, SPECIMEN, Column, Table
from spinepipe.units import ROTATIONS, TRANSLATIONS

PARAMETERS = (*(f"centre_{axis}" for axis in TRANSLATIONS), *(f"tilt_{turn}" for turn in ROTATIONS))
"""What the nuisances of a joint are called."""


def _number(name: str, meaning: str, null: str | None = None, low: float | None = None) -> Column:
    return Column(name, "number", meaning, "mm or deg, see unit", null, low=low)


NUISANCES = Table(
    "nuisances",
    "Errors of joint centres and axes that were fitted beside stiffness: one row per specimen, "
    "representation, load cases fitted to, joint and parameter, where the fit has a stiffness.",
    ("specimen", "representation", "fitted_to", "joint", "parameter"),
    (
        SPECIMEN,
        Column("representation", "text", "see stiffness", allowed=NUISANCE),
        FITTED_TO,
        JOINT,
        Column(
            "parameter",
            "text",
            "centre_...: where the centre lies from the stated one along that axis of the joint; "
            "tilt_...: of the joint's axes about that axis, as Z-X'-Y'' angles",
            allowed=PARAMETERS,
        ),
        Column("unit", "text", "unit of the numbers", allowed=("mm", "deg")),
        _number("value", "what the fit has of it; 0 is as stated"),
        _number("prior_sd", "SD of its prior, which is around 0", low=0.0),
        _number(
            "standard_error",
            "standard error, to first order, the prior counted in: as large as prior_sd where no "
            "reading tells of it",
            "at a bound, or fewer readings than stiffnesses",
            low=0.0,
        ),
        Column(
            "pull",
            "number",
            "value over prior_sd: beyond 3 either way the prior is too narrow, or something else "
            "is wrong that a displaced joint imitates",
        ),
    ),
)
