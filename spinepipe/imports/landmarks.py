"""Points picked in 3D Slicer (`.mrk.json`, `.fcsv`) as the landmarks of a cohort.

Formats by Slicer's developer guide on its lists of points: a `.mrk.json` that does not tell them
has axes LPS and mm; older `.fcsv` tell their axes by a number.
"""

import csv
import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise, product
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import BaseModel, Field

from spinepipe.cohort.check_geometry import LOWER_FACE, UPPER_FACE
from spinepipe.cohort.cohort import FORM
from spinepipe.documents.settings import validate
from spinepipe.documents.text import MOST_CSV_BYTES, read_text
from spinepipe.documents.yaml_text import YamlDocument
from spinepipe.effects.contract import Array
from spinepipe.frames import FRAME_LANDMARKS
from spinepipe.imports.file_patterns import with_files
from spinepipe.imports.imported import ImportedCohort, ImportSettings, assembled, rounded
from spinepipe.problems import InputError, InputProblem, did_you_mean
from spinepipe.report.words import count

LPS = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]])
"""Anterior, superior and right (rows) in axes of a scanner to the left, posterior and superior."""
RAS = LPS @ np.diag([-1.0, -1.0, 1.0])
AXES = {"LPS": LPS, "RAS": RAS, "1": LPS, "0": RAS}
MM_PER = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "um": 1e-3}

POSTURE = (
    "The neutral pose is that of the scan (lying, as a rule), on the axes of the scanner: how the "
    "specimen lay in it is not corrected."
)


class LandmarkFiles(BaseModel):
    """One file, or all whose names follow a pattern."""

    model_config = FORM

    file: str = Field(default="", description="its path, relative to this YAML")
    glob: str = Field(
        default="",
        description="instead of `file`: a pattern of paths with *; {specimen} and {vertebra} in it "
        "tell these",
    )
    specimen: str = Field(default="", description="whose it is")
    vertebra: str = Field(default="", description="of which, where labels are of landmarks alone")


class Surfaces(BaseModel):
    """Surfaces of vertebrae, which stay where they are."""

    model_config = FORM

    file: str = Field(description="path of an STL file, with `{specimen}` and `{vertebra}`")
    unit: Literal["mm", "cm", "m"] = Field(default="mm", description="unit of its numbers")
    axes: Literal["LPS", "RAS"] = Field(default="LPS", description="its axes, as they were chosen")


class LandmarkSettings(ImportSettings):
    """The keys of a YAML of kind `landmarks`."""

    kind: Literal["landmarks"] = Field(description="what the files are")
    files: tuple[LandmarkFiles, ...] = Field(strict=False, description="the files")
    labels: dict[str, str] = Field(
        default_factory=dict,
        description="your label: vertebra and landmark, as `L4_superior_endplate_centre`; "
        "`{vertebra}` on both sides stands for each vertebra",
    )
    sd_mm: float | None = Field(
        default=None, ge=0, le=50, description="SD of a picked point along each axis"
    )
    surfaces: Surfaces | None = Field(default=None, description="surfaces of the vertebrae")


@dataclass(frozen=True)
class PickedPoint:
    """A point of a file; ``place`` (3,) mm on ground axes, None where it was never placed."""

    file: str
    line: int | None
    label: str
    axes: str
    place: Array | None


Place = tuple[str, int | None, str]

Landmarks = dict[tuple[str, str], PickedPoint]
"""Points of a specimen by vertebra and landmark."""


def imported(folder: Path, document: YamlDocument) -> ImportedCohort:
    """Read all files that the settings name.

    Raises
    ------
    InputError
        With every problem of the settings, else of all files, else of the cohort they make.
    """
    expanded, numbers, problems = with_files(folder, document, ("specimen", "vertebra"))
    settings, faults = validate(LandmarkSettings, expanded)
    if settings is None or problems:
        raise InputError([*problems, *faults])
    found, unread, broken = dict[str, Landmarks](), dict[str, list[str]](), set[str]()
    for number, of in zip(numbers, settings.files, strict=True):
        if not of.file or not of.specimen:
            place = document.place_of(f"files.{number}")
            remedy = "name `file` and `specimen`, or a `glob` with {specimen}"
            problems.append(InputProblem(*place, "a file of nobody", "files and whose", remedy))
            continue
        points, faults = read_points(folder / of.file, of.file)
        problems += faults
        broken |= {of.specimen} if faults else set()
        landmarks = found.setdefault(of.specimen, {})
        for point in points:
            key = _meant(point.label, of.vertebra, settings)
            if key is None or point.place is None:
                why = "" if point.place is not None else " (not placed)"
                unread.setdefault(of.specimen, []).append(point.label + why)
            elif key in landmarks:
                told = f"'{point.label}' a second time, after {landmarks[key].file}"
                where, remedy = (point.file, point.line, None), "delete or rename one of them"
                problems.append(InputProblem(*where, told, "each point once", remedy))
            else:
                landmarks[key] = point
    place = document.place_of("files")
    for specimen in [one for one in found if one not in broken]:
        problems += _lacking(place, settings, specimen, found[specimen], unread.get(specimen, []))
    surfaces = list[tuple[str, ...]]()
    if (named := settings.surfaces) is not None:
        place = document.place_of("surfaces.file")
        surfaces, faults = _surfaces(folder, place, named, found, settings.vertebrae)
        problems += faults
    if problems:
        raise InputError(problems)
    picked = [(who, *key, point) for who, points in found.items() for key, point in points.items()]
    sd = "" if settings.sd_mm is None else f"{settings.sd_mm:g}"
    rows = [(*key, *map(rounded, one.place), sd) for *key, one in picked if one.place is not None]
    tables: dict[str, Sequence[Sequence[object]]] = {
        "specimens": [(who,) for who in found],
        "landmarks": rows,
        "surfaces": surfaces,
    }
    sentences = (*_sentences(found, unread), POSTURE)
    files = ", ".join(dict.fromkeys(point.file for *_, point in picked))
    origins = {"landmarks": [(point.file, point.line) for *_, point in picked]}
    return assembled(settings, f"{files}. {POSTURE}", tables, sentences, origins)


def read_points(path: Path, file: str) -> tuple[list[PickedPoint], list[InputProblem]]:
    """Points of a file, and what is wrong with it.

    Parameters
    ----------
    file : its name in messages.
    """
    text, problems = read_text(path, file, MOST_CSV_BYTES)
    points = list[PickedPoint]()
    try:
        raw = () if problems else (_of_fcsv if path.suffix.lower() == ".fcsv" else _of_json)(text)
        for line, label, axes, unit, place, status in raw:
            if axes not in AXES or unit not in MM_PER:
                allowed = f"axes LPS or RAS, in {', '.join(MM_PER)}"
                told = f"axes '{axes}', in '{unit}'"
                problems = [InputProblem(file, None, None, told, allowed, "say which they are")]
                continue
            placed = status in ("defined", "2")
            mm = MM_PER[unit] * AXES[axes] @ np.array(place, float) if placed else None
            points.append(PickedPoint(file, line, label, axes, mm))
    except (ValueError, LookupError, TypeError, AttributeError) as error:
        told, allowed = f"what Slicer does not write ({error})", "a .mrk.json or .fcsv"
        problems = [InputProblem(file, None, None, told, allowed, "save the points again")]
    return points, problems


Raw = Iterator[tuple[int | None, str, str, str, Any, str]]
"""Line, label, axes, unit, place and status of points."""


def _of_json(text: str) -> Raw:
    for markup in json.loads(text)["markups"]:
        unit = markup.get("coordinateUnits", "mm")  # a word, or a code with its scheme and meaning
        of_all = (markup.get("coordinateSystem", "LPS"), unit if isinstance(unit, str) else unit[0])
        for point in markup.get("controlPoints", ()):
            status = point.get("positionStatus", "defined")
            yield None, point.get("label", ""), *of_all, point.get("position"), status


def _of_fcsv(text: str) -> Raw:
    axes = set(re.findall(r"^# *CoordinateSystem *= *(\w+)", text, re.MULTILINE))
    for line, row in enumerate(csv.reader(text.splitlines()), start=1):
        if row and not row[0].startswith("#"):
            # newer versions write behind the columns that they name how a point was placed
            status = row[14] if len(row) > 14 else "2"
            yield line, row[11], " and ".join(sorted(axes)), "mm", row[1:4], status


def _meant(label: str, vertebra: str, settings: LandmarkSettings) -> tuple[str, str] | None:
    """Vertebra and landmark of a label, None where it tells none."""
    for own, meant in settings.labels.items():
        for one in settings.vertebrae:
            if label == own.replace("{vertebra}", one):
                label = meant.replace("{vertebra}", one)
                break
    for option in (label, f"{vertebra}_{label}"):
        of, _, landmark = option.partition("_")
        if of in settings.vertebrae and landmark:
            return of, landmark
    return None


def _lacking(
    place: Place,
    settings: LandmarkSettings,
    specimen: str,
    points: Landmarks,
    unread: list[str],
) -> Iterator[InputProblem]:
    """All landmarks without which joints have no frame, told at once."""
    needed = dict[tuple[str, str], None]()
    for lower, upper in pairwise(settings.vertebrae):
        needed |= {(upper, UPPER_FACE): None, (lower, LOWER_FACE): None}
        four = [[(one, name) for name in FRAME_LANDMARKS] for one in (lower, upper)]
        needed |= dict.fromkeys(min(four, key=lambda keys: sum(k not in points for k in keys)))
    known = ["_".join(key) for key in points if key not in needed] + unread
    for vertebra in settings.vertebrae:
        lacking = [key[1] for key in needed if key[0] == vertebra and key not in points]
        if lacking:
            found = f"'{specimen}' without {', '.join(lacking)} of {vertebra}"
            allowed = "both endplate centres at each joint; all four points of one of its vertebrae"
            otherwise = "place them, or say in `labels` what they are called"
            remedy = did_you_mean(f"{vertebra}_{lacking[0]}", known, otherwise)
            remedy += f"; further points: {', '.join(known)}" if known else ""
            yield InputProblem(*place, found, allowed, remedy)


def _sentences(found: Mapping[str, Landmarks], unread: Mapping[str, list[str]]) -> Iterator[str]:
    for specimen, points in found.items():
        axes = " and ".join(sorted({point.axes for point in points.values()}))
        files = ", ".join(dict.fromkeys(point.file for point in points.values()))
        yield f"{specimen}: {count(len(points), 'landmark')} from {files}, on axes {axes}."
        if specimen in unread:
            yield f"  Not read: {', '.join(unread[specimen])}."


def _surfaces(
    folder: Path,
    place: Place,
    of: Surfaces,
    found: Mapping[str, Landmarks],
    vertebrae: Sequence[str],
) -> tuple[list[tuple[str, ...]], list[InputProblem]]:
    """Rows of surfaces.csv, and problems of files that are not there."""
    rows, problems = list[tuple[str, ...]](), list[InputProblem]()
    for specimen, vertebra in product(found, vertebrae):
        file = of.file.replace("{specimen}", specimen).replace("{vertebra}", vertebra)
        rows.append((specimen, vertebra, file, of.unit, of.axes))
        if not (folder / file).is_file():
            allowed, remedy = "a surface of each vertebra", "correct `surfaces.file`"
            problems.append(InputProblem(*place, f"no file {file}", allowed, remedy))
    return rows, problems
