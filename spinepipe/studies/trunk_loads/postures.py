"""From a row of `tasks.csv` to the rotations of the eight bodies and what acts on them.

The pelvis is S1; the trunk is T11, which stands for all from there up. What lies between them is
shared among the seven levels by the percentages of Ghezelbash 2016, section 2.6, made to sum to 1:
those of flexion about the axis of extension, those of lateral bending about both others (for axial
rotation the paper has none). Rows that give every body's rotation are taken as they are.

Where a row is silent about the pelvis: bending forwards it follows the lumbopelvic rhythm, which
was measured at the thorax (Tafazzol 2014); sideways it turns 2 deg as the trunk reaches 20
(section 2.6), and on in that proportion; in axial rotation it stands still.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.effects.contract import Array
from spinepipe.facts import number, numbers, several
from spinepipe.motion.joint_tables import USUAL_SHARES, ratio_sets
from spinepipe.muscles.passive_tissue import LUMBAR_FLEXION_DEG
from spinepipe.muscles.task import Exertion, Hands, Task
from spinepipe.muscles.trunk import BODIES
from spinepipe.studies.trunk_loads.forms import FORCE, HANDS, PUSH_N, PUSH_NM, TASKS, UPRIGHT, turn
from spinepipe.studies.trunk_loads.settings import TrunkAngle
from spinepipe.units import DEG_PER_RAD, MM_PER_M, ROTATIONS

_SHARES = ratio_sets()[USUAL_SHARES][: len(BODIES) - 1]


def shares(axis: str) -> Array:
    """(7,) share of each level in the rotation between pelvis and trunk, L5S1 to T11T12."""
    found: Array = _SHARES[:, ROTATIONS.index(axis)]
    return found / found.sum()


FULL_FLEXION_DEG = LUMBAR_FLEXION_DEG / float(1.0 - shares("extension")[-1])
"""Of T11 against the pelvis: joints share it as they share any."""

_LARGEST = numbers(__name__, "largest_bend")
THORAX_DEG = _LARGEST["thorax"]

SEEN_AT_THORAX = (_LARGEST["pelvis"] + _LARGEST["lumbar"]) / THORAX_DEG
"""Rotation of pelvis and lumbar spine over that measured at the thorax; the rest is bending of the
thorax and where the sensor sat."""

_EARLY, _LATE = several(__name__, "lumbar_over_pelvis").values()
"""Rotation of the thorax, deg, and lumbar over pelvic rotation about it."""

_SACRUM_DEG, _TRUNK_DEG = several(__name__, "sacrum_over_trunk_bend")[""]
PELVIS_OF_BEND = _SACRUM_DEG / _TRUNK_DEG
"""Lateral rotation of the sacrum over that of the trunk."""

Row = Mapping[Any, Any]
"""Cells of a row of tasks by column; empty ones are NaN."""

USUAL_STRESS_MPA = number(__name__, "usual_muscle_stress")
USUAL_VERTEBRA = "T9"


def between(pelvis: float, trunk: float, axis: str) -> Array:
    """(8,) rotation of each body, S1 to T11, in the unit of the two that are given.

    Linear in both, so that `between(x, 0, axis)` is what a pelvis adds that turns by x more while
    the trunk stays where it is.
    """
    passed = np.concatenate([[0.0], np.cumsum(shares(axis))])
    found: Array = pelvis + (trunk - pelvis) * passed
    return found


def leaning_deg(pelvis: float, trunk: float, flexion: float) -> Array:
    """(8,) deg, extension of each body that a sample adds to a posture.

    Nobody bends farther than ligaments let them: what pelvis and trunk would add beyond full
    flexion of the joints between them, the pelvis turns less.

    Parameters
    ----------
    pelvis, trunk : deg, extension that is drawn. flexion : deg, of the trunk against the pelvis,
        without it.
    """
    room = max(FULL_FLEXION_DEG - flexion, 0.0)
    return between(pelvis - max(pelvis - trunk - room, 0.0), trunk, "extension")


def rhythm(trunk_deg: float, means: TrunkAngle) -> tuple[float, float]:
    """Rotations of pelvis and T11, deg, of a trunk that bends forwards (negative) with its pelvis.

    The pelvis' share is linear between the two ratios that Tafazzol's abstract has, and on beyond.

    Parameters
    ----------
    means : measured_at_thorax, T11 turns less, as much as pelvis and lumbar spine together (46.8
        of 50 deg); rotation_of_t11, T11 turns by this much, and the thorax would be measured
        to have turned more.
    """
    thorax = trunk_deg if means == "measured_at_thorax" else trunk_deg / SEEN_AT_THORAX
    t11 = SEEN_AT_THORAX * thorax
    (low, at_low), (high, at_high) = ((at, 1.0 / (1.0 + ratio)) for at, ratio in (_EARLY, _LATE))
    share = at_low + (at_high - at_low) * (abs(thorax) - low) / (high - low)
    return share * t11, t11


def _ends(row: Row, axis: str, means: TrunkAngle) -> tuple[float, float]:
    """Rotations of pelvis and T11 about an axis, deg; with the pelvis given the trunk is T11."""
    trunk, pelvis = (_number(row, turn(what, axis), np.nan) for what in ("trunk", "pelvis"))
    if np.isnan(trunk):
        return 0.0, 0.0
    if not np.isnan(pelvis):
        return pelvis, trunk
    if axis == "extension":
        return rhythm(trunk, means)
    return (PELVIS_OF_BEND * trunk if axis == "right_bending" else 0.0), trunk


def turned_deg(row: Row, means: TrunkAngle) -> Array:
    """(8, 3) deg, rotations of the bodies, S1 to T11, about the three axes."""
    found = np.zeros((len(BODIES), len(ROTATIONS)))
    for column, axis in enumerate(ROTATIONS):
        each = np.array([_number(row, turn(body, axis), np.nan) for body in BODIES])
        given = not np.isnan(each).any()
        found[:, column] = each if given else between(*_ends(row, axis, means), axis)
    return found


def task_of(row: Row, means: TrunkAngle) -> Task:
    """The task of a row of `tasks.csv`; `checks` has seen to it that it is sound.

    Parameters
    ----------
    means : what the rotation of the trunk means where the pelvis follows the rhythm.
    """
    number = _number(row, "number", np.nan)
    at = np.array([_number(row, name, np.nan) for name in HANDS]) / MM_PER_M
    # moments of the file are about z, x and y; those of the task about x, y and z
    extension, right_bending, left_rotation = (_number(row, name, 0.0) for name in PUSH_NM)
    return Task(
        name=str(row["task"]),
        number=None if np.isnan(number) else int(number),
        turned=turned_deg(row, means) / DEG_PER_RAD,
        from_upright=_word(row, "counted_from") == UPRIGHT,
        hands=Hands(
            _number(row, "hand_load_kg", 0.0),
            None if np.isnan(at).any() else at,
            _word(row, "holding"),
        ),
        exertion=Exertion(
            force=np.array([_number(row, name, 0.0) for name in PUSH_N]),
            moment=np.array([right_bending, left_rotation, extension]),
            at=USUAL_VERTEBRA if pd.isna(row["applied_at"]) else str(row["applied_at"]),
            as_force=_word(row, "applied_as") == FORCE,
        ),
        pressure_pa=1e3 * _number(row, "intra_abdominal_pressure_kpa", 0.0),
        stress_pa=1e6 * _number(row, "largest_stress_mpa", USUAL_STRESS_MPA),
        tone=_word(row, "tone"),
        tone_share=_number(row, "tone_percent", 0.0) / 100.0,
    )


def read_tasks(cohort: Cohort, means: TrunkAngle) -> dict[str, Task]:
    """The tasks of a cohort by name, in the order of its file."""
    rows = cohort.further["tasks"].to_dict("records") if "tasks" in cohort.further else []
    return {str(row["task"]): task_of(row, means) for row in rows}


def _number(row: Row, name: str, empty: float) -> float:
    return empty if pd.isna(row[name]) else float(row[name])


def _word(row: Row, name: str) -> Any:
    """One of the words of a column."""
    return TASKS.column(name).allowed[0] if pd.isna(row[name]) else str(row[name])
