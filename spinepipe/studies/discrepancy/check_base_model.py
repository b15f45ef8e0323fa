"""Is the model file that a search starts from there, sound, and of this spine?"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from spinepipe.cohort import Cohort
from spinepipe.cohort.read_yaml import Document
from spinepipe.model.file import EffectEntry, ModelFile, effects_for, read_model
from spinepipe.problems import InputError, Problem, did_you_mean, one_of
from spinepipe.studies.base_model import made_by
from spinepipe.studies.discrepancy import Discrepancy
from spinepipe.studies.places import at

__all__ = ["check_base_model"]

_KEY = "base.model"


def check_base_model(
    document: Document, study: Discrepancy, cohort: Cohort, root: Path
) -> Iterator[Problem]:
    """Every way in which the base's model file cannot be used; none where it is no model file.

    A file that another study makes may be missing until that study has run.

    Parameters
    ----------
    document : the study file, for the lines of its keys.
    root : folder of the Snakefile.
    """
    if study.base.model is None:
        return
    path = Path(root, study.base.model)  # an absolute path replaces the root
    maker = made_by(path, root)
    if maker == study.study:
        allowed = "a model file that this study does not write itself"
        yield Problem(*at(document, _KEY), study.base.model, allowed, "copy it to another folder")
    elif path.is_file():
        yield from _content(document, study.base.model, path, cohort)
    elif maker is None:
        allowed = "a model file, or a result of another study in config/studies"
        remedy = "correct the path (relative to the Snakefile), or use stiffness: per_joint"
        yield Problem(*at(document, _KEY), f"no file '{study.base.model}'", allowed, remedy)


def _content(document: Document, name: str, path: Path, cohort: Cohort) -> Iterator[Problem]:
    """Problems of the file itself, then joints, specimens and tests that the cohort lacks."""
    try:
        model = read_model(path)
    except InputError as error:
        yield from (replace(problem, file=name) for problem in error.problems)
        return
    yield from _strangers(document, name, model, cohort)
    try:
        effects_for(model, cohort.specimen_names[0], cohort.joint_names)
    except InputError as error:
        for fault in error.problems:
            found = f"{name} with '{fault.found}' in {fault.column}"
            remedy = "take a model of this spine, or correct it"
            yield Problem(*at(document, _KEY), found, fault.allowed, remedy)


def _strangers(
    document: Document, name: str, model: ModelFile, cohort: Cohort
) -> Iterator[Problem]:
    """Specimens and tests of a scope that are none of the cohort's."""
    for entry in model.effects:
        for what, named, known in _named(entry, cohort):
            if named != "*" and named not in known:
                found = f"{name} with effect {entry.effect} of {what} '{named}'"
                remedy = did_you_mean(named, known, "take a model of this cohort, or correct it")
                yield Problem(*at(document, _KEY), found, one_of(known), remedy)


def _named(entry: EffectEntry, cohort: Cohort) -> Iterator[tuple[str, str, tuple[str, ...]]]:
    """What kind of name, the name, and the names that there are."""
    specimens = dict.fromkeys((*entry.scope.specimens, *(row.specimen for row in entry.values)))
    for name in specimens:
        yield "specimen", name, cohort.specimen_names
    for name in entry.scope.tests:
        yield "test", name, cohort.tests
