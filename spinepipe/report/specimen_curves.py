"""What was measured of a specimen: load over motion, joint by joint, cycle by cycle."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from spinepipe.cohort import Cohort
from spinepipe.cohort.load_response import LoadedCycle, joint_loads
from spinepipe.cohort.measured import MeasuredCycle
from spinepipe.effects.contract import Array
from spinepipe.report.panels import explain_marks, side_by_side
from spinepipe.report.specimen import SpecimenView
from spinepipe.report.style import BLUE, GREEN, GREY, PURPLE, SKY, VERMILLION, blank
from spinepipe.report.words import AXIS, POSITIVE, SIGNS, case, short
from spinepipe.units import (
    COORDINATE_UNITS,
    COORDINATES,
    LOAD_UNITS,
    ROTATIONS,
    TRANSLATIONS,
    from_si,
)

_COLORS = (BLUE, VERMILLION, GREEN, PURPLE, SKY, GREY)
_MARKERS = ("o", "s", "^", "D", "v", "P")
_ACROSS, _ROW_MM, _AROUND_MM = 4, 38.0, 22.0


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


def curve_figures(cohort: Cohort, curves: Sequence[MeasuredCurve]) -> Iterator[tuple[str, Figure]]:
    """Of each coordinate its name in words and a figure with a panel of each joint, from above."""
    for coordinate in COORDINATES:
        own = [curve for curve in curves if curve.coordinate == coordinate]
        if own:
            yield AXIS[coordinate], _figure(cohort, coordinate, own)


def _figure(cohort: Cohort, coordinate: str, curves: Sequence[MeasuredCurve]) -> Figure:
    joints = sorted({curve.joint for curve in curves}, reverse=True)
    tests = list(dict.fromkeys(curve.test for curve in curves))
    last = {test: max(c.cycle for c in curves if c.test == test) for test in tests}
    rows = -(-len(joints) // _ACROSS)
    figure = blank(rows * _ROW_MM + _AROUND_MM)
    panels = side_by_side(figure, len(joints), _ACROSS, sharex=True, sharey=True)
    sides = list(pairwise(cohort.vertebrae))
    for panel, joint in zip(panels, joints, strict=True):
        lower, upper = sides[joint]
        _zero_lines(panel)
        panel.set_title(f"{upper}–{lower}")
        for curve in (c for c in curves if c.joint == joint):
            k = tests.index(curve.test)
            there = np.isfinite(curve.motion)
            panel.plot(
                curve.motion[there],
                curve.load[there],
                color=_COLORS[k % len(_COLORS)],
                marker=_MARKERS[k % len(_MARKERS)],
                ms=2.2,
                mew=0.0,
                alpha=1.0 if curve.cycle == last[curve.test] else 0.4,
            )
    for panel in panels[::_ACROSS]:
        panel.set_ylabel(f"load ({LOAD_UNITS[coordinate]})")
    for panel in panels[-_ACROSS:]:
        panel.tick_params(labelbottom=True)
        panel.set_xlabel(f"{POSITIVE[coordinate]} ({SIGNS[COORDINATE_UNITS[coordinate]]})")
    handles = [
        Line2D(
            [], [], color=_COLORS[k % 6], marker=_MARKERS[k % 6], ms=3.0, label=short(case(test))
        )
        for k, test in enumerate(tests)
    ]
    cycles = "Faint: cycles before the last." if any(n > 1 for n in last.values()) else ""
    explain_marks(figure, handles, cycles, _ACROSS)
    return figure


def _zero_lines(panel: Axes) -> None:
    panel.axhline(0.0, color=GREY, lw=0.4)
    panel.axvline(0.0, color=GREY, lw=0.4)
