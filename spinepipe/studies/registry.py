"""Which kinds of studies there are: one folder each, found by name.

Nothing is imported here by a written name, so that the digest of a job that asks for its study
does not follow all kinds.
"""

from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

from spinepipe.cohort import Cohort
from spinepipe.documents.form import TableForm
from spinepipe.studies.kind import Kind
from spinepipe.studies.study import Study
from spinepipe.studies.study_files import StudyFiles

_HERE = Path(__file__).resolve().parent
PACKAGE = "spinepipe.studies"


@cache
def kind_names() -> tuple[str, ...]:
    """Names of all kinds: the folders beside this file that declare one."""
    return tuple(sorted(path.parent.name for path in _HERE.glob("*/kind.py")))


@cache
def kind_of(name: str) -> Kind:
    """The declaration of a kind."""
    found: Kind = import_module(f"{PACKAGE}.{name}.kind").KIND
    return found


def every_kind() -> dict[str, Kind]:
    """All kinds by name."""
    return {name: kind_of(name) for name in kind_names()}


def every_form(complete: bool = False) -> tuple[TableForm, ...]:
    """Files that some kind reads besides those of every cohort, each once.

    Parameters
    ----------
    complete : whether each specimen must have the rows that studies of a kind need of it.
    """
    forms = {form.stem: form for kind in every_kind().values() for form in kind.forms}
    if not complete:
        forms = {
            stem: replace(form, rules=tuple(one for one in form.rules if not one.of_each_specimen))
            for stem, form in forms.items()
        }
    return tuple(forms.values())


def files_of(study: Study, cohort: Cohort) -> StudyFiles:
    """The result files of a study of a cohort."""
    return kind_of(study.kind).files.of(study, cohort)


def function_at(kind: str, place: str) -> Callable[..., Any]:
    """What a kind declares as ``file:function``, the file in its folder."""
    module, _, function = place.partition(":")
    found: Callable[..., Any] = getattr(import_module(f"{PACKAGE}.{kind}.{module}"), function)
    return found


def place_of(kind: str, job: str) -> str:
    """``module:function`` of a job of a kind."""
    found = kind_of(kind).job(job)
    return f"{PACKAGE}.{kind}.{found.module}:{found.function}"


def modules_of_many(kinds: Iterable[str]) -> list[str]:
    """Modules of the jobs of these kinds that come by the hundreds."""
    return sorted(
        {
            place_of(name, job.name).partition(":")[0]
            for name in kinds
            for job in kind_of(name).jobs
            if job.many or job.in_blocks
        }
    )
