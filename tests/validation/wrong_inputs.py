"""Thousands of projects that are spoilt in one place each: is every one told, and where?

`python -m tests.validation wrong_inputs` looks at `DRAWN` of them, drawn from all by a seed;
`python -m tests.validation.wrong_inputs all` at every one, with a number at those of another draw.
Each is looked at in a process of its own, which the system ends after ten seconds of processor
time. What was seen is kept, case by case, in `results/validation/wrong_inputs`, as long as library,
documentation and cases stay the same: a run that was cut off goes on.
"""

import json
import os
import resource
import signal
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

import pandas as pd

from tests.cases.spoilt_cases import Seen, Verdict, look_at, looked, verdict
from tests.generators.spoilt.case import Case, removed
from tests.generators.spoilt.catalogue import cases, sample
from tests.generators.spoilt.projects import projects, write
from tests.validation.kept import Kept

DRAWN = 3000

HANGS_S = 10

MOST_BYTES = 6_000_000_000
"""Addresses that a process may use; what a check needs is a tenth of it."""

CORES = 2

HANGS_ON = (
    *("spinepipe/**/*.py", "docs/**/*.md", "config/**/*.*", "tests/generators/spoilt/*.py"),
    *("tests/cases/spoilt_cases.py", "tests/validation/wrong_inputs.py"),
)


@dataclass(frozen=True)
class Judged:
    """A case and what became of it."""

    case: Case
    verdict: Verdict
    seen: Seen


_held: list[Case] = []
"""Cases of this run: processes that are forked have them without being sent."""


def judged(some: Sequence[Case], workers: int = CORES) -> Iterator[Judged]:
    """Cases as they are done, those first that an earlier run has looked at."""
    kept = Kept("wrong_inputs", HANGS_ON)
    for case in some:
        if case.name in kept.known:
            what, code, printed = kept.known[case.name]
            yield Judged(case, Verdict(what), Seen(code, printed))
    _held[:] = [case for case in some if case.name not in kept.known]
    if not _held:
        return
    _warm()
    with get_context("fork").Pool(workers) as pool:
        for number, what, code, printed in pool.imap_unordered(_one, range(len(_held))):
            kept.add(_held[number].name, [what, code, printed])
            yield Judged(_held[number], Verdict(what), Seen(code, printed))


def _one(number: int) -> tuple[int, str, int, str]:
    case = _held[number]
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder) / "project"
        case.write(root)
        seen = _in_a_process(root, case)
        removed(root)
    what = Verdict.HANGS if seen is None else verdict(case, seen)
    seen = seen or Seen(-2, "")
    return number, what.value, seen.code, seen.printed


def _warm() -> None:
    """Load all that a check loads, so that each process starts with it."""
    for project in projects():
        with tempfile.TemporaryDirectory() as folder:
            seen = look_at(project, write(project.files, Path(folder)))
            assert (seen.code, seen.messages) == (0, []), seen.printed


def _in_a_process(root: Path, case: Case) -> Seen | None:
    """What was said; None where the process had to be ended."""
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reader)
        signal.setitimer(signal.ITIMER_PROF, HANGS_S)
        signal.alarm(60 * HANGS_S)  # one that waits uses no processor
        resource.setrlimit(resource.RLIMIT_AS, (MOST_BYTES, MOST_BYTES))
        with os.fdopen(writer, "w", encoding="utf-8") as out:
            seen = looked(case, root)
            json.dump((seen.code, seen.printed), out)
        os._exit(0)
    os.close(writer)
    with os.fdopen(reader, encoding="utf-8") as answer:
        data = answer.read()
    os.waitpid(child, 0)
    return Seen(*json.loads(data)) if data else None


def tables(some: Sequence[Case], workers: int = CORES) -> tuple[pd.DataFrame, pd.DataFrame]:
    """How many cases of each family ended how, and those that did not end as they should."""
    counts: Counter[tuple[str, str, str]] = Counter()
    others = []
    for number, one in enumerate(judged(some, workers), start=1):
        counts[one.case.family, one.case.expected.value, one.verdict.value] += 1
        if one.verdict is not Verdict.RIGHT:
            others.append({"case": one.case.name.replace(" | ", ", "), "is": one.verdict.value})
            print(one.verdict.value, one.case.name, one.seen.printed[-600:], sep="\n", flush=True)
        if number % 100 == 0:
            print(f"wrong_inputs: {number} of {len(some)}", flush=True)
    return counted(counts), pd.DataFrame(others, columns=["case", "is"])


def counted(counts: Counter[tuple[str, str, str]]) -> pd.DataFrame:
    """Rows of families and what must be said, columns of what was; a sum at the end."""
    keys = sorted({key[:2] for key in counts})
    rows = [
        {
            "what is spoilt": family,
            "goal": goal,
            "cases": sum(n for key, n in counts.items() if key[:2] == (family, goal)),
            **{v.value: counts[family, goal, v.value] for v in Verdict},
        }
        for family, goal in keys
    ]
    table = pd.DataFrame(rows)
    sums = table.drop(columns=["what is spoilt", "goal"]).sum()
    table.loc[len(table)] = {"what is spoilt": "all", "goal": "", **sums}
    return table


def drawn(seed: int = 19) -> list[Case]:
    """The cases of the part of `make validate`, or those of another draw."""
    return sample(DRAWN, seed)


if __name__ == "__main__":
    asked = sys.argv[1:]
    every = list(cases()) if asked == ["all"] else drawn(*map(int, asked))
    for found in tables(every, os.cpu_count() or CORES):
        print(found.to_string())
