"""Names of the columns of `tasks.csv`, and the forms of files that a study of trunk loads reads.

What they hold is in `forms.yaml` beside this file.
"""

from pathlib import Path

from spinepipe.documents.form import read_forms
from spinepipe.units import ROTATIONS, TRANSLATIONS

UPRIGHT, FORCE = "upright", "force"

HANDS = tuple(f"hands_{way}_mm" for way in TRANSLATIONS)
PUSH_N = tuple(f"push_{way}_n" for way in TRANSLATIONS)
PUSH_NM = tuple(f"push_{axis}_nm" for axis in ROTATIONS)

TASKS, *GEOMETRY_FORMS = read_forms(Path(__file__).with_name("forms.yaml")).values()
MUSCLES, MUSCLE_PARAMETERS, BODY_FRAMES = GEOMETRY_FORMS


def turn(what: str, axis: str) -> str:
    """Column of the rotation of a body, or of trunk or pelvis, about an axis."""
    return f"{what}_{axis}_deg"
