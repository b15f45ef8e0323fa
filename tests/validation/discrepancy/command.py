"""`python -m tests.validation discrepancy`: its options."""

import argparse
import os
from collections.abc import Sequence

from tests.validation.discrepancy.report import write
from tests.validation.discrepancy.run import run
from tests.validation.discrepancy.seeds import claim, first_seed
from tests.validation.discrepancy.store import PLACE, folder, kept
from tests.validation.discrepancy.targets import DRAWN, NUMBER, Target, of_seeds, targets


def main(arguments: Sequence[str] = ()) -> None:
    """Score what is not scored yet, then write the tables of all rows there are."""
    asked = _options(arguments)
    place = PLACE / asked.code if asked.code else folder()
    first = first_seed(place.name)
    if not (asked.report or asked.code):
        claim(place.name, first, first + NUMBER - 1)
        run(_chosen(asked, first), place, asked.jobs)
    found = kept(targets(first), place)
    rows = [row for _, row in found]
    write(rows, "python -m tests.validation discrepancy", place.name)


def _chosen(asked: argparse.Namespace, first: int) -> list[Target]:
    found = targets(first, tuple(asked.kind or DRAWN))
    if asked.seeds:
        found = list(of_seeds(found, *asked.seeds))
    return found[: asked.limit]


def _range(text: str) -> tuple[int, int]:
    first, last = text.split(":")
    return int(first), int(last)


def _options(arguments: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser("python -m tests.validation discrepancy")
    parser.add_argument("--jobs", type=int, default=min(2, os.cpu_count() or 1))
    parser.add_argument("--kind", action="append", choices=DRAWN, help="one kind; may be repeated")
    parser.add_argument("--limit", type=int, help="only the first so many, a fair sample of all")
    parser.add_argument("--seeds", type=_range, metavar="FIRST:LAST", help="both ends included")
    parser.add_argument("--code", help="only the tables, of rows that this code made (its digest)")
    parser.add_argument("--report", action="store_true", help="only the tables, of rows there are")
    return parser.parse_args(list(arguments))
