"""Who takes part: `subjects.csv`, for every kind that asks for sex, age, height and mass."""

from collections.abc import Iterator
from pathlib import Path

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.documents.form import read_forms
from spinepipe.muscles.subject import CM_PER_M, Subject
from spinepipe.problems import InputProblem
from spinepipe.units import GRAVITY_M_S2

HEIGHT_CM = (120.0, 220.0)
MASS_KG = (30.0, 300.0)
BMI = (14.0, 55.0)

LARGEST_HEIGHT_M = 3.0
"""A height that is no more than this is in metres."""

M_PER_INCH, M_PER_FOOT = 0.0254, 0.3048


SUBJECTS = read_forms(Path(__file__).with_name("forms.yaml"))["subjects"]


def subject_of(cohort: Cohort, specimen: str) -> Subject:
    """A person of `subjects.csv`."""
    rows = cohort.further["subjects"]
    row = rows[rows["specimen"] == specimen].iloc[0]
    height = float(row["height_cm"]) / CM_PER_M
    return Subject(row["sex"], float(row["age_years"]), height, float(row["mass_kg"]))


def subject_problems(cohort: Cohort, rows: pd.DataFrame) -> Iterator[InputProblem]:
    """Bodies that nobody has."""
    for line, row in rows.iterrows():
        place = (f"{cohort.name}/{SUBJECTS.file}", int(str(line)))
        yield from _size(place, str(row["specimen"]), row["height_cm"], row["mass_kg"])


def _size(place: tuple[str, int], who: str, cm: float, kg: float) -> Iterator[InputProblem]:
    """Height and mass each by itself; only where both can be, the two together."""
    if not HEIGHT_CM[0] <= cm <= HEIGHT_CM[1]:
        remedy = "correct it"
        if cm <= LARGEST_HEIGHT_M:
            remedy = f"is it in m? write {100.0 * cm:g}"
        elif HEIGHT_CM[0] <= 100.0 * M_PER_FOOT * cm <= HEIGHT_CM[1]:
            remedy = f"is it in feet? write {100.0 * M_PER_FOOT * cm:.1f}"
        elif HEIGHT_CM[0] <= kg <= HEIGHT_CM[1] and MASS_KG[0] <= cm <= MASS_KG[1]:
            remedy = (
                f"are height_cm and mass_kg exchanged, or inches ({100.0 * M_PER_INCH * cm:.0f})?"
            )
        elif HEIGHT_CM[0] <= 100.0 * M_PER_INCH * cm <= HEIGHT_CM[1]:
            remedy = f"is it in inches? write {100.0 * M_PER_INCH * cm:.1f}"
        elif HEIGHT_CM[0] <= cm / 10.0 <= HEIGHT_CM[1]:
            remedy = f"is it in mm? write {cm / 10.0:g}"
        yield InputProblem(
            *place, "height_cm", f"{who} is {cm:g} cm tall", _range(HEIGHT_CM), remedy
        )
    if not MASS_KG[0] <= kg <= MASS_KG[1]:
        remedy = "correct it"
        if kg > MASS_KG[1]:
            remedy = f"is it the weight in N? write {kg / GRAVITY_M_S2:.1f}"
        yield InputProblem(*place, "mass_kg", f"{who} weighs {kg:g} kg", _range(MASS_KG), remedy)
    elif HEIGHT_CM[0] <= cm <= HEIGHT_CM[1]:
        bmi = kg / (cm / 100.0) ** 2
        if not BMI[0] <= bmi <= BMI[1]:
            found = f"{who} has a BMI of {bmi:.1f} ({kg:g} kg, {cm:g} cm)"
            yield InputProblem(*place, "mass_kg", found, _range(BMI), "correct height or mass")


def _range(pair: tuple[float, float]) -> str:
    return f"{pair[0]:g} to {pair[1]:g}"
