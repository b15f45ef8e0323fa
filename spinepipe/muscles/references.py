"""Pressures measured in a volunteer's disc, each with its source and how sure it is.

A status is confirmed (read where it stands), derived (worked out from such), or from_memory (not
found in any text at hand: shown, never used to accept or reject a result).
"""

import csv
from dataclasses import dataclass
from functools import cache
from importlib.resources import files


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
    status: str
    note: str


@cache
def measured_pressures() -> tuple[MeasuredPressure, ...]:
    """Pressures measured in L4L5 (Wilke 1999, 2001), several for a task where series differ."""
    text = files("spinepipe.muscles").joinpath("measured_pressures.csv").read_text(encoding="utf-8")
    return tuple(
        MeasuredPressure(
            int(row["task"]) if row["task"] else None,
            row["posture"],
            row["condition"],
            _number(row["pressure_mpa"]),
            _number(row["low_mpa"]),
            _number(row["high_mpa"]),
            row["source"],
            row["status"],
            row["note"],
        )
        for row in csv.DictReader(text.splitlines())
    )


def _number(cell: str) -> float | None:
    return float(cell) if cell else None
