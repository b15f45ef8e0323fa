"""What kinds share in writing files for OpenSim: what is refused, and what comes of it."""

from pathlib import Path
from typing import NamedTuple

from spinepipe.problems import InputError, InputProblem
from spinepipe.studies.kind import WantedFiles

_OPTIONS = {
    "pose": ("--pose", "exports no sampled joints"),
    "representation": ("--representation", "has one representation of stiffness"),
    "test": ("--test", "has motions among its results"),
    "point_mm": ("--matrix", "tells no stiffness matrix"),
}
"""What some kinds do not have, by its name in `WantedFiles`: the option, and what they do."""


class Exported(NamedTuple):
    """OpenSim's document of a model, in words what it is, and of a test the motion as .mot."""

    document: str
    words: str
    motion: str = ""


def refuse(wanted: WantedFiles, *has: str) -> None:
    """Refuse what a kind of study does not have.

    Parameters
    ----------
    has : of `_OPTIONS`, what it has.

    Raises
    ------
    InputError
        With every such option.
    """
    problems = [
        problem(option, f"{value}", f"none: this kind of study {does}", "leave it out")
        for name, (option, does) in _OPTIONS.items()
        if name not in has and (value := getattr(wanted, name)) is not None
    ]
    if problems:
        raise InputError(problems)


def required_result(path: Path, otherwise: str = "add --start") -> Path:
    """A result file that must be there.

    Raises
    ------
    InputError
        With the command that makes it, and how to do without.
    """
    if not path.is_file():
        folders = path.parts
        name = "/".join(folders[folders.index("results") :])
        remedy = f"run `snakemake -j2 {name}` first, or {otherwise}"
        raise InputError([problem("STUDY", f"no {name}", "a computed study", remedy)])
    return path


def problem(column: str, found: str, allowed: str, remedy: str) -> InputProblem:
    """A problem of the command line."""
    return InputProblem("command line", None, column, found, allowed, remedy)
