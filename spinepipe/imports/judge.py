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
from spinepipe.imports.imported import ImportedCohort, write
from spinepipe.plausibility.warnings.warning import PlausibilityWarning
from spinepipe.problems import InputError, InputProblem
from spinepipe.studies.plausibility import suspicions
from spinepipe.studies.registry import every_form

PARTS: Mapping[str, str] = {
    **dict.fromkeys(("test_against_load", "joints_against_load"), "positive"),
    **dict.fromkeys(("motion_against_name", "signs_lost"), "positive"),
    **dict.fromkeys(("rotations_exchanged", "column_repeated", "column_constant"), "column"),
    **dict.fromkeys(("column_zero", "joint_silent", "load_without_motion"), "column"),
}
"""The key that is suspected, by warning; it is the unit for all others."""

SPEAKS_OF = {
    "loads": re.compile("torque|moment|force|load|couple|kraft|fuerza"),
    "motion": re.compile("angle|rotation|displac|winkel|verschieb|dépl|ángulo|desplaz"),
}
"""Names of columns that tell what they hold, in small letters."""


def write_judged(
    imported: ImportedCohort, folder: Path, replace: bool
) -> tuple[list[str], list[InputProblem]]:
    """As `write`, unless `judge` objects; files that stayed, and warnings.

    Raises
    ------
    InputError
        As both do.
    """
    warnings: list[InputProblem] = []
    stayed = write(imported, folder, replace, lambda new: warnings.extend(judge(imported, new)))
    return stayed, warnings


def judge(imported: ImportedCohort, folder: Path) -> list[InputProblem]:
    """What looks wrong in the folder and stops nothing: it is of no setting, or it is meant.

    Parameters
    ----------
    folder : of the cohort as it would be, of its name.

    Raises
    ------
    InputError
        With all that names of columns speak against, else every problem that the reader of cohorts
        finds, else all that looks wrong in columns that settings made.
    """
    if exchanged := list(_against_names(imported)):
        raise InputError(exchanged)
    try:
        cohort = read(folder, every_form())
    except InputError as error:
        told = [
            _at_settings(imported, folder, one, None) or _at_origin(imported, one) or one
            for one in error.problems
        ]
        raise InputError(_once(told)) from error
    stops, rest = [], []
    for one in suspicions(cohort):
        if one.group in cohort.acknowledged_warnings:
            rest.append(one.problem)
            continue
        found = _at_settings(imported, folder, one.problem, one)
        if found is None and one.certain:
            found = _at_origin(imported, one.problem)
        if found is not None:
            stops.append(found)
        else:
            rest.append(one.with_switch if one.certain else one.problem)
    if stops:
        raise InputError(_once(stops))
    return rest


def _once(problems: Iterable[InputProblem]) -> Iterator[InputProblem]:
    """The first problem of each place, with how many more there are."""
    of_place: dict[tuple[object, ...], list[InputProblem]] = defaultdict(list)
    for one in problems:
        of_place[one.file, one.row, one.column, one.allowed].append(one)
    for first, *others in of_place.values():
        yield replace(first, others=first.others + len(others)) if others else first


def _against_names(imported: ImportedCohort) -> Iterator[InputProblem]:
    """Loads whose column speaks of motion, and the reverse: exchanged they may look right."""
    document = imported.settings
    if document is None:
        return
    for (stem, _), keys in imported.made_by.items():
        for key in (f"{key}.column" for key in keys if stem in SPEAKS_OF):
            name = _value(document.data, key)
            said = {of for of, words in SPEAKS_OF.items() if words.search(str(name).lower())}
            if said and stem not in said:
                remedy = "exchange the columns of loads and motion, or name it by its number if it "
                found, allowed = f"{name!r} in {stem}", f"a column of {stem}"
                place = document.place_of(key)
                yield InputProblem(*place, found, allowed, f"{remedy}is the right one")


def _at_origin(imported: ImportedCohort, problem: InputProblem) -> InputProblem | None:
    """The problem at the file and line that its row came from; None where none is known."""
    rows = imported.origins.get(problem.file.rpartition("/")[2].removesuffix(".csv"), ())
    at = (problem.row or 0) - 2  # the header of a table is line 1
    if not 0 <= at < len(rows):
        return None
    return replace(problem, file=rows[at][0], row=rows[at][1], rows=())


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
    data = document.data
    joint = _joint(folder / f"{stem}.csv", problem.row)
    own = [key for key in named if _value(data, f"{key}.joint") in (None, joint)] or named
    units = _units(imported, str(_value(data, f"{own[0]}.unit")), problem.found, warning)
    part = PARTS.get(warning.name, "unit") if warning is not None else "unit"
    part = "column" if units == [] else part  # no other unit would do
    keys = [_key(data, key, part) for key in own]
    if units is None:
        # the words of the remedy, with keys of the settings in the place of columns of the cohort
        remedy = re.sub(rf" in (?:{re.escape(folder.name)}/)?\w+\.csv", "", problem.remedy)
        for (_, column), others in imported.made_by.items():
            remedy = re.sub(rf"\b{column}\b", _key(data, others[0], part), remedy)
        remedy = remedy if keys[0] in remedy else f"{remedy}; correct {', '.join(keys)}"
        remedy += " or the unit of its load" if stem == "motion" and part == "unit" else ""
    else:
        suspected = " or ".join(units) or "another column"
        remedy = f"suspected: {suspected}; correct {', '.join(keys)}"
    if warning is not None:
        remedy += f" (if you mean it: acknowledged_warnings: [{warning.group}] in {document.file})"
    stands = _value(data, keys[0])
    found = problem.found if warning else f"{problem.column} {problem.found}"
    found = found if isinstance(stands, dict | list) else f"{stands!r}, and {found}"
    return InputProblem(*document.place_of(keys[0]), found, problem.allowed, remedy)


def _key(data: Any, key: str, part: str) -> str:
    """The part of what a key holds, or the key itself where it has no such part."""
    return key if _value(data, f"{key}.{part}") is None else f"{key}.{part}"


def _value(data: Any, key: str) -> Any:
    """What stands at a dotted key; None where nothing does."""
    for name in key.split("."):
        if isinstance(data, list) and name.isdecimal() and int(name) < len(data):
            data = data[int(name)]
        else:
            data = data.get(name) if isinstance(data, Mapping) else None
    return data


def _joint(path: Path, line: int | None) -> str | None:
    """The joint of a line of a table that has one line for each row."""
    if line is None or not path.is_file():
        return None
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.reader(file))
    return dict(zip(rows[0], rows[line - 1], strict=False)).get("joint")


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
