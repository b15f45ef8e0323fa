"""What was measured of a specimen: load over motion, joint by joint, cycle by cycle."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.cohort.load_response import LoadedCycle, joint_loads
from spinepipe.cohort.measured import MeasuredCycle
from spinepipe.effects.contract import Array
from spinepipe.report.forms.chart import Chart, Key
from spinepipe.report.forms.curves import Curves
from spinepipe.report.forms.look import SEVERAL
from spinepipe.report.specimen import SpecimenView
from spinepipe.report.words import AXIS, POSITIVE, SIGNS, case, short
from spinepipe.units import (
    COORDINATE_UNITS,
    COORDINATES,
    LOAD_UNITS,
    ROTATIONS,
    TRANSLATIONS,
    from_si,
)


@dataclass(frozen=True, eq=False)
class MeasuredCurve:
    """One joint in one cycle of one test.

    Attributes
    ----------
    joint : its number from below. coordinate : one of `COORDINATES`.
    motion, load : (T,) mm or deg, N or N m, by load step; motion NaN where it was not read.
    """

    test: str
    cycle: int
    joint: int
    coordinate: str
    motion: Array
    load: Array


def main_coordinate(cycle: MeasuredCycle) -> str | None:
    """The coordinate to look at in a test: that which the largest moment drives.

    A force turns joints by its lever arms: there it is the rotation that moves most.
    """
    turned = np.nansum(np.abs(cycle.readings[..., len(TRANSLATIONS) :]), axis=(0, 1))
    if cycle.is_pushed and turned.any():
        return ROTATIONS[int(np.argmax(turned))]
    return cycle.loaded


def measured_curves(view: SpecimenView) -> Iterator[MeasuredCurve]:
    """Of each cycle the main coordinate, of each joint where it was read.

    Loads are those that the joints carry in the neutral pose. Cycles in which a rig holds a joint
    have none: what the rig bears is not part of the loads.
    """
    for one in view.tested:
        coordinate = main_coordinate(one)
        if coordinate is None or one.case.steps[0].supports:
            continue
        number = COORDINATES.index(coordinate)
        loads = joint_loads(view.frames, one.case)
        read = LoadedCycle(view.specimen, one.case, view.frames, loads, one.readings).from_rest
        for joint, motion in enumerate(from_si(read)[:, :, number].T):
            if np.isfinite(motion).sum() > 1:
                yield MeasuredCurve(
                    *(one.case.test, one.case.cycle, joint, coordinate),
                    motion,
                    loads[:, joint, number],
                )


def curve_charts(cohort: Cohort, curves: Sequence[MeasuredCurve]) -> list[Chart]:
    """Of each coordinate a figure with a panel of each joint, from above."""
    own = [[one for one in curves if one.coordinate == name] for name in COORDINATES]
    return [_chart(cohort, name, part) for name, part in zip(COORDINATES, own, strict=True) if part]


def _chart(cohort: Cohort, coordinate: str, curves: Sequence[MeasuredCurve]) -> Chart:
    tests = list(dict.fromkeys(curve.test for curve in curves))
    looks = {test: SEVERAL[number % len(SEVERAL)] for number, test in enumerate(tests)}
    frames = []
    for curve in curves:
        there = np.isfinite(curve.motion)
        frame = pd.DataFrame({"x": curve.motion[there], "y": curve.load[there]})
        frames.append(frame.assign(joint=curve.joint, series=curve.test, part=curve.cycle))
    every = pd.concat(frames)
    ends = [
        (float(every[axis].min()), float(every[axis].max()))
        if every[axis].min() < every[axis].max()
        else None
        for axis in ("x", "y")
    ]
    x, y = (None if end is None else _with_room(*end) for end in ends)
    unit = SIGNS[COORDINATE_UNITS[coordinate]]
    names = [f"{upper}–{lower}" for lower, upper in pairwise(cohort.vertebrae)]
    panels = [
        Curves(
            title=names[joint],
            x_label=f"{POSITIVE[coordinate]} ({unit})",
            y_label=f"load ({LOAD_UNITS[coordinate]})",
            frame=every[every["joint"] == joint],
            looks=looks,
            x_limits=x,
            y_limits=y,
            width=226.0,
            high=180.0,
        )
        for joint in sorted(set(every["joint"]), reverse=True)
    ]
    keys = [Key(look, short(case(test)), as_line=True) for test, look in looks.items()]
    caption = "Load that a joint carries in the neutral pose over its measured motion, all cycles."
    return Chart(f"Measured {AXIS[coordinate].lower()}", panels, caption, keys)


def _with_room(low: float, high: float) -> tuple[float, float]:
    room = 0.05 * (high - low)
    return low - room, high + room
