"""What a settings file of `spinepipe import` can be about, by its key `kind`."""

from collections.abc import Mapping
from importlib import import_module
from pathlib import Path

from spinepipe.documents.yaml_text import YamlDocument, read_yaml
from spinepipe.imports.imported import ImportedCohort
from spinepipe.problems import InputError, InputProblem, did_you_mean, one_of

TESTING_MACHINE = "testing_machine"

KINDS: Mapping[str, str] = {
    TESTING_MACHINE: "spinepipe.testing_machine.folder",
    "landmarks": "spinepipe.imports.landmarks",
    "motion_capture": "spinepipe.imports.motion_capture",
    "opensim_model": "spinepipe.imports.opensim_model.folder",
}
"""Module by kind. Its `imported(folder, document)` returns an `ImportedCohort`, or raises
`InputError` with every problem; `folder` is where the settings file is."""


def read(path: Path) -> ImportedCohort:
    """Read a settings file and all files that it names.

    Raises
    ------
    InputError
        With every problem of the settings, else of the files.
    """
    return of_document(path.parent, read_settings(path))


def of_document(folder: Path, document: YamlDocument) -> ImportedCohort:
    """As `read`, of settings that may be in no file yet, about files in a folder."""
    module = import_module(KINDS[_kind(document)])
    imported: ImportedCohort = module.imported(folder, document)
    return imported


def read_settings(path: Path) -> YamlDocument:
    """A settings file as it stands.

    Raises
    ------
    InputError
        Where it cannot be read.
    """
    if not path.is_file():
        allowed = "the YAML that says what the files are"
        raise InputError(
            [InputProblem(str(path), None, None, "no such file", allowed, "check the name")]
        )
    document, problems = read_yaml(path, path.name)
    if document is None:
        raise InputError(problems)
    return document


def _kind(document: YamlDocument) -> str:
    kind = document.data.get("kind", TESTING_MACHINE)
    if not isinstance(kind, str) or kind not in KINDS:
        remedy = did_you_mean(str(kind), KINDS, "correct it")
        place = document.place_of("kind")
        raise InputError([InputProblem(*place, f"{kind!r}", one_of(KINDS), remedy)])
    return kind
