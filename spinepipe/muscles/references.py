"""Facts that postures and loads rest on, each with its source and how sure it is.

A status is confirmed (read where it stands), derived (worked out from such), or from_memory (not
found in any text at hand: shown, never used to accept or reject a result).
"""

import csv
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any, Literal, get_args

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.muscles.masses import ARM, Segment
from spinepipe.muscles.trunk import LEVELS
from spinepipe.units import DEG_PER_RAD

Status = Literal["confirmed", "derived", "from_memory"]
Direction = Literal["flexion", "lateral"]

STATUSES: tuple[Status, ...] = get_args(Status)


@dataclass(frozen=True)
class MeasuredPressure:
    """Pressure in the disc L4L5 of one volunteer, MPa.

    Attributes
    ----------
    task : of Ghezelbash 2016 Table 1; None for other postures.
    value : None where a range alone is given, `low` to `high`.
    """

    task: int | None
    posture: str
    condition: str
    value: float | None
    low: float | None
    high: float | None
    source: str
    status: Status
    note: str


@dataclass(frozen=True)
class LoadFact:
    """Something known of where a task's load is.

    Attributes
    ----------
    quantity : mass, anterior, lateral, upper_arm_flexion, elbow_flexion.
    unit : kg, mm or deg. from_where : what it is counted from.
    """

    task: int
    quantity: str
    value: float
    unit: str
    from_where: str
    source: str
    status: Status
    note: str


@cache
def measured_pressures() -> tuple[MeasuredPressure, ...]:
    """Pressures measured in L4L5 (Wilke 1999, 2001), several for a task where series differ."""
    return tuple(
        MeasuredPressure(
            int(row["task"]) if row["task"] else None,
            row["posture"],
            row["condition"],
            _number(row["pressure_mpa"]),
            _number(row["low_mpa"]),
            _number(row["high_mpa"]),
            row["source"],
            _status(row["status"]),
            row["note"],
        )
        for row in _rows("measured_pressures.csv")
    )


@cache
def load_facts() -> tuple[LoadFact, ...]:
    """What is known of loads and arms in tasks 2, 3, 4, 6 and 8."""
    return tuple(
        LoadFact(
            int(row["task"]),
            row["quantity"],
            float(row["value"]),
            row["unit"],
            row["from"],
            row["source"],
            _status(row["status"]),
            row["note"],
        )
        for row in _rows("load_positions.csv")
    )


def largest_trunk_flexion() -> float:
    """Flexion of the thorax up to which the lumbopelvic rhythm was measured, rad."""
    return float(_facts()["lumbopelvic"]["thorax_peak_deg"]) / DEG_PER_RAD


def pelvis_flexion(trunk_flexion: float) -> float:
    """How far the pelvis has turned when the trunk is flexed so far, rad, both flexion positive.

    The share of the pelvis in what pelvis and lumbar spine turn rises in a straight line from the
    first thirty degrees to the last; derived, for nobody printed the curve.

    Raises
    ------
    ValueError
        Outside 0 to the measured peak, 121 deg.
    """
    facts, trunk_deg = _facts()["lumbopelvic"], trunk_flexion * DEG_PER_RAD
    if not 0.0 <= trunk_deg <= facts["thorax_peak_deg"] + 1e-9:
        raise ValueError(
            f"the lumbopelvic rhythm was measured for trunk flexion from 0 to "
            f"{facts['thorax_peak_deg']:g} deg, not {trunk_deg:.1f}"
        )
    share = facts["pelvis_share_at_15_deg"] + facts["pelvis_share_per_deg"] * (trunk_deg - 15.0)
    return float(share * facts["pelvis_and_lumbar_over_thorax"]) * trunk_flexion


def sacrum_lateral(trunk_lateral: float) -> float:
    """How far the sacrum bends sideways with the trunk, rad; 2 deg at 20, in proportion."""
    facts = _facts()["sacrum"]
    return float(facts["lateral_deg"] / facts["at_trunk_lateral_deg"]) * trunk_lateral


def printed_percents(direction: Direction) -> Mapping[str, float]:
    """Share of each joint in what T11 turns against S1, per cent as printed, by level."""
    found: Mapping[str, float] = _facts()["partition"][f"{direction}_percent"]
    return found


def joint_shares(direction: Direction) -> Array:
    """(7,) the same as shares that sum to 1, caudal to cranial."""
    printed = np.array([printed_percents(direction)[level] for level in LEVELS])
    found: Array = printed / printed.sum()
    return found


def parted(trunk: float, pelvis: float, direction: Direction) -> Array:
    """(8,) rotation of each body when T11 has turned by `trunk` and S1 by `pelvis`.

    Caudal to cranial, in the unit and with the sign of what is given.
    """
    turned = np.concatenate([[0.0], np.cumsum(joint_shares(direction))])
    found: Array = pelvis + turned * (trunk - pelvis)
    return found


def hand_below_shoulder(
    arm_length: float, upper_arm_flexion: float, elbow_flexion: float, trunk_flexion: float = 0.0
) -> Array:
    """(3,) m from the shoulder to the middle of the hand, for an arm in a sagittal plane.

    Parameters
    ----------
    arm_length : m, of the straight arm.
    upper_arm_flexion : rad against the thorax; nought hangs along it.
    elbow_flexion : rad; nought is straight.
    trunk_flexion : rad of the thorax against ground.
    """
    upper = _upper_arm_share() * arm_length
    shoulder = upper_arm_flexion - trunk_flexion
    return upper * _hanging(shoulder) + (arm_length - upper) * _hanging(shoulder + elbow_flexion)


def _hanging(forwards: float) -> Array:
    """(3,) direction that hangs at nought and swings forwards, rad."""
    return np.array([np.sin(forwards), -np.cos(forwards), 0.0])


def _upper_arm_share() -> float:
    """Share of the upper arm in the arm to the middle of the hand, of a man."""
    upper, fore, hand = ARM
    return upper.length_percent / (upper.length_percent + fore.length_percent + _middle(hand))


def _middle(hand: Segment) -> float:
    return hand.centre["male"] * hand.length_percent


@cache
def _facts() -> Mapping[str, Any]:
    text = files("spinepipe.muscles").joinpath("references.toml").read_text(encoding="utf-8")
    return tomllib.loads(text)


def _rows(name: str) -> list[dict[str, str]]:
    text = files("spinepipe.muscles").joinpath(name).read_text(encoding="utf-8")
    return list(csv.DictReader(text.splitlines()))


def _number(cell: str) -> float | None:
    return float(cell) if cell else None


def _status(cell: str) -> Status:
    return next(status for status in STATUSES if status == cell)
