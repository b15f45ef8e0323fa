"""What a study of scoliotic spines demands of its films: each fault with its place and remedy."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.documents.yaml_text import YamlDocument
from spinepipe.problems import InputProblem
from spinepipe.studies.scoliosis.curve_angles import curves, main_curve
from spinepipe.studies.scoliosis.films import (
    CENTRE,
    CORNERS,
    ERECT,
    FEWEST_READ,
    HELD_OUT,
    LEFT,
    NEEDED,
    PATIENTS,
    RIGHT,
    Film,
    Flags,
    by_reading,
    film_readings,
    read_on,
    read_rows,
    run_around,
    uncrossed,
)
from spinepipe.studies.scoliosis.settings import Scoliosis
from spinepipe.units import DEG_PER_RAD, MM_PER_M

FEWEST = 2
"""Vertebrae that have a line between them."""

FARTHEST_APART_DEG = 25.0
"""Tilt of a vertebra and of the line through its neighbours' centres differ by less."""

LEAST_BEND_DEG = 2.0
"""A bending film tilts the top of the spine by more than this."""

RADIANS = 0.1
"""Tilts that are so small a share of what the centres say are no degrees."""

SAME_MM = 0.05
"""Films whose centres all agree to this are one film."""

SHORTER = 0.97
"""Traction may not leave less than this share of the erect length."""


def check_scoliosis(
    document: YamlDocument, study: Scoliosis, cohort: Cohort
) -> Iterator[InputProblem]:
    """Everything that is wrong with the films of a cohort."""
    films = cohort.further.get("films")
    if films is None:
        found, allowed = "a cohort without films.csv", "a cohort with films of its patients"
        remedy = "add films.csv, or name another cohort"
        yield InputProblem(*document.place_of("cohort"), found, allowed, remedy)
        return
    for patient in cohort.specimen_names:
        rows = films[films["specimen"] == patient]
        file = f"{cohort.name}/films.csv"
        seen = read_on(rows, cohort.vertebrae)
        shapes: dict[str, Film] = {}
        for position in dict.fromkeys(rows["position"]):
            film = rows[rows["position"] == position]
            place = _FilmPlace(file, patient, position)
            faults = list(_film(cohort, place, film))
            around = run_around(rows)  # which `plausibility` tells
            faults += [] if around else _corners(place, film)
            yield from faults
            if not faults and not around and seen[position].sum() >= FEWEST:
                names = tuple(np.array(cohort.vertebrae)[seen[position]])
                shapes[position] = Film(*film_readings(read_rows(film), names).mean(axis=0))
                yield from _tilts(place, film, names, shapes[position])
        yield from _too_few(cohort, file, patient, seen)
        if ERECT in shapes:
            yield from _cobb(cohort, patient, shapes[ERECT])
        # then what films of one patient say of each other, by the vertebrae that all of them have
        shared = np.all([seen[name] for name in shapes] or [np.zeros(1, dtype=bool)], axis=0)
        if shared.sum() >= FEWEST:
            alike = {
                name: Film(*film.rows[:, shared[seen[name]]]).seen_from_below()
                for name, film in shapes.items()
            }
            yield from _bends(file, patient, alike)


def _too_few(
    cohort: Cohort, file: str, patient: str, seen: Mapping[str, Flags]
) -> Iterator[InputProblem]:
    """Is there a spine that the erect and both bending films show?"""
    if not set(NEEDED) <= set(seen):  # which the form tells
        return
    shared = np.all([seen[name] for name in NEEDED], axis=0)
    fewest = min(FEWEST_READ, len(cohort.vertebrae))
    if shared.sum() < fewest:
        position = min(NEEDED, key=lambda name: int(seen[name].sum()))
        has = f"{shared.sum()} vertebrae read on all of {', '.join(NEEDED)}"
        yield _FilmPlace(file, patient, position).problem(
            None,
            "vertebra",
            f"{has}, {seen[position].sum()} on this one",
            f"at least {fewest} that all of these films have",
            "read more vertebrae, or leave the patient out",
        )


@dataclass(frozen=True)
class _FilmPlace:
    """Where a fault of a film is told."""

    file: str
    patient: str
    position: str

    def problem(
        self, row: int | None, what: str | None, found: str, allowed: str, remedy: str
    ) -> InputProblem:
        named = f"{self.patient}, film {self.position}: {found}"
        return InputProblem(self.file, row, what, named, allowed, remedy)


def _cobb(cohort: Cohort, patient: str, erect: Film) -> Iterator[InputProblem]:
    """Does the Cobb angle that is stated go with the film?"""
    rows = cohort.further.get(PATIENTS.stem)
    if rows is None or not curves(erect):
        return
    own = rows.loc[rows["specimen"] == patient, "cobb_deg"].dropna()
    read = DEG_PER_RAD * main_curve(erect).cobb(erect)
    for line, stated in own.items():
        if abs(stated - read) > FARTHEST_APART_DEG:
            found = f"{stated:g} deg of {patient}, whose film erect has {read:.0f} deg"
            allowed = f"within {FARTHEST_APART_DEG:g} deg of the film"
            place = (f"{cohort.name}/{PATIENTS.file}", int(str(line)), "cobb_deg")
            remedy = "correct it (radians? another patient?), or the tilts of the film"
            yield InputProblem(*place, found, allowed, remedy)


def _film(cohort: Cohort, place: _FilmPlace, rows: pd.DataFrame) -> Iterator[InputProblem]:
    """Each reading of a film: a vertebra once, the lowest at nought."""
    for reading in by_reading(rows):
        known = reading[["observer", "repeat"]].iloc[0].dropna()
        who = ", ".join(f"{name} {value}" for name, value in known.items())
        by = f" ({who})" if who else ""
        line = int(reading.index[0])
        there = list(reading["vertebra"])
        twice = [name for name in dict.fromkeys(there) if there.count(name) > 1]
        if twice:
            found = f"{', '.join(twice)} twice{by}"
            remedy = "delete one film, or number them as repeats"
            yield place.problem(line, "vertebra", found, "a position once", remedy)
        read = read_rows(reading)
        by_corners = read[list(CORNERS)].notna().all(axis=None)
        if not twice and not by_corners and cohort.vertebrae[0] in set(read["vertebra"]):
            yield from _lowest(cohort, place, read)


def _corners(place: _FilmPlace, rows: pd.DataFrame) -> Iterator[InputProblem]:
    """Corners that are not in their order, which would make any centre and tilt."""
    if len(wrong := uncrossed(rows)):
        found = f"diagonals that do not cross inside {', '.join(dict.fromkeys(wrong['vertebra']))}"
        allowed = "upper_left across from lower_right, upper_right across from lower_left"
        remedy = (
            "corners listed around the vertebra? exchange the two that are in the wrong columns"
        )
        yield place.problem(int(wrong.index[0]), CORNERS[4], found, allowed, remedy)


def _lowest(cohort: Cohort, place: _FilmPlace, reading: pd.DataFrame) -> Iterator[InputProblem]:
    lowest = reading[reading["vertebra"] == cohort.vertebrae[0]]
    numbers = lowest[list(CENTRE)].to_numpy(float)[0]
    if np.abs(numbers).max() > 1e-6:
        shown = ", ".join(f"{n} {v:g}" for n, v in zip(CENTRE, numbers, strict=True))
        yield place.problem(
            int(lowest.index[0]),
            None,
            f"{cohort.vertebrae[0]} at {shown}",
            f"0, 0 and 0 at {cohort.vertebrae[0]}, whose frame the film is measured in",
            "subtract its place and turn the film, or give corners",
        )


def _tilts(
    place: _FilmPlace, rows: pd.DataFrame, vertebrae: tuple[str, ...], film: Film
) -> Iterator[InputProblem]:
    """Does what is said of tilt go with the line of the centres?"""
    # (V,) rad, of the line from the neighbour below to the neighbour above
    below = np.maximum(np.arange(len(film.up)) - 1, 0)
    above = np.minimum(np.arange(len(film.up)) + 1, len(film.up) - 1)
    line = np.arctan2(film.right[above] - film.right[below], film.up[above] - film.up[below])
    given = float(np.abs(film.tilt).max())
    if np.abs(line).max() > np.deg2rad(5.0) and given < RADIANS * np.abs(line).max():
        found = f"no vertebra tilted by more than {DEG_PER_RAD * given:.2g}, while the line of "
        found += f"centres leans by {DEG_PER_RAD * float(np.abs(line).max()):.0f} deg"
        remedy = "radians? multiply by 57.3"
        yield place.problem(None, "orientation_deg", found, "degrees", remedy)
        return
    # a vertebra stands across the line of centres: tilts read off the other way or of another
    # vertebra do not follow it
    off = np.abs(film.tilt - line)
    worst = int(np.argmax(off))
    if off[worst] > np.deg2rad(FARTHEST_APART_DEG):
        row = int(rows.index[(rows["vertebra"] == vertebrae[worst]).to_numpy()][0])
        found = f"{vertebrae[worst]} tilted {DEG_PER_RAD * float(off[worst]):.0f} deg from the line"
        allowed = f"within {FARTHEST_APART_DEG:g} deg of the line through its neighbours' centres"
        remedy = "check sign and vertebra; is the film mirrored (AP for PA)?"
        yield place.problem(row, "orientation_deg", f"{found} of centres", allowed, remedy)


def _bends(file: str, patient: str, films: dict[str, Film]) -> Iterator[InputProblem]:
    """Do the films show what their positions say?"""
    if ERECT not in films:
        return
    erect = films[ERECT]
    yield from _duplicates(file, patient, films)
    leans = {}
    for position, side in ((RIGHT, 1.0), (LEFT, -1.0)):
        if position in films and not _is_same(films[position], erect):
            leans[position] = side * float(films[position].tilt[-1] - erect.tilt[-1])
    wrong = [name for name, lean in leans.items() if lean < -np.deg2rad(LEAST_BEND_DEG)]
    if len(wrong) == 2:
        found = f"{patient}: both bending films lean to the other side"
        remedy = "exchange the two positions, or mirror the films (AP for PA)"
        allowed = "right_bending to the right: y and orientation fall"
        yield InputProblem(file, None, "position", found, allowed, remedy)
    for position, lean in leans.items():
        place = _FilmPlace(file, patient, position)
        if wrong == [position]:
            found = "the spine leans to the other side than on the erect film"
            remedy = "is the film mirrored (AP for PA), or the other bend?"
            yield place.problem(None, "position", found, f"a film of {position}", remedy)
        elif abs(lean) <= np.deg2rad(LEAST_BEND_DEG):
            found = f"the top tilts by {DEG_PER_RAD * lean:.1f} deg only"
            allowed = f"more than {LEAST_BEND_DEG:g} deg from the erect film"
            yield place.problem(None, "position", found, allowed, "is this the bending film?")
    traction = films.get("traction")
    if traction is not None and traction.up[-1] < SHORTER * erect.up[-1]:
        place, lengths = _FilmPlace(file, patient, "traction"), (traction.up[-1], erect.up[-1])
        found = "{:.0f} mm tall, {:.0f} mm erect".format(*(MM_PER_M * one for one in lengths))
        remedy = "is the film scaled, or of another position?"
        yield place.problem(None, "z_mm", found, "traction lengthens a spine", remedy)


def _duplicates(file: str, patient: str, films: dict[str, Film]) -> Iterator[InputProblem]:
    names = [name for name in (*NEEDED, *HELD_OUT) if name in films]
    for number, one in enumerate(names):
        for other in names[number + 1 :]:
            if _is_same(films[one], films[other]):
                place, found = _FilmPlace(file, patient, other), f"the same as film {one}"
                remedy = "replace the one that was entered twice"
                yield place.problem(None, "position", found, "a film of its own", remedy)


def _is_same(one: Film, other: Film) -> bool:
    apart = np.hypot(one.right - other.right, one.up - other.up)
    return bool(MM_PER_M * apart.max() < SAME_MM)
