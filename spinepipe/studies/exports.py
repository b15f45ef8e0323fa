"""What kinds share in writing a specimen's model for OpenSim: what is refused, and the file."""

from pathlib import Path

from spinepipe.model import SpineModel
from spinepipe.model.osim import expressible, osim
from spinepipe.problems import InputError, InputProblem
from spinepipe.studies.kind import WantedFiles

_OPTIONS = {
    "pose": ("--pose", "none: this kind of study exports no sampled joints"),
    "representation": (
        "--representation",
        "none: stiffness of this kind of study has one representation",
    ),
    "point_mm": ("--matrix", "none: this kind of study tells no stiffness matrix"),
}
"""What some kinds do not have, by its name in `WantedFiles`."""


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


def opensim_document(model: SpineModel, words: str) -> tuple[str, str]:
    """OpenSim's document of a model, and in words what it is and what it leaves out.

    Raises
    ------
    RefusedModel
        For a name that OpenSim cannot take.
    """
    said, unsaid = expressible(model)
    document = osim(said, left_out=unsaid)
    if unsaid:
        words += f"; not in the file, as OpenSim has no counterpart: {', '.join(unsaid)}"
    return document, words


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
