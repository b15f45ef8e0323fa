"""One cycle of load and rotation of a joint: its range of motion, loop area and elastic zones.

Each number comes with its derivative by every rotation of the loop, so that whatever is known of
the rotations, noise of readings or uncertainty of a model, becomes an interval in one way.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import stats

Array = NDArray[np.float64]
Places = NDArray[np.int64]

SIDE_SHARE = 0.2
"""A side is loaded where its largest load is at least this share of the other side's."""

SAME_LOAD = 0.01
"""Loads closer than this share of the range of loads are one load."""

CLOSED = 0.1
"""A loop is closed where its last load is within this share of the range from its first."""

MOST_TRAVEL = 2.5
"""Loads of one cycle go up and down once: twice their range at most, with some slack."""

UPPER_HALF = 0.5
"""Where no neutral zone is found, the elastic zone begins at this share of the side's load."""

_TRACE = 1e-3
"""What moves a number by less than this share of it leaves no trace."""

_MEDIAN_SLOPE = float(np.sqrt(np.pi / 3.0))
"""SD of the median slope over that of least squares, normal noise and many points."""

_FEWEST_FOR_MEDIAN = 4
"""Of three points or fewer, evenly spaced, the median slope is that of least squares."""


@dataclass(frozen=True)
class Measure:
    """A number made of the rotations of a loop.

    Attributes
    ----------
    weights : (T,) its derivative by each rotation.
    """

    value: float
    weights: Array


@dataclass(frozen=True)
class RotationErrors:
    """What is uncertain of rotations, as combinations of independent errors of SD 1.

    Attributes
    ----------
    root : (T, k) rotation per error; root @ root.T is the covariance.
    free : (T, u) rotation per unit of what nothing is known of.
    reach : SDs from the middle of a 95 % interval to its end.
    """

    root: Array
    free: Array
    reach: float

    def way(self, measure: "Measure") -> float | None:
        """From a number to the ends of its 95 % interval; None where it hangs on ``free``."""
        loose = np.abs(measure.weights @ self.free)
        if loose.max(initial=0.0) > _TRACE * abs(measure.value):
            return None
        return self.reach * float(np.linalg.norm(measure.weights @ self.root))

    def at(self, places: NDArray[np.bool_]) -> "RotationErrors":
        """That of some of the rotations (T,)."""
        return RotationErrors(self.root[places], self.free[places], self.reach)


NORMAL_REACH = float(stats.norm.ppf(0.975))
"""SDs to the ends of a 95 % interval where the SD is known."""


def reading_noise(parts: Sequence[int], sd: float, zeroed: bool) -> RotationErrors:
    """Independent noise of readings, of which the first of each part may have been subtracted.

    Parameters
    ----------
    parts : readings of each recording that the loop is made of. sd : of one reading, rad.
    """
    root = sd * np.eye(sum(parts))
    if zeroed:
        first = 0
        for many in parts:
            root[first : first + many, first] -= sd
            first += many
    return RotationErrors(root, np.zeros((len(root), 0)), NORMAL_REACH)


@dataclass(frozen=True)
class Loop:
    """Load and rotation in the order applied, of one cycle.

    Attributes
    ----------
    load : (T,) N m. rotation : (T,) rad, positive where a positive load turns the joint.
    """

    load: Array
    rotation: Array

    @cached_property
    def span(self) -> float:
        """N m: range of the loads."""
        return float(np.ptp(self.load)) if len(self.load) else 0.0

    def reached(self, side: int) -> bool:
        """Whether a side (1 or -1) is loaded."""
        here, there = (float((sign * self.load).max()) for sign in (side, -side))
        return here > 0.0 and here >= SIDE_SHARE * there

    @cached_property
    def two_sided(self) -> bool:
        """Whether both sides are loaded."""
        return self.reached(1) and self.reached(-1)

    @cached_property
    def goes_round_once(self) -> bool:
        """False where several cycles stand behind one another."""
        travel = float(np.abs(np.diff(self.load)).sum())
        return travel <= MOST_TRAVEL * self.span

    @cached_property
    def unloaded(self) -> bool:
        """Whether anything was read while the load of a side went down."""
        slack = SAME_LOAD * self.span
        for side in (1, -1):
            after = side * self.load[self.peak(side) :]
            below = after[after < after[0] - slack]
            if self.reached(side) and len(below) and below[0] > slack:
                return True
        return False

    @cached_property
    def closed(self) -> bool:
        """Whether the load was read on its way back to where it began."""
        return self.unloaded and abs(self.load[-1] - self.load[0]) <= CLOSED * self.span

    def peak(self, side: int) -> int:
        """Place of the largest load to a side."""
        return int(np.argmax(side * self.load))

    def range_of_motion(self) -> Measure:
        """Rotation at the largest load less that at the least; negative against the load.

        Readings at one end of the range count alike. Of a loop to one side the other end is the
        first reading, before the joint was ever loaded.
        """
        weights = self._mean_at(1) - self._mean_at(-1)
        return self._measure(weights)

    def _mean_at(self, side: int) -> Array:
        """(T,) weights of the mean rotation where the load is largest to a side."""
        near = side * self.load >= (side * self.load).max() - SAME_LOAD * self.span
        if not self.two_sided and not self.reached(side):
            near = np.arange(len(near)) == int(np.argmax(near))
        return near / near.sum()

    def _measure(self, weights: Array) -> Measure:
        return Measure(float(weights @ self.rotation), weights)

    def area(self) -> Measure:
        """J: work lost in one closed cycle, trapezoids; positive where unloading gives back less.

        Where the last rotation is not the first, a straight line closes the loop.
        """
        # Integral of load over rotation by the shoelace formula, as weights of the rotations.
        before, after = np.roll(self.load, 1), np.roll(self.load, -1)
        return self._measure(0.5 * (before - after))

    def branch(self, side: int) -> Places:
        """Places from the peak of the other side to that of this one, in the order applied."""
        # A closed loop may go round its end between the peaks; an open one has no such branch.
        first, last = self.peak(-side), self.peak(side)
        if first <= last:
            return np.arange(first, last + 1)
        if self.closed:
            return np.concatenate([np.arange(first, len(self.load)), np.arange(last + 1)])
        return np.zeros(0, dtype=np.int64)

    def curves(self) -> tuple[Places, ...]:
        """Places of the curves from one side to the other: each direction, or all points as one."""
        if not self.two_sided:
            return ()
        if not self.unloaded:
            return (np.arange(len(self.load)),)
        return tuple(one for one in (self.branch(1), self.branch(-1)) if len(one))

    def gap(self) -> Measure | None:
        """Rotation where the load passes zero on its way down less that on its way up.

        None where it was not read on both ways.
        """
        up, down = (self.branch(side) for side in (1, -1))
        if not (self.two_sided and self.unloaded and len(up) and len(down)):
            return None
        return self._measure(self._passing_zero(-1, down) - self._passing_zero(1, up))

    def _passing_zero(self, side: int, places: Places) -> Array:
        """(T,) weights of the rotation where a branch passes zero, on a line between readings."""
        load, weights = side * self.load[places], np.zeros(len(self.load))
        # the first that counts as zero or beyond: of a closed loop its end, and not its beginning
        at = int(np.argmax(load >= -SAME_LOAD * self.span))
        share = max(load[at], 0.0) / (load[at] - load[at - 1])
        weights[places[[at - 1, at]]] = share, 1.0 - share
        return weights

    def loading(self, side: int) -> Places:
        """Places of a side while its load grows, from nothing to the peak."""
        # Back from the peak, round the end of a closed loop, until the load leaves that side.
        places, at = [], self.peak(side)
        for _ in range(len(self.load)):
            if side * self.load[at] <= 0.0:
                break
            places.append(at)
            if at == 0 and not self.closed:
                break
            at = (at - 1) % len(self.load)
        return np.array(places[::-1], dtype=np.int64)

    def elastic_compliance(self, side: int, beyond: float | None) -> Measure | None:
        """rad/(N m): robust slope of rotation over load in the elastic zone of a side.

        The median of the slopes of all pairs of points, each counting by the load between them
        (Sievers 1978, doi:10.1080/01621459.1978.10480067): one bad reading does not move it far.

        Parameters
        ----------
        beyond : load (N m, of that sign) at which the zone begins; None: the upper half.

        Returns
        -------
        None where there are not two loads in the zone.
        """
        begins = UPPER_HALF * self.load[self.peak(side)] if beyond is None else beyond
        slack = SAME_LOAD * self.span
        places = self.loading(side)
        places = places[side * (self.load[places] - begins) >= -slack]
        x, y = self.load[places], self.rotation[places]
        if len(x) < 2 or np.ptp(x) <= slack:
            return None
        weights = np.zeros(len(self.load))
        around = x - x.mean()
        factor = _MEDIAN_SLOPE if len(x) >= _FEWEST_FOR_MEDIAN else 1.0
        # Noise moves the median slope as it moves the slope of least squares, but for a factor.
        weights[places] = factor * around / (around @ around)
        return Measure(_median_slope(x, y), weights)


def _median_slope(x: Array, y: Array) -> float:
    """Weighted median of the slopes between all points (n,), two at least of different x."""
    # The slope at which the loads of pairs below it reach half of those of all pairs.
    first, second = np.triu_indices(len(x), 1)
    run = x[second] - x[first]
    pairs = np.abs(run) > 1e-9 * np.ptp(x)
    slopes = (y[second] - y[first])[pairs] / run[pairs]
    order = np.argsort(slopes)
    below = np.cumsum(np.abs(run[pairs])[order])
    middle = np.searchsorted(below, 0.5 * below[-1], side="left")
    return float(slopes[order][middle])


def stiffness_interval(
    compliance: Measure, way: float | None
) -> tuple[float | None, float | None, float | None]:
    """Stiffness (N m/rad) of a compliance, and the ends of its interval, None where open.

    Parameters
    ----------
    way : from the compliance to the ends of its interval; None where there is none.

    Returns
    -------
    No value where the joint moves against the load.
    """
    value = compliance.value
    if value <= 0.0:
        return None, None, None
    if way is None:
        return 1.0 / value, None, None
    return 1.0 / value, 1.0 / (value + way), 1.0 / (value - way) if value > way else None
