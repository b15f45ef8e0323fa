"""A warning about files that are sound cell by cell, with its words from `warnings.csv`."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from spinepipe.cohort.cohort import Cohort, Group
from spinepipe.cohort.columns import COHORT_YAML
from spinepipe.cohort.load_response import of_specimens
from spinepipe.documents.csv_table import read_rows
from spinepipe.plausibility.score import has_range, table, usual
from spinepipe.problems import InputProblem

PACKAGE = "spinepipe.plausibility.warnings"


@dataclass(frozen=True)
class PlausibilityWarning:
    """One thing that looks wrong.

    Attributes
    ----------
    group : what can be meant though it looks wrong: ``acknowledged_warnings`` in cohort.yaml.
    certain : it cannot be right; no run starts with it unless the cohort says that it is meant.
    name : its row in `warnings.csv`. factor : of all numbers of its column that would mend it.
    specimens, tests, joints : that it is about; none: all that have the column.
    over_expected : motion over that of its load, where a unit of either may be behind it.
    """

    problem: InputProblem
    group: Group
    certain: bool = False
    name: str = ""
    factor: float | None = None
    specimens: tuple[str, ...] = ()
    tests: tuple[str, ...] = ()
    joints: tuple[str, ...] = ()
    over_expected: float | None = None

    @property
    def with_switch(self) -> InputProblem:
        """The problem, with what to write where it is meant."""
        told = self.problem
        remedy = (
            f"{told.remedy} (if you mean it: acknowledged_warnings: [{self.group}] in cohort.yaml)"
        )
        place = (told.file, told.row, told.column)
        return InputProblem(*place, told.found, told.allowed, remedy)


class WarningGroup(NamedTuple):
    """Warnings of one sort, and the specimens that they are about."""

    warnings: tuple[PlausibilityWarning, ...]
    specimens: frozenset[str]

    @classmethod
    def of(
        cls, warnings: Iterable[PlausibilityWarning], specimens: Iterable[str]
    ) -> "WarningGroup":
        """From anything that yields them."""
        return cls(tuple(warnings), frozenset(specimens))


class TableCell(NamedTuple):
    """A table by its stem, a row as the table counts it from 0, and a column."""

    stem: str
    row: Any
    column: str | None


@cache
def _texts() -> dict[str, dict[str, Any]]:
    return {row["warning"]: row for row in table(PACKAGE, "warnings")}


def warn(
    cohort: Cohort,
    name: str,
    place: TableCell,
    /,
    *,
    remedy: str | None = None,
    certain: bool | None = None,
    group: Group | None = None,
    factor: float | None = None,
    whose: Iterable[object] = (),
    of_tests: Iterable[str] = (),
    of_joints: Iterable[str] = (),
    over_expected: float | None = None,
    **values: object,
) -> PlausibilityWarning:
    """The warning of a row of `warnings.csv`, about a place in the tables of a cohort.

    Parameters
    ----------
    remedy, certain, group : in place of those of the row. factor : of the numbers of the column
        that would mend it, if a unit is behind it. whose : specimens, ``{whose}`` in texts.
    of_tests, of_joints : that it is about, where ``{test}`` and ``{joint}`` do not tell them.
    values : what the texts have in braces besides; ``{range}`` is that of the same name.
    """
    text = _texts()[name]
    specimens = tuple(dict.fromkeys(map(str, whose)))
    tests = tuple(of_tests) or ((str(values["test"]),) if "test" in values else ())
    joints = tuple(of_joints) or ((str(values["joint"]),) if "joint" in values else ())
    values["whose"] = of_specimens(specimens, cohort.specimen_names)
    if has_range(name):
        values.setdefault("range", usual(name))
    problem = InputProblem(
        file_of(cohort, place.stem),
        line_of(cohort, place),
        place.column,
        text["found"].format(**values),
        text["allowed"].format(**values),
        text["remedy"].format(**values) if remedy is None else remedy,
    )
    sure = text["certain"] == "yes" if certain is None else certain
    about = (specimens, tests, joints, over_expected)
    return PlausibilityWarning(problem, group or text["group"], sure, name, factor, *about)


def file_of(cohort: Cohort, stem: str) -> str:
    """A table's file in messages."""
    return f"{cohort.folder.resolve().name}/{stem if '.' in stem else f'{stem}.csv'}"


def line_of(cohort: Cohort, place: TableCell) -> int | None:
    """Line, as an editor shows it; tables that kinds read besides count rows by it already."""
    stem, row, _ = place
    if row is None or stem == COHORT_YAML:
        return None
    if stem in cohort.further:
        return int(row)
    rows, _ = read_rows(cohort.folder / f"{stem}.csv", stem)
    return None if rows is None or row >= len(rows.lines) else rows.lines[int(row)]


def first_row(
    cohort: Cohort,
    stem: str,
    *,
    filled: str | None = None,
    **names: str,
) -> int | None:
    """The first row with these names, ``*`` for each; of a column one not empty or 0, if any."""
    table: pd.DataFrame = getattr(cohort, stem)
    rows = pd.Series(True, table.index)
    for column, name in names.items():
        rows &= table[column].isin([name, "*"])
    chosen = rows if filled is None else rows & table[filled].notna() & (table[filled] != 0.0)
    found = np.flatnonzero(chosen if chosen.any() else rows)
    return int(found[0]) if len(found) else None
