"""Job: one block of a table of thousands of job files, in one process.

Each job file stays a result of its own, with its own mark: those that carry the mark they must have
are kept, the others are computed together, then the rows of all become the block. So a run that was
killed goes on where it stood, and a file that was lost is made alone.
"""

from collections.abc import Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

from spinepipe.jobs.collect import join_files
from spinepipe.jobs.expected import Expected, place_of
from spinepipe.jobs.inputs import study_of
from spinepipe.marks import mark_in
from spinepipe.studies.registry import kind_of
from spinepipe.studies.registry import place_of as function_of

_MOST_NAMED = 5


class PartsFailed(Exception):
    """Some job files of a block could not be made; the text says which and why."""


def run(
    root: str,
    study: str,
    table: str,
    specimen: str,
    output: str,
    anew: bool = False,
    **inputs: Any,
) -> None:
    """Make what is missing of the job files of a block and join them, or make one job file.

    Parameters
    ----------
    output : the block or the job file; the names and values in its path are no inputs.
    anew : whether job files that are right are made all the same.
    """
    expected = Expected(root, *study_of(root, study))
    place = place_of(output)
    given = {name: value for name, value in inputs.items() if name not in (*place, "block")}
    given |= {"root": root, "study": study, "specimen": specimen}
    if "block" not in place:
        _make(expected, table, [output], given)
        return
    parts = expected.files.job_files(table, specimen, place["block"])
    marks = {path: expected.of_part(table, path) for path in parts}
    missing = [path for path, mark in marks.items() if anew or mark_in(path) != mark]
    _make(expected, table, missing, given)
    join_files(kind_of(expected.study.kind).table(table), marks, output)


def run_joined(
    root: str, study: str, table: str, inputs: list[str], output: str, **_place: str
) -> None:
    """Join files that other jobs have made: job files to a block, or blocks to a table."""
    expected = Expected(root, *study_of(root, study))
    marks = {path: expected.of_part(table, path) for path in inputs}
    join_files(kind_of(expected.study.kind).table(table), marks, output)


def _make(
    expected: Expected, table: str, paths: Sequence[str], arguments: Mapping[str, Any]
) -> None:
    """Compute job files together; one by one where that fails, so that the others are there."""
    if not paths:
        return
    job = expected.files.job_of(table, paths[0])
    module, _, name = function_of(expected.study.kind, job).partition(":")
    function = getattr(import_module(module), name)
    parts = {path: place_of(path) for path in paths}
    for path in parts:
        Path(path).parent.mkdir(parents=True, exist_ok=True)
    try:
        function(parts=parts, **arguments)
    except Exception:
        if len(parts) == 1:
            raise
        _one_by_one(function, parts, arguments)


def _one_by_one(
    function: Any, parts: Mapping[str, Mapping[str, str]], arguments: Mapping[str, Any]
) -> None:
    failed = {}
    for path, place in parts.items():
        try:
            function(parts={path: place}, **arguments)
        except Exception as error:  # whatever it is: the others are made all the same
            failed[path] = f"{type(error).__name__}: {error}"
    if failed:
        shown = [f"  {path}: {why}" for path, why in list(failed.items())[:_MOST_NAMED]]
        more = len(failed) - len(shown)
        lines = [*shown, *([f"  and {more} more"] if more else [])]
        raise PartsFailed(
            f"{len(failed)} of {len(parts)} files were not made, the others are kept:\n"
            + "\n".join(lines)
        )
