"""Heights, masses and ages that are sound and no person's together: lb, inches, months."""

from collections.abc import Iterator

import numpy as np
import pandas as pd

from spinepipe.cohort.cohort import Cohort
from spinepipe.cohort.doubt import Doubt
from spinepipe.cohort.doubtful_places import file_of, first_line
from spinepipe.problems import Problem

KG_PER_LB, M_PER_INCH, M_PER_FOOT = 0.45359237, 0.0254, 0.3048

BMI = (13.0, 45.0)
"""kg/m2, chosen: persons are beyond it, few of them; a mass in lb raises it 2.2 times."""

USUAL_BMI = (16.0, 38.0)
"""Of a person once a unit is undone."""

HEIGHT_M = (1.2, 2.2)
"""Of who stands upright and is grown."""

MONTHS = 120.0
"""No person is so old in years; it is 10 years in months."""


def doubtful_persons(cohort: Cohort) -> Iterator[Doubt]:
    """Doubts about ``specimens.csv``."""
    table = cohort.specimens
    if not {"height_m", "mass_kg"} <= set(table.columns):
        return
    size, mass = (pd.to_numeric(table[name], errors="coerce") for name in ("height_m", "mass_kg"))
    age = pd.to_numeric(table.get("age_years", pd.Series(np.nan, table.index)), errors="coerce")
    file = file_of(cohort, "specimens")
    for row, who in enumerate(table["specimen"]):
        line = first_line(cohort, "specimens", row)
        sizes = (float(size.iloc[row]), float(mass.iloc[row]), float(age.iloc[row]))
        yield from of_person(file, line, who, "height_m", 1.0, *sizes)


def of_person(
    file: str,
    line: int | None,
    who: str,
    height_column: str,
    per_m: float,
    height_m: float,
    mass_kg: float,
    age_years: float,
) -> Iterator[Doubt]:
    """Doubts about one person; numbers that are not given are NaN.

    Parameters
    ----------
    height_column, per_m : where its height stands, and how many of its units are a metre.
    """
    if age_years >= MONTHS:
        remedy = f"suspected: age in months and not years; {age_years / 12.0:.0f}?"
        problem = Problem(file, line, "age_years", f"{age_years:g} ({who})", "years", remedy)
        yield Doubt(problem, "persons")
    if 0.0 < height_m < HEIGHT_M[0] or height_m > HEIGHT_M[1]:
        found = f"{who} is {height_m * per_m:g} tall"
        allowed = f"{HEIGHT_M[0] * per_m:g} to {HEIGHT_M[1] * per_m:g}"
        problem = Problem(file, line, height_column, found, allowed, _height(height_m, per_m))
        yield Doubt(problem, "persons")
    elif height_m > 0.0 and mass_kg > 0.0:
        bmi = mass_kg / height_m**2
        if not BMI[0] <= bmi <= BMI[1]:
            found = f"{who} has a BMI of {bmi:.1f} ({mass_kg:g} kg)"
            remedy = "look at height and mass"
            if USUAL_BMI[0] <= bmi * KG_PER_LB <= USUAL_BMI[1]:
                remedy = f"suspected: mass in lb and not kg; {mass_kg * KG_PER_LB:.1f}?"
            allowed = f"{BMI[0]:g} to {BMI[1]:g}"
            yield Doubt(Problem(file, line, "mass_kg", found, allowed, remedy), "persons")


def _height(height_m: float, per_m: float) -> str:
    """The unit that makes a height one of a person, or what else to do."""
    told = height_m * per_m
    for factor, unit in ((M_PER_INCH, "inches"), (M_PER_FOOT, "feet"), (0.01, "cm"), (1.0, "m")):
        if HEIGHT_M[0] <= told * factor <= HEIGHT_M[1] and factor * per_m != 1.0:
            return f"suspected: height in {unit}; {told * factor * per_m:.4g}?"
    return "correct it"
