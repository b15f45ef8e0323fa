"""Make a cohort folder of a testing machine's files, and say in plain sentences what was done."""

import csv
import os
import shutil
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from dataclasses import replace as with_values
from io import StringIO
from pathlib import Path

import numpy as np
import yaml

from spinepipe.cohort.cohort import joint_names
from spinepipe.cohort.columns import COHORT_YAML, TABLES
from spinepipe.documents.form import TableForm
from spinepipe.documents.settings import validate
from spinepipe.documents.yaml_text import read_yaml
from spinepipe.problems import InputError, InputProblem
from spinepipe.schema import Column, Table
from spinepipe.schema.datapackage import FILE, descriptor
from spinepipe.testing_machine.channels import LOAD_COLUMNS
from spinepipe.testing_machine.load_steps import (
    ReadingPrecision,
    ResampledTest,
    reading_precision,
    resample_test,
)
from spinepipe.testing_machine.recording import Recording, read_recording
from spinepipe.testing_machine.settings import MachineMapping, check_mapping
from spinepipe.units import COORDINATE_COLUMNS

BY_HAND = ("joints.csv", "specimens.csv")
"""Files that are made to be edited: they stay when a folder is made again."""

LEVEL_APART_MM = 35.0
NOT_READ = {"deg": 0.1, "mm": 0.1}
"""SD that stands for a kind of reading that there is none of: the form asks for one."""

_POINT = ("px_mm", "py_mm", "pz_mm")
_FRAME = ("x_mm", "y_mm", "z_mm", "extension_deg", "right_bending_deg", "left_rotation_deg")

_UNITS = {
    **{"mm": "mm", "deg": "deg", "n": "N", "nm": "N m", "s": "s"},
    **{"kg": "kg", "m": "m", "m2": "kg m2", "years": "years"},
}
"""Units as names of columns end with them."""

Rows = list[Sequence[object]]


@dataclass(frozen=True)
class ImportedCohort:
    """A cohort that is read and not yet written."""

    mapping: MachineMapping
    tests: tuple[ResampledTest, ...]
    rotation: ReadingPrecision | None
    translation: ReadingPrecision | None


def read(path: Path) -> ImportedCohort:
    """Read the YAML and all files that it names.

    Raises
    ------
    InputError
        With every problem of the YAML, else of all files, else of all tests.
    """
    mapping = _mapping(path)
    problems: list[InputProblem] = []
    recordings: dict[tuple[str, str], list[Recording]] = {}
    for of in mapping.files:
        recording, faults = read_recording(path.parent / of.file, of, mapping)
        problems += faults
        if recording is not None:
            recordings.setdefault((of.specimen, of.test), []).append(recording)
    tests = []
    for group in recordings.values():
        test, faults = resample_test(group, mapping.steps, mapping.zeroed)
        problems += faults
        if test is not None:
            tests.append(test)
    if problems:
        raise InputError(problems)
    sures = [reading_precision(tests, unit, mapping.zeroed) for unit in ("_deg", "_mm")]
    return ImportedCohort(mapping, tuple(tests), *sures)


def _mapping(path: Path) -> MachineMapping:
    if not path.is_file():
        allowed = "the YAML that says what the columns are"
        raise InputError(
            [InputProblem(str(path), None, None, "no such file", allowed, "check the name")]
        )
    document, problems = read_yaml(path, path.name)
    if document is None:
        raise InputError(problems)
    mapping, faults = validate(MachineMapping, document)
    problems += faults
    if mapping is not None:
        problems += check_mapping(document, mapping)
    if problems or mapping is None:
        raise InputError(problems)
    return mapping


def write(imported: ImportedCohort, folder: Path, replace: bool) -> list[str]:
    """Write the cohort folder, and return the names of files that were there and stayed.

    Parameters
    ----------
    replace : whether a folder that is there may be written again; what is edited by hand stays.

    Raises
    ------
    InputError
        When the folder is there and must not be touched.
    """
    if folder.exists() and not replace:
        remedy = "choose another `cohort:` in the YAML, or add --replace"
        found = "a folder of this name"
        raise InputError([InputProblem(str(folder), None, None, found, "a new folder", remedy)])
    texts = {
        COHORT_YAML: _header(imported),
        "specimens.csv": _table([("specimen",), *((name,) for name in _specimens(imported))]),
        "joints.csv": _table(_joints(imported)),
        "loads.csv": _table(_loads(imported)),
        "motion.csv": _table(_motion(imported)),
    }
    stay = [name for name in BY_HAND if (folder / name).exists()]
    here = texts | {name: (folder / name).read_text("utf-8", "replace") for name in stay}
    forms = [form for form in TABLES.values() if form.file in here]
    tables = [(_shape(form, here[form.file]), form.file) for form in forms]
    texts[FILE] = descriptor(imported.mapping.cohort, imported.mapping.title, tables)
    folder.parent.mkdir(parents=True, exist_ok=True)
    temporary = folder.with_name(f".{folder.name}.{os.getpid()}")
    shutil.rmtree(temporary, ignore_errors=True)
    temporary.mkdir()
    try:
        for name, text in texts.items():
            if name not in stay:
                (temporary / name).write_text(text, encoding="utf-8")
        if folder.exists():
            for path in temporary.iterdir():
                os.replace(path, folder / path.name)
        else:
            temporary.rename(folder)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
    return stay


def _shape(form: TableForm, text: str) -> Table:
    """What the columns of a file of a cohort are, in its own order; somebody's own are text."""
    declared: dict[str, Column] = {
        one.name: with_values(one, unit=_UNITS.get(one.name.rpartition("_")[2], ""))
        for one in form.columns
    }
    header = next(csv.reader(StringIO(text)), [])
    own = {name: Column(name, "text", "carried through", nullable=True) for name in header}
    columns = tuple((own | declared)[name] for name in header)
    keys = tuple(key for key in form.keys if key in header)
    return Table(form.stem, f"One row per {form.row}", keys, columns)


def _header(imported: ImportedCohort) -> str:
    mapping = imported.mapping
    files = ", ".join(dict.fromkeys(of.file for of in mapping.files))
    rows = np.concatenate([cycle.rows for test in imported.tests for cycle in test.cycles])
    end = "" if mapping.source.rstrip().endswith(".") else "."
    source = (
        f"{mapping.source.rstrip()}{end} Made by `spinepipe import` of {files}: cycles cut at "
        "reversals of the load, each reading by local regression on the load over "
        f"{int(np.median(rows))} rows (median), loading and unloading apart. "
        f"measurement_sd: {sd_sentence(imported)}"
    )
    document = {
        "cohort": mapping.cohort,
        "title": mapping.title,
        "source": source,
        "vertebrae": list(mapping.vertebrae),
        "gravity": False,
        "zeroed_at_step_0": mapping.zeroed,
        "measurement_sd": {
            "rotation_deg": _declared(imported.rotation, "deg"),
            "translation_mm": _declared(imported.translation, "mm"),
        },
    }
    return yaml.safe_dump(document, sort_keys=False, allow_unicode=True, width=110)


def _declared(sure: ReadingPrecision | None, unit: str) -> float:
    """The SD with two digits, rounded up."""
    if sure is None or sure.sd == 0.0:
        return NOT_READ[unit]
    scale = 10.0 ** (1 - int(np.floor(np.log10(sure.sd))))
    return float(f"{np.ceil(sure.sd * scale - 1e-9) / scale:.10g}")


def sd_sentence(imported: ImportedCohort) -> str:
    """Where the declared SDs come from."""
    words = []
    for sure, unit in ((imported.rotation, "deg"), (imported.translation, "mm")):
        if sure is None:
            words.append(f"No motion in {unit} was read, {NOT_READ[unit]} stands for its SD.")
        elif sure.sd == 0.0:
            words.append(f"Readings in {unit} never change, {NOT_READ[unit]} stands for their SD.")
        else:
            between = (
                "no cycle is repeated"
                if np.isnan(sure.cycles)
                else f"{sure.cycles:.2g} {unit} between cycles"
            )
            words.append(
                f"{_declared(sure, unit):g} {unit}, the largest of {sure.regression:.2g} {unit} by "
                f"what rows leave around the regression ({sure.row:.2g} for a single row), "
                f"{between}, and {sure.finest:.2g} by the resolution of the files."
            )
    return " ".join(words)


def _specimens(imported: ImportedCohort) -> list[str]:
    return list(dict.fromkeys(test.specimen for test in imported.tests))


def _joints(imported: ImportedCohort) -> Rows:
    """A template: joints above each other, axes of ground."""
    joints = joint_names(imported.mapping.vertebrae)
    rows: Rows = [("specimen", "joint", *_FRAME)]
    for specimen in _specimens(imported):
        for number, joint in enumerate(joints):
            rows.append((specimen, joint, 0, f"{number * LEVEL_APART_MM:g}", 0, 0, 0, 0))
    return rows


def _loads(imported: ImportedCohort) -> Rows:
    point = imported.mapping.load_point_mm or ("", "", "")
    vertebra = imported.mapping.loaded_vertebra
    rows: Rows = [
        ("specimen", "test", "cycle", "step", "vertebra", *LOAD_COLUMNS, *_POINT, "time_s")
    ]
    for test in imported.tests:
        for number, cycle in enumerate(test.cycles, start=1):
            for step, loads in enumerate(cycle.loads):
                time = "" if cycle.time is None else _number(cycle.time[step])
                values = [_number(value) for value in loads]
                key = (test.specimen, test.test, number, step, vertebra)
                rows.append((*key, *values, *point, time))
    return rows


def _motion(imported: ImportedCohort) -> Rows:
    joints = joint_names(imported.mapping.vertebrae)
    rows: Rows = [("specimen", "test", "cycle", "step", "joint", *COORDINATE_COLUMNS)]
    for test in imported.tests:
        at = {place: number for number, place in enumerate(test.places)}
        for number, cycle in enumerate(test.cycles, start=1):
            for step, values in enumerate(cycle.motion):
                for joint in joints:
                    cells = [
                        _number(values[at[joint, name]]) if (joint, name) in at else ""
                        for name in COORDINATE_COLUMNS
                    ]
                    rows.append((test.specimen, test.test, number, step, joint, *cells))
    return rows


def _number(value: float) -> str:
    """Six decimals at most, no minus before zero."""
    return f"{round(float(value), 6) + 0.0:.10g}"


def _table(rows: Iterable[Sequence[object]]) -> str:
    text = StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()
