"""Read study files: one by itself, one together with its cohort, and which of them a run builds.

Whatever is wrong is told at once, with file, line, what was found, what is allowed and what to do.
"""

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, Field

from spinepipe import cohort as cohorts
from spinepipe.cohort import Cohort
from spinepipe.documents.form import TableForm
from spinepipe.documents.names import COHORT_NAME
from spinepipe.documents.settings import validate
from spinepipe.documents.yaml_text import YamlDocument, read_yaml
from spinepipe.files import CONFIG, files_in, folders_in, strays_in
from spinepipe.problems import InputError, InputProblem, Spelling, closest, did_you_mean, one_of
from spinepipe.studies.kind import Kind
from spinepipe.studies.parts import FORM
from spinepipe.studies.registry import every_form, kind_names, kind_of
from spinepipe.studies.study import COHORTS, STUDIES, Study, cohort_folder

ENDING = ".yaml"
"""Of the files of studies."""


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


def load(path: Path, root: Path) -> tuple[YamlDocument | None, Study | None, list[InputProblem]]:
    """The study file as data and as a study, None where it is neither; and its problems."""
    file = displayed(path, root)
    if not path.is_file():
        known = [other.stem for other in files_in(path.parent, ENDING)]
        remedy = did_you_mean(path.stem, known, "add it or correct the name")
        return None, None, [InputProblem(file, None, None, "no such file", one_of(known), remedy)]
    document, problems = read_yaml(path, file)
    if document is None:
        return None, None, problems
    study, faults = _validated(document)
    problems += faults
    name = document.data.get("study")
    if isinstance(name, str) and name != path.stem:
        place = document.place_of("study")
        found, allowed = f"'{name}'", f"the file's name, '{path.stem}'"
        problems.append(InputProblem(*place, found, allowed, "rename the file or change the key"))
    return document, study, problems


def of_data(data: dict[str, Any], cohort: Cohort, called: str) -> Study:
    """A study that no file holds, of a cohort that was read; ``called`` is its name in messages.

    Raises
    ------
    InputError
        With every problem of the settings, else with every way in which the two do not fit.
    """
    document = YamlDocument(called, data, {})
    study, problems = _validated(document)
    if study is not None and not problems:
        study = _settled(study, cohort)
        problems = _misfits(document, study, cohort, Path.cwd(), at_start=False)
    if study is None or problems:
        raise InputError(problems)
    return study


def displayed(path: Path, root: Path) -> str:
    """A path as messages show it: from the root where it lies below."""
    return path.relative_to(root).as_posix() if path.is_relative_to(root) else str(path)


def _validated(document: YamlDocument) -> tuple[Study | None, list[InputProblem]]:
    declared, kind = _kind(document), document.data.get("kind")
    if declared is not None:
        return validate(declared.settings, document)
    near = closest("kind", map(str.casefold, document.data))
    if "kind" not in document.data and near is not None:
        near = next(key for key in document.data if key.casefold() == near)
        place = document.place_of(near)
        remedy = "did you mean 'kind'? it decides which other keys are allowed"
        return None, [InputProblem(*place, "an unknown key", "kind", remedy)]
    place = document.place_of("kind")
    found = "nothing: the key is missing" if kind is None else repr(kind)
    otherwise = "the kind decides which other keys are allowed"
    remedy = did_you_mean(str(kind), kind_names(), otherwise)
    return None, [InputProblem(*place, found, one_of(kind_names()), remedy)]


class Misfit(InputError):
    """A sound study and a sound cohort that do not fit.

    Attributes
    ----------
    cohort : the cohort, which may be what is wrong though each of its cells is sound.
    """

    def __init__(self, problems: Iterable[InputProblem], cohort: Cohort) -> None:
        super().__init__(problems)
        self.cohort = cohort


ReadCohort = Callable[[Path, Sequence[TableForm]], Cohort]
"""Reads a cohort folder with files of these forms besides, as `cohort.read` does."""


def check(
    root: Path, study_name: str, starting: bool = True, read_cohort: ReadCohort = cohorts.read
) -> tuple[Study, Cohort]:
    """Read a study and its cohort and hold them against each other.

    Parameters
    ----------
    root : folder of the Snakefile.
    study_name : name of a file in ``config/studies``, without ``.yaml``.
    starting : whether the study is yet to start, so that the machine must have room for it; a
        job of a study that runs has its own share in what is short.
    read_cohort : reads its cohort; a `Reader` keeps it for whoever asks again.

    Raises
    ------
    InputError
        With every problem of the study and of its cohort; when each is sound by itself, with
        every way in which they do not fit.
    """
    document, study, problems = load(root / STUDIES / f"{study_name}.yaml", root)
    cohort, faults = _cohort(document, root, read_cohort)
    problems += faults
    if document and study and cohort:
        study = _settled(study, cohort)
        sound = not problems
        problems += _misfits(document, study, cohort, root, starting and sound)
        if problems and sound:
            raise Misfit(problems, cohort)
    if problems or study is None or cohort is None:
        raise InputError(problems)
    return study, cohort


def _settled(study: Study, cohort: Cohort) -> Study:
    """The study with what its file leaves to the cohort in place."""
    settled = kind_of(study.kind).settled
    return study if settled is None else settled(study, cohort)


def _misfits(
    document: YamlDocument, study: Study, cohort: Cohort, root: Path, at_start: bool
) -> list[InputProblem]:
    """What the kind of the study finds wrong with it, its cohort, files and machine."""
    kind = kind_of(study.kind)
    problems = [found for check in kind.checks for found in check(document, study, cohort)]
    if cohort.supports is not None and not kind.holds:
        problems.append(_held(document, study, cohort))
    for ask in kind.checks_of_files:
        problems += ask(document, study, cohort, root)
    if at_start and not problems:
        problems = [p for ask in kind.checks_at_start for p in ask(document, study, cohort, root)]
    return problems


def _held(document: YamlDocument, study: Study, cohort: Cohort) -> InputProblem:
    """A rig in the cohort of a study that would leave it out."""
    place = document.place_of("cohort")
    found = f"cohort '{cohort.name}', whose rig fixes joint coordinates (supports.csv)"
    holding = [name for name in kind_names() if kind_of(name).holds]
    allowed = f"studies of kind {', '.join(holding)}: {study.kind} knows no rig"
    remedy = "choose such a study, or take supports.csv out if the rig does not matter"
    return InputProblem(*place, found, allowed, remedy)


def _cohort(
    document: YamlDocument | None, root: Path, read_cohort: ReadCohort
) -> tuple[Cohort | None, list[InputProblem]]:
    """The cohort a study file names, though the rest of the file may be unsound."""
    name = document.data.get("cohort") if document else None
    if document is None or not isinstance(name, str) or not name:
        return None, []
    folder = cohort_folder(name, root)
    if not folder.is_dir():
        present = [path.name for path in folders_in(root / COHORTS)]
        known = [other for other in present if COHORT_NAME.fullmatch(other)]
        found = f"unknown cohort '{name}'"
        remedy = did_you_mean(name, known, f"add the folder {folder}")
        if name in present:
            found = f"'{name}', a folder whose name no cohort can have"
            remedy = "rename it with a-z, 0-9 and _ alone, in its cohort.yaml and here too"
        allowed = f"{one_of(known)}, or the path of a folder"
        place = document.place_of("cohort")
        return None, [InputProblem(*place, found, allowed, remedy)]
    try:
        return read_cohort(folder, _further(document)), []
    except InputError as error:
        return None, list(error.problems)


def _further(document: YamlDocument) -> tuple[TableForm, ...]:
    """The files that the kind of a study reads besides; where it names none, those of any kind."""
    kind = _kind(document)
    return every_form() if kind is None else kind.forms


def _kind(document: YamlDocument) -> Kind | None:
    """The kind that a study file names, or None."""
    name = document.data.get("kind")
    return kind_of(name) if isinstance(name, str) and name in kind_names() else None


_Names = Annotated[tuple[str, ...], Field(strict=False)]


class Selection(BaseModel):
    """The keys of ``config/config.yaml``."""

    model_config = FORM

    studies: _Names = Field(description="studies that a plain run builds; none in a new project")
    full: _Names = Field(default=(), description="further studies, built by `make full` only")


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
        found, allowed, remedy = "no such file", "a file with `studies: [...]`", "add it"
        if not path.parent.is_dir():  # a run that was started elsewhere
            found = f"no such file in {root}, nor a folder for it"
            remedy = "go to the folder of the project, or name it: `snakemake -d FOLDER`"
        raise InputError([InputProblem(file, None, None, found, allowed, remedy)])
    document, problems = read_yaml(path, file)
    if document is None:
        raise InputError(problems)
    selection, faults = validate(Selection, document)
    problems += faults
    if selection is not None:
        problems += _unknown_names(selection, document, root)
    if problems or selection is None:
        raise InputError(problems)
    return selection


def names_by_kind(root: Path) -> dict[str, list[str]]:
    """Names of the study files of each kind, sound or not; those that cannot be read have none."""
    found: dict[str, list[str]] = {}
    for path in files_in(root / STUDIES, ENDING):
        document, _ = read_yaml(path, displayed(path, root))
        kind = None if document is None else document.data.get("kind")
        if isinstance(kind, str):
            found.setdefault(kind, []).append(path.stem)
    return found


def strays(root: Path) -> list[InputProblem]:
    """What lies among the study files and is none, which stops nothing."""
    remedy = "rename it, or leave it: no study is made of it"
    return [
        InputProblem(
            displayed(path, root), None, None, _what(path), f"files <study>{ENDING}", remedy
        )
        for path in strays_in(root / STUDIES, ENDING)
    ]


def _what(path: Path) -> str:
    if path.is_dir():
        return "a folder"
    return f"a file that ends with {path.suffix}" if path.is_file() else "a link to nothing"


def _unknown_names(selection: Selection, document: YamlDocument, root: Path) -> list[InputProblem]:
    known = [path.stem for path in files_in(root / STUDIES, ENDING)]
    problems = []
    seen: set[str] = set()
    spelling = Spelling(known, f"add a file of that name to {STUDIES.as_posix()}")
    for key in ("studies", "full"):
        for index, name in enumerate(getattr(selection, key)):
            place = document.place_of(f"{key}.{index}")
            if name in seen:
                problems.append(InputProblem(*place, f"'{name}' again", "each once", "delete one"))
            elif name not in known:
                found, remedy = f"unknown study '{name}'", spelling.remedy(name)
                problems.append(InputProblem(*place, found, spelling.allowed, remedy))
            seen.add(name)
    return problems
