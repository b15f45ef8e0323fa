"""What `spinepipe import` shows of data files and asks about them, as the text of import.yaml."""

import os
import re
import sys
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import typer
from rich.console import Console
from rich.table import Table
from rich.text import Text

from spinepipe.cli.find import vertebrae_of
from spinepipe.cohort.cohort import joint_names
from spinepipe.documents.text import NUMBER
from spinepipe.documents.yaml_text import YamlDocument, yaml_of_text
from spinepipe.problems import InputError, InputProblem, one_of
from spinepipe.report.words import count, listed
from spinepipe.testing_machine.channels import DIRECTIONS
from spinepipe.testing_machine.folder import read
from spinepipe.testing_machine.settings import FileForm
from spinepipe.testing_machine.sniff import seen, unit_of
from spinepipe.testing_machine.suggest import (
    ANSWERS,
    KINDS_OF_UNITS,
    Suggestion,
    likely_unit,
    suggested,
)

SETTINGS = "import.yaml"

USUAL_DEG = 0.1
"""Accuracy of one angle that is suggested: rigs are seldom better."""

NO_NAMES = ("raw", "data", "csv", "files", "export")
"""Names of folders that say nothing about a cohort."""

TURNS = tuple(word for word, way in DIRECTIONS.items() if way.turns)
PUSHES = tuple(word for word, way in DIRECTIONS.items() if not way.turns)


class Questions:
    """Asks, or takes every suggestion."""

    def __init__(self, yes: bool) -> None:
        self.yes = yes

    def ask(self, text: str, suggestion: Any, **how: Any) -> Any:
        """The answer; the suggestion where it is just accepted."""
        return suggestion if self.yes else typer.prompt(text, default=suggestion, **how)

    def choose(
        self,
        text: str,
        suggestion: str,
        allowed: Sequence[str],
        meant: Callable[[str], str] = str,
    ) -> str:
        """As `ask`, again until it is one of those allowed; a suggestion that is taken may be none.

        Parameters
        ----------
        meant : our word for what is typed.
        """
        while (answer := meant(self.ask(text, suggestion or None) or "")) not in allowed:
            if self.yes:
                break
            print(f"Allowed: {', '.join(allowed)}.")
        return answer


def described(
    files: Sequence[Path],
    ask: Questions,
    pattern: str | None,
    cohort: str | None,
    vertebrae: str | None,
    accuracy_deg: float | None,
) -> tuple[Path, str]:
    """The folder of the files and the text of the settings that describe them.

    Parameters
    ----------
    pattern, cohort, vertebrae, accuracy_deg : answers given beforehand; None: asked.

    Raises
    ------
    InputError
        Where a file holds no table, or, without questions, something cannot be told.
    """
    folder = Path(os.path.commonpath([one.absolute().parent for one in files]))
    names = [one.absolute().relative_to(folder).as_posix() for one in files]
    looked = [seen(path, name) for path, name in zip(files, names, strict=True)]
    try:
        suggestion = suggested(folder, looked, pattern)
    except InputError:
        if pattern is not None or ask.yes:
            raise
        print(f"Where do specimen and test stand in names such as {names[0]}?")
        pattern = typer.prompt("Pattern, such as {specimen}_{test}.csv")
        suggestion = suggested(folder, looked, pattern)
    _print_files(suggestion)
    _columns(suggestion, ask)
    _directions(suggestion, ask)
    if vertebrae is None:
        shown = " ".join(suggestion.vertebrae)
        vertebrae = ask.ask("Which vertebrae, from the lowest, which is held?", shown)
    suggestion = replace(suggestion, vertebrae=vertebrae_of(vertebrae))
    _joints(suggestion, ask)
    own = next(
        (n for n in (folder.name, folder.parent.name) if n.lower() not in NO_NAMES), "my_lab"
    )
    cohort = cohort or ask.ask(
        "Name of the cohort", re.sub("[^a-z0-9]+", "_", own.lower()).strip("_")
    )
    chain = suggestion.vertebrae
    what = f"{count(len(suggestion.specimens), 'specimen')} {chain[-1]}-{chain[0]}"
    tests = listed([one.replace("_", " ") for one in suggestion.tests])
    header = {
        "cohort": cohort,
        "title": f"{what}, {count(len(suggestion.tests), 'test')}: {tests}",
        "source": ask.ask("Source: who measured, when, how; licence", "not told"),
        "vertebrae": list(chain),
    }
    if suggestion.load_point_mm:
        header["load_point_mm"] = suggestion.load_point_mm
    kept, repeats = _cycles(folder, suggestion.settings(header, 0))
    first = int(kept > 2)
    if kept > 2 and not ask.yes:
        text = f"Cycles: {kept} in each file. Leave out the first as preconditioning?"
        first = int(typer.confirm(text, default=True))
    if accuracy_deg is None:
        if first and not ask.yes:  # else they are those, or nobody is asked
            _, repeats = _cycles(folder, suggestion.settings(header, first))
        told = (
            ""
            if np.isnan(repeats)
            else f" The cycles repeat within {repeats:.2g}, which is no accuracy."
        )
        text = f"Accuracy of one angle, deg?{told} Rigs are seldom better than {USUAL_DEG:g}"
        accuracy_deg = ask.ask(text, USUAL_DEG, type=float)
    header["accuracy"] = {"rotation_deg": accuracy_deg}
    return folder, suggestion.settings(header, first)


def document_of(text: str) -> YamlDocument:
    """Settings that no file holds yet.

    Raises
    ------
    InputError
        Where they are no YAML.
    """
    document, problems = yaml_of_text(text, SETTINGS)
    if document is None:
        raise InputError(problems)
    return document


def _cycles(folder: Path, text: str) -> tuple[int, float]:
    """The fewest cycles of a file, and SD of a rotation between cycles, deg; 0 if not readable."""
    try:
        tests = read(folder, document_of(text))
    except InputError:  # said when it is imported
        return 0, float("nan")
    kept = min(len(cut.kept) for test in tests.tests for cut in test.cuts)
    return kept, float("nan") if tests.rotation is None else tests.rotation.cycles


def _print_files(of: Suggestion) -> None:
    alike = all(one.form == of.files[0].form for one in of.files)
    form = FileForm.model_validate(of.files[0].form)
    names = f"names in line {form.names_line}" if form.names_line else "no names"
    how = f"separated by {form.delimiter}s, decimal {form.decimal}"
    if of.files[0].name.endswith(".xlsx"):
        how = "workbooks"
    names += f", numbers from line {form.first_line or form.names_line + 1}"
    names += "" if alike else " (the first; others differ)"
    of_what = (("specimen", of.specimens), ("test", of.tests))
    there = [f"{count(len(every), what)} ({listed(every)})" for what, every in of_what]
    print(f"{count(len(of.files), 'file')}, {', '.join(there)}; {how}, {names}.")


def _columns(of: Suggestion, ask: Questions) -> None:
    """Show what columns are taken as, until nothing is to be changed."""
    while True:
        columns = of.columns()
        _print_columns(of)
        text = "Right? Enter, or the number of a column to change"
        answer = ask.ask(text, "", show_default=False).strip()
        if not answer:
            return
        if not answer.isdecimal() or not 1 <= int(answer) <= len(columns):
            print(f"A number from 1 to {len(columns)}.")
            continue
        key = list(columns)[int(answer) - 1]
        what = ask.choose(f"{key} is ({', '.join(ANSWERS)})", of.taken[key][0], ANSWERS)
        unit = ""
        if what != "no":
            size = max(float(np.nanmax(np.abs(one.values))) for one in columns[key])
            clock = columns[key][0].clock
            told = (one.unit for one in columns[key] if KINDS_OF_UNITS.get(one.unit) == what)
            unit = next(told, "") or likely_unit(what, size, clock)
            if not clock:
                kinds = KINDS_OF_UNITS.items()
                units = [one for one, kind in kinds if kind == what and one != "clock"]
                text = f"Unit ({', '.join(units)})"
                unit = ask.choose(text, unit, units, lambda given: unit_of(given) or given)
        of.taken[key] = what, unit
        if what == "force":
            of.force_towards[key] = ask.choose("A positive number pushes to", "inferior", PUSHES)
            text = "Where forces act, mm anterior, superior, right of the joint"
            point: list[str] = []
            while len(point) != 3 or not all(map(NUMBER.fullmatch, point)):
                point = ask.ask(text, "0 0 0").split()
            of.load_point_mm[:] = map(float, point)


def _print_columns(of: Suggestion) -> None:
    ways: dict[Any, dict[str, list[str]]] = defaultdict(lambda: defaultdict(list))
    for file in of.files:
        _, loads, motion = of.channels(file)
        for one in (*loads, *motion):
            told = ways[one["column"]][of.of[file.name][1]]
            told += [one["positive"]] if one["positive"] not in told else []
    table = Table(box=None, pad_edge=False)
    for name in ("", "column", "values", "taken as", "a positive number turns towards"):
        table.add_column(name)
    for number, (key, there) in enumerate(of.columns().items(), start=1):
        what, unit = of.taken[key]
        low = min(float(np.nanmin(one.values)) for one in there)
        high = max(float(np.nanmax(one.values)) for one in there)
        some = "" if len(there) == len(of.files) else f" (in {count(len(there), 'file')})"
        words = ", ".join(f"{test} {' or '.join(way)}" for test, way in ways[key].items())
        if what == "no" and unit == "N":
            mean = np.nanmean(np.concatenate([one.values for one in there]))
            words = f"(mean {mean:.3g} N: a preload?)"
        taken = "not used" if what == "no" else f"{what}, {unit}"
        cells = (str(number), f"{key}{some}", f"{low:.4g} to {high:.4g}", taken, words)
        table.add_row(*map(Text, cells))
    Console(file=sys.stdout, width=110, highlight=False).print(table)


def _directions(of: Suggestion, ask: Questions) -> None:
    """Ask where moments turn, and refuse what lacks a moment, an angle or a direction."""
    for test in of.tests:
        text = f"A positive moment in {test} turns the upper vertebra towards"
        way = ask.choose(text, of.towards.get(test, ""), TURNS)
        if way not in TURNS:
            remedy = (
                "name the test FE, LB or AR in the files' names or by --pattern, or leave out --yes"
            )
            found = "a test whose name does not tell its direction"
            raise InputError([InputProblem(test, None, None, found, one_of(TURNS), remedy)])
        of.towards[test] = way
    for what in ("moment", "angle"):
        lack = [f.name for f in of.files if not any(of.taken[c.key][0] == what for c in f.columns)]
        if lack:
            remedy = f"say which column is the {what}; without --yes it is asked"
            told = InputProblem(
                lack[0], None, None, f"no {what}", f"one {what}", remedy, len(lack) - 1
            )
            raise InputError([told])


def _joints(of: Suggestion, ask: Questions) -> None:
    """Ask which joint an angle moves, where there are several and its name tells none."""
    joints = joint_names(of.vertebrae)
    for key, (what, _) in of.taken.items():
        if what == "angle" and len(joints) > 1 and of.joints.get(key) not in joints:
            of.joints[key] = ask.ask(
                f"{key} is the motion of which joint ({', '.join(joints)})", joints[0]
            )
