"""What kinds share in writing files for OpenSim: what is refused, and what comes of it."""

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from spinepipe.problems import InputError, InputProblem
from spinepipe.studies.kind import WantedFiles


class Exported(NamedTuple):
    """OpenSim's document of a model, in words what it is, and of a test the motion as .mot."""

    document: str
    words: str
    motion: str = ""


def refuse(
    wanted: WantedFiles,
    *,
    poses: bool = False,
    representations: bool = False,
    tests: bool = True,
) -> None:
    """Refuse what a kind of study does not have.

    Parameters
    ----------
    poses, representations, tests : whether it has them.

    Raises
    ------
    InputError
        With every such option.
    """
    problems = list(_options(wanted, poses, representations, tests))
    if problems:
        raise InputError(problems)


def _options(
    wanted: WantedFiles, poses: bool, representations: bool, tests: bool
) -> Iterator[InputProblem]:
    if wanted.test is not None and not tests:
        allowed = "none: motions of this kind of study are among its results"
        yield problem("--test", wanted.test, allowed, "leave it out")
    if wanted.pose is not None and not poses:
        allowed = "none: this kind of study exports no sampled joints"
        yield problem("--pose", f"pose {wanted.pose}", allowed, "leave it out")
    if wanted.representation is not None and not representations:
        allowed = "none: stiffness of this kind of study has one representation"
        yield problem("--representation", wanted.representation, allowed, "leave it out")


def required_result(path: Path, what: str) -> Path:
    """A result file that must be there.

    Raises
    ------
    InputError
        With the command that makes it.
    """
    if not path.is_file():
        folders = path.parts
        name = "/".join(folders[folders.index("results") :])
        remedy = f"run `snakemake -j2 {name}` first, or add --start"
        raise InputError([problem("STUDY", f"no {name}", what, remedy)])
    return path


def problem(column: str, found: str, allowed: str, remedy: str) -> InputProblem:
    """A problem of the command line."""
    return InputProblem("command line", None, column, found, allowed, remedy)
