"""`python -m tests.mutants [--each N] [--seed S] [AREA ...]`: put in faults, count who sees them.

Each fault is put into a copy of the project, and the test files nearest to it are run, then the
next nearest, then their slow tests. What no test sees is listed, to be looked at by a person: a
test is missing, or the code means the same, which goes into `equal.csv`.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from queue import Queue
from typing import Self

from tests.mutants.nearest import nearest
from tests.mutants.runner import TIME
from tests.mutants.sample import AREAS, ROOT, Mutant, drawn
from tests.mutants.table import Ended, equal_ones, table

TABLE = ROOT / "docs" / "mutants.md"
RINGS = ((0, 1, "not slow"), (1, 3, "not slow"), (4, 5, "not slow"), (0, 4, "slow"))
"""How many of the nearest test files are left out, how many are run, and which of their tests."""

MOST_S = 300
"""Processor time of a run; what takes longer, and without the fault a quarter at most, hangs."""


class Copy:
    """A copy of the project in which one fault at a time is put."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._without: dict[tuple[tuple[str, ...], str, int], str] = {}
        listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True)
        for name in listed.stdout.splitlines():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, folder / name)
        compiled = [sys.executable, "-m", "compileall", "-q", "spinepipe", "tests"]
        subprocess.run(compiled, cwd=folder, check=True)
        one = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
        path = f"{folder}:{folder / 'tests' / 'cases'}"
        # with what is kept of a fault compiled, the next one of the same second would not be seen
        told = {**os.environ, **one, "PYTHONPATH": path, "PYTHONDONTWRITEBYTECODE": "1"}
        self._runner = subprocess.Popen(
            [sys.executable, "-m", "tests.mutants.runner"],
            cwd=folder, env=told, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        )  # fmt: skip

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._runner.communicate()

    def tried(self, mutant: Mutant) -> Ended:
        """Run the tests near a fault until one fails that passes without it."""
        file = self.folder / mutant.path
        whole, times = file.read_bytes(), file.stat()
        for beyond, count, marks in RINGS:
            tests = tuple(nearest(mutant.path, count, beyond))
            try:
                file.write_text(mutant.code())
                failed = self._failed(tests, marks, MOST_S)
            finally:
                file.write_bytes(whole)
                os.utime(file, ns=(times.st_atime_ns, times.st_mtime_ns))
            if failed and not self._fails_anyway(failed, tests, marks):
                return Ended(mutant, failed)
        return Ended(mutant, "")

    def _fails_anyway(self, failed: str, tests: tuple[str, ...], marks: str) -> bool:
        """Whether a test fails, or a run takes long, without the fault too."""
        asked = (tests, marks, MOST_S // 4) if failed == TIME else ((failed,), marks, MOST_S)
        if asked not in self._without:
            self._without[asked] = self._failed(*asked)
        return bool(self._without[asked])

    def _failed(self, tests: Sequence[str], marks: str, most_s: int) -> str:
        """What fails first; empty where nothing does."""
        if not tests:
            return ""
        assert self._runner.stdin is not None
        assert self._runner.stdout is not None
        asked = {"tests": tests, "marks": marks, "most_s": most_s}
        self._runner.stdin.write(json.dumps(asked) + "\n")
        self._runner.stdin.flush()
        return str(json.loads(self._runner.stdout.readline()))


def tried(mutants: Sequence[Mutant], workers: int) -> list[Ended]:
    """All mutants, in copies of their own; progress is printed."""
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        pool = stack.enter_context(ThreadPoolExecutor(workers))
        free: Queue[Copy] = Queue()
        for number in range(workers):
            free.put(stack.enter_context(Copy(folder / str(number))))
        ended = []
        for one in pool.map(partial(_in_a_copy, free), mutants):
            ended.append(one)
            was, becomes = one.mutant.change()
            where = f"{one.mutant.path}:{one.mutant.line} {was} -> {becomes}"
            print(f"{len(ended)}/{len(mutants)} {one.seen_by or 'LIVES'}: {where}", flush=True)
        return ended


def _in_a_copy(free: "Queue[Copy]", mutant: Mutant) -> Ended:
    copy = free.get()
    try:
        return copy.tried(mutant)
    finally:
        free.put(copy)


def main() -> None:
    """Draw, try, print and write the table."""
    parser = argparse.ArgumentParser(prog="python -m tests.mutants")
    parser.add_argument("areas", nargs="*", choices=[[], *AREAS], help="all by default")
    parser.add_argument("--each", type=int, default=20, help="mutants of each area")
    parser.add_argument("--seed", type=int, default=1, help="of the draw")
    parser.add_argument("--workers", type=int, default=2, help="copies at once")
    asked = parser.parse_args()
    areas = asked.areas or list(AREAS)
    mutants = [one for area in areas for one in drawn(area, asked.each, asked.seed)]
    equal = [one for one in mutants if (one.path, *one.change()) in equal_ones()]
    ended = tried([one for one in mutants if one not in equal], asked.workers)
    words = " ".join(["python -m tests.mutants", f"--each {asked.each}", f"--seed {asked.seed}"])
    text = table(ended, equal, " ".join([words, *asked.areas]))
    print(text)
    TABLE.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
