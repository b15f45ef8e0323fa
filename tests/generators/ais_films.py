"""Made-up patients with scoliosis, filmed erect, bending, without weight and under traction.

``python -m tests.generators.ais_films`` writes the cohorts ``ais18_phantom*`` again: the 18
patients of Jalalian 2017 Table 1 by sex, age, Lenke class and Cobb angle, all else drawn here.

A patient is a chain in space that turns about points behind and between its vertebrae. To the side
a segment resists by an exponential and a stop, other ones to the left and to the right, stiffer
near the apex of a curve and on its hollow side; about its length and to the front by springs that
stiffen. Erect it carries its weight and is at rest. It is bent by a sideways pull at the top and a
righting effort of the head and shoulders, which turns the uppermost segments back. Its pose is
where its energy is least, found by scipy. Nothing of spinepipe is used.
"""

import csv
import json
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]

COHORTS = Path(__file__).resolve().parents[2] / "config" / "cohorts"

LEVELS = ("L4", "L3", "L2", "L1", *(f"T{number}" for number in range(12, 1, -1)))
L4, T11, T5, T2 = 0, 5, 11, 14

# Jalalian 2017 Table 1: sex, age, Lenke class, Cobb angle of the main curve (deg).
TABLE_1 = (
    ("female", 13, "1A", 49),
    ("female", 15, "1B", 53),
    ("female", 16, "1C", 46),
    ("female", 12, "1C", 48),
    ("female", 13, "2A", 53),
    ("female", 16, "2B", 53),
    ("female", 19, "2C", 48),
    ("female", 14, "2C", 55),
    ("female", 15, "3A", 59),
    ("female", 13, "4C", 86),
    ("female", 12, "5C", 62),
    ("female", 14, "6C", 59),
    ("male", 14, "2A", 59),
    ("male", 19, "2B", 48),
    ("male", 18, "2B", 61),
    ("male", 18, "3B", 46),
    ("male", 14, "3C", 53),
    ("male", 19, "3C", 70),
)

CURVES = {"lumbar": (L4, T11, -1.0), "thoracic": (T11, T5, 1.0), "upper": (T5, T2, -1.0)}
"""Lowest and uppermost vertebra of a curve, and its side: 1 for a bulge to the right."""

# Share of the main curve that the others have, by Lenke's type: structural ones are large.
SHARES = {
    "1": {"lumbar": 0.55, "thoracic": 1.0, "upper": 0.40},
    "2": {"lumbar": 0.50, "thoracic": 1.0, "upper": 0.70},
    "3": {"lumbar": 0.80, "thoracic": 1.0, "upper": 0.40},
    "4": {"lumbar": 0.80, "thoracic": 1.0, "upper": 0.65},
    "5": {"lumbar": 1.0, "thoracic": 0.50, "upper": 0.25},
    "6": {"lumbar": 1.0, "thoracic": 0.80, "upper": 0.35},
}
LUMBAR_MODIFIER = {"A": 0.75, "B": 0.9, "C": 1.0}

TRACTION_N = 300.0
STIFFENING = np.deg2rad(4.0)
"""Turn about the length or to the front at which its spring is twice as stiff."""

WEIGHTS = np.array([0.025] * (T2 - L4) + [0.16])
"""Share of the body's weight that hangs on each vertebra; head, neck and arms on the uppermost."""

POSITIONS = ("erect", "right_bending", "left_bending", "neutral", "traction")


@dataclass(frozen=True)
class Patient:
    """A chain of 15 vertebrae, erect; the axes are front, right and up.

    Attributes
    ----------
    places : (15, 3) m. tilts : (15,) rad, to the right.
    pivots : (14, 3) m, about which each segment turns.
    loaded_depth : m to the front, where weight and pulls act.
    stiffness, rate : (14, 2) N m/rad and 1/rad, to the left and to the right.
    gap, stop : (14, 2) rad and N m/rad^3, where a stop begins and how hard it is.
    others : (14, 2) N m/rad, to the front and about the length.
    """

    name: str
    sex: str
    age: int
    lenke: str
    cobb: float
    weight_n: float
    places: Array
    tilts: Array
    pivots: Array
    loaded_depth: float
    stiffness: Array
    rate: Array
    gap: Array
    stop: Array
    others: Array

    def energy(self, turns: Array) -> tuple[Array, Array]:
        """(14,) N m stored by turns (14, 3) about the axes front, right and up, and its slope."""
        aside = turns[:, 0] * -1.0  # about the axis to the front a turn is to the left
        side = (aside > 0.0).astype(int)
        rows = np.arange(len(turns))
        k, b, gap, stop = (
            part[rows, side] for part in (self.stiffness, self.rate, self.gap, self.stop)
        )
        size, sign = np.abs(aside), np.sign(aside)
        over = np.maximum(size - gap, 0.0)
        stored = k * (np.expm1(b * size) - b * size) / b**2 + stop * over**4 / 4.0
        moments = np.zeros_like(turns)
        moments[:, 0] = -sign * (k * np.expm1(b * size) / b + stop * over**3)
        aslant = (turns[:, 1:] / STIFFENING) ** 2
        moments[:, 1:] = self.others * turns[:, 1:] * (1.0 + aslant)
        held = 0.5 * self.others * turns[:, 1:] ** 2 * (1.0 + 0.5 * aslant)
        return stored + held.sum(axis=1), moments

    def moved(self, turns: Array) -> "Posed":
        """The chain when every segment has turned so far against the one below."""
        way, at = np.eye(3), self.places[0]
        ways, places, pivots = [way], [at], []
        for below, pivot, above, turn in zip(
            self.places[:-1], self.pivots, self.places[1:], turns, strict=True
        ):
            pivots.append(at + way @ (pivot - below))
            way = way @ Rotation.from_rotvec(turn).as_matrix()
            at = pivots[-1] + way @ (above - pivot)
            ways.append(way)
            places.append(at)
        return Posed(self, np.array(ways), np.array(places), np.array(pivots))

    def settled(self, forces: Array, effort: float) -> "Posed":
        """Where the energy is least under forces (15, 3) N and an effort (N m) to tilt the top."""

        def work(flat: Array) -> tuple[float, Array]:
            turns = flat.reshape(14, 3)
            stored, slope = self.energy(turns)
            posed, rest = self.moved(turns), self.moved(np.zeros((14, 3)))
            lifted = np.sum((posed.loaded - rest.loaded) * forces)
            lifted += effort * (posed.tilts[-1] - rest.tilts[-1])
            slope = slope - posed.driven(turns, forces, effort)
            return float(stored.sum() - lifted), slope.ravel()

        found = minimize(
            work, np.zeros(42), jac=True, method="BFGS", options={"gtol": 1e-7, "maxiter": 2000}
        )
        return self.moved(found.x.reshape(14, 3))


@dataclass(frozen=True)
class Posed:
    """A pose of a patient.

    Attributes
    ----------
    ways : (15, 3, 3) orientations. places, pivots : (15, 3) and (14, 3) m.
    """

    patient: Patient
    ways: Array
    places: Array
    pivots: Array

    @property
    def loaded(self) -> Array:
        """(15, 3) m: where weight and pulls act."""
        return self.places + self.patient.loaded_depth * self.ways[:, :, 0]

    @property
    def lines(self) -> Array:
        """(15, 3) along the vertebrae."""
        tilts = self.patient.tilts
        up = np.stack([np.zeros(15), np.sin(tilts), np.cos(tilts)], axis=1)
        found: Array = np.einsum("vij,vj->vi", self.ways, up)
        return found

    @property
    def tilts(self) -> Array:
        """(15,) rad to the right, as a film of the coronal plane shows them."""
        found: Array = np.arctan2(self.lines[:, 1], self.lines[:, 2])
        return found

    @property
    def film(self) -> tuple[Array, Array]:
        """Places (15, 2) to the right and up, m, and tilts (15,)."""
        return self.places[:, 1:], self.tilts

    def driven(self, turns: Array, forces: Array, effort: float) -> Array:
        """(14, 3) N m: what forces and effort do per turn of each segment."""
        found, top = np.empty((14, 3)), self.lines[-1]
        by_line = np.array([0.0, top[2], -top[1]]) / (top[1] ** 2 + top[2] ** 2)
        tilting = effort * np.cross(top, by_line)
        arms = self.loaded[1:]
        torques = np.cross(arms, forces[1:])
        above = np.cumsum(torques[::-1], axis=0)[::-1]
        pulls = np.cumsum(forces[:0:-1], axis=0)[::-1]
        for segment, turn in enumerate(turns):
            torque = above[segment] - np.cross(self.pivots[segment], pulls[segment]) + tilting
            found[segment] = _by_turn(turn).T @ self.ways[segment].T @ torque
        return found


def _by_turn(turn: Array) -> Array:
    """(3, 3) small rotation, seen from below, for a small change of the turn."""
    size = float(np.linalg.norm(turn))
    x, y, z = turn
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    if size < 1e-6:
        return np.eye(3) + 0.5 * cross
    one, two = (1.0 - np.cos(size)) / size**2, (size - np.sin(size)) / size**3
    found: Array = np.eye(3) + one * cross + two * cross @ cross
    return found


def _turned(angle: float, vector: Array) -> Array:
    """A vector (right, up) turned to the right."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([c * vector[0] + s * vector[1], c * vector[1] - s * vector[0]])


def patient(number: int, seed: int = 2017) -> Patient:
    """One of the 18, from 1; higher numbers are further patients of the same classes."""
    sex, age, lenke, cobb = TABLE_1[(number - 1) % len(TABLE_1)]
    rng = np.random.default_rng([seed, number])
    size = (0.9 if sex == "female" else 1.0) * min(1.0, 0.85 + 0.025 * (age - 12))
    tilts, apices = _tilts(lenke, cobb)
    rise = size * np.linspace(36.0, 20.0, 14) / 1e3
    chord = rise @ np.stack([np.sin(_between(tilts)), np.cos(_between(tilts))], axis=1)
    tilts = tilts - np.arctan2(*chord)  # the uppermost vertebra stands above the lowest
    between = _between(tilts)
    steps = rise[:, None] * np.stack([np.sin(between), np.cos(between)], axis=1)
    places = np.vstack([np.zeros(2), np.cumsum(steps, axis=0)])
    share = rng.uniform(0.36, 0.44, 14)[:, None]
    depth = size * rng.normal(16e-3, 2e-3, 14)
    others = np.array([120.0, 90.0]) * np.exp(rng.normal(0.0, 0.3, (14, 2)))
    return Patient(
        f"p{number:02d}",
        sex,
        age,
        lenke,
        float(cobb),
        9.81 * (48.0 if sex == "female" else 58.0) * size,
        np.column_stack([np.zeros(15), places]),
        tilts,
        np.column_stack([-depth, places[:-1] + share * steps]),
        size * rng.uniform(-18e-3, -8e-3),
        *_resistance(tilts, apices, rng),
        others,
    )


def _between(tilts: Array) -> Array:
    """(14,) tilt of the way from each vertebra to the next."""
    found: Array = 0.5 * (tilts[1:] + tilts[:-1])
    return found


def _tilts(lenke: str, cobb: float) -> tuple[Array, list[float]]:
    """(15,) rad erect, and the levels of the apices."""
    tilts, apices = np.zeros(15), []
    at = np.arange(15.0)
    for name, (low, high, side) in CURVES.items():
        angle = SHARES[lenke[0]][name] * cobb
        if name == "lumbar" and lenke[0] in "12":
            angle *= LUMBAR_MODIFIER[lenke[1]]
        way = np.clip((at - low) / (high - low), 0.0, 1.0)
        tilts -= side * np.deg2rad(angle) * way**2 * (3.0 - 2.0 * way)
        apices.append(0.5 * (low + high))
    return tilts, apices


def _resistance(
    tilts: Array, apices: Sequence[float], rng: np.random.Generator
) -> tuple[Array, ...]:
    """Stiffness, rate, gap and stop of all segments, left and right."""
    level = np.arange(14) + 0.5
    healthy = np.interp(level, [0, 5, 14], [75.0, 110.0, 130.0])
    near = np.max([np.exp(-0.5 * ((level - apex) / 1.5) ** 2) for apex in apices], axis=0)
    wedge = np.diff(tilts) / np.abs(np.diff(tilts)).max()
    stiffness = np.empty((14, 2))
    for side, sign in enumerate((-1.0, 1.0)):
        hollow = np.maximum(sign * wedge, 0.0)  # turning on the way it is bent already
        stiffness[:, side] = healthy * (1.0 + 1.5 * near) * (1.0 + 1.2 * hollow)
    stiffness *= np.exp(rng.normal(0.0, 0.3, (14, 2)))
    rate = rng.uniform(6.0, 22.0, (14, 2))
    gap = np.deg2rad(rng.uniform(2.5, 7.0, (14, 2)))
    return stiffness, rate, gap, np.exp(rng.normal(np.log(4e5), 0.5, (14, 2)))


def filmed(one: Patient, seed: int = 2017) -> dict[str, tuple[Array, Array]]:
    """Places and tilts at every position, without error."""
    rng = np.random.default_rng([seed, 1, int(one.name[1:])])
    nothing, films = np.zeros((15, 3)), {}
    films["erect"] = one.moved(np.zeros((14, 3))).film
    for position, side in (("right_bending", 1.0), ("left_bending", -1.0)):
        pull = nothing.copy()
        pull[-1, 1] = side * rng.uniform(110.0, 200.0)
        righting = -side * rng.uniform(2.0, 8.0)
        films[position] = one.settled(pull, righting).film
    relieved = nothing.copy()
    relieved[:, 2] = one.weight_n * WEIGHTS
    films["neutral"] = one.settled(relieved, 0.0).film
    stretched = relieved.copy()
    stretched[-1, 2] += TRACTION_N
    films["traction"] = one.settled(stretched, 0.0).film
    return films


@dataclass(frozen=True)
class Reading:
    """How films are read: SD of a place (mm) and of a tilt (deg), observers; steps of both."""

    place_mm: float
    tilt_deg: float
    observers: int
    step: float = 0.1


READINGS = {
    "ais18_phantom": Reading(0.0, 0.0, 1),
    "ais18_phantom_sd07": Reading(0.5, 0.7, 2),
    "ais18_phantom_sd19": Reading(1.0, 1.9, 2),
}


def write(folder: Path, reading: Reading, count: int = 18) -> None:
    """Write the cohort of that many patients."""
    folder.mkdir(parents=True, exist_ok=True)
    everyone = [patient(number) for number in range(1, count + 1)]
    films = {one.name: filmed(one) for one in everyone}
    rng = np.random.default_rng([2017, 2, int(10 * reading.tilt_deg)])
    rows = []
    for name, positions in films.items():
        for position in POSITIONS:
            for observer in range(1, reading.observers + 1):
                rows += _rows(name, position, positions[position], observer, reading, rng)
    _table(folder / "films.csv", rows)
    _table(folder / "specimens.csv", [{"specimen": one.name} for one in everyone])
    known = ("sex", "age_years", "lenke_class", "cobb_deg")
    facts = [
        dict(zip(known, (one.sex, one.age, one.lenke, f"{one.cobb:g}"), strict=True))
        for one in everyone
    ]
    named = zip(everyone, facts, strict=True)
    _table(folder / "patients.csv", [{"specimen": one.name, **fact} for one, fact in named])
    (folder / "cohort.yaml").write_text(_header(folder.name, reading), encoding="utf-8")
    truth = {one.name: _truth(one, films[one.name]) for one in everyone}
    text = json.dumps(truth, indent=None, separators=(",", ":"))
    (folder / "truth.json").write_text(text + "\n", encoding="utf-8")


def _rows(
    name: str,
    position: str,
    shape: tuple[Array, Array],
    observer: int,
    reading: Reading,
    rng: np.random.Generator,
) -> list[dict[str, object]]:
    """The rows of one film as one observer reads it, in the paper's axes."""
    places, tilts = shape
    right, up = 1e3 * places.T + rng.normal(0.0, 1.0, (2, 15)) * reading.place_mm
    tilt = np.rad2deg(tilts) + rng.normal(0.0, 1.0, 15) * reading.tilt_deg
    lowest = -np.deg2rad(tilt[0])  # the film is measured in the frame of the lowest, as it is read
    points = [_turned(lowest, point) for point in np.stack([right - right[0], up - up[0]], axis=1)]
    right, up = np.array(points).T
    tilt = tilt - tilt[0]
    return [
        {
            "specimen": name,
            "position": position,
            "vertebra": level,
            "observer": observer,
            "y_mm": _step(-right[at], reading.step),
            "z_mm": _step(up[at], reading.step),
            "orientation_deg": _step(-tilt[at], reading.step),
        }
        for at, level in enumerate(LEVELS)
    ]


def _step(value: float, step: float) -> str:
    return f"{step * round(value / step) + 0.0:.1f}"


def _table(path: Path, rows: Sequence[Mapping[str, object]]) -> None:
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def _header(name: str, reading: Reading) -> str:
    noise = (
        "no error but the step"
        if not reading.tilt_deg
        else (f"two observers, SD {reading.tilt_deg:g} deg and {reading.place_mm:g} mm each")
    )
    return f"""\
cohort: {name}
title: Made-up scoliotic spines filmed in five positions, {noise}
source: >-
  Made by tests/generators/ais_films.py. Sex, age, Lenke class and Cobb angle are those of Jalalian
  2017, Table 1 (doi 10.1007/s11517-016-1576-8); all else is drawn, the truth is in truth.json.
made_up: true
vertebrae: [{", ".join(LEVELS)}]
gravity: false
"""


def _truth(one: Patient, films: Mapping[str, tuple[Array, Array]]) -> dict[str, object]:
    """What was hidden: laws, pivots and every film without error."""
    parts = ("stiffness", "rate", "gap", "stop", "others", "pivots")
    return {
        **{name: np.round(getattr(one, name), 9).tolist() for name in parts},
        "films": {
            name: np.round(np.column_stack([places, tilts]), 9).tolist()
            for name, (places, tilts) in films.items()
        },
    }


if __name__ == "__main__":
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else COHORTS
    for cohort, how in READINGS.items():
        write(target / cohort, how)
        print(cohort)
