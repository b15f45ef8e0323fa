"""A study of 24,000 jobs: one in a hundred dies, and one run in a hundred tips over.

Those that die do so in four ways, drawn beforehand: by an exception, by SIGKILL, by ending their
process, by a fault of memory. They are told so in the copy's own job, as long as a list lies there;
nothing of the product knows of it. A run that tips over does so by itself: its load is drawn too
large.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import lever
import numpy as np
import pandas as pd
from small_project import Project, written

from spinepipe.tables import read_frame
from tests.validation.soak.started import Cost, seen, timed

SAMPLES = 12_000
"""Of each of two specimens, a job each."""

FAILING = 0.01
NAME = "soak"
FORCE_N, POINT_MM = (0.0, -2.0), (0.0, 30.0)
"""A force that presses a lever down: 1.3 in 100 of its multiples are more than its joint holds."""

STUDY = """\
study: {name}
kind: global_sensitivity
cohort: lever
factors:
  - {{of: load_size, times: {{sd: 3}}, name: size}}
  - {{of: stiffness, coordinate: right_bending, times: {{low: 0.5, high: 2}}, name: bending}}
design: {{method: latin_hypercube, samples: {samples}}}
outputs: {{motion: [extension], joint_load: [extension]}}
bootstraps: 100
{more}
"""

WAYS = {
    "raises": ("raise ValueError('no such spine')", "ValueError: no such spine"),
    "killed": ("import os; os.kill(os.getpid(), 9)", "killed from outside (SIGKILL)"),
    "ends": ("import os; os._exit(7)", "ended itself in mid-job with exit code 7"),
    "crashes": ("import os; os.kill(os.getpid(), 11)", "crashed: segmentation fault"),
}
"""How a job dies, and what must be said of it."""

ACCIDENTS = """

import importlib as _importlib
from pathlib import Path as _Path

_run = run


def run(*given, specimen, parts, **named):
    if _Path("accidents.txt").exists():
        lines = _Path("accidents.txt").read_text().splitlines()
        happens = dict(line.split() for line in lines)
        for place in parts.values():
            how = happens.get(f"{specimen}/{place['batch']}")
            if how:
                getattr(_importlib.import_module("accidents"), how)()
    _run(*given, specimen=specimen, parts=parts, **named)
"""
"""Added to the job of the copy."""

UNVERIFIED = """

import spinepipe.marks

spinepipe.marks._digest = lambda file, marks: marks.content
"""
"""Added to it to find out what verifying costs: marks are read, and nothing else of a file."""

FILE = f"{NAME}/jobs/responses/specimen-{{}}/batch-{{}}.parquet"

Row = dict[str, Any]


@dataclass(frozen=True)
class Big:
    """The study, and which of its jobs die, by specimen/batch."""

    project: Project
    dying: dict[str, str]
    snakefile: str

    def accidents(self, happen: bool) -> None:
        """Let them happen, or no more."""
        listed = self.project.path("accidents.txt")
        listed.unlink(missing_ok=True)
        if happen:
            listed.write_text("".join(f"{place} {how}\n" for place, how in self.dying.items()))

    def files(self) -> set[str]:
        """Those of jobs that die."""
        return {FILE.format(*key.split("/")) for key in self.dying}


def big(folder: Path, samples: int = SAMPLES, seed: int = 19) -> Big:
    """The project, with accidents drawn, which do not happen yet."""
    project = column(folder, samples, "samples_per_target: 1")
    rng = np.random.default_rng(seed)
    places = [f"{name}/{number:05d}" for name in "ab" for number in range(samples)]
    chosen = rng.choice(places, round(FAILING * len(places)), replace=False)
    dying = {str(place): list(WAYS)[k % len(WAYS)] for k, place in enumerate(chosen)}
    respond = project.job("global_sensitivity", "respond")
    respond.write_text(respond.read_text() + ACCIDENTS)
    happens = [f"def {how}():\n    {what}\n" for how, (what, _) in WAYS.items()]
    project.path("accidents.py").write_text("\n".join(happens))
    return Big(project, dying, project.path("Snakefile").read_text())


def column(folder: Path, samples: int, more: str) -> Project:
    """A project with the study."""
    with_study = {"STUDY": STUDY, "FORCE_N": FORCE_N, "POINT_MM": POINT_MM}
    before = {name: getattr(lever, name) for name in with_study}
    vars(lever).update(with_study)
    try:
        return lever.lever(folder, (NAME, samples, more))
    finally:
        vars(lever).update(before)


def rows(folder: Path, samples: int = SAMPLES) -> Iterator[Row]:
    """What each run made, said and cost; raises where something is amiss."""
    study = big(folder / "big", samples)
    project, jobs = study.project, 2 * samples
    study.accidents(True)
    first = timed(project, "all", "--keep-going")
    done = seen(project)
    made = [name for name in done if "/jobs/" in name]
    named = [place for place, how in study.dying.items() if _is_named(first, project, place, how)]
    yield _row("one job in a hundred dies", jobs, made, len(named), first)
    assert first.code != 0
    assert set(study.dying) == set(named), set(study.dying) - set(named)
    assert len(made) == jobs - len(study.dying)
    assert not set(made) & study.files()

    study.accidents(False)
    second = timed(project, "all")
    after = seen(project)
    again = {name for name in written(done, after) if "/jobs/" in name}  # type: ignore[arg-type]
    yield _row("started again", jobs, again, 0, second)
    assert second.code == 0, second.said[-2000:]
    assert again == study.files()

    yield _failed_runs(folder, project, samples)
    yield from _nothing_to_do(study, jobs)


def _is_named(run: Cost, project: Project, place: str, how: str) -> bool:
    """Whether a file that died is told with its cause."""
    specimen, batch = place.split("/")
    path = f"results/{FILE.format(specimen, batch)}"
    told = re.findall(re.escape(path) + ": .*", run.said)
    return any(WAYS[how][1] in line for line in told)


def _row(what: str, jobs: int, made: Sequence[str] | set[str], named: int, run: Cost) -> Row:
    return {
        "run": what,
        "jobs": jobs,
        "job_files_made": len(made),
        "failures_named": named,
        "wall_s": round(run.wall_s, 1),
        "snakemake_processor_s": round(run.engine_s, 1),
    }


def _failed_runs(folder: Path, project: Project, samples: int) -> Row:
    """Rows are those of the same study in batches, failed ones with their status and message."""
    batches = column(folder / "batches", samples, "samples_per_target: 1000")
    beside = timed(batches, f"results/{NAME}/responses.parquet")
    assert beside.code == 0, beside.said[-2000:]
    responses = [
        read_frame(one.path(f"results/{NAME}/responses.parquet")) for one in (project, batches)
    ]
    pd.testing.assert_frame_equal(*responses)
    found = responses[0]
    failed = found[found["status"] != "converged"]
    assert (failed["message"] != "").all()
    told = read_frame(project.path(f"results/{NAME}/failed_runs.parquet"))
    counted = told.groupby("specimen")["failed"].max().sum()
    assert counted == len(failed), (counted, len(failed))
    return _row("the same in batches of 1,000", 2 * samples, [], len(failed), beside)


def _nothing_to_do(study: Big, jobs: int) -> Iterator[Row]:
    """What a run with nothing to do costs, with files verified and without."""
    for what, more in (("verified", ""), ("not verified", UNVERIFIED)):
        study.project.path("Snakefile").write_text(study.snakefile + more)
        before = seen(study.project)
        for _ in range(2):
            run = timed(study.project, "all")
            assert run.code == 0, run.said[-2000:]
            assert "Nothing to be done" in run.said
            assert seen(study.project) == before
            yield _row(f"nothing to do, files {what}", jobs, [], 0, run)
