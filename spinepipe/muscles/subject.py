"""One person, as far as a model is scaled by: sex, age, height and mass."""

from dataclasses import dataclass
from typing import Literal

from spinepipe.facts import numbers

CM_PER_M = 100.0


@dataclass(frozen=True)
class Subject:
    """A person.

    Attributes
    ----------
    sex : male or female; regressions count 1 for male, 0 for female.
    age_years, height_m, mass_kg : at the time of the task.
    """

    sex: Literal["male", "female"]
    age_years: float
    height_m: float
    mass_kg: float

    @property
    def bmi(self) -> float:
        """Body mass index, kg/m2."""
        return self.mass_kg / self.height_m**2

    @property
    def predictors(self) -> tuple[float, float, float, float]:
        """What regressions are of: male (1 or 0), age in years, height in cm, mass in kg."""
        male = 1.0 if self.sex == "male" else 0.0
        return male, self.age_years, CM_PER_M * self.height_m, self.mass_kg


REFERENCE = Subject("male", *numbers(__name__, "reference_man").values())
"""Whom the published model fits best."""
