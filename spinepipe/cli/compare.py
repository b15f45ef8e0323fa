"""`spinepipe compare`: two studies side by side, in the terminal and as a page."""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

import typer

from spinepipe.api.results import Results, compare
from spinepipe.cli.find import unknown
from spinepipe.files import appearing, folders_in
from spinepipe.problems import InputError, InputProblem
from spinepipe.report.overview.index import TEMPLATES
from spinepipe.report.overview.side_by_side import (
    APART,
    ONE,
    VALUE,
    VERDICT,
    Pair,
    SideBySide,
    StudyDifference,
    counted,
    origins_that_differ,
    paired,
    settings_that_differ,
)
from spinepipe.report.overview.stored import stored_conclusions
from spinepipe.report.page.study_page import rendered
from spinepipe.studies import read as studies
from spinepipe.studies.study import STUDIES
from spinepipe.tables import read_metadata

LEVELS = {VERDICT: "stop", APART: "stop", VALUE: "check", ONE: "check"}
"""How urgent each difference of conclusions is."""

BY_THE_CLOCK = "ended", "check_minutes"
"""The conclusion, rule and verdict, of a result that is compared with nothing."""


OF_EITHER = "name of a study that was computed, or a folder of its results"


def command(
    context: typer.Context,
    a: Annotated[str, typer.Argument(help=OF_EITHER)],
    b: Annotated[str, typer.Argument(help=OF_EITHER)],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE.html", help="page to write")
    ] = None,
) -> int:
    """Set two studies side by side."""
    if output and output.suffix != ".html":
        place = "command line", None, "-o"
        raise InputError([InputProblem(*place, output.name, "FILE.html", "rename it")])
    both = side_by_side(*(_folder(name, context.obj) for name in (a, b)))
    told = [*lines(both)]
    if output:  # first: who reads the lines may stop early, as `head` does
        title = f"{both.names[0]} and {both.names[1]}"
        with appearing(output) as temporary:
            page = rendered("compare.html", (TEMPLATES,), title=title, both=both, levels=LEVELS)
            temporary.write_text(page, "utf-8")
        told.append(f"\npage: {output}")
    print("\n".join(told))
    return 0


def _folder(name: str, root: Path) -> Path:
    """The folder of results that a study's name or a path means.

    Raises
    ------
    InputError
        Where there is none.
    """
    results = root / "results"
    if os.sep in name and Path(name).is_dir():
        return Path(name).absolute()
    known = [path.name for path in folders_in(results)]
    if name not in known:
        raise unknown("study with results", name, known)
    return results / name


def side_by_side(a: Path, b: Path) -> SideBySide:
    """Two folders of results held against each other.

    Raises
    ------
    InputError
        Where the clock ended one of them.
    FileNotFoundError
        Where one of them has no tables.
    DamagedFile
        For a table that is not as it was written.
    """
    sides, concluded = (Results(a), Results(b)), (stored_conclusions(a), stored_conclusions(b))
    for folder, those in zip((a, b), concluded, strict=True):
        if BY_THE_CLOCK in {(one.rule, one.verdict) for one in those}:
            found = "a search that the clock ended, so that its answer hangs on the computer"
            allowed, remedy = "results that any computer comes to", "search again without minutes"
            raise InputError([InputProblem(folder.name, None, "minutes", found, allowed, remedy)])
    kinds = tuple(one.provenance["kind"] for one in sides)
    tables, left_out = _tables(*sides)
    settings, note = _settings(a, b, kinds[0] == kinds[1])
    told = [{name: read_metadata(one.files[name]) for name in one} for one in sides]
    return SideBySide(
        names=_names(a, b),
        kinds=(kinds[0], kinds[1]),
        settings=settings,
        settings_note=note,
        conclusions=paired(*concluded, kinds[0] == kinds[1]),
        origin=origins_that_differ(*told),
        tables=tables,
        left_out=left_out,
    )


def _names(a: Path, b: Path) -> tuple[str, str]:
    """Of the folders, with that of their project where these are the same."""
    if a.name != b.name or a == b:
        return a.name, b.name
    return f"{a.parents[1].name}/{a.name}", f"{b.parents[1].name}/{b.name}"


def _tables(a: Results, b: Results) -> tuple[Any, list[str]]:
    """Counts of tables; those of two kinds that are called alike and are not are left out."""
    if a.kind is b.kind:
        names = dict.fromkeys([*a, *b])
        left_out = []
    else:
        alike = (name for name in a if name in b)
        names = dict.fromkeys(n for n in alike if a.kind.table(n).layout == b.kind.table(n).layout)
        left_out = [name for name in dict.fromkeys([*a, *b]) if name not in names]
    rows = {name: (_rows(a, name), _rows(b, name)) for name in names}
    return counted(compare(a, b, names), rows), left_out


def _rows(results: Results, name: str) -> int | None:
    return len(results[name]) if name in results else None


def _settings(a: Path, b: Path, one_kind: bool) -> tuple[list[StudyDifference], str]:
    """Settings that differ as the study files have them by now, and a note on what was left out."""
    read: list[Any] = []
    for folder in (a, b):
        root = folder.parents[1]
        try:
            study = studies.read(root / STUDIES / f"{folder.name}{studies.ENDING}", root)
        except InputError:
            return [], f"Not compared: {folder.name} has no sound study file in {STUDIES}."
        read.append(study.model_dump(mode="json"))
    note = "" if one_kind else "Compared are the settings that both types of study have."
    return settings_that_differ(read[0], read[1], one_kind), note


def lines(both: SideBySide) -> Iterator[str]:
    """What differs, for a terminal."""
    for side, name, kind in zip("ab", both.names, both.kinds, strict=True):
        yield f"{side}: {name} ({kind})"
    if both.kinds[0] != both.kinds[1]:
        yield "two types of study: compared is what both have"
    yield f"\n{both.summary}"
    if both.changed:
        yield f"\nconclusions that differ: {len(both.changed)} of {len(both.conclusions)}"
    for one in both.changed:
        yield from _conclusion(one)
    if both.settings_note:
        yield f"\nsettings: {both.settings_note}"
    yield from _listed("settings", both.settings)
    yield from _listed("code, data and versions", both.origin)
    if both.other_tables:
        yield f"\ntables that differ: {len(both.other_tables)} of {len(both.tables)}"
        yield from (f"  {one.name}: {one.words}" for one in both.other_tables)
    if both.left_out:
        yield f"\ntables not compared: {', '.join(both.left_out)}"


def _conclusion(one: Pair) -> Iterator[str]:
    yield f"  {one.place} [{'; '.join(one.remarks)}]"
    for side, told in (("a", one.a), ("b", one.b)):
        yield f"    {side}: {told.text if told else 'no such conclusion'}"
    for value in one.values:
        if value.remark:
            yield f"    {value.name}: {value.a} | {value.b}  ({value.remark})"


def _listed(what: str, differences: Any) -> Iterator[str]:
    if differences:
        yield f"\n{what} that differ: {len(differences)}"
        yield from (f"  {one.name}: {one.a} | {one.b}" for one in differences)
