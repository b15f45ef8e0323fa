"""Recorded markers with force plates, a lifted box and published moments as a cohort of persons.

Files of markers are copied as they are. Tables beside them are turned into ground axes, mm, N and
N m, and put on the clock of the markers.
"""

import re
from collections.abc import Iterator, Mapping
from math import nan, pi
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import BaseModel, Field

from spinepipe.cohort.cohort import FORM, VertebraName
from spinepipe.documents.settings import validate
from spinepipe.documents.text import MOST_CSV_BYTES, NUMBER, read_text
from spinepipe.documents.yaml_text import YamlDocument
from spinepipe.effects.contract import Array
from spinepipe.imports.imported import (
    CARRIED,
    ImportedCohort,
    ImportSettings,
    all_forms,
    assembled,
    rounded,
)
from spinepipe.motion.reading import axes_of, read_motion
from spinepipe.motion.reading_plates import read_force_plates
from spinepipe.motion.skeleton import BODIES
from spinepipe.problems import InputError, InputProblem, did_you_mean, one_of
from spinepipe.report.words import count, listed
from spinepipe.studies.subjects import STANDARD_GRAVITY

QUANTITIES: Mapping[str, tuple[str, float]] = {
    f"{what}_{unit}": (f"{what}_{ours}", per)
    for names, ours, units in (
        (("time",), "s", {"s": 1.0, "ms": 1e-3}),
        (("fx", "fy", "fz"), "n", {"n": 1.0, "kn": 1e3}),
        (("mx", "my", "mz"), "nm", {"nm": 1.0, "nmm": 1e-3}),
        (("x", "y", "z"), "mm", {"mm": 1.0, "cm": 10.0, "m": 1000.0}),
        (("inclination",), "deg", {"deg": 1.0, "rad": 180.0 / pi}),
    )
    for what in names
    for unit, per in units.items()
}
"""Column of our tables, and what one unit of a file is in it, by how settings name a column."""

SIDES = {"force_plates": ("person", "plate"), "measured_moments": ("upper", "lower")}
"""On what loads of a table act: as ours do, and turned round."""

VECTORS = ("f{}_n", "m{}_nm", "{}_mm")

CELLS = re.compile(r"\s*[,;\t]\s*|\s+")
"""What separates numbers that have a decimal point."""

NEEDED = ("joints.csv or landmarks.csv", "marker_set.csv")
"""What a study of tracked motions asks for besides what an import makes."""

MADE = ("cohort.yaml", "specimens.csv", "subjects.csv", "trials.csv", "datapackage.json")

Place = tuple[str, int | None, str]


class Person(BaseModel):
    """A person."""

    model_config = FORM

    specimen: str = Field(description="name of the person")
    sex: Literal["male", "female"] = Field(description="male or female")
    age_years: float = Field(ge=0, le=130, description="age")
    height_m: float = Field(ge=0.5, le=2.8, description="standing height")
    mass_kg: float = Field(ge=5, le=400, description="body mass")


class Trial(BaseModel):
    """A recording of markers."""

    model_config = FORM

    specimen: str = Field(description="whose it is")
    trial: str = Field(description="name of the trial")
    kind: Literal["stance", "flexion_extension", "lateral_bending", "axial_rotation"] = Field(
        description="about what the person bent; stance: stood still"
    )
    file: str = Field(description="markers: .c3d, .trc or .csv, relative to this YAML")
    arms: Literal["hanging", "behind_head", "crossed"] = Field(description="where the arms were")
    start_s: float | None = Field(default=None, description="what is before is cut off")
    end_s: float | None = Field(default=None, description="what is after is cut off")
    shift_s: float = Field(
        default=0.0,
        description="what is added to times of its tables, but of a .c3d, to give the markers'",
    )


class RecordedTable(BaseModel):
    """A kind of table beside the markers: one file for each trial that has it."""

    model_config = FORM

    table: Literal["force_plates", "box", "measured_moments"] = Field(description="what it holds")
    file: str = Field(description="path, relative to this YAML, with `{specimen}` and `{trial}`")
    columns: tuple[str, ...] = Field(
        default=(),
        strict=False,
        description="what each column is, in order: `time_s`, `fx_n`, `my_nm`, `z_m`, "
        "`inclination_rad` and the like, on the axes of the file; of a force plate after its name "
        "and a point, `left.fx_n`; `-`: not read. Of a .c3d: none",
    )
    first_line: int = Field(default=1, ge=1, description="line of the first numbers")
    acts_on: Literal["person", "plate", "upper", "lower"] | None = Field(
        default=None, description="on what loads act: person or plate, upper or lower vertebra"
    )
    joint: str = Field(default="", description="joint of measured_moments")
    method: str = Field(default="", description="how measured_moments were obtained")

    @property
    def is_c3d(self) -> bool:
        """Whether plates are in the recordings of markers, on their clock."""
        return self.file.lower().endswith(".c3d")


class MotionCaptureSettings(ImportSettings):
    """The keys of a YAML of kind `motion_capture`."""

    kind: Literal["motion_capture"] = Field(description="what the files are")
    vertebrae: tuple[VertebraName, ...] = Field(
        default=BODIES, strict=False, description="names from caudal to cranial"
    )
    axes: str = Field(
        description="what forwards, up and right are on the axes of all files, as in `x z -y`"
    )
    persons: tuple[Person, ...] = Field(strict=False, description="who was recorded")
    trials: tuple[Trial, ...] = Field(strict=False, description="recordings of markers")
    tables: tuple[RecordedTable, ...] = Field(
        default=(), strict=False, description="tables beside them"
    )
    copied: tuple[str, ...] = Field(
        default=(),
        strict=False,
        description="files that become part of the cohort as they are: `marker_set.csv`, "
        "`joints.csv`, a licence",
    )


def imported(folder: Path, document: YamlDocument) -> ImportedCohort:
    """Read all files that the settings name.

    Raises
    ------
    InputError
        With every problem of the settings, else of all files, else of the cohort they make.
    """
    settings, problems = validate(MotionCaptureSettings, document)
    if settings is None:
        raise InputError(problems)

    def place(key: str) -> Place:
        return document.file, document.line_of(key), key

    for number, of in enumerate(settings.tables):
        problems += _misnamed_columns(place(f"tables.{number}.columns"), of)
    try:
        turn = axes_of(settings.axes)
    except ValueError as error:
        allowed = "forwards, up and right on the axes of the files, as in 'x z -y'"
        problems.append(InputProblem(*place("axes"), str(error), allowed, "correct it"))
    if problems:
        raise InputError(problems)
    rows: dict[str, list[tuple[str, ...]]] = {of.table: [] for of in settings.tables}
    sentences, without = list[str](), {of.file: list[str]() for of in settings.tables}
    for index, trial in enumerate(settings.trials):
        try:
            markers = read_motion(
                folder / trial.file, settings.axes, trial.start_s, trial.end_s, trial.file
            )
        except InputError as error:
            problems += error.problems
            continue
        begin, end = markers.time_s[[0, -1]].tolist()
        gaps = [markers.names[k] for k in np.flatnonzero(~markers.seen.all(axis=0))]
        told = f"{trial.trial}: {count(len(markers.names), 'marker')} from {begin:g} to {end:g} s"
        sentences.append(f"{told}, with gaps: {listed(gaps)}." if gaps else f"{told}, no gaps.")
        for number, of in enumerate(settings.tables):
            file = of.file.replace("{specimen}", trial.specimen).replace("{trial}", trial.trial)
            if not (folder / file).exists():
                without[of.file].append(trial.trial)
                continue
            reader = _read_plates if of.is_c3d else _read_table
            parts, faults = reader(folder / file, file, of, turn)
            problems += faults
            for part, values in parts.items():
                values["time_s"] = values["time_s"] + (0.0 if of.is_c3d else trial.shift_s)
                rows[of.table] += _rows(of, trial, part, values)
            for values in list(parts.values())[:1]:
                shift = place(f"trials.{index}.shift_s")
                problems += _other_clock(shift, file, values["time_s"], (begin, end), trial)
            if of.table == "force_plates" and trial.kind == "stance":
                problems += _other_weight(place(f"tables.{number}"), file, parts, trial, settings)
    for number, of in enumerate(settings.tables):
        those = listed(without[of.file])
        if len(without[of.file]) == len(settings.trials):
            found, remedy = f"no file '{of.file}' of any trial", "correct the path"
            problems.append(InputProblem(*place(f"tables.{number}"), found, "files", remedy))
        elif those:
            sentences.append(f"{of.table}: no {of.file} of {those}.")
    if problems:
        raise InputError(problems)
    # recordings keep their names where these are no table's, and each another's
    known = [Path(of.file).name for of in settings.trials]
    names = [
        f"{of.specimen}_{of.trial}{Path(name).suffix}"
        if name.removesuffix(".csv") in all_forms() or known.count(name) > 1
        else name
        for of, name in zip(settings.trials, known, strict=True)
    ]
    copied = {name: folder / of.file for of, name in zip(settings.trials, names, strict=True)}
    for one in settings.copied:
        if not (folder / one).is_file() or Path(one).name in (*MADE, *copied, *rows):
            found, remedy = f"'{one}'", "correct it, or delete what the import makes itself"
            allowed = "files that are there, and that the import does not make"
            problems.append(InputProblem(*place("copied"), found, allowed, remedy))
        copied[Path(one).name] = folder / one
    if problems:
        raise InputError(problems)
    if lacking := [one for one in NEEDED if not set(one.split(" or ")) & set(copied)]:
        sentences.append(f"A study of tracked motions needs {listed(lacking)} besides.")
    if rows:
        sentences.append(f"No study reads {listed(list(rows))} yet: they come along.")
    people = [
        (p.specimen, p.sex, *map(rounded, (p.age_years, 100.0 * p.height_m, p.mass_kg)))
        for p in settings.persons
    ]
    trials = [
        (t.specimen, t.trial, t.kind, name, *ends, settings.axes, t.arms)
        for t, name in zip(settings.trials, names, strict=True)
        for ends in (["" if one is None else rounded(one) for one in (t.start_s, t.end_s)],)
    ]
    tables = {"specimens": [one[:1] for one in people], "subjects": people, "trials": trials}
    persons = [place(f"persons.{k}")[:2] for k in range(len(people))]
    origins = {
        **{"specimens": persons, "subjects": persons},
        "trials": [place(f"trials.{k}")[:2] for k in range(len(trials))],
    }
    return assembled(settings, f"{', '.join(known)}.", tables | rows, sentences, origins, copied)


def _misnamed_columns(place: Place, of: RecordedTable) -> Iterator[InputProblem]:
    """Names of columns that such a table has not, and loads that are not told on what they act."""
    allowed = [name for name, (ours, _) in QUANTITIES.items() if ours in CARRIED[of.table].names]
    for text in [one for one in of.columns if one != "-"]:
        part, _, name = text.rpartition(".")
        if name not in allowed or bool(part) > (of.table == "force_plates"):
            remedy = did_you_mean(name, allowed, "write `-` where a column is not read")
            yield InputProblem(*place, f"'{text}'", one_of(allowed), remedy)
    if not {"time_s", "time_ms"} & set(of.columns) and not of.is_c3d:
        yield InputProblem(*place, "no column of time", "time_s or time_ms", "name it")
    if of.table in SIDES and of.acts_on not in SIDES[of.table]:
        found, remedy = f"loads that act on '{of.acts_on}'", "say on what: `acts_on:`"
        yield InputProblem(*place, found, one_of(SIDES[of.table]), remedy)


Parts = dict[str, dict[str, Array]]
"""Our columns by name, of each force plate; of other tables under an empty name."""


def _read_table(
    path: Path, file: str, of: RecordedTable, turn: Array
) -> tuple[Parts, list[InputProblem]]:
    """Columns of a file in our units and on ground axes; NaN where nothing was measured."""
    text, problems = read_text(path, file, MOST_CSV_BYTES)
    lines = list[list[str]]()
    for number, line in enumerate(text.splitlines(), start=1):
        if number < of.first_line or not line.strip():
            continue
        lines.append(cells := CELLS.split(line.strip()))
        bad = [one for one in cells if one.lower() not in ("", "nan") and not NUMBER.fullmatch(one)]
        if bad or len(cells) != len(of.columns):
            found = f"'{bad[0]}'" if bad else f"{len(cells)} cells"
            allowed = f"{len(of.columns)} numbers, as `columns` says, with a decimal point"
            remedy = "correct it, `columns` or `first_line`"
            problems.append(InputProblem(file, number, None, found, allowed, remedy))
    if problems or not lines:
        return {}, problems or [InputProblem(file, None, None, "no rows", "rows", "look at it")]
    raw = np.array([[float(one or nan) for one in cells] for cells in lines])
    parts: Parts = {one.rpartition(".")[0]: {} for one in of.columns if "." in one} or {"": {}}
    for part, values in parts.items():
        for text, column in zip(of.columns, raw.T, strict=True):
            whose, _, name = text.rpartition(".")
            if text != "-" and whose in ("", part):
                ours, per = QUANTITIES[name]
                values[ours] = per * column
        reaction = of.acts_on in ("plate", "lower")
        for form, side in zip(VECTORS, (reaction, reaction, False), strict=True):
            on_file = [values.pop(form.format(axis), None) for axis in "xyz"]
            for axis, row in zip("xyz", turn, strict=True):
                # each of ground's axes is one of the file's, to one side or the other
                at = int(np.argmax(np.abs(row)))
                if (component := on_file[at]) is not None:
                    values[form.format(axis)] = (-row[at] if side else row[at]) * component
    return parts, problems


def _read_plates(
    path: Path, file: str, of: RecordedTable, turn: Array
) -> tuple[Parts, list[InputProblem]]:
    """Force plates of a `.c3d` as columns, by their number in it."""
    try:
        plates = read_force_plates(path, file=file)
    except InputError as error:
        return {}, list(error.problems)
    side, parts = -1.0 if of.acts_on == "plate" else 1.0, Parts()
    for number, plate in enumerate(plates, start=1):
        loads = (side * plate.force, side * plate.free_moment, 1000.0 * plate.centre_of_pressure)
        columns = {
            form.format(axis): column
            for form, load in zip(VECTORS, loads, strict=True)
            for axis, column in zip("xyz", turn @ load.T, strict=True)
        }
        parts[str(number)] = {"time_s": plate.time_s, **columns}
    lacking = InputProblem(file, None, None, "no force plates", "force plates", "take it out")
    return parts, [] if parts else [lacking]


def _rows(
    of: RecordedTable, trial: Trial, part: str, values: Mapping[str, Array]
) -> Iterator[tuple[str, ...]]:
    """Rows of a table, in the order of its form."""
    fixed = {
        **{"specimen": trial.specimen, "trial": trial.trial, "plate": part or "1"},
        **{"joint": of.joint, "method": of.method},
    }
    for k in range(len(values["time_s"])):
        cells = {name: rounded(one[k]) for name, one in values.items() if np.isfinite(one[k])}
        yield tuple((fixed | cells).get(name, "") for name in CARRIED[of.table].names)


def _other_clock(
    place: Place, file: str, times: Array, of_markers: tuple[float, float], trial: Trial
) -> Iterator[InputProblem]:
    """A table that by its clock was recorded before or after its markers."""
    begin, end = of_markers
    if times.max() < begin or times.min() > end:
        found = f"times of {file} from {times.min():g} to {times.max():g} s after the shift"
        allowed = f"times within those of {trial.file}, {begin:g} to {end:g} s"
        shift = trial.shift_s + begin - times.min()
        remedy = f"where both begin together write `shift_s: {shift:.6g}`"
        yield InputProblem(*place, found, allowed, remedy)


def _other_weight(
    place: Place, file: str, parts: Parts, trial: Trial, settings: MotionCaptureSettings
) -> Iterator[InputProblem]:
    """Plates that bear who stands on them once a sign, a unit or an axis is another."""
    kg = next((p.mass_kg for p in settings.persons if p.specimen == trial.specimen), nan)
    shares = {
        axis: sum(float(np.mean(one.get(f"f{axis}_n", nan))) for one in parts.values())
        / (kg * STANDARD_GRAVITY)
        for axis in "xyz"
    }
    for axis, factor, remedy in (
        ("y", -1.0, "do they act on the other side? correct `acts_on`"),
        ("y", 1e3, "are they in kN? correct `columns`"),
        ("y", 1e-3, "are they in N? correct `columns`"),
        *((axis, sign, "is that up? correct `axes`") for axis in "xz" for sign in (1.0, -1.0)),
    ):
        if 0.9 < factor * shares[axis] < 1.1:
            found = f"{shares['y']:.4g} times the weight upwards while standing, in {file}"
            yield InputProblem(*place, found, "about once", remedy)
