"""What rows of `tasks.csv` may have wrong beyond their form: posture, hands, pushes, muscles."""

from collections.abc import Hashable, Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd

from spinepipe.effects.contract import Array
from spinepipe.facts import number
from spinepipe.frames import rotation_zxy
from spinepipe.muscles.trunk import BODIES
from spinepipe.problems import InputProblem, one_of
from spinepipe.studies.trunk_loads.forms import FORCE, HANDS, PUSH_N, PUSH_NM, TASKS, turn
from spinepipe.studies.trunk_loads.postures import THORAX_DEG, Row, rhythm, turned_deg
from spinepipe.studies.trunk_loads.settings import TrunkAngle
from spinepipe.units import GRAVITY_M_S2, MM_PER_M, ROTATIONS

PUSHED = "applied_at"

MOST_EXTENSION_DEG = 40.0
SAME_DEG = 0.1
"""Rotations that are told twice agree to this."""

HEAVIEST_KG = 100.0
METRES_MM = 2.0
"""Hands that are no farther away than this, mm, are in metres."""

SHOULDERS_OF_HEIGHT = number(__name__, "shoulders_over_height")
"""Height of the shoulders above L5S1 over that of the person; a spine T1-S1 is no longer."""

REACH_M = 0.9
"""From between the shoulders to the hand: half their breadth and an arm, of a tall person."""

LARGEST_STRESS_MPA = 3.0

_TRUNK = turn("trunk", "extension")


@dataclass(frozen=True)
class _Row:
    """One row of tasks, and where it stands."""

    file: str
    line: int
    cells: Row

    def problem(self, column: str | None, found: str, allowed: str, remedy: str) -> InputProblem:
        named = f"task {self.cells['task']}: {found}"
        return InputProblem(self.file, self.line, column, named, allowed, remedy)

    def given(self, column: str) -> bool:
        return not pd.isna(self.cells[column])

    def number(self, column: str) -> float:
        """A number, nought where the cell is empty."""
        return float(self.cells[column]) if self.given(column) else 0.0

    def word(self, column: str) -> str:
        """One of the words of a column, the first where the cell is empty."""
        return str(self.cells[column]) if self.given(column) else TASKS.column(column).allowed[0]


def task_problems(
    file: str, rows: pd.DataFrame, tallest_m: float | None, means: TrunkAngle
) -> Iterator[InputProblem]:
    """Everything that is wrong with tasks; the reader sees to it that names occur once.

    Parameters
    ----------
    tallest_m : height of the tallest subject, for whom hands must be within reach.
    means : as the study reads the rotation of the trunk.
    """
    first: dict[tuple[Hashable, ...], str] = {}
    for line, cells in zip(rows.index.tolist(), rows.to_dict("records"), strict=True):
        row = _Row(file, int(line), cells)
        postures = list(_posture(row, means))
        yield from postures
        if (kg := row.number("hand_load_kg")) > HEAVIEST_KG:
            remedy = f"is it in N? write {kg / GRAVITY_M_S2:.1f}"
            yield row.problem("hand_load_kg", f"{kg:g} kg", f"{HEAVIEST_KG:g} at most", remedy)
        yield from _place_of_hands(row, means, None if postures else tallest_m)
        yield from _push(row)
        yield from _muscles(row)
        yield from _again(row, first)


def _posture(row: _Row, means: TrunkAngle) -> Iterator[InputProblem]:
    told = [turn(what, axis) for what in ("trunk", *BODIES, "pelvis") for axis in ROTATIONS]
    if not any(row.given(name) for name in told):
        allowed = "a rotation of the trunk, or of every body"
        yield row.problem(None, "no posture", allowed, "write trunk_extension_deg, 0 for upright")
        return
    for axis in ROTATIONS:
        bodies = row.given(turn(BODIES[0], axis))  # all of them or none, says the form
        trunk, pelvis = (row.given(turn(what, axis)) for what in ("trunk", "pelvis"))
        if bodies:
            yield from _sums(row, axis)
        elif pelvis and not trunk:
            found, allowed = "the pelvis turns and nothing is said of the trunk", "both"
            remedy = "write the trunk's rotation too, 0 where it stays upright"
            yield row.problem(turn("trunk", axis), found, allowed, remedy)
        elif axis == "extension" and trunk:
            yield from _bend(row, pelvis, means)


def _sums(row: _Row, axis: str) -> Iterator[InputProblem]:
    """Rotations of all bodies beside those of the trunk and the pelvis."""
    for what, body in (("trunk", BODIES[-1]), ("pelvis", BODIES[0])):
        column, said = turn(what, axis), row.number(turn(what, axis))
        by_body = row.number(turn(body, axis))
        if row.given(column) and abs(said - by_body) > SAME_DEG:
            found = f"{said:g}, while the bodies come to {by_body:g} at {body}"
            remedy = f"leave {column} empty, or correct the rotations of the bodies"
            yield row.problem(column, found, f"{by_body:g}, to {SAME_DEG:g} deg", remedy)


def _bend(row: _Row, pelvis: bool, means: TrunkAngle) -> Iterator[InputProblem]:
    """Bending forwards and backwards."""
    column = turn("trunk", "extension")
    trunk = row.number(column)
    if trunk > MOST_EXTENSION_DEG:
        remedy = f"is it flexion? write {-trunk:g}: extension is positive"
        yield row.problem(column, f"{trunk:g} backwards", f"{MOST_EXTENSION_DEG:g} at most", remedy)
    elif trunk > 0.0 and not pelvis:
        found = f"the trunk {trunk:g} deg backwards and no rotation of the pelvis"
        allowed = "the pelvis too: its usual rotation is known for bending forwards alone"
        remedy = "write the pelvis' rotation, 0 where it stands still"
        yield row.problem(turn("pelvis", "extension"), found, allowed, remedy)
    elif not pelvis and rhythm(trunk, means)[1] < rhythm(-THORAX_DEG, "measured_at_thorax")[1]:
        found = f"{-trunk:g} deg forwards and no rotation of the pelvis"
        allowed = f"the pelvis too: it was measured up to {THORAX_DEG:g} deg of the thorax"
        remedy = "write the pelvis' rotation"
        yield row.problem(turn("pelvis", "extension"), found, allowed, remedy)


def _place_of_hands(
    row: _Row, means: TrunkAngle, tallest_m: float | None
) -> Iterator[InputProblem]:
    if not row.given(HANDS[0]):  # all three or none, says the form
        return
    place = np.array([row.number(name) for name in HANDS])
    if 0.0 < np.abs(place).max() <= METRES_MM:
        found = f"hands {np.abs(place).max():g} mm from L5S1"
        remedy = "is it in m? multiply by 1000"
        yield row.problem(HANDS[int(np.abs(place).argmax())], found, "mm", remedy)
    elif tallest_m is not None:
        apart = _from_shoulders(row.cells, place, means, tallest_m)
        beyond_mm = MM_PER_M * (float(np.linalg.norm(apart)) - REACH_M)
        if beyond_mm > 0.0:
            found = (
                f"hands {beyond_mm:.0f} mm beyond the reach of the tallest, {tallest_m:g} m: "
                f"{np.linalg.norm(apart):.2f} m from the shoulders"
            )
            nearer = f"bring them {beyond_mm:.0f} mm nearer; they count from the centre of L5S1"
            bent = _posture_that_reaches(row.cells, place, means, tallest_m)
            remedy = nearer if bent is None else f"write {_TRUNK} {bent:g}, or {nearer}"
            farthest = HANDS[int(np.abs(apart).argmax())]
            yield row.problem(farthest, found, f"{REACH_M:g} m at most, an arm's reach", remedy)


def _from_shoulders(cells: Row, place: Array, means: TrunkAngle, tallest_m: float) -> Array:
    """(3,) m from between the shoulders to hands at (3,) mm from L5S1."""
    leaning = rotation_zxy(*np.deg2rad(turned_deg(cells, means)[-1]).tolist())
    shoulders = leaning @ np.array([0.0, SHOULDERS_OF_HEIGHT * tallest_m, 0.0])
    found: Array = place / MM_PER_M - shoulders
    return found


def _posture_that_reaches(
    cells: Row, place: Array, means: TrunkAngle, tallest_m: float
) -> float | None:
    """Extension of the trunk, whole degrees, nearest to that of a task, in which hands are within
    reach; None where there is none, or every body's rotation is told."""
    now = cells[_TRUNK]
    if pd.isna(now):
        return None
    angles = np.arange(-np.floor(THORAX_DEG), MOST_EXTENSION_DEG)
    for angle in sorted(angles.tolist(), key=lambda angle: abs(angle - float(now))):
        apart = _from_shoulders({**cells, _TRUNK: angle}, place, means, tallest_m)
        if np.linalg.norm(apart) <= REACH_M:
            return float(angle)
    return None


def _push(row: _Row) -> Iterator[InputProblem]:
    pushes = [name for name in (*PUSH_N, *PUSH_NM) if row.number(name) != 0.0]
    if pushes and not row.given(PUSHED):
        allowed, remedy = one_of(TASKS.column(PUSHED).allowed), "write the vertebra that is pushed"
        yield row.problem(PUSHED, f"{pushes[0]} and no vertebra", allowed, remedy)
    bends = any(row.number(name) != 0.0 for name in PUSH_NM[:2])
    if row.word("applied_as") == FORCE and not bends:
        found = "a force that makes a moment, and no moment"
        allowed = f"{PUSH_NM[0]} or {PUSH_NM[1]} beside it"
        yield row.problem("applied_as", found, allowed, "write the moment, or empty the cell")


def _muscles(row: _Row) -> Iterator[InputProblem]:
    stress = row.number("largest_stress_mpa")
    if row.given("largest_stress_mpa") and not 0.0 < stress <= LARGEST_STRESS_MPA:
        remedy = "correct it, or leave it empty for 0.6"
        if 0.0 < stress / 100.0 <= LARGEST_STRESS_MPA:
            remedy = f"is it in N/cm2? write {stress / 100.0:g}"
        allowed = f"above 0 and at most {LARGEST_STRESS_MPA:g}; 0.6 to 1.0 is usual"
        yield row.problem("largest_stress_mpa", f"{stress:g} MPa", allowed, remedy)
    stated, percent = row.word("tone") == "stated", row.given("tone_percent")
    if percent and not stated:
        found = f"{row.number('tone_percent'):g} % and tone {row.word('tone')}"
        remedy = "write stated under tone, or empty the cell"
        yield row.problem("tone_percent", found, "a percentage with tone stated alone", remedy)
    elif stated and not percent:
        remedy = "write the least activation, or tone none"
        yield row.problem("tone_percent", "tone stated and no percentage", "0 to 100", remedy)


def _again(row: _Row, first: dict[tuple[Hashable, ...], str]) -> Iterator[InputProblem]:
    """Another row that says the same under another name."""
    name = str(row.cells["task"])
    said = tuple(
        None if pd.isna(row.cells[column]) else row.cells[column]
        for column in TASKS.names
        if column != "task"
    )
    other = first.setdefault(said, name)
    if other != name:
        allowed = "each task once"
        yield row.problem(None, f"the same as task {other}", allowed, "delete or correct one")
