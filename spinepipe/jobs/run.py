"""How a job of a rule is run: what is there is kept, what is made is looked at.

A job whose files all carry the mark that they must have has nothing to do, whatever made Snakemake
start it; Snakemake dates its files anew. After a job its files are looked at: another mark means
that settings, data or code have changed since the run was planned, and the job has failed.
"""

import os
import sys
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any

from spinepipe.jobs.pool import JobFailed, WorkerDied, submit_and_wait
from spinepipe.jobs.project import OUTDATED, Project, warn
from spinepipe.marks import mark_in
from spinepipe.studies.registry import kind_of
from spinepipe.studies.registry import place_of as function_of

BLOCK = "spinepipe.jobs.block:run"
"""The job that makes the files of a block."""

_OF_RULES = ("digest", "job")
"""Params that tell Snakemake something, and no job."""

_FORCE = ("-f", "-F", "-R", "--force", "--forceall", "--forcerun")


def run_job(
    project: Project,
    job: str,
    rule: str,
    wildcards: Any,
    input: Any,
    output: Any,
    params: Any,
    log: Any,
) -> None:
    """Run a job in the warm pool on the files and wildcards of a rule.

    Named input and output files and the wildcards become arguments of the same name.

    Parameters
    ----------
    job : of the study's kind, or ``module:function`` of one that serves every kind.
    params : with the mark that its files must have, ``digest``; further ones are arguments too.

    Raises
    ------
    JobFailed
        With the job's name, why it failed, and where its log is.
    """
    inputs, outputs = [str(path) for path in input], [str(path) for path in output]
    place = dict(wildcards.items())  # Snakemake's own is a list
    name = " ".join([rule, *(f"{key}={value}" for key, value in place.items())])
    forced = project.plans and any(option in sys.argv for option in _FORCE)
    if forced or not project.plans or not _carry(outputs, params.digest):
        named = {key: _plain(files) for key, files in [*input.items(), *output.items()]}
        others = {key: value for key, value in params.items() if key not in _OF_RULES}
        kind = project.expected(place["study"]).study.kind
        arguments = {"root": project.root, **others, **place, **named}
        function, read = job, []
        if ":" not in job:
            function = function_of(kind, job)
            if kind_of(kind).job(job).reads:
                read = [path for path in inputs if path != OUTDATED]
        elif job == BLOCK:
            arguments["anew"] = forced
        try:
            submit_and_wait(name, function, str(log), read, **arguments)
        except WorkerDied as death:
            if job != BLOCK or "block" not in place:
                raise JobFailed(str(death)) from None
            _one_by_one(project, name, function, place, str(log), arguments)
            submit_and_wait(name, function, str(log), read, **arguments)
        if not _carry(outputs, params.digest):
            raise JobFailed(
                f"job {name}: settings, data or code have changed since this run was planned. Run "
                "the same command again"
            )
    # Snakemake would end the run for an input that is dated in the future
    for path in inputs:
        with suppress(OSError):
            if os.stat(path).st_mtime > time.time():
                os.utime(path)
                warn(f"{path} was dated in the future: a clock is or was wrong. It is dated back")


def _one_by_one(
    project: Project,
    name: str,
    function: str,
    place: Mapping[str, str],
    log: str,
    arguments: Mapping[str, Any],
) -> None:
    """Make the files of a block each in a worker that only it can kill: the others are kept.

    Raises
    ------
    JobFailed
        With what each of those said that failed.
    """
    expected = project.expected(place["study"])
    table, failed = place["table"], []
    for path in expected.files.job_files(table, place["specimen"], place["block"]):
        if mark_in(path) != expected.of_part(table, path):
            try:
                submit_and_wait(f"{name} {path}", function, log, **{**arguments, "output": path})
            except JobFailed as error:
                failed.append(str(error))
    if failed:
        raise JobFailed("\n".join(failed))


def _carry(paths: Sequence[str], mark: str) -> bool:
    return all(mark_in(path) == mark for path in paths)


def _plain(files: Any) -> Any:
    """Paths as plain strings: Snakemake's own carry the whole rule with them."""
    return str(files) if isinstance(files, str) else [str(path) for path in files]
