"""`spinepipe run`: compute studies and write their reports; Snakemake does the work."""

import re
import signal
import sys
import time
import webbrowser
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn
from snakemake_logger_plugin_spinepipe.time_left import duration

from spinepipe.cli.plan import Effort, checked, targets, with_effort
from spinepipe.cli.program import FAILED, FINE, PROBLEM, STOPPED, WrongUsage
from spinepipe.cli.slurm import SLURM, slurm_profile
from spinepipe.files import appearing
from spinepipe.jobs.expected import Expected
from spinepipe.jobs.start import Snakemake, cores_here
from spinepipe.report.overview.index import entry
from spinepipe.report.words import count
from spinepipe.studies import read as studies
from spinepipe.studies.study import STUDIES

MOST_FAILED = 5
"""Failed jobs that are told with their words."""

_SECONDS_BETWEEN_LINES = 10.0
"""Where no bar can be drawn, as in a file."""


def command(
    context: typer.Context,
    names: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[STUDIES]... [-- ARGS]",
            help="names of studies; ARGS go to Snakemake",
            show_default="those of config/config.yaml that are not up to date",
        ),
    ] = None,
    effort: Annotated[
        Effort | None, typer.Option(help="of a search for effects; written into the study's file")
    ] = None,
    cores: Annotated[
        int | None, typer.Option("-j", "--cores", min=1, help="at a time", show_default="all")
    ] = None,
    slurm: Annotated[bool, typer.Option("--slurm", help="submit to Slurm")] = False,
    account: Annotated[str | None, typer.Option(help="of Slurm")] = None,
    partition: Annotated[str | None, typer.Option(help="of Slurm")] = None,
    show: Annotated[bool, typer.Option("--open", help="open the report")] = False,
    keep_going: Annotated[
        bool, typer.Option("--keep-going", help="do the other studies when one fails")
    ] = False,
    force: Annotated[bool, typer.Option("--force", help="compute again")] = False,
) -> int:
    """Compute studies and write their reports."""
    root: Path = context.obj
    asked = context.find_root().params
    names, more = list(names or []), context.meta["rest"]
    wanted = [checked(root, name) for name in dict.fromkeys(names)] or stale(root)
    if not wanted:
        if studies.read_selection(root).studies:
            print("All studies of config/config.yaml are up to date.\nNext: spinepipe index")
        else:
            print("config/config.yaml names no study yet.\nNext: spinepipe new study NAME")
        return FINE
    if {"-n", "--dry-run", "--dryrun"} & set(more):
        raise WrongUsage("a run that computes nothing", "spinepipe plan  says what it would do")
    if effort:
        wanted = [_set_effort(root, one, effort) for one in wanted]
    if slurm and not (root / SLURM).is_file():
        raise WrongUsage(f"there is no {SLURM}", "spinepipe init --slurm writes it")
    arguments = [*targets(wanted)]
    if slurm:
        place = {"slurm_account": account, "slurm_partition": partition}
        also = [f"{key}={value}" for key, value in place.items() if value]
        arguments += slurm_profile(root, more, also)
        arguments += ["--jobs", f"{cores}"] if cores else []
    else:
        arguments += ["--cores", f"{cores or cores_here()}", *more]
    arguments += ["--keep-going"] * keep_going + ["--forceall"] * force
    arguments += ["--verbose"] * asked["verbose"]
    begun = time.monotonic()
    one = wanted[0].study.study if len(wanted) == 1 else ""
    run = Snakemake(root, arguments, one, submits=slurm)
    watched = Watched(run, asked["quiet"] or asked["json"], asked["verbose"])
    code = watched.watch()
    if code != FINE:
        return code
    for expected in wanted:
        _tell(root, expected, duration(time.monotonic() - begun))
        if show:
            webbrowser.open((root / expected.files.page()).resolve().as_uri())
    if len(wanted) == 1:
        print(f"Next: spinepipe why {one} --quality")
    else:
        print("Next: spinepipe index")
    return FINE


def stale(root: Path) -> list[Expected]:
    """The studies of a plain run that are not up to date."""
    chosen = [checked(root, name) for name in studies.read_selection(root).studies]
    return [one for one in chosen if not one.is_up_to_date]


def _set_effort(root: Path, expected: Expected, effort: Effort) -> Expected:
    """The study with another effort, in its file too.

    Results hang on it: were it said in the command line alone, the next command would find the
    report made of other settings than the file has, and compute it again.
    """
    study: Any = expected.study
    with_effort(expected, effort)
    if study.effort != effort.value:
        path = root / STUDIES / f"{study.study}.yaml"
        text, line = path.read_text("utf-8"), f"effort: {effort.value}"
        written = re.sub(r"(?m)^effort:[^#\n]*?(?=\s*(#|$))", line, text)
        if written == text:
            written = f"{text.rstrip()}\n{line}\n"
        with appearing(path) as temporary:
            temporary.write_text(written, "utf-8")
        print(f"{path.relative_to(root)}: effort {study.effort} is now {effort.value}")
    return checked(root, study.study)


class Watched:
    """A run that is told on one line, with the time left of the whole."""

    def __init__(self, run: Snakemake, silent: bool, verbose: bool) -> None:
        self._run, self._verbose = run, verbose
        self._console = Console(stderr=True, quiet=silent, highlight=False)
        self._done = self._total = 0
        self._told_at = 0.0
        self._errors: list[str] = []
        self._failed: list[str] = []
        self._said: list[str] = []

    def watch(self) -> int:
        """Follow it to its end; the exit code, its failures told."""
        columns = [TextColumn("{task.description}"), BarColumn(), TaskProgressColumn()]
        bar = Progress(*columns, TextColumn("{task.fields[left]}"), console=self._console)
        with bar:
            task = bar.add_task("looking at what is to be done", total=None, left="")
            for event in self._run.events():
                self._hear(bar, task, event)
            bar.update(task, visible=False)
        if self._run.code == 0:
            return FINE
        kept = f"{self._done} of {count(self._total, 'job')} are kept"
        if self._run.code == -signal.SIGINT:
            print(f"Stopped. {kept}; the same command goes on.", file=sys.stderr)
            return STOPPED
        told = self._errors or self._failed or self._said[-MOST_FAILED:]
        for words in told[:MOST_FAILED]:
            print(f"error: {words}", file=sys.stderr)
        if not (self._failed or self._errors):
            return PROBLEM
        more = len(told) - MOST_FAILED
        also = f"{count(more, 'job')} more failed: spinepipe why STUDY. " if more > 0 else ""
        print(f"{also}{kept}. After mending, the same command goes on.", file=sys.stderr)
        return FAILED

    def _hear(self, bar: Progress, task: Any, event: Any) -> None:
        match event["event"]:
            case "plan":
                self._total = event["jobs"]
                about = f", about {duration(event['left'])}" if "left" in event else ""
                self._console.print(f"{count(self._total, 'job')}{about}")
                bar.update(task, total=self._total, description="")
            case "progress":
                self._done, self._total = event["done"], event["total"]
                left = f"about {duration(event['left'])} left" if "left" in event else ""
                bar.update(
                    task, completed=self._done, total=self._total, left=left,
                    description=event["last"],
                )  # fmt: skip
                if not self._console.is_terminal:
                    self._line(f"{self._done} of {self._total} jobs  {left}")
            case "error" if not event["text"].startswith("WorkflowError"):  # says no more
                self._errors.append(event["text"])
            case "failed":
                self._failed.append(event["job"])
            case "text" if event["text"]:
                self._said.append(event["text"])
                if self._verbose or event["text"].startswith("warn  "):
                    self._console.print(event["text"], markup=False)
                elif self._total:
                    bar.update(task, description=event["text"][:60])

    def _line(self, words: str) -> None:
        if time.monotonic() - self._told_at > _SECONDS_BETWEEN_LINES:
            self._told_at = time.monotonic()
            self._console.print(words)


def _tell(root: Path, expected: Expected, took: str) -> None:
    """The answer of a study, its lights, and where the report is."""
    name = expected.study.study
    told = entry(root, name, {name: True})
    lights = " ".join(f"{sign} {number}" for _, sign, number in told.lights)
    print(f"{name}: {told.answer}" if told.answer else f"{name}: computed")
    quality = f"Quality {lights}    " if lights else ""
    print(f"{quality}Report: {expected.files.page()}    {took}")
