"""What is wrong with a cohort before it is written, told at the line of the settings behind it.

The folder is read as any other is. What is found in a column that settings made (unit, direction,
name of the column) is theirs to mend; it stops the import, certain or not, unless it is meant.
"""

import csv
import re
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from io import StringIO
from math import isclose, log
from operator import itemgetter
from pathlib import Path
from typing import Any

from spinepipe.cohort import read
from spinepipe.cohort.columns import COHORT_YAML
from spinepipe.documents.names import EVERYONE
from spinepipe.documents.text import NUMBER
from spinepipe.imports.imported import UNITS, ImportedCohort, write
from spinepipe.plausibility.score import is_plausible
from spinepipe.plausibility.warnings.response import LOAD_COLUMNS, MOTION_COLUMNS
from spinepipe.plausibility.warnings.warning import PlausibilityWarning
from spinepipe.problems import InputError, InputProblem
from spinepipe.studies.plausibility import suspicions
from spinepipe.studies.registry import every_form
from spinepipe.units import COORDINATES

PARTS: Mapping[str, str] = {
    **dict.fromkeys(("test_against_load", "joints_against_load"), "positive"),
    **dict.fromkeys(("motion_against_name", "signs_lost"), "positive"),
    **dict.fromkeys(("rotations_exchanged", "column_repeated", "column_constant"), "column"),
    **dict.fromkeys(("column_zero", "joint_silent", "load_without_motion"), "column"),
}
"""The key that is suspected, by warning; it is the unit for all others."""

NOT_MEASURED = ("leave cells empty", "leave the cells empty", "look for a column filled down")
"""How remedies begin that take a column out of the cohort."""

SPEAKS_OF = {
    "loads": re.compile("torque|moment|force|load|couple|kraft|fuerza"),
    "motion": re.compile("angle|rotation|disp|winkel|verschieb|dépl|ángulo|desplaz"),
}
"""Names of columns that tell what they hold, in small letters, without remarks in brackets."""


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
    if absent := list(_absent(imported, folder)):
        raise InputError(absent)
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
    try:
        read(folder, every_form(complete=True))
    except InputError as error:  # a study that needs these rows refuses to run without them
        asked = "which studies that read this file ask for; others do not"
        rest += [replace(one, remedy=f"{one.remedy}, {asked}") for one in error.problems]
    return rest


def _once(problems: Iterable[InputProblem]) -> Iterator[InputProblem]:
    """The first problem of each place, with how many more there are."""
    of_place: dict[tuple[object, ...], list[InputProblem]] = defaultdict(list)
    for one in problems:
        of_place[one.file, one.row, one.column, one.allowed].append(one)
    for first, *others in of_place.values():
        yield replace(first, others=first.others + len(others)) if others else first


def _absent(imported: ImportedCohort, folder: Path) -> Iterator[InputProblem]:
    """Specimens that a file which stayed, as it is edited by hand, has no rows of."""
    for name in imported.by_hand:
        made, there = imported.files.get(name), folder / name
        if isinstance(made, str) and there.is_file():
            of_both = [
                [row.get("specimen") for row in csv.DictReader(StringIO(text))]
                for text in (made, there.read_text("utf-8-sig", "replace"))
            ]
            for lacking in dict.fromkeys(one for one in of_both[0] if one not in of_both[1]):
                place = (f"{folder.name}/{name}", None, "specimen", f"no row of '{lacking}'")
                remedy = f"the file stays as it is, edited by hand: add {lacking} to it"
                yield InputProblem(*place, "rows of every specimen of the settings", remedy)


def _against_names(imported: ImportedCohort) -> Iterator[InputProblem]:
    """Loads whose column speaks of motion, and the reverse: exchanged they may look right."""
    document = imported.settings
    if document is None:
        return
    for (stem, _), keys in imported.made_by.items():
        for key in (f"{key}.column" for key in keys if stem in SPEAKS_OF):
            name = _value(document.data, key)
            own = re.sub(r"[(\[].*?[)\]]", "", str(name)).lower()
            said = {of for of, words in SPEAKS_OF.items() if words.search(own)}
            if said and stem not in said:
                remedy = "exchange the columns of loads and motion, or name it by its number if it "
                found, allowed = f"{name!r} in {stem}", f"a column of {stem}"
                place = document.place_of(key)
                yield InputProblem(*place, found, allowed, f"{remedy}is the right one")


def _at_origin(imported: ImportedCohort, problem: InputProblem) -> InputProblem | None:
    """The problem at the file and line that its row came from; None where none is known.

    Keys of ``cohort.yaml`` came from those of the same name.
    """
    document, key = imported.settings, str(problem.column)
    in_header = problem.file.endswith(f"/{COHORT_YAML}") and document is not None
    if document is not None and in_header and key.partition(".")[0] in document.data:
        return replace(problem, file=document.file, row=document.line_of(key))
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
    about = warning or _row(folder / f"{stem}.csv", problem.row)
    part = PARTS.get(warning.name, "unit") if warning is not None else "unit"
    mends = [] if warning is None else _units_of_both(imported, warning)
    own = mends[0][1] if mends else _keys(imported, (stem, str(problem.column)), about)
    units = [name for name, _ in mends] or _units(imported, own[0], problem, warning)
    part = "column" if units == [] else part  # no other unit would do
    if problem.remedy.startswith(NOT_MEASURED):
        at = " and ".join(own)
        problem = replace(problem, remedy=f"delete {at}, where the axis is blocked or not measured")
    keys = [_key(data, key, part) for key in own]
    if mends:
        ways = (
            f"{name}; correct {', '.join(_key(data, k, part) for k in of)}" for name, of in mends
        )
        remedy = f"suspected: {', or '.join(ways)}"
    elif units is None:
        # the words of the remedy, with keys of the settings in the place of columns of the cohort
        remedy = re.sub(rf" in (?:{re.escape(folder.name)}/)?\w+\.csv", "", problem.remedy)
        for place in imported.made_by:
            others = " and ".join(_key(data, key, part) for key in _keys(imported, place, about))
            remedy = re.sub(rf"\b{place[1]}\b", others, remedy)
        remedy = remedy if keys[0] in remedy else f"{remedy}; correct {', '.join(keys)}"
    else:
        suspected = " or ".join(units) or "another column"
        remedy = f"suspected: {suspected}; correct {', '.join(keys)}"
    if warning is not None:
        remedy += f" (if you mean it: acknowledged_warnings: [{warning.group}] in {document.file})"
    stands = _value(data, keys[0])
    found = problem.found if warning else f"{problem.column} {problem.found}"
    found = found if isinstance(stands, dict | list) else f"{stands!r}, and {found}"
    return InputProblem(*document.place_of(keys[0]), found, problem.allowed, remedy)


def _keys(
    imported: ImportedCohort, place: tuple[str, str], about: PlausibilityWarning | Mapping[str, str]
) -> Sequence[str]:
    """Keys that made a column of what a finding or a row is about; all where that is not known."""
    told: list[Sequence[str]] = []
    for name in ("specimen", "test", "joint"):
        one = about.get(name) if isinstance(about, Mapping) else getattr(about, f"{name}s")
        told.append([one] if isinstance(one, str) and one != EVERYONE else one or ())
    specimens, tests, joints = told
    named = imported.made_by.get(place, ())
    data = imported.settings.data if imported.settings is not None else {}
    return [
        key
        for key in named
        if _fits(_value(data, f"{key}.joint"), joints)
        and any(
            _fits(specimen, specimens) and _fits(test, tests)
            for specimen, test in imported.tests_of.get(key, ((None, None),))
        )
    ] or named


def _fits(name: str | None, names: Sequence[str]) -> bool:
    return name is None or not names or name in names


def _key(data: Any, key: str, part: str) -> str:
    """The part of what a key holds, or the key itself where it has no such part."""
    of_markers = {"positive": "axes", "column": "clusters"}.get(part, part)
    names = (f"{key}.{part}", f"{key}.{of_markers}")
    return next((name for name in names if _value(data, name) is not None), key)


def _value(data: Any, key: str) -> Any:
    """What stands at a dotted key; None where nothing does."""
    for name in key.split("."):
        if isinstance(data, list) and name.isdecimal() and int(name) < len(data):
            data = data[int(name)]
        else:
            data = data.get(name) if isinstance(data, Mapping) else None
    return data


def _row(path: Path, line: int | None) -> Mapping[str, str]:
    """The cells of a line of a table that has one line for each row."""
    if line is None or not path.is_file():
        return {}
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.reader(file))
    return dict(zip(rows[0], rows[line - 1], strict=False))


def _group(imported: ImportedCohort, key: str, column: str) -> tuple[str, Mapping[str, float]]:
    """The unit that a key tells, and those that may stand there."""
    told = str(_value(imported.settings and imported.settings.data, f"{key}.unit"))
    unit = UNITS.get(column.rpartition("_")[2])
    return told, next((one for one in imported.units if told in one and unit in one), {})


def _units_of_both(
    imported: ImportedCohort, warning: PlausibilityWarning
) -> list[tuple[str, Sequence[str]]]:
    """Units of the motion or of its load that would explain their ratio, with their keys."""
    pairs = [(MOTION_COLUMNS[one], LOAD_COLUMNS[one]) for one in COORDINATES]
    pair = next((one for one in pairs if warning.problem.column in one), ())
    found = []
    for stem, column in zip(("motion", "loads"), pair, strict=False):
        keys = _keys(imported, (stem, column), warning)
        told, group = _group(imported, keys[0], column) if keys else ("", {})
        for size, name in {size: name for name, size in reversed(list(group.items()))}.items():
            times = size / group[told] if stem == "motion" else group[told] / size
            ratio = (warning.over_expected or 0.0) * times
            if times != 1.0 and is_plausible(ratio):
                found.append((stem == "loads", abs(log(ratio)), name, keys))
    # one joint alone has no load of its own
    found = [one for one in found if not (one[0] and warning.joints)]
    return [(name, keys) for *_, name, keys in sorted(found, key=itemgetter(0, 1))]


def _units(
    imported: ImportedCohort, key: str, problem: InputProblem, warning: PlausibilityWarning | None
) -> list[str] | None:
    """Units that would mend the numbers of a column; None where no unit is behind it.

    Those of the warning's factor beside what is told; smaller ones where a number is out of range.
    """
    told, units = _group(imported, key, str(problem.column))
    if warning is None:
        if not units or NUMBER.fullmatch(problem.found.strip("'")) is None:
            return None
        smaller = {size: name for name, size in reversed(list(units.items())) if size < units[told]}
        return list(smaller.values())
    if warning.factor is None or warning.over_expected is not None:
        return None
    wanted = units.get(told, 0.0) * warning.factor
    return [name for name, size in units.items() if isclose(size, wanted, rel_tol=0.05)][:1] or None
