"""What came of mutants, as Markdown; which of them are known to change nothing."""

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date
from functools import cache
from pathlib import Path

from tests.mutants.sample import Mutant

EQUAL = Path(__file__).with_name("equal.csv")

WORDS = """\
Small faults put into the code, place by place at random, and whether the tests that run them see
them. What lives is looked at one by one: a test is missing, or the code means the same, which is
judged and argued in `tests/mutants/equal.csv`. Those found equal before are not tried again and do
not count.
"""


@dataclass(frozen=True)
class Ended:
    """A mutant, and what saw it: a test, time that ran out, or nobody (empty)."""

    mutant: Mutant
    seen_by: str


@cache
def equal_ones() -> frozenset[tuple[str, str, str]]:
    """Path, line as it is and line as it becomes of each mutant that changes nothing."""
    with EQUAL.open(newline="", encoding="utf-8") as file:
        return frozenset((row["path"], row["was"], row["becomes"]) for row in csv.DictReader(file))


def table(ended: Sequence[Ended], equal: Sequence[Mutant], asked: str) -> str:
    """Shares by area, and who lives."""
    lines = ["# Mutants", "", WORDS, f"`{asked}`, {date.today().isoformat()}", ""]
    lines += ["| area | tried | seen | lives | share | equal |", "|---|---|---|---|---|---|"]
    areas = dict.fromkeys([*(one.mutant.area for one in ended), *(one.area for one in equal)])
    lines += [_row(area, ended, equal, {area}) for area in areas]
    lines.append(_row("all", ended, equal, {*areas}))
    lines += ["", "Not seen:", "", "| file | line | becomes |", "|---|---|---|"]
    for one in ended:
        if not one.seen_by:
            changed = (f"`{text.replace('|', chr(92) + '|')}`" for text in one.mutant.change())
            lines.append(f"| `{one.mutant.path}` | {' | '.join(changed)} |")
    return "\n".join([*lines, ""])


def _row(name: str, ended: Sequence[Ended], equal: Sequence[Mutant], areas: set[str]) -> str:
    """Of some areas together; no share where nothing was tried."""
    rows = [one for one in ended if one.mutant.area in areas]
    seen, alike = sum(bool(one.seen_by) for one in rows), sum(one.area in areas for one in equal)
    share = f"{100 * seen / len(rows):.0f} %" if rows else ""
    return f"| {name} | {len(rows)} | {seen} | {len(rows) - seen} | {share} | {alike} |"
