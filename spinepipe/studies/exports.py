"""What kinds share in writing a specimen's model for OpenSim: what is refused, and the file."""

from collections.abc import Iterator
from pathlib import Path

from spinepipe.model import SpineModel
from spinepipe.model.osim import expressible, osim
from spinepipe.problems import InputError, InputProblem
from spinepipe.studies.kind import WantedFiles


def refuse(
    wanted: WantedFiles,
    *,
    poses: bool = False,
    representations: bool = False,
    matrices: bool = False,
) -> None:
    """Refuse what a kind of study does not have.

    Parameters
    ----------
    poses, representations, matrices : whether it has them.

    Raises
    ------
    InputError
        With every such option.
    """
    problems = list(_options(wanted, poses, representations))
    if wanted.point_mm is not None and not matrices:
        allowed = "none: only studies of kind cohort_stiffness tell the matrix of each joint"
        problems.append(problem("--matrix", str(wanted.point_mm), allowed, "leave it out"))
    if problems:
        raise InputError(problems)


def _options(wanted: WantedFiles, poses: bool, representations: bool) -> Iterator[InputProblem]:
    if wanted.pose is not None and not poses:
        allowed = "none: this kind of study exports no sampled joints"
        yield problem("--pose", f"pose {wanted.pose}", allowed, "leave it out")
    if wanted.representation is not None and not representations:
        allowed = "none: stiffness of this kind of study has one representation"
        yield problem("--representation", wanted.representation, allowed, "leave it out")


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
