"""`spinepipe docs`: the parts of the documentation that come from the code."""

import argparse

from spinepipe.reference.pages import outdated, refreshed
from spinepipe.reference.pictures import FOLDER, PICTURES, renewed
from spinepipe.reference.result_tables import PAGE, columns_page


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Write, or only compare."""
    parser.add_argument(
        "--check", action="store_true", help="write nothing; fail where a page is out of date"
    )
    parser.add_argument(
        "--figures",
        action="store_true",
        help="copy the pictures of README and tutorial from results instead",
    )


def run(options: argparse.Namespace) -> int:
    """Write the pages that are out of date, or name them; or copy pictures."""
    if options.figures:
        return _pictures(options)
    pages = outdated(options.root)
    for path in pages:
        name = path.relative_to(options.root)
        if options.check:
            print(f"FAIL  {name}: out of date; run `spinepipe docs`")
        else:
            path.write_text(refreshed(path.read_text(encoding="utf-8"), str(name)), "utf-8")
            print(f"wrote {name}")
    if not options.check:
        (options.root / PAGE).write_text(columns_page(), "utf-8")
        print(f"wrote {PAGE}: the columns of all result tables")
    if not pages:
        print("ok    every generated part of docs/ is up to date")
    return 1 if pages and options.check else 0


def _pictures(options: argparse.Namespace) -> int:
    """Copy what was computed, and name what was not."""
    found = renewed(options.root)
    for name, there in found.items():
        source = PICTURES[name]
        told = f"wrote {FOLDER / name} from {source}"
        print(told if there else f"FAIL  {FOLDER / name}: no {source}; run `make all` first")
    return 0 if all(found.values()) else 1
