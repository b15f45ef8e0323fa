"""Copies of the project: a fault is put into one, and tests are run there until one fails."""

import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path
from queue import Queue
from typing import Self, TypeVar

from tests.mutants.reach import ROOT, Reach
from tests.mutants.runner import TIME
from tests.mutants.sample import Mutant
from tests.mutants.table import Ended

What = TypeVar("What")
Came = TypeVar("Came")

MOST_S = 300
"""Processor time of a run; what takes longer, and without the fault a quarter at most, hangs."""

FIRST_S, THEN_S = 40.0, 200.0
"""Processor time, as followed, of the tests that run a line, and of their whole files."""

FILES = 12
"""Files of tests that are loaded to try a line, at most: loading takes longer than most tests."""


class Copy:
    """A copy of the project in which one fault at a time is put."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._without: dict[tuple[tuple[str, ...], int], bool] = {}
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

    def follow(self, tests: str, reach: Reach) -> str:
        """Keep what a file of tests runs; returned is what fails in it without a fault."""
        failed = self._failed((tests,), 4 * MOST_S, str(reach.kept(tests)))
        reach.vouch(tests)
        return failed

    def try_one(self, mutant: Mutant, reach: Reach) -> Ended:
        """Run the tests near a fault until one fails that passes without it."""
        file = self.folder / mutant.path
        whole, times = file.read_bytes(), file.stat()
        for tests in rings(reach, mutant):
            try:
                file.write_text(mutant.code())
                failed = self._failed(tests, MOST_S)
            finally:
                file.write_bytes(whole)
                os.utime(file, ns=(times.st_atime_ns, times.st_mtime_ns))
            if failed and not self._fails_anyway(failed, tests):
                return Ended(mutant, failed)
        return Ended(mutant, "")

    def _fails_anyway(self, failed: str, tests: tuple[str, ...]) -> bool:
        """Whether a test fails, or a run takes long, without the fault too."""
        asked = (tests, MOST_S // 4) if failed == TIME else ((failed,), MOST_S)
        if asked not in self._without:
            self._without[asked] = bool(self._failed(*asked))
        return self._without[asked]

    def _failed(self, tests: Sequence[str], most_s: int, kept: str = "") -> str:
        """What fails first; empty where nothing does."""
        if not tests:
            return ""
        assert self._runner.stdin is not None
        assert self._runner.stdout is not None
        asked = {"tests": tests, "most_s": most_s, "kept": kept}
        self._runner.stdin.write(json.dumps(asked) + "\n")
        self._runner.stdin.flush()
        return str(json.loads(self._runner.stdout.readline()))


def rings(reach: Reach, mutant: Mutant) -> Iterator[tuple[str, ...]]:
    """Tests that run the line of a fault, in the nearest files; then these files as a whole."""
    quick, files = reach.near(mutant.path, mutant.line)
    place = {name: at for at, name in enumerate(files[:FILES])}
    first, spent = [], 0.0
    for name in quick:
        if name.partition("::")[0] in place and spent < FIRST_S:
            first.append(name)
            spent += reach.cpu_s(name)
    yield tuple(sorted(first, key=lambda name: place[name.partition("::")[0]]))
    spent = 0.0
    for name in files:
        if spent < THEN_S:
            yield (name,)
            spent += reach.cpu_s(name)


class Copies:
    """As many copies as workers; each is used by one piece of work at a time."""

    def __init__(self, workers: int) -> None:
        self._stack = ExitStack()
        folder = Path(self._stack.enter_context(tempfile.TemporaryDirectory()))
        self._free: Queue[Copy] = Queue()
        for number in range(workers):
            self._free.put(self._stack.enter_context(Copy(folder / str(number))))
        self._pool = self._stack.enter_context(ThreadPoolExecutor(workers))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def each(self, work: Callable[[Copy, What], Came], many: Iterable[What]) -> Iterator[Came]:
        """What comes of a piece of work with each of many, in their order."""

        def done(what: What) -> Came:
            copy = self._free.get()
            try:
                return work(copy, what)
            finally:
                self._free.put(copy)

        return self._pool.map(done, many)
