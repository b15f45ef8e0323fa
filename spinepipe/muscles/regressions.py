"""How muscles and the rib cage grow with a person, as a table that users may replace.

Columns `muscle, level, quantity, form, intercept, sex, age, height, weight, source`: one row is one
regression. The columns intercept to weight are its coefficients. What they multiply is of a person:
male (1 of a male, 0 of a female), years of age, cm of height, kg of mass. Only the ratio of two
persons' values counts, so a quantity may have any unit. Forms, with u = intercept + sex * male:

- linear: u + age * years + height * cm + weight * kg
- exponential: e to the power of this sum, where a source says per cent per year, cm or kg: 0.3 %
  per kg is 0.003 in the column weight
- power: e^u * years^age * cm^height * kg^weight

Quantities, see `scaling`: ap_distance and ml_distance, how far a muscle's points lie in front of or
behind the line through the vertebrae (antero-posterior) and to the side of it (medio-lateral);
pcsa, the physiological cross-section of a muscle; rib_cage_area, the cross-section of the rib cage,
with which those of the discs and of the diaphragm grow.

`*` stands for all muscles or all levels; the row that names most applies, a named muscle before a
named level. Each quantity needs a row for all muscles and levels; rib_cage_area has no other.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from math import exp, isfinite
from pathlib import Path
from typing import Literal, get_args

from spinepipe.documents.csv_table import read_table
from spinepipe.documents.form import read_forms
from spinepipe.documents.rules import Listed, TableCheck
from spinepipe.muscles.subject import Subject
from spinepipe.muscles.trunk import SLICES
from spinepipe.problems import InputError, InputProblem

Quantity = Literal["ap_distance", "ml_distance", "pcsa", "rib_cage_area"]
Form = Literal["linear", "exponential", "power"]

QUANTITIES: tuple[Quantity, ...] = get_args(Quantity)
REGRESSION_LEVELS = (*SLICES, "S1")
"""Vertebrae that a row may name, from above: T1 to L5, and S1."""

(_FORM,) = read_forms(Path(__file__).with_name("forms.yaml")).values()
"""What the CSV file must look like: its columns and rules. Not the `Form` of a regression."""

ALL = "*"
"""Stands for all muscles, or all levels."""
COEFFICIENTS = ("intercept", "sex", "age", "height", "weight")
WORDS = ("muscle", "level", "quantity", "form", "source")
"""Columns of a row: its numbers, and its texts."""

PACKAGED: Mapping[str, str] = {
    "ct_trends": "regressions.csv",
    "constant_density": "constant_density.csv",
}
"""Tables that come along, by name: means of published CT trends; a body of constant density and
shape, whose widths go as the root of mass over height and whose areas go as mass over height.
"""


@dataclass(frozen=True)
class Regression:
    """One row of the table.

    Attributes
    ----------
    muscle, level : whose it is, ``*`` for all.
    form : how the coefficients make the quantity, see the module.
    coefficients : intercept, then those of sex, age (years), height (cm) and weight (mass, kg).
    source : where the numbers are from, in words.
    """

    muscle: str
    level: str
    quantity: Quantity
    form: Form
    coefficients: tuple[float, float, float, float, float]
    source: str

    @property
    def of(self) -> str:
        """Which muscle and level it holds for, in words."""
        if self.muscle == ALL:
            return "all" if self.level == ALL else f"all at {self.level}"
        return self.muscle if self.level == ALL else f"{self.muscle} at {self.level}"

    def value(self, subject: Subject) -> float:
        """Value of one person, in the row's own unit; positive.

        Raises
        ------
        ValueError
            If the row gives no positive number for this person.
        """
        intercept, *slopes = self.coefficients
        if self.form == "power":
            male, *sizes = subject.predictors
            found = exp(intercept + slopes[0] * male)
            for size, power in zip(sizes, slopes[1:], strict=True):
                found *= size**power
        else:
            found = intercept + sum(k * x for k, x in zip(slopes, subject.predictors, strict=True))
            found = exp(found) if self.form == "exponential" else found
        if not (isfinite(found) and found > 0.0):
            raise ValueError(
                f"the regression of {self.quantity} for {self.of} is {found:.4g} for a "
                f"{subject.sex} of {subject.age_years:g} y, {subject.height_m:.2f} m and "
                f"{subject.mass_kg:.1f} kg; it must be positive"
            )
        return found

    def ratio(self, subject: Subject, reference: Subject) -> float:
        """The person's value over the reference person's; no unit, above 0.

        Raises
        ------
        ValueError
            As `value` does, of either person.
        """
        return self.value(subject) / self.value(reference)


@dataclass(frozen=True)
class Regressions:
    """A table of regressions.

    Attributes
    ----------
    name : the file as the user names it, or the name of a packaged table.
    rows : in the order of the file; each quantity has one for all muscles and levels.
    """

    name: str
    rows: tuple[Regression, ...]

    def row(self, quantity: Quantity, muscle: str = ALL, level: str = ALL) -> Regression:
        """The row that applies to a muscle at a level.

        The first there is of: this muscle at this level, this muscle at all levels, all muscles at
        this level, all muscles at all levels.
        """
        asked = (quantity, muscle, level)
        if asked not in self._applies:
            places = ((muscle, level), (muscle, ALL), (ALL, level), (ALL, ALL))
            found = (self._at.get((quantity, *place)) for place in places)
            self._applies[asked] = next(row for row in found if row is not None)
        return self._applies[asked]

    @cached_property
    def _applies(self) -> dict[tuple[str, str, str], Regression]:
        """Rows found so far by (quantity, muscle, level), filled by `row`: each person asks for the
        same ones.
        """
        return {}

    @cached_property
    def _at(self) -> Mapping[tuple[str, str, str], Regression]:
        """Rows of the table by their own (quantity, muscle, level)."""
        return {(row.quantity, row.muscle, row.level): row for row in self.rows}


@cache
def packaged(name: str = "ct_trends") -> Regressions:
    """A table that comes along, by its name in `PACKAGED`."""
    return read_regressions(Path(__file__).with_name(PACKAGED[name]), name)


def read_regressions(path: Path, file: str) -> Regressions:
    """The table in a CSV file, checked.

    Parameters
    ----------
    path : CSV file. file : its name in messages, and that of the result.

    Raises
    ------
    InputError
        With every fault of the table.
    """
    table, problems = read_table(path, _FORM, file)
    if table is None:
        raise InputError(problems)
    refused = {(one.row, one.column) for one in problems}
    lists = {"quantities": Listed(QUANTITIES, file)}
    problems += TableCheck(_FORM, file, table, refused, lists.get, {}).problems()
    # the rib cage is one: no muscles, no levels
    thorax = table[table["quantity"] == "rib_cage_area"]
    for line, muscle, level in zip(thorax.index, thorax["muscle"], thorax["level"], strict=True):
        if (muscle, level) != (ALL, ALL):
            place, found = (file, int(line), "muscle"), f"{muscle}, {level}"
            problems.append(InputProblem(*place, found, "*, * for rib_cage_area", "it has one row"))
    if problems:
        raise InputError(problems)
    rows = []
    for cells in table.to_dict("records"):
        intercept, sex, age, height, weight = (float(cells[name]) for name in COEFFICIENTS)
        numbers = (intercept, sex, age, height, weight)
        muscle, level, quantity, form, source = (cells[name] for name in WORDS)
        rows.append(Regression(muscle, level, quantity, form, numbers, source))
    return Regressions(file, tuple(rows))
