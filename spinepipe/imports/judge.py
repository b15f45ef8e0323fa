"""What is wrong with a cohort before it is written, told at the line of the settings behind it.

The folder is read as any other is. What is found in a column that settings made (unit, direction,
name of the column) is theirs to mend; it stops the import, certain or not, unless it is meant.
"""

import csv
import re
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from math import isclose
from pathlib import Path
from typing import Any

from spinepipe.cohort import read
from spinepipe.documents.text import NUMBER
from spinepipe.imports.imported import ImportedCohort
from spinepipe.plausibility.warnings.warning import PlausibilityWarning
from spinepipe.problems import InputError, InputProblem
from spinepipe.studies.plausibility import suspicions
from spinepipe.studies.registry import every_form

SIGNS = frozenset(
    {"test_against_load", "joints_against_load", "motion_against_name", "signs_lost"},
)
"""Warnings about the direction in which a column is positive."""

COLUMNS = frozenset(
    {"rotations_exchanged", "column_repeated", "column_constant", "column_zero"}
    | {"joint_silent", "load_without_motion", "loop_backwards"}
)
"""Warnings about which column is taken; all others are about its unit."""


def judge(imported: ImportedCohort, folder: Path) -> list[InputProblem]:
    """What looks wrong in the folder and stops nothing: it is of no setting, or it is meant.

    Parameters
    ----------
    folder : of the cohort as it would be, of its name.

    Raises
    ------
    InputError
        With every problem that the reader of cohorts finds, else with all that looks wrong in
        columns that settings made.
    """
    try:
        cohort = read(folder, every_form())
    except InputError as error:
        told = [_at_settings(imported, folder, one, None) or one for one in error.problems]
        raise InputError(_once(told)) from error
    stops, rest = [], []
    for one in suspicions(cohort):
        if one.group in cohort.acknowledged_warnings:
            rest.append(one.problem)
        elif (found := _at_settings(imported, folder, one.problem, one)) is not None:
            stops.append(found)
        else:
            rest.append(one.with_switch if one.certain else one.problem)
    if stops:
        raise InputError(_once(stops))
    return rest


def _once(problems: Iterable[InputProblem]) -> Iterator[InputProblem]:
    """The first problem of each place and column, with how many more there are."""
    of_place: dict[tuple[object, ...], list[InputProblem]] = defaultdict(list)
    for one in problems:
        of_place[one.file, one.row, one.column, one.allowed].append(one)
    for first, *others in of_place.values():
        yield replace(first, others=first.others + len(others)) if others else first


def _at_settings(
    imported: ImportedCohort,
    folder: Path,
    problem: InputProblem,
    warning: PlausibilityWarning | None,
) -> InputProblem | None:
    """The problem at the keys that made its column; None where none did."""
    stem = problem.file.rpartition("/")[2].removesuffix(".csv")
    named = imported.made_by.get((stem, str(problem.column)), ())
    document = imported.settings
    if not named or document is None:
        return None
    joint = _cell(folder / f"{stem}.csv", problem.row, "joint")
    own = [key for key in named if _value(document.data, f"{key}.joint") in (None, joint)] or named
    part = "unit" if warning is None else _part(warning.name)
    told = str(_value(document.data, f"{own[0]}.unit"))
    units = _units(imported, told, problem.found, warning)
    part = "column" if units == [] else part  # no other unit would do
    keys = [_key(document.data, key, part) for key in own]
    stands = _value(document.data, keys[0])
    remedy = _remedy(imported, problem.remedy, part, folder.name, keys[0])
    if units is not None:
        wanted = f"suspected: {' or '.join(units)}" if units else "suspected: another column"
        remedy = f"{wanted}; correct {', '.join(keys)}"
    if warning is not None:
        remedy += f" (if you mean it: acknowledged_warnings: [{warning.group}] in {document.file})"
    found = problem.found if warning else f"{problem.column} {problem.found}"
    found = found if isinstance(stands, dict | list) else f"{stands!r}, and {found}"
    return InputProblem(
        document.file, document.line_of(keys[0]), keys[0], found, problem.allowed, remedy
    )


def _part(name: str) -> str:
    return "positive" if name in SIGNS else "column" if name in COLUMNS else "unit"


def _key(data: Any, key: str, part: str) -> str:
    """The part of what a key holds, or the key itself where it has no such part."""
    return key if _value(data, f"{key}.{part}") is None else f"{key}.{part}"


def _value(data: Any, key: str) -> Any:
    """What stands at a dotted key; None where nothing does."""
    for name in key.split("."):
        if isinstance(data, list) and name.isdecimal() and int(name) < len(data):
            data = data[int(name)]
        elif isinstance(data, Mapping):
            data = data.get(name)
        else:
            return None
    return data


def _cell(path: Path, line: int | None, column: str) -> str | None:
    """A cell of a table with one line for each row; None where there is none."""
    if line is None or not path.is_file():
        return None
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.reader(file))
    known = dict(zip(rows[0], rows[line - 1], strict=False)) if line <= len(rows) else {}
    return known.get(column)


def _units(
    imported: ImportedCohort, told: str, found: str, warning: PlausibilityWarning | None
) -> list[str] | None:
    """Units that would mend the numbers of a column; None where no unit is behind it.

    Those of the warning's factor beside what is told; smaller ones where a number is out of range.
    """
    units = next((group for group in imported.units if told in group), {})
    if warning is None:
        if not units or NUMBER.fullmatch(found.strip("'")) is None:
            return None
        smaller = {size: name for name, size in reversed(list(units.items())) if size < units[told]}
        return list(smaller.values())
    if warning.factor is None:
        return None
    wanted = units.get(told, 0.0) * warning.factor
    return [name for name, size in units.items() if isclose(size, wanted, rel_tol=0.05)][:1] or None


def _remedy(imported: ImportedCohort, remedy: str, part: str, cohort: str, key: str) -> str:
    """The words of a remedy, keys of the settings in the place of columns of the cohort."""
    assert imported.settings is not None
    words = re.sub(rf" in (?:{re.escape(cohort)}/)?\w+\.csv", "", remedy)
    words = words.replace("; convert the column", "")
    for (_, column), keys in imported.made_by.items():
        words = re.sub(rf"\b{column}\b", _key(imported.settings.data, keys[0], part), words)
    return words if key in words else f"{words}; correct {key}"
