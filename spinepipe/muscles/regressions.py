"""How muscles and the rib cage grow with a person, as a table that users may replace.

Columns `muscle, level, quantity, form, intercept, sex, age, height, weight, source`. Predictors are
sex (1 male, 0 female), age in years, height in cm, weight as mass in kg. Only the ratio of two
persons counts, so a quantity may have any unit. Forms, with u = intercept + sex * male:

- linear: u + age * years + height * cm + weight * kg
- exponential: e to that power, where a source says per cent per year, cm or kg
- power: e^u * years^age * cm^height * kg^weight

`*` stands for all muscles or all levels; the row that names most applies, a named muscle before a
named level. Each quantity needs a row for all muscles and levels.
"""

import csv
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from importlib.resources import files
from math import exp, isfinite
from pathlib import Path
from typing import Literal, get_args

from spinepipe.muscles.subject import Subject
from spinepipe.muscles.trunk import SLICES
from spinepipe.problems import InputError, Problem, Spelling, one_of

Quantity = Literal["ap_distance", "ml_distance", "pcsa", "rib_cage_area"]
Form = Literal["linear", "exponential", "power"]

QUANTITIES: tuple[Quantity, ...] = get_args(Quantity)
FORMS: tuple[Form, ...] = get_args(Form)
REGRESSION_LEVELS = (*SLICES, "S1")
"""Vertebrae that a row may name."""

ALL = "*"
COEFFICIENTS = ("intercept", "sex", "age", "height", "weight")
COLUMNS = ("muscle", "level", "quantity", "form", *COEFFICIENTS, "source")

PACKAGED: Mapping[str, str] = {
    "ct_trends": "regressions.csv",
    "constant_density": "constant_density.csv",
}
"""Tables that come along: means of published CT trends; a body of constant density and shape."""


@dataclass(frozen=True)
class Regression:
    """One row; `coefficients` are intercept, sex, age, height, weight."""

    muscle: str
    level: str
    quantity: Quantity
    form: Form
    coefficients: tuple[float, float, float, float, float]
    source: str

    @property
    def of(self) -> str:
        """What it holds for, in words."""
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
        """The person's value over the reference person's."""
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
        """The row that applies to a muscle at a level."""
        asked = (quantity, muscle, level)
        if asked not in self._applies:
            places = ((muscle, level), (muscle, ALL), (ALL, level), (ALL, ALL))
            found = (self._at.get((quantity, *place)) for place in places)
            self._applies[asked] = next(row for row in found if row is not None)
        return self._applies[asked]

    @cached_property
    def _applies(self) -> dict[tuple[str, str, str], Regression]:
        """Rows that were asked for: each person asks for the same ones."""
        return {}

    @cached_property
    def _at(self) -> Mapping[tuple[str, str, str], Regression]:
        return {(row.quantity, row.muscle, row.level): row for row in self.rows}


@cache
def packaged(name: str = "ct_trends") -> Regressions:
    """A table that comes along, by its name in `PACKAGED`."""
    text = files("spinepipe.muscles").joinpath(PACKAGED[name]).read_text(encoding="utf-8")
    return _parsed(text, name)


def read_regressions(path: str | Path, file: str | None = None) -> Regressions:
    """A user's table.

    Parameters
    ----------
    path : CSV file. file : its name in messages; None: the path.

    Raises
    ------
    InputError
        With every fault of the table.
    """
    named = str(path) if file is None else file
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        fault = Problem(named, None, None, str(error), "a CSV file in UTF-8", "check the file")
        raise InputError([fault]) from error
    return _parsed(text, named)


def _parsed(text: str, file: str) -> Regressions:
    lines = csv.DictReader(text.splitlines(), restkey="more", restval="")
    missing = [name for name in COLUMNS if name not in (lines.fieldnames or ())]
    if missing:
        raise InputError(
            Problem(file, 1, name, "no such column", one_of(COLUMNS), "add the column")
            for name in missing
        )
    rows: list[Regression] = []
    problems: list[Problem] = []
    words = {column: Spelling(known, "name one of these") for column, known in _WORDS.items()}
    for line, cells in enumerate(lines, start=2):
        faults = list(_cell_problems(file, line, cells, words))
        problems += faults
        if not faults:
            rows.append(_row(cells))
    problems += _table_problems(file, rows) if not problems else []
    if problems:
        raise InputError(problems)
    return Regressions(file, tuple(rows))


def _row(cells: Mapping[str, str]) -> Regression:
    intercept, sex, age, height, weight = (float(cells[name]) for name in COEFFICIENTS)
    return Regression(
        cells["muscle"],
        cells["level"],
        next(name for name in QUANTITIES if name == cells["quantity"]),
        next(name for name in FORMS if name == cells["form"]),
        (intercept, sex, age, height, weight),
        cells["source"],
    )


_WORDS: Mapping[str, Sequence[str]] = {
    "level": (ALL, *REGRESSION_LEVELS),
    "quantity": QUANTITIES,
    "form": FORMS,
}
"""What the columns of words may say."""


def _cell_problems(
    file: str, line: int, cells: Mapping[str, str], words: Mapping[str, Spelling]
) -> Iterator[Problem]:
    for column, of in words.items():
        if cells[column] not in of.known:
            remedy = of.remedy(cells[column])
            yield Problem(file, line, column, repr(cells[column]), of.allowed, remedy)
    for column in COEFFICIENTS:
        if not _is_number(cells[column]):
            yield Problem(
                file, line, column, repr(cells[column]), "a finite number", "0 if it has no effect"
            )
    for column in ("muscle", "source"):
        if not cells[column].strip():
            yield Problem(file, line, column, "nothing", "text", f"fill in the {column}")
    if cells["quantity"] == "rib_cage_area" and (cells["muscle"], cells["level"]) != (ALL, ALL):
        found = f"{cells['muscle']}, {cells['level']}"
        yield Problem(file, line, "muscle", found, "*, * for rib_cage_area", "it has one row")


def _table_problems(file: str, rows: list[Regression]) -> Iterator[Problem]:
    places = [(row.quantity, row.muscle, row.level) for row in rows]
    for at, place in enumerate(places):
        if place in places[:at]:
            yield Problem(
                file, None, "quantity", " ".join(place), "each once", "remove one of the rows"
            )
    for quantity in QUANTITIES:
        if (quantity, ALL, ALL) not in places:
            yield Problem(
                file,
                None,
                "quantity",
                f"no row for {quantity} of all muscles at all levels",
                "one row with * and *",
                "add it; it holds wherever no other row does",
            )


def _is_number(cell: str) -> bool:
    try:
        return isfinite(float(cell))
    except ValueError:
        return False
