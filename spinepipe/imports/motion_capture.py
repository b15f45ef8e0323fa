"""Recorded markers with force plates, a lifted box and published moments as a cohort of persons.

Files of markers are copied as they are. Tables beside them are put on their clock.
"""

from collections.abc import Iterator, Mapping
from itertools import product
from math import nan
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import BaseModel, Field

from spinepipe.cohort.cohort import FORM, VertebraName
from spinepipe.documents.settings import validate
from spinepipe.documents.yaml_text import YamlDocument
from spinepipe.effects.contract import Array
from spinepipe.imports.imported import (
    AxesText,
    ImportedCohort,
    ImportSettings,
    all_forms,
    assembled,
    rounded,
)
from spinepipe.imports.recorded_tables import (
    Parts,
    Place,
    RecordedTable,
    misnamed_columns,
    read_recorded_table,
)
from spinepipe.motion.reading import axes_of, read_motion
from spinepipe.motion.skeleton import BODIES
from spinepipe.problems import InputError, InputProblem
from spinepipe.report.words import count, listed
from spinepipe.units import GRAVITY_M_S2

MADE = ("cohort.yaml", "specimens.csv", "subjects.csv", "trials.csv", "datapackage.json")


class RecordedPerson(BaseModel):
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
    load_kg: float | None = Field(default=None, gt=0, le=200, description="what both hands lift")
    shift_s: float = Field(
        default=0.0,
        description="what is added to times of its tables, but of a .c3d, to give the markers'",
    )


class MotionCaptureSettings(ImportSettings):
    """The keys of a YAML of kind `motion_capture`."""

    kind: Literal["motion_capture"] = Field(description="what the files are")
    vertebrae: tuple[VertebraName, ...] = Field(
        default=BODIES, strict=False, description="names from caudal to cranial"
    )
    axes: AxesText = Field(
        description="what forwards, up and right are on the axes of all files, as in `x z -y`"
    )
    persons: tuple[RecordedPerson, ...] = Field(strict=False, description="who was recorded")
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
    place = document.place_of
    for number, of in enumerate(settings.tables):
        problems += misnamed_columns(place(f"tables.{number}.columns"), of)
    if problems:
        raise InputError(problems)
    turn = axes_of(settings.axes)
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
            try:
                parts = read_recorded_table(folder / file, file, of, turn)
            except InputError as error:
                problems += error.problems
                continue
            for part, values in parts.items():
                values["time_s"] = values["time_s"] + (0.0 if of.is_c3d else trial.shift_s)
                rows[of.table] += _rows(of, trial, part, values)
            times = next(iter(parts.values()))["time_s"]
            shift = place(f"trials.{index}.shift_s")
            columns = place(f"tables.{number}.columns")
            unit = list(_other_unit(columns, file, times, end - begin, of))
            problems += unit or _other_clock(shift, file, times, (begin, end), trial)
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
    people = [
        (p.specimen, p.sex, *map(rounded, (p.age_years, 100.0 * p.height_m, p.mass_kg)))
        for p in settings.persons
    ]
    # the column of loads is there where somebody lifts one
    loads = slice(2, 3 if any(t.load_kg for t in settings.trials) else 2)
    trials = [
        (t.specimen, t.trial, t.kind, name, *numbers[:2], settings.axes, t.arms, *numbers[loads])
        for t, name in zip(settings.trials, names, strict=True)
        for numbers in (
            ["" if one is None else rounded(one) for one in (t.start_s, t.end_s, t.load_kg)],
        )
    ]
    tables = {"specimens": [one[:1] for one in people], "subjects": people, "trials": trials}
    persons = [place(f"persons.{k}")[:2] for k in range(len(people))]
    origins = {
        **{"specimens": persons, "subjects": persons},
        "trials": [place(f"trials.{k}")[:2] for k in range(len(trials))],
    }
    return assembled(settings, f"{', '.join(known)}.", tables | rows, sentences, origins, copied)


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
        yield tuple((fixed | cells).get(name, "") for name in all_forms()[of.table].names)


def _other_unit(
    place: Place, file: str, times: Array, markers_s: float, of: RecordedTable
) -> Iterator[InputProblem]:
    """A table that in the other unit of time is about as long as its markers."""
    unit, per = ("s", 1e3) if "time_ms" in of.columns else ("ms", 1e-3)
    took = float(np.ptp(times))
    if 0.5 * markers_s < per * took < 2.0 * markers_s:
        found, allowed = f"{took:g} s in {file}", f"about the {markers_s:g} s of its markers"
        yield InputProblem(*place, found, allowed, f"is its time in {unit}? correct the column")


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
    shares = dict.fromkeys("xyz", 0.0)
    for axis, one in product("xyz", parts.values()):
        force = one.get(f"f{axis}_n", np.zeros(0))
        read = force[np.isfinite(force)]
        shares[axis] += float(read.sum()) / max(len(read), 1) / (kg * GRAVITY_M_S2)
    for axis, factor, remedy in (
        ("y", -1.0, "do they act on the other side? correct `acts_on`"),
        ("y", 1e3, "are they in kN? correct `columns`"),
        ("y", 1e-3, "are they in N? correct `columns`"),
        *((axis, sign, "is that up? correct `axes`") for axis in "xz" for sign in (1.0, -1.0)),
    ):
        if 0.9 < factor * shares[axis] < 1.1:
            found = f"{shares['y']:.4g} times the weight upwards while standing, in {file}"
            yield InputProblem(*place, found, "about once", remedy)
