"""What the rules of a project ask: its studies, their files, and the marks these must have.

A result file is what it should be if it carries the mark that its rule expects (`spinepipe.marks`),
whatever its age and whatever Snakemake's record says. `Project.outdated` tells Snakemake so by a
public door: an input that is newer than the file, where the file carries another mark.
"""

import fcntl
import json
import os
import shutil
import sys
import threading
import time
from collections.abc import Iterable, Mapping
from functools import cached_property
from pathlib import Path
from typing import Any, NoReturn, TextIO

from spinepipe.files import HOST, appearing, refusal, sweep
from spinepipe.jobs import code
from spinepipe.jobs.digest import versions
from spinepipe.jobs.expected import Expected
from spinepipe.jobs.pool import warm_up
from spinepipe.marks import mark_in
from spinepipe.problems import InputError
from spinepipe.studies import read as studies
from spinepipe.studies.plausibility import doubts, refusals
from spinepipe.studies.registry import kind_names, modules_of_many
from spinepipe.studies.study_files import StudyFiles

OUTDATED = ".snakemake/changed_settings_data_or_code"
"""Newer than the files that count as outdated; nothing reads what it says."""

RECORD = ".snakemake/metadata"
"""What Snakemake knows of files, a JSON file each."""

RUNNING = ".snakemake/spinepipe-running"
"""The lock of the run that is at work."""

_MOST_NAMED = 5
_PARENT = "SPINEPIPE_RUN"
"""Environment variable with the process that plans a run: those that it starts inherit it."""


def stop(message: object) -> NoReturn:
    """End with a message for people: Snakemake would add where in its rules it was raised."""
    raise SystemExit(f"Nothing was run. {message}")


def warn(message: object) -> None:
    """Say what a run goes on with."""
    print(f"warn  {message}", file=sys.stderr)


class Project:
    """The folder of a Snakefile with its studies, each read when first asked for.

    Attributes
    ----------
    plans : whether this process plans the run; else it is one that a run has started.
    """

    def __init__(self, root: str) -> None:
        self.root = root
        me = str(os.getpid())
        self.plans = os.environ.setdefault(_PARENT, me) == me
        self.names = studies.names_by_kind(Path(root))
        self.kinds = [name for name in kind_names() if name in self.names]
        self._expected: dict[str, Expected] = {}
        self._asked: set[str] = set()
        self._marks: dict[str, str | None] = {}
        self._lost: list[str] = []
        self._lock: TextIO | None = None
        kept = Path(".snakemake" if os.path.isdir(".snakemake") else ".")
        if self.plans and not os.access(kept, os.W_OK):  # else Snakemake ends with a Python stack
            stop(
                f"{kept.resolve()} cannot be written, where Snakemake keeps its record. Change its "
                "permissions or owner, or copy the project to a folder of your own."
            )
        if self.plans:
            _drop_damaged(Path(RECORD))

    @cached_property
    def selection(self) -> studies.Selection:
        """Which studies are built; those of `all` are validated, all problems told at once."""
        if not self.plans:  # it was validated before it was submitted
            return studies.Selection.model_construct(studies=(), full=())
        problems = []
        try:
            chosen = studies.read_selection(Path(self.root))
        except InputError as error:
            stop(error)
        for name in chosen.studies:
            try:
                self._check(name)
            except InputError as error:
                problems.append(f"study {name}: {error}")
        if problems:
            stop("\n".join(problems))
        return chosen

    def _check(self, name: str) -> Expected:
        if name not in self._expected:
            checked = studies.check(Path(self.root), name, starting=self.plans)
            self._expected[name] = Expected(self.root, *checked)
        return self._expected[name]

    def expected(self, name: str) -> Expected:
        """What tells the marks that results of a study must have."""
        try:
            return self._check(name)
        except InputError as error:
            stop(f"study {name}: {error}")

    def files(self, name: str) -> StudyFiles:
        """The result files of a study."""
        return self.expected(name).files

    @property
    def at_work(self) -> list[str]:
        """Names of the studies of which rules have asked for marks: files of theirs are wanted."""
        return sorted(self._asked)

    def everything(self, names: Iterable[str], full: bool = False) -> list[str]:
        """Results of these studies, with those of `full` or without, and lost job files."""
        return [
            file
            for name in names
            for file in self.files(name).results(full) + self.files(name).lost(full)
        ]

    def _of(self, study: str) -> Expected:
        self._asked.add(study)
        return self.expected(study)

    def mark(self, job: str, place: Mapping[str, str]) -> str:
        """The mark of the files of a job."""
        return self._of(place["study"]).of_job(job, {**place})

    def mark_of_block(self, place: Any) -> str:
        """The mark of a block of a table."""
        return self._of(place.study).of_block(place.table, place.specimen, place.block)

    def mark_of_table(self, place: Any) -> str:
        """The mark of a table that is joined from others."""
        return self._of(place.study).of_table(place.table)

    def mark_of_figure(self, place: Any) -> str:
        """The mark of a figure."""
        return self._of(place.study).of_figure(place.figure)

    def mark_of_page(self, place: Any) -> str:
        """The mark of a page."""
        return self._of(place.study).of_report(place.page)

    def base_model(self, place: Any) -> list[str]:
        """The model file that a study builds on, or nothing; another study may make it."""
        study: Any = self.expected(place.study).study
        model = study.base and study.base.model
        return [os.path.relpath(Path(self.root) / model)] if model else []

    def inputs_of_figure(self, place: Any) -> dict[str, Any]:
        """Tables and other results that a figure is drawn from."""
        files = self.files(place.study)
        read = tuple(files.read_by_figure(place.figure))
        return {"tables": files.table_files(read), **files.other_files(read)}

    def inputs_of_page(self, place: Any) -> dict[str, Any]:
        """All that a page shows."""
        files, full = self.files(place.study), place.page == "full"
        drawn = files.figures(full)
        return {
            "tables": files.table_files(files.tables, full),
            "figures": [f"{files.folder}/figures/{figure}.svg" for figure in drawn],
            **files.other_files(files.told_in_report),
        }

    def outdated(self, files: Iterable[str], mark: str) -> list[str]:
        """Nothing if the files that are there carry a mark, else an input newer than they."""
        if not self.plans:  # what a started process is to make was decided by the one that plans
            return []
        wrong = [path for path in files if self._mark_in(path) not in (None, mark)]
        if not wrong:
            return []
        newest = max(os.stat(path).st_mtime for path in wrong)
        now = time.time()
        with appearing(OUTDATED) as temporary:
            temporary.write_text(str(time.time_ns()))  # another content, else it is not news
            os.utime(temporary, (now, max(now, newest + 1)))
        return [OUTDATED]

    def _mark_in(self, path: str) -> str | None:
        if path not in self._marks:
            self._marks[path] = mark_in(path)
            if self._marks[path] == "":
                self._lost.append(path)
                if len(self._lost) <= _MOST_NAMED:
                    warn(
                        f"{path} is damaged, cut off, empty or of an older version: it counts as "
                        "lost and is computed again"
                    )
        return self._marks[path]

    def begin(self) -> None:
        """What is said and done before the first job of a run, alone in the project from now on.

        Raises
        ------
        SystemExit
            Where a run cannot end well, with the reason.
        """
        try:
            versions()
            self._lock = lock(Path(RUNNING))
        except ImportError as error:
            stop(error)
        except AtWork as run:
            stop(f"A run is at work in this folder: {run}. Wait until it ends, or end it.")
        for folder in (Path("results"), *(Path("results", name) for name in self.at_work)):
            if why := refusal(folder):
                stop(
                    f"results cannot be written to {folder.resolve()}: {why}. Make room or change "
                    "permissions, then run again (finished jobs are kept)."
                )
        at_work = [self.expected(name) for name in self.at_work]
        cohorts = {one.cohort.digest: one.cohort for one in at_work}
        for doubt in (doubt for cohort in cohorts.values() for doubt in doubts(cohort)):
            warn(doubt)
        refused = [str(one) for cohort in cohorts.values() for one in refusals(cohort)]
        if refused:
            stop("\n".join(refused))
        if len(self._lost) > _MOST_NAMED:
            warn(f"so do {len(self._lost) - _MOST_NAMED} more files below results")
        for name in self.at_work:
            sweep(f"results/{name}")
            _drop_former(Path("results", name))
        code.keep()  # workers then read no source file for its digest
        warm_up(modules_of_many({one.study.kind for one in at_work}))
        threading.Thread(target=_stop_timers).start()

    def end(self) -> None:
        """Write the page of all studies; first remove empty logs, of jobs that went well.

        A folder of logs that is a link is somebody's own.
        """
        places = (f"results/{name}/logs" for name in self.at_work)
        for logs in (place for place in places if not os.path.islink(place)):
            for folder, _, files in os.walk(logs, topdown=False):
                for path in (os.path.join(folder, file) for file in files):
                    if not os.path.getsize(path):
                        os.unlink(path)
                if not os.listdir(folder):
                    os.rmdir(folder)
        self._write_index()

    def _write_index(self) -> None:
        """The page of all studies; of those of this run the marks are known, and state is told."""
        # here: a look at what is to be done needs no templates
        from spinepipe.report.overview.index import INDEX, write_index

        try:
            of_run = {name: self.expected(name).is_up_to_date for name in self.at_work}
            page = write_index(Path(self.root), of_run)
        except (OSError, InputError) as trouble:  # of a disk, or a study changed meanwhile
            warn(f"{INDEX} is not written: {trouble}")
        else:
            print(f"all studies: {page.as_uri()}", file=sys.stderr)


def _drop_damaged(record: Path) -> None:
    """Remove entries that cannot be read, which would end the run with a Python stack.

    Snakemake writes them in place: one that was being written when a run was killed is cut off.
    """
    for path in record.rglob("*") if record.is_dir() else ():
        if path.is_file():
            try:
                json.loads(path.read_bytes())
            except ValueError:
                path.unlink()


def _drop_former(results: Path) -> None:
    """Remove job files where versions before decision 0063 had them: read as one data set with
    those of now, which are computed anew, each row would be there twice.
    """
    for former in ("*/specimen=*", "*/*/specimen=*", "*/representation=*"):
        for path in results.glob(former):
            shutil.rmtree(path) if path.is_dir() else path.unlink()


def _stop_timers() -> None:
    """Wait for the main thread, then stop what would hold up the end of the process.

    Snakemake's limit of jobs per time starts a timer at each look at what is ready.
    """
    threading.main_thread().join()
    for thread in threading.enumerate():
        if isinstance(thread, threading.Timer):
            thread.cancel()


class AtWork(Exception):
    """Another run holds the lock; the text says which."""


def lock(path: Path) -> TextIO:
    """The lock of a run, one at a time in a project; held until the file returned is closed.

    It belongs to a process (`flock`): the system takes it off when that one ends, however it ends,
    so that a run that was killed leaves nothing to be unlocked.
    Where a disk knows no such locks, every run gets it.

    Raises
    ------
    AtWork
        With process, machine and hour of the run that holds it.
    """
    file = path.open("a+", encoding="utf-8")
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        with file:
            file.seek(0)
            raise AtWork(file.read().strip()) from None
    except OSError:
        pass
    file.truncate(0)
    file.write(f"process {os.getpid()} on {HOST}, since {time.strftime('%Y-%m-%d %H:%M')}\n")
    file.flush()
    return file
