"""A cohort of made-up people as files: what is seen and told, and apart from it the truth."""

import csv
from collections.abc import Iterable, Sequence
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tests.generators.tracking.laws import Array, plain_curves
from tests.generators.tracking.moved import Filmed, Motion, moved
from tests.generators.tracking.person import BODIES, Person, drawn
from tests.generators.tracking.rows import (
    FILES,
    PASSIVE,
    Row,
    told_rows,
    true_passive,
    true_places,
    true_stiffness,
)
from tests.generators.tracking.seen import EXACT, Errors, Worn, seen, told, worn

ARMS = {"stance": "hanging", "flexion_extension": "behind_head", "lateral_bending": "hanging"}
STANCE_S = 0.4


@dataclass(frozen=True)
class Wanted:
    """A cohort that is wanted.

    Attributes
    ----------
    plain : the control: exponentials (`laws.exponentials`), exact but for noise. rate_hz : frames
        a second. long_s : of each bend.
    """

    seed: int
    generator: str
    subjects: int
    plain: bool = False
    rate_hz: float = 50.0
    long_s: float = 4.0

    @property
    def errors(self) -> Errors:
        """Of markers and of what is told."""
        return EXACT if self.plain else Errors()

    @property
    def command(self) -> str:
        """That writes it."""
        return (
            f"python -m tests.generators.tracking --seed {self.seed} --generator {self.generator} "
            f"--subjects {self.subjects} --rate {self.rate_hz:g} --long {self.long_s:g}"
            f"{' --plain' * self.plain}"
        )


@dataclass(frozen=True, eq=False)
class Taken:
    """A trial of a person: who they were in it, with what markers, and what of these was seen."""

    kind: str
    person: Person
    motion: Motion
    markers: Worn
    places: Array


class Subject:
    """A person with markers, who can be asked for trials; each trial by itself, in any order."""

    def __init__(self, wanted: Wanted, number: int, errors: Errors | None = None) -> None:
        rng = np.random.default_rng([wanted.seed, number])
        self.wanted, self.number, self.name = wanted, number, f"s{number + 1:02d}"
        self.errors = wanted.errors if errors is None else errors
        self._motions: dict[str, tuple[Motion, np.random.Generator]] = {}
        self._male = number % 10 in (2, 5, 8)
        self._seeds = dict(zip(ARMS, rng.integers(2**32, size=3).tolist(), strict=True))
        self._drawing = int(rng.integers(2**32))
        self._plain = plain_curves(wanted.seed) if wanted.plain else None
        self.person = self._with("none")
        self.markers = worn(self.person, rng, self.errors)
        self.told = told(self.person, rng, self.errors)

    def with_errors(self, errors: Errors) -> "Subject":
        """The same person in the same motions, seen and told with other errors."""
        found = Subject(self.wanted, self.number, errors)
        found._motions = self._motions
        return found

    def _with(self, arms: str) -> Person:
        return drawn(np.random.default_rng(self._drawing), self._male, arms, self._plain)

    def taken(self, kind: str) -> Taken:
        """A trial."""
        person = self._with(ARMS[kind])
        if kind not in self._motions:
            rng = np.random.default_rng(self._seeds[kind])
            long_s = STANCE_S if kind == "stance" else self.wanted.long_s
            filmed = Filmed(self.wanted.rate_hz, long_s)
            self._motions[kind] = moved(person, kind, self.wanted.generator, rng, filmed), rng
        motion, rng = self._motions[kind]
        places = seen(motion, self.markers, deepcopy(rng), self.errors)
        return Taken(kind, person, motion, self.markers, places)


def cohort(wanted: Wanted, folder: Path) -> None:
    """Write all files of a cohort."""
    write(wanted, [Subject(wanted, number) for number in range(wanted.subjects)], folder)


def write(wanted: Wanted, subjects: Sequence[Subject], folder: Path) -> None:
    """The same of people that are there."""
    (folder / "hidden").mkdir(parents=True, exist_ok=True)
    rows: dict[str, list[Row]] = {name: [] for name in FILES}
    for subject in subjects:
        _subject(subject, folder, rows)
    for stem, columns in FILES.items():
        _csv(folder / f"{stem}.csv", columns, rows[stem])
    if wanted.plain:
        _csv(folder / "true_passive.csv", PASSIVE, true_passive(wanted.seed))
    (folder / "cohort.yaml").write_text(
        f"cohort: {folder.name}\n"
        f"title: Made-up people bending with markers on their backs ({wanted.generator})\n"
        f"source: >-\n  No measurement. {wanted.command}\n"
        f"made_up: true\nvertebrae: [{', '.join(BODIES)}]\ngravity: true\n"
    )


def _subject(subject: Subject, folder: Path, rows: dict[str, list[Row]]) -> None:
    """Rows and files of motion of a person."""
    name = subject.name
    for table, row in told_rows(name, subject.person, subject.told, subject.markers):
        rows[table].append(row)
    rows["hidden/truth"] += true_stiffness(name, subject.person)
    for kind, arms in ARMS.items():
        taken = subject.taken(kind)
        file = f"{name}_{kind}.trc"
        trc(folder / file, taken)
        trial: dict[str, Any] = {"trial": kind, "kind": kind, "file": file}
        rows["trials"].append({"specimen": name, **trial, "axes": "x z -y", "arms": arms})
        rows["truth_centres"] += true_places(name, kind, taken.person, taken.motion)


def _csv(path: Path, columns: Sequence[str], rows: Iterable[dict[str, Any]]) -> None:
    with path.open("w", newline="") as file:
        table = csv.DictWriter(file, columns, restval="", lineterminator="\n")
        table.writeheader()
        table.writerows(rows)


def trc(path: Path, taken: Taken) -> None:
    """As motion capture writes it: z up, mm; the lab's x is forwards and its y to the left."""
    markers, time_s, places = taken.markers, taken.motion.time_s, taken.places
    rate = 1.0 / (time_s[1] - time_s[0])
    count, frames = len(markers.names), len(time_s)
    lines = [
        f"PathFileType\t4\t(X/Y/Z)\t{path.name}",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\t"
        "OrigDataStartFrame\tOrigNumFrames",
        f"{rate:g}\t{rate:g}\t{frames}\t{count}\tmm\t{rate:g}\t1\t{frames}",
        "Frame#\tTime\t" + "\t\t\t".join(markers.names) + "\t\t",
        "\t\t" + "\t".join(f"X{k}\tY{k}\tZ{k}" for k in range(1, count + 1)),
        "",
    ]
    for frame in range(frames):
        cells = [str(frame + 1), f"{time_s[frame]:.4f}"]
        for x, y, z in 1e3 * places[frame]:
            cells += ["", "", ""] if np.isnan(x) else [f"{x:.2f}", f"{-z:.2f}", f"{y:.2f}"]
        lines.append("\t".join(cells))
    path.write_text("\n".join(lines) + "\n")
