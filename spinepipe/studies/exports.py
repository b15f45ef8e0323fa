"""What kinds share in writing files for OpenSim: what is refused, and what comes of it."""

from pathlib import Path
from typing import NamedTuple

from spinepipe.problems import InputError, InputProblem
from spinepipe.studies.kind import WantedFiles

_OPTIONS = {
    "pose": ("--pose", "none: this kind of study exports no sampled joints"),
    "representation": (
        "--representation",
        "none: stiffness of this kind of study has one representation",
    ),
    "test": ("--test", "none: motions of this kind of study are among its results"),
    "point_mm": ("--matrix", "none: this kind of study tells no stiffness matrix"),
}
"""What some kinds do not have, by its name in `WantedFiles`."""


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
    asked = {name: getattr(wanted, name) for name in _OPTIONS if name not in has}
    problems = [
        problem(_OPTIONS[name][0], f"{value}", _OPTIONS[name][1], "leave it out")
        for name, value in asked.items()
        if value is not None
    ]
    if problems:
        raise InputError(problems)


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
