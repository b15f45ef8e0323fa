"""`spinepipe import`: files of a laboratory become a cohort folder."""

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated

import typer

from spinepipe import cohort as cohorts
from spinepipe.documents.yaml_text import YamlDocument
from spinepipe.files import appearing
from spinepipe.imports.file_patterns import with_files
from spinepipe.imports.imported import write
from spinepipe.imports.judge import judge, write_judged
from spinepipe.imports.registry import read, read_settings
from spinepipe.problems import InputError
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
    settings: Annotated[Path, typer.Argument(metavar="FILE.yaml", help="says what the files are")],
    replace: Annotated[
        bool, typer.Option("--replace", help="write a cohort again; files edited by hand stay")
    ] = False,
    show: Annotated[
        bool, typer.Option("--show", help="write no cohort: show what was understood, and a page")
    ] = False,
) -> int:
    """Make a cohort from files of a testing machine, C3D, OpenSim."""
    root = context.obj
    if show:
        return _show(settings, root)
    try:
        imported = read(settings)
        folder = root / COHORTS / imported.name
        stayed, warnings = write_judged(imported, folder, replace)
    except InputError:
        told = f"Nothing was written. `spinepipe import --show {settings}` shows the files"
        print(f"{told} as they are understood.")
        raise
    for sentence in imported.sentences:
        print(sentence)
    print(f"Wrote {COHORTS / imported.name}.")
    if stayed:
        print(f"{listed(stayed)} were there and stayed as they are.")
    for name, remark in imported.by_hand.items():
        if remark and name not in stayed:
            print(remark)
    for warning in warnings:
        print(f"warn  {warning}")
    print(f"Next: spinepipe check {imported.name}, then spinepipe show {imported.name}.")
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
