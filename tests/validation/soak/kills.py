"""Twenty kills in each kind of study: what it gives in the end, what was lost, what stays.

When a run is killed is drawn: after so many more result files, and a part of a second later. So
kills are spread over all that a study does, on slow machines and on fast ones. Most kill the
whole group of processes at once, as a machine that goes down does; some Snakemake alone, some one
worker. Each is followed by the same command, `snakemake -j2 all`, and nothing else.
"""

import base64
import hashlib
import shutil
import signal
import time
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass, field
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import pyarrow as pa
import pyarrow.parquet as pq
from small_project import Project
from small_studies import of_kind

from spinepipe.files import is_temporary
from spinepipe.marks import CONTENT
from tests.validation.soak.started import Seen, Started, ended, looks, seen, start, timed

KILLS = 20
ALL, SNAKEMAKE, WORKER = "all processes", "snakemake alone", "one worker"
WAYS = (ALL, ALL, SNAKEMAKE, ALL, WORKER)
"""Who is killed, in turn."""

AMISS = (
    *("files that differ", "finished files made twice or lost"),
    *("temporary files left", "processes left"),
)
"""None of these may happen."""

SOUND = "nothing lost, nothing twice, same bytes"

TELLS_TIME = "cpu_s"
"""A column of processor time, which no two runs share: files are compared without it."""

ROW_OF_TIME, PAGE_OF_TIME = "results.computation_time", "processor time of a motion"
"""A row of the comparison with a paper is left out; a page that has that row is not compared."""

MOST_DELAY_S = 1.0
STARTING_S = 10.0
"""Within which a run is killed that is to make no more file: it reads and plans."""

Row = dict[str, Any]


@dataclass
class Disturbed:
    """A study that is killed again and again.

    Attributes
    ----------
    finished : files that were finished when a run was killed, as they were; in this round.
    told : how often what happened.
    """

    project: Project
    rng: np.random.Generator
    files: int
    finished: Seen = field(default_factory=dict)
    told: Counter[str] = field(default_factory=Counter)

    def kill_once(self, way: str) -> bool:
        """Start, wait, kill; False when the run was done before."""
        more = int(self.rng.integers(0, max(2, self.files // 8)))
        delay = self.rng.uniform(0, MOST_DELAY_S if more else STARTING_S)
        before = seen(self.project)
        with start(self.project) as run:
            self._wait(run, set(before), more, delay)
            if run.process.poll() is not None:
                assert run.process.returncode == 0, run.words()
                return False
            at_work = incomplete(self.project)
            family = self._kill(run, way)
        self.told["processes left"] += not ended(family)
        self.told[way] += 1
        self._look(at_work)
        return True

    def _wait(self, run: Started, before: set[str], more: int, delay: float) -> None:
        """Until so many more files are there, and then a while."""
        for _ in looks(run):
            if len(seen(self.project).keys() - before) >= more:
                break
        until = time.monotonic() + delay
        for _ in looks(run):
            if time.monotonic() > until:
                break

    def _kill(self, run: Started, way: str) -> list[psutil.Process]:
        """Kill; the processes that there were. A run that lost a worker comes to its own end."""
        family, workers = run.family(), run.workers()
        with suppress(psutil.NoSuchProcess):
            if way == WORKER and workers:
                workers[int(self.rng.integers(len(workers)))].kill()
                run.end()
                return family
            if way == SNAKEMAKE:
                run.process.send_signal(signal.SIGKILL)
                run.end()
                return family
        return run.kill_all()

    def _look(self, at_work: set[str]) -> None:
        """What was finished before is still there and was not made again.

        Files of jobs that were at work do not count as finished, though some may be there: a job
        that writes several files writes one after the other.
        """
        now, at_work = seen(self.project), at_work | incomplete(self.project)
        self._count_twice(now)
        self.finished |= {
            name: stamp
            for name, stamp in now.items()
            if name not in at_work and not is_temporary(Path(name).name)
        }

    def _count_twice(self, now: Seen) -> None:
        wrong = {name for name, stamp in self.finished.items() if now.get(name) != stamp}
        self.told["finished files made twice or lost"] += len(wrong)
        for name in wrong:
            print(f"  made twice or lost: {name}", flush=True)
            del self.finished[name]

    def finish(self, reference: dict[str, str]) -> None:
        """Let it come to its end and compare with what an undisturbed run gave."""
        run = timed(self.project)
        assert run.code == 0, run.said
        self._count_twice(seen(self.project))
        found = digests(self.project)
        differing = {name for name in reference if found.get(name) != reference[name]}
        further = found.keys() - reference.keys()
        for name in sorted(differing | further):
            print(f"  differs: {name}", flush=True)
        self.told["files that differ"] += len(differing | further)
        self.told["temporary files left"] += sum(is_temporary(Path(name).name) for name in further)
        scratch = self.project.path("scratch")
        self.told["left in the temporary folder"] += len(list(scratch.iterdir()))
        self.told["rounds"] += 1
        assert not incomplete(self.project)
        assert not self.project.path(".snakemake/locks").exists()
        self.finished.clear()


def row(kind: str, folder: Path, kills: int = KILLS, seed: int = 0) -> Row:
    """Kill the small study of that kind so often; what came of it."""
    reference = of_kind(kind, folder / "reference")
    whole = timed(reference)
    assert whole.code == 0, whole.said
    wanted = digests(reference)
    rng = np.random.default_rng([seed, *kind.encode()])
    disturbed = Disturbed(fresh(reference, folder / "killed"), rng, len(wanted))
    killed = 0
    while killed < kills:
        if disturbed.kill_once(WAYS[killed % len(WAYS)]):
            killed += 1
            print(f"kills: {kind}, {killed} of {kills}", flush=True)
        else:
            disturbed.finish(wanted)
            clear(disturbed.project)
    disturbed.finish(wanted)
    told = disturbed.told
    amiss = [f"{told[name]} {name}" for name in AMISS if told[name]]
    return {
        "kind": kind,
        "result_files": len(wanted),
        "kills": killed,
        **{f"kills of {way}".replace(" ", "_"): told[way] for way in (ALL, SNAKEMAKE, WORKER)},
        "rounds": told["rounds"],
        **{name.replace(" ", "_"): told[name] for name in AMISS},
        "left_in_the_temporary_folder": told["left in the temporary folder"],
        "undisturbed_s": round(whole.wall_s, 1),
        "measured": date.today().isoformat(),
        "verdict": "; ".join(amiss) or SOUND,
    }


def is_sound(row: Row) -> bool:
    """Whether no kill did harm."""
    return not any(int(row[name.replace(" ", "_")]) for name in AMISS)


def fresh(project: Project, folder: Path) -> Project:
    """A copy without results; what was compiled comes along."""
    copy = project.copy(folder)
    clear(copy)
    return copy


def clear(project: Project) -> None:
    """Without results, as before the first run."""
    for name in ("results", ".snakemake", "scratch"):
        shutil.rmtree(project.path(name), ignore_errors=True)


def digests(project: Project) -> dict[str, str]:
    """sha256 of each result file, of all in it that does not tell processor time."""
    return {name: _digest(project.path(f"results/{name}")) for name in project.files()}


def _digest(path: Path) -> str:
    data = path.read_bytes()
    if path.suffix == ".html" and PAGE_OF_TIME.encode() in data:
        data = PAGE_OF_TIME.encode()
    if path.suffix == ".parquet":
        data = _timeless(pq.read_table(path)) or data
    return hashlib.sha256(data).hexdigest()


def _timeless(table: pa.Table) -> bytes | None:
    """A table's rows and notes without processor time; None where it tells none."""
    ids = table["id"].to_pylist() if "id" in table.column_names else ()
    if TELLS_TIME not in table.column_names and ROW_OF_TIME not in ids:
        return None
    rows = [row for row in table.to_pylist() if row.get("id") != ROW_OF_TIME]
    rest = [{key: cell for key, cell in row.items() if key != TELLS_TIME} for row in rows]
    told = {key: value for key, value in table.schema.metadata.items() if key != CONTENT.encode()}
    return repr((sorted(told.items()), table.schema.remove_metadata().to_string(), rest)).encode()


def incomplete(project: Project) -> set[str]:
    """Result files that Snakemake's record says are being made."""
    folder = project.path(".snakemake/incomplete")
    names = {base64.b64decode(path.name).decode() for path in folder.rglob("*") if path.is_file()}
    return {name.removeprefix("results/") for name in names}
