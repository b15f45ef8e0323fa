"""A drawn sequence of kills, changes, changes back, damage and losses in one project.

After each step but a kill the same command is run to its end, and every table is compared with that
of a fresh run of the same settings, byte by byte. Nothing is reset in between.
"""

import os
import random
import shutil
import signal
from collections import Counter
from contextlib import suppress
from pathlib import Path
from typing import Any

from small_project import Project
from small_studies import of_kind

from tests.validation.soak.started import Cost, start, timed

STEPS = 200
SEED = 41
STUDY = Path("config/studies/probe.yaml")
COHORT = Path("config/cohorts/stack/joints.csv")
TABLES = ("frames", "stiffness_sets", "range_of_motion", "rom_summary", "rom_variance")
TARGETS = tuple(f"results/probe/{name}.parquet" for name in TABLES)

CHANGES = {
    "seed": (STUDY, "poses: 4", "poses: 4\nseed: 2"),
    "moment": (STUDY, "moment_nm: 7.5", "moment_nm: 6.5"),
    "tests": (STUDY, "tests: [flexion, left_rotation]", "tests: [flexion]"),
    "a number of b": (COHORT, "b,L2L3,0,36,", "b,L2L3,0,37,"),
    "code": (
        Path("spinepipe/studies/range_of_motion/draw.py"),
        "import numpy",
        "import os\nimport numpy",
    ),
}
"""What may be changed, each back and forth: the file, the text there, and in its place."""

WAYS = ("change", "change", "kill", "kill", "damage", "lose", "forget", "age")

Row = dict[str, Any]


class Sequence:
    """The project, which changes are in force, and tables of fresh runs by these."""

    def __init__(self, folder: Path, seed: int) -> None:
        self.folder = folder
        self.project = of_kind("range_of_motion", folder / "project")
        self.draw = random.Random(seed)
        self.changed: set[str] = set()
        self.fresh: dict[frozenset[str], dict[str, bytes]] = {}
        self.steps: Counter[str] = Counter()
        self.differ: list[str] = []

    def step(self, number: int) -> None:
        """One drawn step, and the run after it."""
        way = self.draw.choice(WAYS)
        self.steps[way] += 1
        getattr(self, f"_{way}")()
        print(f"step {number}: {way}; {len(self.differ)} tables differ so far", flush=True)
        if way == "kill":
            return
        run = timed(self.project, *TARGETS)
        assert run.code == 0, run.said[-3000:]
        wanted = self._wanted()
        found = tables(self.project)
        self.differ += [
            f"step {number}, {way}: {name}" for name in TARGETS if found[name] != wanted[name]
        ]

    def _change(self) -> None:
        name = self.draw.choice(list(CHANGES))
        path, first, other = CHANGES[name]
        pair = (other, first) if name in self.changed else (first, other)
        self.project.edit(str(path), *pair)
        self.changed ^= {name}

    def _kill(self) -> None:
        """Change something, then kill everything after a drawn number of further files."""
        self._change()
        until = self.draw.randint(1, 40)
        before = self._written()
        with start(self.project, *TARGETS) as run:
            while run.process.poll() is None:
                now = self._written()
                if sum(before.get(name) != state for name, state in now.items()) >= until:
                    run.process.send_signal(signal.SIGKILL)
                    run.kill_all()
                    return

    def _written(self) -> dict[str, int]:
        """Result files by number on the disk; what goes while one looks is left out."""
        found = {}
        for folder, _, names in os.walk(self.project.path("results/probe")):  # bears with that
            for path in (os.path.join(folder, name) for name in names):
                with suppress(FileNotFoundError):
                    found[path] = os.stat(path).st_ino
        return found

    def _damage(self) -> None:
        """One bit of one file, its age kept."""
        path = self._some_file()
        if path is not None:
            raw, age = bytearray(path.read_bytes()), path.stat().st_mtime_ns
            if raw:
                raw[self.draw.randrange(len(raw))] ^= 1 << self.draw.randrange(8)
                path.write_bytes(bytes(raw))
                os.utime(path, ns=(age, age))

    def _lose(self) -> None:
        path = self._some_file()
        if path is not None:
            path.unlink()

    def _forget(self) -> None:
        """Snakemake's record is gone, as of results that were copied."""
        shutil.rmtree(self.project.path(".snakemake"), ignore_errors=True)

    def _age(self) -> None:
        """Files get dates in a drawn order."""
        paths = self._files()
        self.draw.shuffle(paths)
        for number, path in enumerate(paths):
            os.utime(path, (1.7e9 + number, 1.7e9 + number))

    def _files(self) -> list[Path]:
        results = self.project.path("results/probe")
        return sorted(path for path in results.rglob("*.parquet") if not path.name.startswith("."))

    def _some_file(self) -> Path | None:
        paths = self._files()
        return self.draw.choice(paths) if paths else None

    def _wanted(self) -> dict[str, bytes]:
        key = frozenset(self.changed)
        if key not in self.fresh:
            fresh = of_kind("range_of_motion", self.folder / f"fresh{len(self.fresh)}")
            for name in key:
                path, first, other = CHANGES[name]
                fresh.edit(str(path), first, other)
            run = timed(fresh, *TARGETS)
            assert run.code == 0, run.said[-3000:]
            self.fresh[key] = tables(fresh)
            shutil.rmtree(fresh.folder)
        return self.fresh[key]


def tables(project: Project) -> dict[str, bytes]:
    """Content of the tables."""
    return {name: project.path(name).read_bytes() for name in TARGETS}


def rows(folder: Path, steps: int = STEPS, seed: int = SEED) -> list[Row]:
    """What was done how often, and how many tables differed from those of fresh runs."""
    sequence = Sequence(folder, seed)
    first: Cost = timed(sequence.project, *TARGETS)
    assert first.code == 0, first.said[-3000:]
    for number in range(steps):
        sequence.step(number)
    counts = {way: sequence.steps[way] for way in dict.fromkeys(WAYS)}
    compared = sum(counts.values()) - counts["kill"]
    told = {
        "seed": seed,
        "steps": steps,
        **counts,
        "settings": len(sequence.fresh),
        "tables_compared": compared * len(TARGETS),
        "tables_that_differ": len(sequence.differ),
    }
    print("\n".join(sequence.differ), flush=True)
    return [told]
