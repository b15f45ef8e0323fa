"""A testing machine's files as the tables of a cohort, and in plain sentences what was done."""

import re
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from spinepipe.cohort.cohort import joint_names
from spinepipe.cohort.columns import TABLES
from spinepipe.documents.settings import validate
from spinepipe.documents.yaml_text import YamlDocument
from spinepipe.imports.file_patterns import with_files
from spinepipe.imports.imported import ImportedCohort, Rows, assembled, rounded
from spinepipe.problems import InputError, InputProblem
from spinepipe.report.words import count, listed
from spinepipe.testing_machine.channels import (
    ANGLES,
    DIRECTIONS,
    FORCES,
    LENGTHS,
    MOMENTS,
    SECONDS,
)
from spinepipe.testing_machine.check_settings import check_mapping
from spinepipe.testing_machine.clocks import read_test
from spinepipe.testing_machine.conversions import converted
from spinepipe.testing_machine.conversions import sentences as of_conversions
from spinepipe.testing_machine.load_steps import ResampledTest, resample_test
from spinepipe.testing_machine.precision import (
    ReadingPrecision,
    declared_sd,
    reading_precision,
    sd_sentence,
)
from spinepipe.testing_machine.recording import Recording
from spinepipe.testing_machine.settings import MachineMapping
from spinepipe.testing_machine.shared_faults import told_once

BY_HAND = {
    "joints.csv": "joints.csv is a template: it has the first joint at the origin, all axes along "
    "ground. Put in where the joints are before you trust anything but rotations under moments.",
    "specimens.csv": "",
}
"""Files that are made to be edited, and what is said of them."""

SHOWN = 8
"""Rows of a file that `spinepipe import --show` shows."""

LEVEL_APART_MM = 35.0


@dataclass(frozen=True)
class ImportedTests:
    """What the settings say, and all tests on their load steps.

    Attributes
    ----------
    items : number of the item of `files` in the YAML that named each file.
    rotation, translation : how sure readings are, deg and mm; None where none were read.
    """

    mapping: MachineMapping
    items: tuple[int, ...]
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
    expanded, numbers, problems = with_files(folder, document, ("specimen", "test"))
    mapping, faults = validate(MachineMapping, expanded)
    if mapping is not None and not problems:
        faults += check_mapping(expanded, mapping)
    if problems or faults or mapping is None:
        # items of `files` are told by their number in the YAML
        for one in faults:
            key = re.sub(
                r"^files\.(\d+)", lambda at: f"files.{numbers[int(at[1])]}", one.column or ""
            )
            problems.append(replace(one, column=key or None))
        raise InputError(problems)
    recordings: dict[tuple[str, str], list[Recording]] = {}
    for of in mapping.files:
        try:
            recording = converted(read_test(folder, of, mapping), mapping)
            recordings.setdefault((of.specimen, of.test), []).append(recording)
        except InputError as error:
            problems += error.problems
    for group in recordings.values():
        problems += _not_the_same(group)
    if problems:
        raise InputError(told_once(expanded, mapping, problems))
    tests = []
    for group in recordings.values():
        try:
            tests.append(resample_test(group, mapping.steps, mapping.zeroed))
        except InputError as error:
            problems += error.problems
    if problems:
        raise InputError(problems)
    sures = [reading_precision(tests, unit, mapping.zeroed) for unit in ("_deg", "_mm")]
    return ImportedTests(mapping, numbers, tuple(tests), *sures)


def _not_the_same(group: Sequence[Recording]) -> Iterator[InputProblem]:
    """Repeats of a test with other quantities than the first of them."""
    first, *others = (
        [f"driven by {one.driving}", *one.loads, *(" ".join(place) for place in one.motion)]
        + ["time"] * (one.time is not None)
        for one in group
    )
    for one, names in zip(group[1:], others, strict=True):
        if names != first:
            allowed = f"{', '.join(first)}, as in {group[0].file}"
            remedy = "give the test of this file another name, or correct its columns"
            yield InputProblem(one.file, None, None, ", ".join(names), allowed, remedy)


def imported(folder: Path, document: YamlDocument) -> ImportedCohort:
    """As `read`, with the tables of the cohort folder."""
    tests = read(folder, document)
    tables: dict[str, Rows] = {
        "specimens": [(name,) for name in _specimens(tests)],
        "joints": template_of_joints(_specimens(tests), joint_names(tests.mapping.vertebrae)),
        "loads": _loads(tests),
        "motion": _motion(tests),
    }
    cohort = assembled(
        tests.mapping, _made_of(tests), tables, [*_sentences(tests)], {}, further=_header(tests)
    )
    return replace(
        cohort,
        by_hand=BY_HAND,
        settings=document,
        **_made_by(tests),
        units=(FORCES, MOMENTS, ANGLES, LENGTHS, SECONDS),
        first_rows={
            one.file: list(_first_rows(one)) for test in tests.tests for one in test.recordings
        },
    )


def _made_by(tests: ImportedTests) -> dict[str, Any]:
    """`made_by` and `tests_of`: keys that made each column, those of files of their own too."""
    mapping = tests.mapping
    made = {("loads", "vertebra"): ["loaded"], ("loads", "time_s"): ["time"]}
    made |= {("loads", f"p{axis}_mm"): ["load_point_mm"] for axis in "xyz"}
    tests_of: dict[str, set[tuple[str, str]]] = defaultdict(set)
    if mapping.motion_files is not None and mapping.motion_files.markers is not None:
        made |= {("motion", way.motion): ["motion_files.markers"] for way in DIRECTIONS.values()}
    for item, of in zip(tests.items, mapping.files, strict=True):
        own = mapping.of_file(of)
        for side in ("loads", "motion"):
            prefix = side if getattr(of, side) is None else f"files.{item}.{side}"
            for number, channel in enumerate(getattr(own, side)):
                way = DIRECTIONS[channel.positive]
                column = way.load if side == "loads" else way.motion
                made.setdefault((side, column), []).append(f"{prefix}.{number}")
                tests_of[made[side, column][-1]].add((of.specimen, of.test))
    keys = {place: list(dict.fromkeys(keys)) for place, keys in made.items()}
    return {"made_by": keys, "tests_of": tests_of}


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
    mapping = tests.mapping
    yield from of_conversions({place for test in tests.tests for place in test.places}, mapping)
    if mapping.accuracy is not None:
        yield "The accuracy goes on to cohort.yaml; where it is larger than the SD, it counts."
    yield f"SD of a reading: {sd_sentence(tests.rotation, tests.translation)}"
    if mapping.zeroed:
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
        lines += [f"  {note}." for note in one.notes]
        lines += [f"  Cycle {number} is left out: {why}." for number, why in found.left_out]
    unit = _unit(test.recordings[0])
    each = "each" if len({len(cycle.motion) for cycle in test.cycles}) == 1 else "at most"
    # without a turn there is one way; with one, a cycle that is cut off ends on the way back
    ways = "there and back"
    if not all(cycle.complete for cycle in test.cycles):
        turned = any(found.reversals for found in test.cuts)
        ways = "and not all the way back" if turned else "one way"
    lines.append(
        f"  {test.specimen}, {test.test}: {count(len(test.cycles), 'cycle')} of "
        f"{count(len(test.levels), 'load step')} {each}, from {min(test.levels):.3g} to "
        f"{max(test.levels):.3g} {unit}, {ways}."
    )
    return lines


def _unit(one: Recording) -> str:
    return "N" if one.driving.endswith("_n") else "N m"


def _made_of(tests: ImportedTests) -> str:
    # a text of a YAML file has an end: of very many files the first
    files = listed(dict.fromkeys(of.file for of in tests.mapping.files), 50, None)
    rows = np.concatenate([cycle.rows for test in tests.tests for cycle in test.cycles])
    return (
        f"{files}: cycles cut at reversals of the load, each reading by local regression on the "
        f"load over {int(np.median(rows))} rows (median), loading and unloading apart. "
        f"measurement_sd: {sd_sentence(tests.rotation, tests.translation)}"
    )


def _header(tests: ImportedTests) -> dict[str, object]:
    """Keys of ``cohort.yaml`` that no other import has."""
    mapping = tests.mapping
    told = mapping.model_dump(include={"accuracy", "acknowledged_warnings"}, exclude_none=True)
    return {
        "zeroed_at_step_0": mapping.zeroed,
        "measurement_sd": {
            "rotation_deg": declared_sd(tests.rotation, "deg"),
            "translation_mm": declared_sd(tests.translation, "mm"),
        },
        **{key: value for key, value in told.items() if value},
    }


def _specimens(tests: ImportedTests) -> list[str]:
    return list(dict.fromkeys(test.specimen for test in tests.tests))


def template_of_joints(specimens: Sequence[str], joints: Sequence[str]) -> Rows:
    """Rows of joints.csv to put places into: joints above each other, axes of ground."""
    return [
        (specimen, joint, 0, f"{number * LEVEL_APART_MM:g}", 0, 0, 0, 0)
        for specimen in specimens
        for number, joint in enumerate(joints)
    ]


def _loads(tests: ImportedTests) -> Rows:
    vertebra = tests.mapping.loaded_vertebra
    rows: Rows = []
    for test in tests.tests:
        for number, cycle in enumerate(test.cycles, start=1):
            point = tests.mapping.of_file(cycle.of).load_point_mm or ("", "", "")
            for step, loads in enumerate(cycle.loads):
                time = "" if cycle.time is None else rounded(cycle.time[step])
                values = [rounded(value) for value in loads]
                key = (test.specimen, test.test, number, step, vertebra)
                rows.append((*key, *values, *point, time))
    return rows


def _motion(tests: ImportedTests) -> Rows:
    joints = joint_names(tests.mapping.vertebrae)
    columns = TABLES["motion"].names[5:]
    rows: Rows = []
    for test in tests.tests:
        at = {place: number for number, place in enumerate(test.places)}
        for number, cycle in enumerate(test.cycles, start=1):
            for step, values in enumerate(cycle.motion):
                for joint in joints:
                    cells = [
                        rounded(values[at[joint, name]]) if (joint, name) in at else ""
                        for name in columns
                    ]
                    rows.append((test.specimen, test.test, number, step, joint, *cells))
    return rows
