"""The tables ``load_displacement`` and ``helical_axes``: a row of one joint in one cycle.

Rows are made here, and the two of one curve, measured and simulated, are read side by side.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from spinepipe.effects.contract import Array
from spinepipe.experiment.double_sigmoid import FittedNeutralZone, Zone, neutral_zone
from spinepipe.experiment.loop import Loop, Measure, RotationErrors, stiffness_interval
from spinepipe.experiment.screw import SMALLEST_ANGLE, derivatives, screw_between
from spinepipe.schema import Table
from spinepipe.status import Status, joined
from spinepipe.studies.cohort_stiffness.tables import (
    BEYOND,
    DIRECTION,
    HELICAL_AXES,
    LOAD_DISPLACEMENT,
    MEASURED,
    NOT_READ,
    NOWHERE,
    SIMULATED,
    SMALL,
    UPPER_HALF,
    WHOLE,
)
from spinepipe.units import COORDINATES, DEG_PER_RAD, MM_PER_M

Row = dict[str, Any]

CURVE_KEY = ["specimen", "joint", "test", "cycle"]
"""Columns that name a curve, measured or simulated."""

SIDES = {1: "positive", -1: "negative"}

NO_UNLOADING = "no unloading was read: no hysteresis area"
NOT_CLOSED = "the loop is not closed: no hysteresis area"
ONE_SIDE = "loaded to one side: no neutral zone"
ONE_WAY = "the load passes zero in one direction only: no gap there"
TWO_ZEROS = "two tests, each with its own zero, joined there"
MANY = "the load goes up and down several times in this cycle: number its cycles in loads.csv"
NO_ELASTIC = "fewer than two loads in the elastic zone of the {side} side"
AGAINST = "moves against the {side} moment: no stiffness there"


def empty(table: Table) -> Row:
    """A row without numbers."""
    return {column.name: None for column in table.columns if column.nullable}


@dataclass(frozen=True)
class LoopReading:
    """Rotation of one joint in one cycle, and what is uncertain of it.

    Attributes
    ----------
    sd : rad, of one reading, for the question whether a curve is bent; None where not declared.
    spread : for intervals; None where nothing is known.
    definition : of the neutral zone. below : N m/rad, the stiffness of ``threshold``.
    """

    loop: Loop
    spread: RotationErrors | None
    sd: float | None
    definition: str = "double_sigmoid"
    below: float | None = None


def displacement_row(seen: LoopReading) -> Row:
    """What is read off a curve of two steps at least; without key and coordinate."""
    loop = seen.loop
    row = empty(LOAD_DISPLACEMENT) | {
        "readings": len(loop.load),
        "least_load_nm": float(loop.load.min()),
        "largest_load_nm": float(loop.load.max()),
        "neutral_zone": Zone.NOT_READ.value,
        "elastic_zone": NOWHERE,
        "status": Status.CONVERGED.value,
    }
    if not loop.goes_round_once:
        return row | {"status": Status.REFUSED.value, "message": MANY}
    row |= _cells(seen, "range_of_motion", "deg", loop.range_of_motion(), DEG_PER_RAD)
    zones, found, why = _zones(seen)
    gap = loop.gap() if seen.definition == "at_zero_load" and found is not Zone.ONE_SIDE else None
    if gap is not None:  # of no load, so that elastic zones do not begin at its ends
        zones, found, why = [], Zone.FOUND, ""
        row |= _cells(seen, "neutral_zone", "deg", gap, DEG_PER_RAD)
        row |= {"neutral_zone_from_nm": 0.0, "neutral_zone_to_nm": 0.0}
    row["neutral_zone"] = found.value
    row |= _zone_cells(seen, zones)
    elastic, lost = _elastic_cells(seen, zones)
    row |= elastic
    lacking = why
    if loop.closed:
        row |= _cells(seen, "hysteresis_area", "j", loop.area(), 1.0)
    else:
        lacking = joined(lacking, NOT_CLOSED if loop.unloaded else NO_UNLOADING)
    return row | {"message": joined(lacking, lost)}


def _way(seen: LoopReading, measure: Measure) -> float | None:
    return None if seen.spread is None else seen.spread.way(measure)


def _cells(seen: LoopReading, name: str, suffix: str, measure: Measure, unit: float) -> Row:
    """A number and the ends of its interval, ``unit`` times each."""
    way = _way(seen, measure)
    ends = (None, None) if way is None else (measure.value - way, measure.value + way)
    low, high = (None if end is None else unit * end for end in ends)
    names = (f"{name}_{suffix}", f"{name}_low_{suffix}", f"{name}_high_{suffix}")
    return dict(zip(names, (unit * measure.value, low, high), strict=True))


def _stiffness_cells(seen: LoopReading, name: str, compliance: Measure) -> Row:
    """Stiffness of a compliance and the ends of its interval."""
    numbers = stiffness_interval(compliance, _way(seen, compliance))
    names = (f"{name}_{part}nm_per_rad" for part in ("", "low_", "high_"))
    return dict(zip(names, numbers, strict=True))


def _zones(seen: LoopReading) -> tuple[list[FittedNeutralZone], Zone, str]:
    """Neutral zones of each direction, told for the whole loop, or why there is none."""
    loop = seen.loop
    if not loop.two_sided:
        return [], Zone.ONE_SIDE, ONE_SIDE
    if seen.definition == "at_zero_load":
        return [], Zone.ONE_WAY, ONE_WAY
    zones, words = [], []
    for places in loop.curves():
        zone, found, why = neutral_zone(
            loop.load[places], loop.rotation[places], seen.sd, seen.below
        )
        words.append((found, why))
        if zone is not None:
            zones.append(_of_loop(zone, places, len(loop.load)))
    if zones:
        only = "" if len(zones) == len(words) else "neutral zone found in one direction only"
        return zones, Zone.FOUND, only
    return [], *words[0]


def _of_loop(zone: FittedNeutralZone, places: Any, steps: int) -> FittedNeutralZone:
    """A zone with weights by the rotations of the whole loop."""

    def whole(measure: Measure) -> Measure:
        weights = np.zeros(steps)
        np.add.at(weights, places, measure.weights)
        return Measure(measure.value, weights)

    return FittedNeutralZone(whole(zone.size), whole(zone.compliance), zone.ends)


def _mean(measures: Sequence[Measure]) -> Measure:
    weights = np.mean([one.weights for one in measures], axis=0)
    return Measure(float(np.mean([one.value for one in measures])), weights)


def _zone_cells(seen: LoopReading, zones: Sequence[FittedNeutralZone]) -> Row:
    if not zones:
        return {}
    size = _cells(seen, "neutral_zone", "deg", _mean([one.size for one in zones]), DEG_PER_RAD)
    low = size["neutral_zone_low_deg"]
    begins, ends = np.mean([one.ends for one in zones], axis=0)
    stiffness = _stiffness_cells(
        seen, "neutral_zone_stiffness", _mean([one.compliance for one in zones])
    )
    return {
        **size,
        "neutral_zone_low_deg": None if low is None else max(low, 0.0),
        "neutral_zone_from_nm": float(begins),
        "neutral_zone_to_nm": float(ends),
        **stiffness,
    }


def _elastic_cells(seen: LoopReading, zones: Sequence[FittedNeutralZone]) -> tuple[Row, str]:
    """Stiffness of both elastic zones, as far as their sides were loaded, and what is lost."""
    row: Row = {"elastic_zone": BEYOND if zones else UPPER_HALF}
    notes, found = [], False
    for side, name in SIDES.items():
        if not seen.loop.reached(side):
            continue
        ends = [one.ends[1 if side > 0 else 0] for one in zones]
        begins = float(np.mean(ends)) if ends else None
        slope = seen.loop.elastic_compliance(side, begins)
        if slope is None:
            notes.append(NO_ELASTIC.format(side=name))
            continue
        row |= _stiffness_cells(seen, f"elastic_zone_stiffness_{name}", slope)
        found = True
        if slope.value <= 0.0:
            notes.append(AGAINST.format(side=name))
    return row | ({} if found else {"elastic_zone": NOWHERE}), joined(*notes)


def axis_row(before: Array, after: Array, root: Array | None, free: Array | None) -> Row:
    """The helical axis between two poses (6,), NaN where not read; without key.

    Parameters
    ----------
    root : (12, k) coordinates before and after per independent error of SD 1; None: not known.
    free : (12, u) the same per unit of what nothing is known of.
    """
    row: Row = empty(HELICAL_AXES)
    both = np.concatenate([before, after])
    if not np.isfinite(both.reshape(2, 6)[:, 3:]).all():
        told = "a helical axis takes all three rotations"
        return row | {"status": NOT_READ, "message": told}
    placed = bool(np.isfinite(both).all())
    before, after = np.nan_to_num(before), np.nan_to_num(after)
    if not np.abs(after - before)[3:].any():
        return row | {"angle_deg": 0.0, "status": SMALL, "message": "the joint does not turn"}
    screw = screw_between(before, after)
    sds = _sds(before, after, root, free)
    row |= {"angle_deg": screw.angle * DEG_PER_RAD, "angle_sd_deg": sds[0]}
    if screw.angle < SMALLEST_ANGLE:
        told = f"turns by less than {SMALLEST_ANGLE * DEG_PER_RAD:g} deg: its axis would be noise"
        return row | {"status": SMALL, "message": told}
    for place, axis in enumerate(COORDINATES[:3]):
        row |= {
            f"direction_{axis}": float(screw.direction[place]),
            f"direction_{axis}_sd": sds[1 + place],
        }
    if not placed:
        told = "translations were not read: the axis has a direction and no place"
        return row | {"status": DIRECTION, "message": told}
    for place, axis in enumerate(COORDINATES[:3]):
        row |= {
            f"centre_{axis}_mm": float(screw.centre[place]) * MM_PER_M,
            f"centre_{axis}_sd_mm": sds[4 + place],
        }
    row |= {"along_mm": screw.shift * MM_PER_M, "along_sd_mm": sds[7]}
    return row | {"status": WHOLE, "message": ""}


_UNITS = np.array([DEG_PER_RAD, *[1.0] * 3, *[MM_PER_M] * 4])
_TRACES = np.array([0.1, *[1e-3] * 3, *[0.1] * 4])
"""deg and mm per e-fold of a stiffness: what moves less hangs on nothing unknown."""


def _sds(before: Array, after: Array, root: Array | None, free: Array | None) -> list[float | None]:
    """SD of each number of the screw, deg and mm; None where it is not known."""
    if root is None or free is None:
        return [None] * len(_UNITS)
    # First order: numbers of the screw by the coordinates, and these by their independent errors.
    by = derivatives(before, after) * _UNITS[:, None]
    sds = np.linalg.norm(by @ root, axis=1)
    loose = np.abs(by @ free).max(axis=1, initial=0.0) > _TRACES
    return [None if no else float(sd) for sd, no in zip(sds, loose, strict=True)]


def paired_curves(rows: pd.DataFrame, name: str, unit: str) -> pd.DataFrame:
    """One row per curve: a number measured and simulated, and the way to the ends of each.

    Parameters
    ----------
    rows : of ``load_displacement``. name : of the number, whose column ends in ``unit``.

    Returns
    -------
    Columns `CURVE_KEY`, ``measured``, ``simulated``, ``measured_way`` and ``simulated_way``; NaN
    where not known.
    """
    value = f"{name}_{unit}"
    told = rows[[*CURVE_KEY, "source"]].assign(
        number=rows[value].astype(float),
        way=0.5 * (rows[f"{name}_high_{unit}"].astype(float) - rows[f"{name}_low_{unit}"]),
    )
    sides = []
    for source in (MEASURED, SIMULATED):
        here = told[told["source"] == source].drop(columns="source")
        sides.append(here.rename(columns={"number": source, "way": f"{source}_way"}))
    return sides[0].merge(sides[1], on=CURVE_KEY, how="left")
