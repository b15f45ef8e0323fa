"""A cohort from the files of a laboratory."""

from dataclasses import replace as with_values
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import yaml

from spinepipe.api.cohorts import read_cohort
from spinepipe.cohort import Cohort
from spinepipe.documents.yaml_text import YamlDocument
from spinepipe.imports.judge import write_judged
from spinepipe.imports.registry import of_document, read_settings


def import_machine(
    settings: str | Path | None = None,
    *,
    folder: str | Path = ".",
    accuracy_deg: float | None = None,
    to: str | Path | None = None,
    replace: bool = False,
    **keys: Any,
) -> Cohort:
    """Read files of a testing machine, C3D or OpenSim, and judge them as `spinepipe import` does.

    Parameters
    ----------
    settings : file that says what the files are, see docs/import.md; else ``keys`` say it.
    folder : where the files of ``keys`` are.
    accuracy_deg : of the instrument that reads angles, as an SD, in degrees.
    to : folder of cohorts, such as ``config/cohorts``, where a folder of the cohort is written;
        none is kept by default. replace : a folder that is there is written again.
    keys : of a settings file: ``cohort``, ``vertebrae``, ``loads``, ``motion``, ``files``, ...

    Raises
    ------
    InputError
        With every problem of settings and files; then nothing is written.

    Examples
    --------
    >>> import spinepipe as sp
    >>> rig = sp.import_machine("docs/examples/testing_machine/rig.yaml", accuracy_deg=0.1)
    >>> rig.specimen_names, rig.joint_names, rig.accuracy.rotation_deg
    (('s01', 's02'), ('L4L5',), 0.1)
    """
    data = {key: value for key, value in keys.items() if value is not None}
    document = YamlDocument("keyword arguments", {}, {})
    if settings is not None:
        document, folder = read_settings(Path(settings)), Path(settings).parent
    if accuracy_deg is not None:
        data["accuracy"] = {**document.data.get("accuracy", {}), "rotation_deg": accuracy_deg}
    plain = yaml.safe_load(yaml.safe_dump({**document.data, **data}))  # lists, as in a file
    imported = of_document(Path(folder), with_values(document, data=plain))
    with TemporaryDirectory() as temporary:
        place = Path(temporary if to is None else to) / imported.name
        write_judged(imported, place, replace)
        return read_cohort(place)
