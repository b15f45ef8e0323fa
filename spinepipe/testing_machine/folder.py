"""A testing machine's files as the tables of a cohort, and in plain sentences what was done."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml

from spinepipe.cohort.cohort import joint_names
from spinepipe.cohort.columns import COHORT_YAML
from spinepipe.documents.settings import validate
from spinepipe.documents.yaml_text import YamlDocument
from spinepipe.imports.imported import ImportedCohort, csv_text, rounded
from spinepipe.problems import InputError
from spinepipe.report.words import count
from spinepipe.testing_machine.channels import (
    ANGLES,
    DIRECTIONS,
    FORCES,
    LENGTHS,
    LOAD_COLUMNS,
    MOMENTS,
    SECONDS,
    column_of,
)
from spinepipe.testing_machine.load_steps import (
    ReadingPrecision,
    ResampledTest,
    reading_precision,
    resample_test,
)
from spinepipe.testing_machine.recording import Recording, read_recording
from spinepipe.testing_machine.settings import MachineMapping, check_mapping
from spinepipe.units import COORDINATE_COLUMNS

BY_HAND = {
    "joints.csv": "joints.csv is a template: it has the first joint at the origin, all axes along "
    "ground. Put in where the joints are before you trust anything but rotations under moments.",
    "specimens.csv": "",
}
"""Files that are made to be edited, and what is said of them."""

SHOWN = 8
"""Rows of a file that `spinepipe import --show` shows."""

LEVEL_APART_MM = 35.0
NOT_READ = {"deg": 0.1, "mm": 0.1}
"""SD that stands for a kind of reading that there is none of: the form asks for one."""

_POINT = ("px_mm", "py_mm", "pz_mm")
_FRAME = ("x_mm", "y_mm", "z_mm", "extension_deg", "right_bending_deg", "left_rotation_deg")

Rows = list[Sequence[object]]


@dataclass(frozen=True)
class ImportedTests:
    """What the settings say, and all tests on their load steps.

    Attributes
    ----------
    rotation, translation : how sure readings are, deg and mm; None where none were read.
    """

    mapping: MachineMapping
    tests: tuple[ResampledTest, ...]
    rotation: ReadingPrecision | None
    translation: ReadingPrecision | None


def read(folder: Path, document: YamlDocument) -> ImportedTests:
    """Read all files that the settings name.

    Parameters
    ----------
    folder : where the settings are; files are told relative to it.

    Raises
    ------
    InputError
        With every problem of the settings, else of all files, else of all tests.
    """
    mapping, problems = validate(MachineMapping, document)
    if mapping is not None:
        problems += check_mapping(document, mapping)
    if problems or mapping is None:
        raise InputError(problems)
    recordings: dict[tuple[str, str], list[Recording]] = {}
    for of in mapping.files:
        recording, faults = read_recording(folder / of.file, of, mapping)
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
    return ImportedTests(mapping, tuple(tests), *sures)


def imported(folder: Path, document: YamlDocument) -> ImportedCohort:
    """As `read`, with the tables of the cohort folder."""
    tests = read(folder, document)
    mapping = tests.mapping
    return ImportedCohort(
        name=mapping.cohort,
        title=mapping.title,
        files={
            COHORT_YAML: _header(tests),
            "specimens.csv": csv_text([("specimen",), *((name,) for name in _specimens(tests))]),
            "joints.csv": csv_text(_joints(tests)),
            "loads.csv": csv_text(_loads(tests)),
            "motion.csv": csv_text(_motion(tests)),
        },
        by_hand=BY_HAND,
        sentences=tuple(_sentences(tests)),
        settings=document,
        made_by=_made_by(mapping),
        units=(FORCES, MOMENTS, ANGLES, LENGTHS, SECONDS),
        first_rows={
            one.file: list(_first_rows(one)) for test in tests.tests for one in test.recordings
        },
    )


def _made_by(mapping: MachineMapping) -> dict[tuple[str, str], list[str]]:
    """Keys of the settings that made each column."""
    made = {("loads", "vertebra"): ["loaded"], ("loads", "time_s"): ["time"]}
    made |= {("loads", column): ["load_point_mm"] for column in _POINT}
    for number, load in enumerate(mapping.loads):
        made["loads", DIRECTIONS[load.positive].load] = [f"loads.{number}"]
    for number, motion in enumerate(mapping.motion):
        column = column_of(DIRECTIONS[motion.positive].coordinate)
        made.setdefault(("motion", column), []).append(f"motion.{number}")
    return made


def _first_rows(one: Recording) -> Iterator[Sequence[object]]:
    """Names of the columns, as in the tables of the cohort, then the first rows of a file."""
    columns = {"line": one.lines} | ({} if one.time is None else {"time_s": one.time})
    ways = {way.load: word for word, way in DIRECTIONS.items() if way.sign > 0}
    columns |= {f"{column} to {ways[column]}": values for column, values in one.loads.items()}
    columns |= {f"{joint} {column}": values for (joint, column), values in one.motion.items()}
    yield tuple(columns)
    yield from zip(*(values[:SHOWN].tolist() for values in columns.values()), strict=True)


def _sentences(tests: ImportedTests) -> Iterator[str]:
    """What was done with each file, and what the readings are worth."""
    for test in tests.tests:
        yield from _of_test(test)
    yield f"SD of a reading: {sd_sentence(tests)}"
    if tests.mapping.zeroed:
        yield "Readings count from those of step 0 of their cycle (zeroed_at_step_0: true)."
    else:
        yield "Readings stay as they are: their zero must be the neutral pose."
    steps = sum(len(cycle.motion) for test in tests.tests for cycle in test.cycles)
    yield f"{count(steps, 'load step')} in all."


def _of_test(test: ResampledTest) -> list[str]:
    lines = []
    for one, found in zip(test.recordings, test.cuts, strict=True):
        kept = len(found.kept)
        rows = count(len(one.lines), "row")
        if one.spikes:
            rows += f" without {count(one.spikes, 'row')} in which a reading jumps"
        lines.append(
            f"{one.file}: {rows}; the load "
            f"runs from {found.low:.3g} to {found.high:.3g} {_unit(one)} and turns back "
            f"{count(found.reversals, 'time')}: {count(len(found.cycles), 'cycle')}, {kept} kept."
        )
        lines += [f"  Cycle {number} is left out: {why}." for number, why in found.left_out]
    unit = _unit(test.recordings[0])
    lines.append(
        f"  {test.specimen}, {test.test}: {count(len(test.cycles), 'cycle')} of "
        f"{count(len(test.levels), 'load step')} each, from {min(test.levels):.3g} to "
        f"{max(test.levels):.3g} {unit}, there and back."
    )
    return lines


def _unit(one: Recording) -> str:
    return "N" if one.driving.endswith("_n") else "N m"


def _header(tests: ImportedTests) -> str:
    mapping = tests.mapping
    files = ", ".join(dict.fromkeys(of.file for of in mapping.files))
    rows = np.concatenate([cycle.rows for test in tests.tests for cycle in test.cycles])
    end = "" if mapping.source.rstrip().endswith(".") else "."
    source = (
        f"{mapping.source.rstrip()}{end} Made by `spinepipe import` of {files}: cycles cut at "
        "reversals of the load, each reading by local regression on the load over "
        f"{int(np.median(rows))} rows (median), loading and unloading apart. "
        f"measurement_sd: {sd_sentence(tests)}"
    )
    document = {
        "cohort": mapping.cohort,
        "title": mapping.title,
        "source": source,
        "vertebrae": list(mapping.vertebrae),
        "gravity": False,
        "zeroed_at_step_0": mapping.zeroed,
        "measurement_sd": {
            "rotation_deg": _declared(tests.rotation, "deg"),
            "translation_mm": _declared(tests.translation, "mm"),
        },
    }
    if mapping.accuracy is not None:
        document["accuracy"] = mapping.accuracy.model_dump(exclude_none=True)
    if mapping.acknowledged_warnings:
        document["acknowledged_warnings"] = list(mapping.acknowledged_warnings)
    return yaml.safe_dump(document, sort_keys=False, allow_unicode=True, width=110)


def _declared(sure: ReadingPrecision | None, unit: str) -> float:
    """The SD with two digits, rounded up."""
    if sure is None or sure.sd == 0.0:
        return NOT_READ[unit]
    scale = 10.0 ** (1 - int(np.floor(np.log10(sure.sd))))
    return float(f"{np.ceil(sure.sd * scale - 1e-9) / scale:.10g}")


def sd_sentence(tests: ImportedTests) -> str:
    """Where the declared SDs come from."""
    words = []
    for sure, unit in ((tests.rotation, "deg"), (tests.translation, "mm")):
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


def _specimens(tests: ImportedTests) -> list[str]:
    return list(dict.fromkeys(test.specimen for test in tests.tests))


def _joints(tests: ImportedTests) -> Rows:
    """A template: joints above each other, axes of ground."""
    joints = joint_names(tests.mapping.vertebrae)
    rows: Rows = [("specimen", "joint", *_FRAME)]
    for specimen in _specimens(tests):
        for number, joint in enumerate(joints):
            rows.append((specimen, joint, 0, f"{number * LEVEL_APART_MM:g}", 0, 0, 0, 0))
    return rows


def _loads(tests: ImportedTests) -> Rows:
    point = tests.mapping.load_point_mm or ("", "", "")
    vertebra = tests.mapping.loaded_vertebra
    rows: Rows = [
        ("specimen", "test", "cycle", "step", "vertebra", *LOAD_COLUMNS, *_POINT, "time_s")
    ]
    for test in tests.tests:
        for number, cycle in enumerate(test.cycles, start=1):
            for step, loads in enumerate(cycle.loads):
                time = "" if cycle.time is None else rounded(cycle.time[step])
                values = [rounded(value) for value in loads]
                key = (test.specimen, test.test, number, step, vertebra)
                rows.append((*key, *values, *point, time))
    return rows


def _motion(tests: ImportedTests) -> Rows:
    joints = joint_names(tests.mapping.vertebrae)
    rows: Rows = [("specimen", "test", "cycle", "step", "joint", *COORDINATE_COLUMNS)]
    for test in tests.tests:
        at = {place: number for number, place in enumerate(test.places)}
        for number, cycle in enumerate(test.cycles, start=1):
            for step, values in enumerate(cycle.motion):
                for joint in joints:
                    cells = [
                        rounded(values[at[joint, name]]) if (joint, name) in at else ""
                        for name in COORDINATE_COLUMNS
                    ]
                    rows.append((test.specimen, test.test, number, step, joint, *cells))
    return rows
