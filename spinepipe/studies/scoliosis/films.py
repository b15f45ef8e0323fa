"""Films of a patient: where every vertebra lies and how it is tilted, at every position.

In files the axes are those of Jalalian 2017: y to the left, z along the lowest vertebra, rotation
to the right negative. Here: to the right, up, tilt to the right; m and rad. Each film is seen from
its own lowest vertebra, which then lies at nought and stands upright.

A vertebra that was not read on a film is put where its neighbours have it, and compared with
nothing. One that lacks at an end of the erect or a bending film shortens the patient's spine.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from spinepipe.cohort import Cohort
from spinepipe.cohort.cohort import memoize_per_cohort
from spinepipe.decomposition import lstsq
from spinepipe.documents.form import read_forms
from spinepipe.effects.contract import Array
from spinepipe.studies.scoliosis.settings import Scoliosis
from spinepipe.units import DEG_PER_RAD, MM_PER_M

ERECT, RIGHT, LEFT = "erect", "right_bending", "left_bending"
NEEDED = (ERECT, RIGHT, LEFT)
HELD_OUT = ("neutral", "traction")

READINGS_OF_A_CHANGE = 2
"""On the film and on the erect one. Those of the erect one are in both bending films; here they are
two, so that the films are trusted less in what they differ by."""

FEWEST_READ = 3
"""Vertebrae that a film has at least: between the two that are given one is compared."""

Flags = NDArray[np.bool_]

CENTRE = ("y_mm", "z_mm", "orientation_deg")
CORNERS = tuple(
    f"{end}_{side}_{axis}_mm"
    for end in ("upper", "lower")
    for side in ("left", "right")
    for axis in "yz"
)

FILMS, PATIENTS = read_forms(Path(__file__).with_name("forms.yaml")).values()


@dataclass(frozen=True)
class Film:
    """One position of V vertebrae, caudal to cranial.

    Attributes
    ----------
    right, up, tilt : (V,) m, m and rad; nought at the lowest vertebra.
    """

    right: Array
    up: Array
    tilt: Array

    @cached_property
    def turned(self) -> Array:
        """(V - 1,) rad, tilt of each vertebra less that of the one below."""
        found: Array = np.diff(self.tilt)
        return found

    @property
    def rows(self) -> Array:
        """(3, V) right, up and tilt."""
        return np.stack([self.right, self.up, self.tilt])

    @property
    def top(self) -> Array:
        """(3,) place and tilt of the uppermost vertebra."""
        return np.array([self.right[-1], self.up[-1], self.tilt[-1]])

    def joints(self, share: float) -> Array:
        """(V - 1, 2) m, right and up: so far on the way from each centre to the one above."""
        points = np.stack([self.right, self.up], axis=1)
        found: Array = points[:-1] + share * np.diff(points, axis=0)
        return found

    def seen_from_below(self) -> "Film":
        """The same from its lowest vertebra."""
        cos, sin = np.cos(self.tilt[0]), np.sin(self.tilt[0])
        right, up = self.right - self.right[0], self.up - self.up[0]
        return Film(cos * right - sin * up, sin * right + cos * up, self.tilt - self.tilt[0])


@dataclass(frozen=True)
class PatientFilms:
    """What was read of one patient.

    Attributes
    ----------
    films : by position, the mean of all readings.
    scales : by position, the factor that makes the film as large as the erect one.
    sd : (3,) m, m and rad, SD of one reading: of right and up as seen from the lowest vertebra, of
        a vertebra's own tilt; NaN where none tells.
    readings : by position, how many were averaged.
    own_sd : m, SD of a vertebra's own place, whatever the frame of the reading.
    traction : by position, N; NaN without.
    vertebrae : names of the patient's, caudal to cranial. lowest : number of the first of them in
        the cohort.
    seen : by position, (V,) whether a vertebra was read; all, where it is not told.
    """

    films: Mapping[str, Film]
    scales: Mapping[str, float]
    sd: Array
    readings: Mapping[str, int]
    own_sd: float = np.nan
    traction: Mapping[str, float] = field(default_factory=dict)
    vertebrae: tuple[str, ...] = ()
    lowest: int = 0
    seen: Mapping[str, Flags] = field(default_factory=dict)

    def compared(self, position: str) -> Flags:
        """(V,) vertebrae that were read on this film and on the erect one."""
        every = np.ones(len(self.films[position].up), dtype=bool)
        found: Flags = self.seen.get(position, every) & self.seen.get(ERECT, every)
        return found

    def compared_turns(self, position: str) -> Flags:
        """(V - 1,) segments between two such vertebrae."""
        read = self.compared(position)
        found: Flags = read[1:] & read[:-1]
        return found

    def turned(self, position: str) -> Array:
        """(V - 1,) rad: r, how far segments have turned since the erect film, right positive."""
        found: Array = self.films[position].turned - self.films[ERECT].turned
        return found

    def chord(self, position: str) -> float:
        """Distance from the lowest to the uppermost vertebra, over that on the erect film."""
        lengths = [np.hypot(*self.films[one].top[:2]) for one in (position, ERECT)]
        return float(lengths[0] / lengths[1])


@memoize_per_cohort
def read_films(cohort: Cohort, patient: str) -> PatientFilms:
    """The films of a patient; `checks` has seen to it that there is enough on them."""
    rows = cohort.further["films"]
    rows = rows[rows["specimen"] == patient]
    seen = read_on(rows, cohort.vertebrae)
    lowest, top = span_of(seen)
    vertebrae = cohort.vertebrae[lowest : top + 1]
    seen = {name: one[lowest : top + 1] for name, one in seen.items()}
    seen = {name: one for name, one in seen.items() if can_be_held(one)}
    read = {name: read_rows(rows[rows["position"] == name]) for name in seen}
    # corners tell how large a film is: all become as large as the erect one
    scales = {name: _scale(read[ERECT], film) for name, film in read.items()}
    every = {
        name: film_readings(film, tuple(np.array(vertebrae)[seen[name]]))
        * np.array([[scales[name]] * 2 + [1.0]]).T
        for name, film in read.items()
    }
    erect = filled(every[ERECT].mean(axis=0), seen[ERECT], np.zeros((3, len(vertebrae))))
    films = {n: Film(*filled(each.mean(axis=0), seen[n], erect)) for n, each in every.items()}
    traction = {}
    if "traction_n" in rows:
        traction = {name: float(film["traction_n"].mean()) for name, film in read.items()}
    readings = {name: len(each) for name, each in every.items()}
    repeated = list(every.values())
    errors = _sd(repeated), readings, _own_sd(repeated)
    return PatientFilms(films, scales, *errors, traction, vertebrae, lowest, seen)


def read_rows(film: pd.DataFrame) -> pd.DataFrame:
    """Rows that have what most of their reading have, corners or else centre and tilt."""
    by = [film["observer"], film["repeat"]]
    corner, centre = (film[list(names)].notna().all(axis=1) for names in (CORNERS, CENTRE))
    more = (corner.astype(int) - centre.astype(int)).groupby(by, dropna=False).transform("sum") >= 0
    found: pd.DataFrame = film[corner.where(more, centre)]
    return found


def read_on(rows: pd.DataFrame, vertebrae: tuple[str, ...]) -> dict[str, Flags]:
    """By position, (V,) whether all readings of the film have a vertebra."""
    found = {}
    for position, film in rows.groupby("position", sort=False):
        each = [np.isin(vertebrae, one["vertebra"]) for one in by_reading(read_rows(film))]
        found[str(position)] = np.all(each or [np.zeros(len(vertebrae), bool)], axis=0)
    return found


def span_of(seen: Mapping[str, Flags]) -> tuple[int, int]:
    """Lowest and uppermost vertebra that are read on the erect and on both bending films."""
    at = np.flatnonzero(np.all([seen[name] for name in NEEDED], axis=0))
    return int(at[0]), int(at[-1])


def can_be_held(seen: Flags) -> bool:
    """Whether a film has the ends of the patient's spine (V,), and a vertebra between."""
    return bool(seen[0] and seen[-1] and seen.sum() >= min(FEWEST_READ, len(seen)))


def filled(read: Array, seen: Flags, base: Array) -> Array:
    """(3, V): what was read (3, R), and a base (3, V) moved smoothly where nothing was."""
    at = np.flatnonzero(seen)
    found: Array = base + CubicSpline(at, read - base[:, at], axis=1)(np.arange(len(seen)))
    found[:, at] = read
    return found


def _scale(erect: pd.DataFrame, film: pd.DataFrame) -> float:
    """Factor of a film that makes vertebrae as high as on the erect one."""
    both = set(erect["vertebra"]) & set(film["vertebra"])
    sizes = [height(one[one["vertebra"].isin(both)]) for one in (erect, film)]
    return sizes[0] / sizes[1] if sizes[0] and sizes[1] else 1.0


def by_reading(rows: pd.DataFrame) -> Iterator[pd.DataFrame]:
    """The rows of each reading of a film."""
    for _, one in rows.groupby(["observer", "repeat"], sort=False, dropna=False):
        yield one


def film_readings(rows: pd.DataFrame, vertebrae: tuple[str, ...]) -> Array:
    """(K, 3, V) right, up and tilt of each reading of a film, seen from its lowest vertebra."""
    each = (film_of_rows(one, vertebrae).seen_from_below() for one in by_reading(rows))
    return np.array([[one.right, one.up, one.tilt] for one in each])


def film_of_rows(rows: pd.DataFrame, vertebrae: tuple[str, ...]) -> Film:
    """One reading of a film, in the film's own frame."""
    rows = rows.set_index("vertebra").loc[list(vertebrae)]
    if rows[list(CORNERS)].notna().all(axis=None):
        return _of_corners(rows)
    y, z, turn = (rows[name].to_numpy(float) for name in CENTRE)
    return Film(-y / MM_PER_M, z / MM_PER_M, -turn / DEG_PER_RAD)


def _of_corners(rows: pd.DataFrame) -> Film:
    """Centre where the diagonals cross, tilt of the line through the centres of the endplates."""
    corner = corners(rows)
    start, across, share, _ = _diagonals(corner)
    centre = start + share[:, None] * across
    # twice the line from the centre of the lower endplate to that of the upper one
    axis = (corner["upper_left"] + corner["upper_right"]) - (
        corner["lower_left"] + corner["lower_right"]
    )
    tilt = np.arctan2(-axis[:, 0], axis[:, 1])
    return Film(-centre[:, 0] / MM_PER_M, centre[:, 1] / MM_PER_M, tilt)


def corners(rows: pd.DataFrame) -> dict[str, Array]:
    """(V, 2) y and z, mm, of the four corners."""
    return {
        f"{end}_{side}": rows[[f"{end}_{side}_{axis}_mm" for axis in "yz"]].to_numpy(float)
        for end in ("upper", "lower")
        for side in ("left", "right")
    }


def _diagonals(corner: dict[str, Array]) -> tuple[Array, Array, Array, Array]:
    """One diagonal's begin and way (V, 2), and the share (V,) of it and the other to the crossing.

    Nought and nought where they are parallel.
    """
    start, across = corner["upper_left"], corner["lower_right"] - corner["upper_left"]
    other, back = corner["upper_right"], corner["lower_left"] - corner["upper_right"]
    # start + share across = other + s back, by Cramer's rule
    turn = _cross(across, back)
    shares = np.zeros((2, len(turn)))
    for share, way in zip(shares, (back, across), strict=True):
        np.divide(_cross(other - start, way), turn, out=share, where=turn != 0.0)
    return start, across, *shares


def uncrossed(rows: pd.DataFrame) -> pd.DataFrame:
    """Rows with all corners, but not in their order: the diagonals do not cross inside."""
    rows = rows[rows[list(CORNERS)].notna().all(axis=1)]
    *_, one, other = _diagonals(corners(rows))
    found: pd.DataFrame = rows[(np.minimum(one, other) <= 0.0) | (np.maximum(one, other) >= 1.0)]
    return found


def run_around(rows: pd.DataFrame) -> bool:
    """Whether endplates run against each other: corners listed around the vertebra."""
    corner = corners(rows)
    upper, lower = (corner[f"{end}_left"] - corner[f"{end}_right"] for end in ("upper", "lower"))
    return bool(np.median(np.sum(upper * lower, axis=1)) < 0.0)  # False where there are none


def _cross(one: Array, other: Array) -> Array:
    found: Array = one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]
    return found


def height(rows: pd.DataFrame) -> float | None:
    """Mean height of the vertebrae on a film, m; None without their corners."""
    if not rows[list(CORNERS)].notna().all(axis=None):
        return None
    corner = corners(rows)
    axis = 0.5 * (
        corner["upper_left"] + corner["upper_right"] - corner["lower_left"] - corner["lower_right"]
    )
    return float(np.hypot(*axis.T).mean()) / MM_PER_M


def _sd(films: Sequence[Array]) -> Array:
    """(3,) SD of one reading, pooled over the films (K, 3, V) that were read more than once."""
    repeated = [each for each in films if len(each) > 1]
    if not repeated:
        return np.full(3, np.nan)
    squares = np.zeros(3)
    for each in repeated:
        off = each - each.mean(axis=0)
        # The lowest vertebra is at nought by definition, so its own error is in all the others.
        # Tilts about the mean tilt of their reading are rid of it: V of them hold V - 1 errors.
        off[:, 2] -= off[:, 2].mean(axis=1, keepdims=True)
        squares += (off**2).sum(axis=(0, 2)) / (each.shape[2] - 1)
    found: Array = np.sqrt(squares / sum(len(each) - 1 for each in repeated))
    return found


def _own_sd(films: Sequence[Array]) -> float:
    """m, each way: SD of places about the mean film (K, 3, V), turned and shifted onto it."""
    squares, count = 0.0, 0
    for each in (one for one in films if len(one) > 1):
        right, up = (each.mean(axis=0) - each.mean(axis=(0, 2))[:, None])[:2]
        turning = np.append(up, -right) / np.hypot(right, up).max()
        level = np.kron(np.eye(2), np.ones(len(right)))
        moves = np.vstack([level, turning]).T  # (2 V, 3) what a frame's error does to all places
        off = (each - each.mean(axis=0))[:, :2].reshape(len(each), -1).T
        squares += float(((off - moves @ lstsq(moves, off)[0]) ** 2).sum())
        count += (len(each) - 1) * (len(off) - 3)
    return float(np.sqrt(squares / count)) if count else np.nan


def step_sd_deg(cohort: Cohort) -> float | None:
    """SD of a tilt that is exact but for its last decimal; None of corners, or without a step."""
    rows = cohort.further["films"]
    if rows[list(CORNERS)].notna().any(axis=None):
        return None
    tilts = rows["orientation_deg"].dropna().to_numpy(float)
    steps = (10.0**-k for k in range(4) if np.allclose(tilts, tilts.round(k), rtol=0.0, atol=1e-9))
    step = next(steps, None)
    return None if step is None else step / float(np.sqrt(12.0))


def reading_noise(settings: Scoliosis, cohort: Cohort) -> Array:
    """(3,) SD of what is taken for a place seen from the lowest vertebra (mm, each way), for a
    vertebra's own tilt (deg) and its own place (mm, each way); NaN where nothing tells.

    Repeated readings tell; where there are none, the study may state it. A mean of readings has
    less than one: by the mean over all films of one over their readings.
    """
    patients = [read_films(cohort, name) for name in cohort.specimen_names]
    known = [(*one.sd, one.own_sd) for one in patients if np.isfinite(one.sd).all()]
    if known:
        share = np.mean([1.0 / count for one in patients for count in one.readings.values()])
        right, up, tilt, own = np.sqrt(share * np.mean(np.square(known), axis=0))
        place = np.sqrt(0.5 * (right**2 + up**2))
        return np.array([MM_PER_M * place, DEG_PER_RAD * tilt, MM_PER_M * own])
    stated = (settings.place_sd_mm, settings.tilt_sd_deg, settings.place_sd_mm)
    return np.array([np.nan if one is None else one for one in stated])


@dataclass(frozen=True)
class FilmSd:
    """SD of a film less the model, which begins with the erect film.

    Attributes
    ----------
    vertebra : (3,) m, m and rad, of a vertebra's own place and tilt; the model's misses among it.
    frame : (3,) m, m and rad, of the lowest vertebra's place and tilt, from reading alone.
    """

    vertebra: Array
    frame: Array


def film_sd(reading_mm: float, reading_deg: float, model_mm: float, model_deg: float) -> FilmSd:
    """Of the readings of one vertebra, and of the model."""
    units = np.array([MM_PER_M, MM_PER_M, DEG_PER_RAD])
    read = np.sqrt(READINGS_OF_A_CHANGE) * np.array([reading_mm, reading_mm, reading_deg]) / units
    return FilmSd(np.hypot(read, np.array([model_mm, model_mm, model_deg]) / units), read)


def weights(settings: Scoliosis, cohort: Cohort) -> FilmSd:
    """With which films are weighed; those of which nothing tells how they were read are exact."""
    _, tilt, own = np.nan_to_num(reading_noise(settings, cohort)).tolist()
    return film_sd(own, tilt, settings.model_sd_mm, settings.model_sd_deg)
