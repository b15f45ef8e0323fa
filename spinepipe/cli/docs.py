"""`spinepipe docs`: the parts of the documentation that come from the code."""

import argparse

from spinepipe.reference.pages import outdated, refreshed


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Write, or only compare."""
    parser.add_argument(
        "--check", action="store_true", help="write nothing; fail where a page is out of date"
    )


def run(options: argparse.Namespace) -> int:
    """Write the pages that are out of date, or name them."""
    pages = outdated(options.root)
    for path in pages:
        name = path.relative_to(options.root)
        if options.check:
            print(f"FAIL  {name}: out of date; run `spinepipe docs`")
        else:
            path.write_text(refreshed(path.read_text(encoding="utf-8"), str(name)), "utf-8")
            print(f"wrote {name}")
    if not pages:
        print("ok    every generated part of docs/ is up to date")
    return 1 if pages and options.check else 0
