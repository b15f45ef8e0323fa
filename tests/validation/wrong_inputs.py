"""Thousands of projects that are spoilt in one place each: is every one told, and where?

Each is looked at in a process of its own, which the system ends after ten seconds of processor time
or with more memory than `MOST_BYTES`.
"""

import json
import os
import resource
import signal
import tempfile
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import pandas as pd
from spoilt_cases import Seen, Verdict, asked, look, verdict

from tests.generators.spoilt.case import Case, Expected, removed
from tests.generators.spoilt.catalogue import cases, sample
from tests.generators.spoilt.projects import projects, write

HANGS_S = 10

MOST_BYTES = 6_000_000_000
"""Addresses that a process may use; what a check needs is a tenth of it."""


@dataclass(frozen=True)
class Judged:
    """A case and what became of it."""

    case: Case
    verdict: Verdict
    seen: Seen


def judged(some: Iterable[Case]) -> Iterator[Judged]:
    """Cases, one after the other."""
    _warm()
    with tempfile.TemporaryDirectory() as folder:
        for case in some:
            root = Path(folder) / "project"
            case.write(root)
            seen = _in_a_process(root, asked(case))
            removed(root)
            what = Verdict.HANGS if seen is None else verdict(case, seen)
            yield Judged(case, what, seen or Seen(-2, ""))


def _warm() -> None:
    """Load all that a check loads, so that each process starts with it."""
    for project in projects():
        with tempfile.TemporaryDirectory() as folder:
            seen = look(write(project.files, Path(folder)))
            assert seen.code == 0, seen.printed
            assert not seen.messages, seen.printed


def _in_a_process(root: Path, names: tuple[str, ...]) -> Seen | None:
    """What was said; None where the process had to be ended."""
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reader)
        signal.setitimer(signal.ITIMER_PROF, HANGS_S)
        signal.alarm(30 * HANGS_S)  # one that waits uses no processor
        resource.setrlimit(resource.RLIMIT_AS, (MOST_BYTES, MOST_BYTES))
        with os.fdopen(writer, "w", encoding="utf-8") as out:
            seen = look(root, *names)
            json.dump((seen.code, seen.printed), out)
        os._exit(0)
    os.close(writer)
    with os.fdopen(reader, encoding="utf-8") as answer:
        data = answer.read()
    os.waitpid(child, 0)
    return Seen(*json.loads(data)) if data else None


def table(number: int | None = None) -> pd.DataFrame:
    """How many cases of each family ended how; all cases, or so many drawn from them."""
    some = cases() if number is None else sample(number)
    counts: Counter[tuple[str, str, str]] = Counter()
    for one in judged(some):
        counts[one.case.family, one.case.expected.value, one.verdict.value] += 1
    return counted(counts)


def counted(counts: Counter[tuple[str, str, str]]) -> pd.DataFrame:
    """Rows of families and what must be said, columns of what was."""
    rows = []
    for family, expected in sorted({key[:2] for key in counts}):
        row: dict[str, object] = {"what is spoilt": family, "goal": expected}
        row["cases"] = sum(n for key, n in counts.items() if key[:2] == (family, expected))
        row |= {v.value: counts[family, expected, v.value] for v in Verdict}
        rows.append(row)
    assert {e.value for e in Expected} >= {row["goal"] for row in rows}
    return pd.DataFrame(rows)
