"""Read one study file, or say everything that is wrong with it."""

from pathlib import Path

from spinepipe.cohort.read_yaml import Document, read_yaml
from spinepipe.cohort.validate import validate
from spinepipe.problems import InputError, Problem, did_you_mean, one_of
from spinepipe.studies.cohort_stiffness import CohortStiffness
from spinepipe.studies.discrepancy import Discrepancy
from spinepipe.studies.global_sensitivity import GlobalSensitivity
from spinepipe.studies.joint_pose_sensitivity import JointPoseSensitivity
from spinepipe.studies.range_of_motion import RangeOfMotion
from spinepipe.studies.study import Study

__all__ = ["KINDS", "STUDIES", "displayed", "load", "read"]

STUDIES = Path("config") / "studies"

KINDS: dict[str, type[Study]] = {
    "joint_pose_sensitivity": JointPoseSensitivity,
    "range_of_motion": RangeOfMotion,
    "cohort_stiffness": CohortStiffness,
    "discrepancy": Discrepancy,
    "global_sensitivity": GlobalSensitivity,
}
"""The model of each kind of study."""


def read(path: Path, root: Path) -> Study:
    """Read and validate a study file by itself; its cohort is not opened.

    Parameters
    ----------
    path : ``config/studies/<study>.yaml``.
    root : folder of the Snakefile; messages name files from there.

    Raises
    ------
    InputError
        With every problem of the file.
    """
    _, study, problems = load(path, root)
    if problems or study is None:
        raise InputError(problems)
    return study


def load(path: Path, root: Path) -> tuple[Document | None, Study | None, list[Problem]]:
    """The study file as data and as a study, None where it is neither; and its problems."""
    file = displayed(path, root)
    if not path.is_file():
        known = sorted(other.stem for other in path.parent.glob("*.yaml"))
        remedy = did_you_mean(path.stem, known, "add it or correct the name")
        return None, None, [Problem(file, None, None, "no such file", one_of(known), remedy)]
    document, problems = read_yaml(path, file)
    if document is None:
        return None, None, problems
    study, faults = _validated(document)
    return document, study, [*problems, *faults, *_name_problems(document, path.stem)]


def displayed(path: Path, root: Path) -> str:
    """A path as messages show it: from the root where it lies below."""
    return path.relative_to(root).as_posix() if path.is_relative_to(root) else str(path)


def _validated(document: Document) -> tuple[Study | None, list[Problem]]:
    kind = document.data.get("kind")
    if isinstance(kind, str) and kind in KINDS:
        return validate(KINDS[kind], document)
    place = (document.file, document.line_of("kind"), "kind")
    found = "nothing: the key is missing" if kind is None else repr(kind)
    otherwise = "the kind decides which other keys are allowed"
    remedy = did_you_mean(str(kind), KINDS, otherwise)
    return None, [Problem(*place, found, one_of(KINDS), remedy)]


def _name_problems(document: Document, stem: str) -> list[Problem]:
    name = document.data.get("study")
    if not isinstance(name, str) or name == stem:
        return []
    place = (document.file, document.line_of("study"), "study")
    remedy = "rename the file or change the key"
    return [Problem(*place, f"'{name}'", f"the file's name, '{stem}'", remedy)]
