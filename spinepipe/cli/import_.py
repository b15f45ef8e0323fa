"""`spinepipe import`: files of a laboratory become a cohort folder."""

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated

import typer

from spinepipe import cohort as cohorts
from spinepipe.cli.import_questions import SETTINGS, Questions, described, document_of
from spinepipe.cli.program import STOPPED, WrongUsage
from spinepipe.documents.yaml_text import YamlDocument
from spinepipe.files import appearing
from spinepipe.imports.file_patterns import with_files
from spinepipe.imports.imported import write
from spinepipe.imports.judge import judge, write_judged
from spinepipe.imports.registry import of_document, read, read_settings
from spinepipe.problems import InputError, InputProblem
from spinepipe.report.specimen import view_of
from spinepipe.report.specimen_page import specimen_page
from spinepipe.report.words import listed
from spinepipe.studies.registry import every_form
from spinepipe.studies.study import COHORTS
from spinepipe.testing_machine.raw_table import MOST_BYTES, first_lines

RAW_FILES, RAW_LINES, RAW_WIDTH = 10, 8, 100
"""What is shown of a file that is not understood."""


def command(
    context: typer.Context,
    files: Annotated[
        list[Path],
        typer.Argument(
            metavar="FILES...",
            help="files of a testing machine (.csv .txt .tsv .lvm .xlsx), or the .yaml that tells "
            "what files are and repeats an import",
        ),
    ],
    cohort: Annotated[str | None, typer.Option(help="name of the cohort")] = None,
    pattern: Annotated[
        str | None,
        typer.Option(
            metavar="TEXT",
            help='where specimen and test stand in the names, as in "{specimen}_{test}.csv"',
        ),
    ] = None,
    vertebrae: Annotated[
        str | None, typer.Option(metavar="TEXT", help='from the lowest, as in "L5 L4"')
    ] = None,
    accuracy_deg: Annotated[
        float | None,
        typer.Option(
            metavar="DEG",
            help="accuracy of one angle, as its maker or your calibration states it",
        ),
    ] = None,
    yes: Annotated[bool, typer.Option("--yes", help="take every suggestion")] = False,
    replace: Annotated[
        bool,
        typer.Option(
            "--replace",
            help="write a cohort again that is there; files that are edited by hand stay",
        ),
    ] = False,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="show it all, write nothing")] = False,
    show: Annotated[
        bool,
        typer.Option(
            "--show",
            help="with a .yaml: write no cohort, show the first rows as they were understood, and "
            "draw a page",
        ),
    ] = False,
) -> int:
    """Make a cohort of files of a testing machine, of motion, or of a model.

    Data files start questions, whose answers are written as import.yaml beside them; that file
    repeats the import.
    """
    root: Path = context.obj
    if files[0].suffix in (".yaml", ".yml"):
        told = (cohort, pattern, vertebrae, accuracy_deg)
        if len(files) > 1 or yes or any(one is not None for one in told):
            raise WrongUsage(f"{files[0]} with further files or answers", "write them in it")
        if show:
            return _show(files[0], root)
        document, settings = read_settings(files[0]), files[0]
    else:
        if show:
            raise WrongUsage("--show with data files", "write --dry-run instead")
        try:
            folder, text = described(
                files, Questions(yes), pattern, cohort, vertebrae, accuracy_deg
            )
        except typer.Abort:
            print("Stopped; nothing was written. With --yes every suggestion is taken.")
            return STOPPED
        document, settings = document_of(text), folder / SETTINGS
        if dry_run:
            print(f"{settings} would be:\n\n{text}")
        elif settings.exists() and not replace:
            found, allowed = "a file of this name", "a new file"
            remedy = f"repeat it: spinepipe import {settings}; or add --replace to write it anew"
            raise InputError([InputProblem(str(settings), None, None, found, allowed, remedy)])
        else:
            with appearing(settings) as temporary:
                temporary.write_text(text, encoding="utf-8")
            print(f"Wrote {settings}, which repeats this import.")
    return _imported(document, settings, root, replace, dry_run)


def _imported(
    document: YamlDocument, settings: Path, root: Path, replace: bool, dry_run: bool
) -> int:
    """Read all files, judge them, write the folder, and say what was done."""
    try:
        imported = of_document(settings.parent, document)
        folder = root / COHORTS / imported.name
        if dry_run:
            with TemporaryDirectory() as place:
                stayed, warnings = write_judged(imported, Path(place) / imported.name, False)
        else:
            stayed, warnings = write_judged(imported, folder, replace)
    except InputError:
        told = "No cohort was written."
        if not dry_run:
            told += (
                f" `spinepipe import --show {settings}` shows the files as they are understood; "
            )
            told += f"after mending {settings}, spinepipe import {settings} goes on."
        print(told)
        raise
    for sentence in imported.sentences:
        print(sentence)
    print("Nothing was written." if dry_run else f"Wrote {COHORTS / imported.name}.")
    if stayed:
        print(f"{listed(stayed)} were there and stayed as they are.")
    for name, remark in imported.by_hand.items():
        if remark and name not in stayed and not dry_run:
            print(remark)
    for warning in warnings:
        print(f"warn  {warning}")
    if dry_run:
        print("Next: the same without --dry-run.")
    else:
        name = imported.name
        print(f"Next: spinepipe show {name}, then spinepipe new study NAME --cohort {name}")
    return 0


def _show(path: Path, root: Path) -> int:
    """Print the first rows of each file, and draw the cohort that would be written."""
    settings = read_settings(path)
    try:
        imported = read(path)
    except InputError as error:
        print(error)
        _print_raw(settings, path.parent)
        return 1
    for file, rows in imported.first_rows.items():
        cells = [[f"{c:.6g}" if isinstance(c, float) else str(c) for c in row] for row in rows]
        widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
        print(f"\n{file}, as it is understood:")
        for row in cells:
            print("  " + "  ".join(cell.rjust(w) for cell, w in zip(row, widths, strict=True)))
    print()
    for sentence in imported.sentences:
        print(sentence)
    with TemporaryDirectory() as place:
        folder = Path(place) / imported.name
        write(imported, folder, replace=False)
        try:
            for warning in judge(imported, folder):
                print(f"warn  {warning}")
        except InputError as error:
            print(error)
        try:
            cohort = cohorts.read(folder, every_form())
        except InputError:
            print("No page: the cohort cannot be read.")
            return 1
        output = root / "results" / "show" / f"{imported.name}-import.html"
        with appearing(output) as temporary:
            view = view_of(cohort, cohort.specimen_names[0], None, (0.0, 0.0, 0.0))
            temporary.write_text(specimen_page(cohort, view), encoding="utf-8")
    print(f"No cohort was written. Page: {output}")
    return 0


def _print_raw(settings: YamlDocument, folder: Path) -> None:
    """The first lines of files that nothing could read, tabs as arrows."""
    items = with_files(folder, settings, ("specimen", "test"))[0].data.get("files")
    names: list[str] = []
    for one in items if isinstance(items, list) else ():
        if isinstance(one, dict):
            stem = Path(str(one.get("file"))).stem
            names += [str(one.get("file")), str(one.get("motion_file")).replace("{stem}", stem)]
    for name in [one for one in dict.fromkeys(names) if (folder / one).is_file()][:RAW_FILES]:
        print(f"\n{name}, as it stands:")
        with (folder / name).open("rb") as file:
            start = file.read(RAW_LINES * 1000)
            start += file.read(MOST_BYTES) if start.startswith(b"PK") else b""
        for number, line in first_lines(start, RAW_LINES):
            print(f"{number or '':5}  {line.replace(chr(9), ' → ')[:RAW_WIDTH]}")
