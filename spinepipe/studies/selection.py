"""Which studies a run builds."""

from pathlib import Path
from typing import Annotated

from pydantic import BaseModel, Field

from spinepipe.cohort.read_yaml import Document, read_yaml
from spinepipe.cohort.validate import validate
from spinepipe.problems import InputError, Problem, did_you_mean, one_of
from spinepipe.studies.coordinates import FORM
from spinepipe.studies.read import STUDIES, displayed

__all__ = ["Selection", "names_of_kind", "read_selection"]

CONFIG = Path("config") / "config.yaml"

_Names = Annotated[tuple[str, ...], Field(strict=False)]


class Selection(BaseModel):
    """The keys of ``config/config.yaml``."""

    model_config = FORM

    studies: _Names = Field(min_length=1, description="studies that a plain run builds")
    full: _Names = Field(default=(), description="long studies, built by `make full` only")


def read_selection(root: Path) -> Selection:
    """Read ``config/config.yaml`` and look for the file of every study it names.

    Parameters
    ----------
    root : folder of the Snakefile.

    Raises
    ------
    InputError
        With every problem of the file.
    """
    path = root / CONFIG
    file = displayed(path, root)
    if not path.is_file():
        allowed = "a file with `studies: [...]`"
        raise InputError([Problem(file, None, None, "no such file", allowed, "add it")])
    document, problems = read_yaml(path, file)
    if document is None:
        raise InputError(problems)
    selection, faults = validate(Selection, document)
    problems += faults
    if selection is not None:
        problems += _name_problems(selection, document, root)
    if problems or selection is None:
        raise InputError(problems)
    return selection


def names_of_kind(root: Path, kind: str) -> tuple[str, ...]:
    """Names of the study files of a kind, sound or not; those that cannot be read have none."""
    found = []
    for path in sorted((root / STUDIES).glob("*.yaml")):
        document, _ = read_yaml(path, displayed(path, root))
        if document is not None and document.data.get("kind") == kind:
            found.append(path.stem)
    return tuple(found)


def _name_problems(selection: Selection, document: Document, root: Path) -> list[Problem]:
    known = sorted(path.stem for path in (root / STUDIES).glob("*.yaml"))
    problems = []
    seen: set[str] = set()
    for key in ("studies", "full"):
        for index, name in enumerate(getattr(selection, key)):
            place = (document.file, document.line_of(f"{key}.{index}"), f"{key}.{index}")
            if name in seen:
                problems.append(Problem(*place, f"'{name}' again", "each once", "delete one"))
            elif name not in known:
                remedy = did_you_mean(name, known, f"add {(STUDIES / name).as_posix()}.yaml")
                problems.append(Problem(*place, f"unknown study '{name}'", one_of(known), remedy))
            seen.add(name)
    return problems
