"""Cycles that do not come back to where they began: something slipped, drifted or crept."""

from collections import defaultdict
from collections.abc import Iterator, Sequence

import numpy as np

from spinepipe.cohort.cohort import Array, Cohort
from spinepipe.cohort.load_response import LoadResponse
from spinepipe.plausibility.score import CLEAR
from spinepipe.plausibility.warnings.warning import PlausibilityWarning, TableCell, first_row, warn
from spinepipe.units import COORDINATE_COLUMNS, COORDINATES, DISPLAY_PER_SI

OPEN = 0.03
"""Share of the range of the motion from which a cycle is open."""

SAME = 0.01
"""Share of the range of a load by which two loads are the same."""

Loop = tuple[Array, Array]
"""(T,) load, N m or N, and motion, deg or mm."""


def open_loops(
    cohort: Cohort, answers: Sequence[LoadResponse], sd: Array
) -> Iterator[PlausibilityWarning]:
    """One warning for each test and coordinate; ``sd`` (6,) mm and deg, of one reading."""
    of_joint: dict[tuple[str, int, str, int], list[Loop]] = defaultdict(list)
    for one in answers:
        number = COORDINATES.index(one.coordinate)
        load, motion = one.load, DISPLAY_PER_SI[number] * one.motion
        if cohort.zeroed_at_step_0:  # step 0, from which both are told, is no reading
            load, motion = np.append(0.0, load), np.append(0.0, motion)
        if len(load) > 2 and abs(load[-1] - load[0]) <= SAME * np.ptp(load):
            of_joint[one.test, number, one.specimen, one.joint].append((load, motion))
    told: dict[tuple[str, int], list[tuple[str, int, float]]] = defaultdict(list)
    for (test, number, specimen, joint), cycles in of_joint.items():
        left, drift = _opening(cycles)
        span = float(np.median([np.ptp(motion) for _, motion in cycles]))
        if abs(left) > max(CLEAR * np.sqrt(2.0) * sd[number], drift, OPEN * span):
            told[test, number].append((specimen, joint, left))
    for (test, number), places in told.items():
        specimen, joint, left = places[0]
        name = cohort.joint_names[joint]
        row = first_row(cohort, "motion", specimen=specimen, test=test, joint=name)
        yield warn(
            cohort,
            "loop_open",
            TableCell("motion", row, None),  # no fault of a column
            whose=[whose for whose, *_ in places],
            column=COORDINATE_COLUMNS[number],
            left=left,
            test=test,
            joint=name,
        )


def _opening(cycles: Sequence[Loop]) -> tuple[float, float]:
    """How far cycles end from where they began, and what their scatter allows.

    Of repeats those after the first count. A first one begins inside of the loop of a specimen that
    lags, between its two ways past the same load.
    """
    ends = np.array([motion[-1] - motion[0] for _, motion in cycles])
    if len(cycles) > 1:
        return float(ends[1:].mean()), 2.0 * float(np.std(ends[1:]))
    load, motion = cycles[0]
    passed = motion[1:][np.abs(load[1:] - load[0]) <= SAME * np.ptp(load)]
    return (0.0 if passed.min() <= motion[0] <= passed.max() else float(ends[0])), 0.0
