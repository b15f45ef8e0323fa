"""`spinepipe import`: files of a laboratory become a cohort folder."""

import argparse
from pathlib import Path

from spinepipe.imports.imported import write
from spinepipe.imports.registry import read
from spinepipe.report.words import listed
from spinepipe.studies.study import COHORTS


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which YAML, and whether a folder may be written again."""
    parser.add_argument("settings", type=Path, metavar="FILE.yaml", help="says what the files are")
    parser.add_argument(
        "--replace",
        action="store_true",
        help="write a cohort again that is there; files that are edited by hand stay",
    )


def run(options: argparse.Namespace) -> int:
    """Read all files, write the folder, and say what was done."""
    imported = read(options.settings)
    folder = options.root / COHORTS / imported.name
    stayed = write(imported, folder, options.replace)
    for sentence in imported.sentences:
        print(sentence)
    print(f"Wrote {COHORTS / imported.name}.")
    if stayed:
        print(f"{listed(stayed)} were there and stayed as they are.")
    for name, remark in imported.by_hand.items():
        if remark and name not in stayed:
            print(remark)
    print(f"Next: spinepipe check {imported.name}, then spinepipe show {imported.name}.")
    return 0
