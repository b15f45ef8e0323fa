"""Equilibrium with places of vertebrae prescribed and joint coordinates locked.

Each prescription is a number g that the pose decides: how far a point lies along a direction, how
far a line is tilted in a plane. The holder pushes along the slope of g with what it takes to keep g
where it shall be, so equilibrium is

    F(q) - sum_k p_k dg_k/dq = 0 on the free coordinates,    g_k(q) = wanted_k

with F what the joints hold less what is applied (Lagrange's multipliers p). Newton takes the exact
tangents of both. A law may be infinite beyond its ends: a step that leaves them is halved.

Where no pose has all that is wanted, the pose is taken that misses it least: the holder is given a
compliance, W^2 e, which is let go to nothing (W: 1 mm, 1 deg).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from spinepipe.decomposition import eigh, svd
from spinepipe.effects.contract import Array
from spinepipe.statics.equilibrium import (
    FIRST_INCREMENT,
    LARGEST_ROTATION,
    SMALLEST_FRACTION,
    STEP_TOLERANCE,
)
from spinepipe.statics.motion import ChainMotion, cross_matrix
from spinepipe.statics.system import System
from spinepipe.status import Ended

Flags = NDArray[np.bool_]

MOST_ITERATIONS = 40
"""Newton's, halved steps among them."""

PUSH_TOLERANCE, SMALL_PUSH = 1e-9, 1.0
"""Newton has arrived when pushes change by less than this share of the largest; N and N m."""

SOFTEST, HARDEST = 1e4, 1e-4
"""Compliances of a holder: units squared that it gives way per N m of work."""

HARDER = 10.0 ** (-0.5)

STILL = 1e-4
"""Units: the miss has settled when a harder holder changes it by less."""

REACHED = 0.1
"""Units: what a hard holder misses by less can be had."""

UNREACHABLE = "no pose has all that is prescribed"
UNSTABLE = "the spine buckles out of what is prescribed"


class Prescription(Protocol):
    """A number that the pose decides, and its derivatives."""

    @property
    def unit(self) -> float:
        """Size of a miss by which others are told: m or rad."""

    def value(self, motion: ChainMotion) -> float:
        """The number, m or rad."""

    def slope(self, motion: ChainMotion) -> Array:
        """(n,) its derivative by the coordinates."""

    def bend(self, motion: ChainMotion) -> Array:
        """(n, n) its second derivative."""


@dataclass(frozen=True)
class Place:
    """How far a vertebra's point lies along a direction, m.

    Attributes
    ----------
    point : (3,) m in ground, neutral pose. direction : (3,) unit vector in ground.
    """

    body: int
    point: Array
    direction: Array

    unit = 1e-3

    def value(self, motion: ChainMotion) -> float:
        return float(self.direction @ motion.displacement(self.body).apply(self.point))

    def slope(self, motion: ChainMotion) -> Array:
        found: Array = motion.velocities(self.body, self.point) @ self.direction
        return found

    def bend(self, motion: ChainMotion) -> Array:
        return motion.wrench(self.body, self.point, self.direction, np.zeros(3)).tangent


@dataclass(frozen=True)
class Tilt:
    """Angle in a plane between a vertebra's line and a direction, rad.

    Attributes
    ----------
    line : (3,) in ground, neutral pose.
    up, aside : (3,) unit vectors that span the plane; tilt from the first to the second counts.
    """

    body: int
    line: Array
    up: Array
    aside: Array

    unit = float(np.deg2rad(1.0))

    def value(self, motion: ChainMotion) -> float:
        line = self._now(motion)
        return float(np.arctan2(line @ self.aside, line @ self.up))

    def slope(self, motion: ChainMotion) -> Array:
        line = self._now(motion)
        found: Array = motion.angular(self.body) @ (cross_matrix(line) @ self._gradient(line))
        return found

    def bend(self, motion: ChainMotion) -> Array:
        line, angular = self._now(motion), motion.angular(self.body)
        of_line, gradient = cross_matrix(line), self._gradient(line)
        moment = of_line @ gradient
        turned = motion.wrench(self.body, np.zeros(3), np.zeros(3), moment).tangent
        change = angular @ of_line  # of the line, by each coordinate
        by_change = change @ cross_matrix(gradient) + self._bent(line, change) @ of_line.T
        found: Array = turned + angular @ by_change.T
        return found

    def _now(self, motion: ChainMotion) -> Array:
        found: Array = motion.displacement(self.body).rotation @ self.line
        return found

    def _gradient(self, line: Array) -> Array:
        """(3,) derivative of the angle by the line."""
        up, aside = line @ self.up, line @ self.aside
        found: Array = (up * self.aside - aside * self.up) / (up**2 + aside**2)
        return found

    def _bent(self, line: Array, changes: Array) -> Array:
        """(n, 3) change of the gradient with changes (n, 3) of the line."""
        up, aside = line @ self.up, line @ self.aside
        by_up, by_aside = (changes @ self.up)[:, None], (changes @ self.aside)[:, None]
        square = up**2 + aside**2
        shrink = 2.0 * (up * by_up + aside * by_aside) / square * self._gradient(line)
        found: Array = (by_up * self.aside - by_aside * self.up) / square - shrink
        return found


@dataclass(frozen=True)
class Held:
    """End of a solve.

    Attributes
    ----------
    q : (n,) m and rad. pushes : (k,) N and N m that the holder applies to meet each prescription.
    missed : (k,) m and rad by which the value is short of what is wanted; an ``unstable`` end is
        the last pose that stood on the way.
    """

    q: Array
    pushes: Array
    missed: Array
    status: Ended
    message: str
    iterations: int
    answers: "Answers | None" = None


@dataclass(frozen=True)
class Answers:
    """How a held spine answers small changes.

    Attributes
    ----------
    matrix : (f + k, f + k) derivative of the equations by free coordinates and pushes.
    """

    matrix: Array
    free: Flags

    def to(self, held_by: Array, wanted_by: Array | None = None) -> tuple[Array, Array]:
        """Changes of q (n, m) and pushes (k, m).

        Parameters
        ----------
        held_by : (n, m) changes of what the joints hold. wanted_by : (k, m) of what is prescribed.
        """
        count = int(self.free.sum())
        right = np.zeros((len(self.matrix), held_by.shape[1]))
        right[:count] = -held_by[self.free]
        if wanted_by is not None:
            right[count:] = wanted_by
        found: Array = np.linalg.solve(self.matrix, right).astype(float, copy=False)
        q = np.zeros_like(held_by)
        q[self.free] = found[:count]
        return q, found[count:]


def hold_at(
    system: System,
    prescriptions: Sequence[Prescription],
    wanted: Array,
    free: Flags,
    start: Held | None = None,
) -> Held:
    """The pose in which an unloaded, weightless chain is held.

    Parameters
    ----------
    wanted : (k,) m and rad, value of each prescription.
    free : (n,) coordinates that may move; the others stay zero.
    start : a pose near by, with its pushes; the neutral pose without.
    """
    problem = _Problem(system, tuple(prescriptions), free)
    rest = Held(np.zeros(len(free)), np.zeros(len(wanted)), wanted, Ended.CONVERGED, "", 0)
    for near in filter(None, (start, rest)):
        found = problem.newton(near, wanted, 0.0)
        if found is not None and found.status is Ended.CONVERGED:
            return found
    return problem.led(rest, wanted)


class _Problem:
    """The equations of a held chain."""

    def __init__(
        self, system: System, prescriptions: tuple[Prescription, ...], free: Flags
    ) -> None:
        self.system, self.prescriptions, self.free = system, prescriptions, free
        self.count = int(free.sum())
        self.loading, self.states = system.slots.unloaded(), system.initial_states()
        self.tolerance = np.tile(STEP_TOLERANCE, len(free) // 6)[free]
        self.units = np.array([one.unit for one in prescriptions])

    def values(self, q: Array) -> Array:
        """(k,) of the prescriptions at q."""
        return self._values(ChainMotion(self.system.chain, q))

    def _values(self, motion: ChainMotion) -> Array:
        return np.array([one.value(motion) for one in self.prescriptions])

    def newton(self, start: Held, wanted: Array, compliance: float) -> Held | None:
        """From a pose near by; None where the steps lead nowhere."""
        q, pushes = start.q.copy(), start.pushes.copy()
        step = np.zeros(self.count + len(wanted))
        for iteration in range(1, MOST_ITERATIONS + 1):
            equations = self._equations(q, pushes, wanted, compliance)
            if equations is None:  # beyond the ends of a law
                step *= 0.5
                q[self.free] -= step[: self.count]
                pushes -= step[self.count :]
                continue
            missing, matrix = equations
            try:
                step = np.asarray(np.linalg.solve(matrix, -missing), dtype=np.float64)
            except np.linalg.LinAlgError:
                return None
            q[self.free] += step[: self.count]
            pushes += step[self.count :]
            if not np.abs(q.reshape(-1, 6)[:, 3:]).max() < LARGEST_ROTATION:
                return None
            if self._arrived(step, pushes):
                return self._ended(q, pushes, wanted, matrix, iteration)
        return None

    def _arrived(self, step: Array, pushes: Array) -> bool:
        moved, pushed = step[: self.count], step[self.count :]
        largest = max(float(np.abs(pushes).max(initial=0.0)), SMALL_PUSH)
        near = float(np.abs(pushed).max(initial=0.0)) < PUSH_TOLERANCE * largest
        return near and bool((np.abs(moved) < self.tolerance).all())

    def _equations(
        self, q: Array, pushes: Array, wanted: Array, compliance: float
    ) -> tuple[Array, Array] | None:
        """What is missing (f + k,) and its derivative; None beyond the ends of a law."""
        balance = self.system.balance(q, self.loading, self.states)
        if not np.isfinite(balance.residual).all():
            return None
        motion, free = ChainMotion(self.system.chain, q), self.free
        slopes = np.array([one.slope(motion) for one in self.prescriptions])[:, free]
        values = self._values(motion)
        tangent = balance.tangent.copy()
        for push, one in zip(pushes, self.prescriptions, strict=True):
            tangent -= push * one.bend(motion)
        matrix = np.zeros((self.count + len(wanted),) * 2)
        matrix[: self.count, : self.count] = tangent[np.ix_(free, free)]
        matrix[: self.count, self.count :] = -slopes.T
        matrix[self.count :, : self.count] = slopes
        given = compliance * self.units**2
        matrix[self.count :, self.count :] = np.diag(given)
        missing = [
            balance.residual[free] - pushes @ slopes,
            values - wanted + given * pushes,
        ]
        return np.concatenate(missing), matrix

    def _ended(
        self, q: Array, pushes: Array, wanted: Array, matrix: Array, iterations: int
    ) -> Held:
        missed = wanted - self.values(q)
        answers = Answers(matrix, self.free)
        if self._stands(matrix):
            return Held(q, pushes, missed, Ended.CONVERGED, "", iterations, answers)
        return Held(q, pushes, missed, Ended.UNSTABLE, UNSTABLE, iterations, answers)

    def _stands(self, matrix: Array) -> bool:
        """Whether the work grows along all that the prescriptions leave open."""
        tangent, slopes = matrix[: self.count, : self.count], matrix[self.count :, : self.count]
        given = np.diagonal(matrix)[self.count :]
        if given.any():
            work = tangent + slopes.T @ (slopes / given[:, None])
        else:
            _, _, shut = svd(slopes)  # orthonormal ways that the prescriptions shut
            left_open = np.eye(self.count) - shut.T @ shut
            work = left_open @ tangent @ left_open + np.linalg.norm(tangent) * shut.T @ shut
        sizes, _ = eigh(0.5 * (work + work.T))
        return bool(sizes[0] > 0.0)

    def led(self, rest: Held, wanted: Array) -> Held:
        """What is wanted in fractions, from the neutral pose; the nearest where the way ends."""
        first, last = self.values(rest.q), rest
        reached, increment = 0.0, FIRST_INCREMENT
        while reached < 1.0:
            target = min(1.0, reached + increment)
            found = self.newton(last, first + target * (wanted - first), 0.0)
            if found is not None and found.status is Ended.CONVERGED:
                last, reached, increment = found, target, 2.0 * increment
            elif increment > SMALLEST_FRACTION:
                increment *= 0.5
            else:
                return self._stopped(last, rest, wanted)
        return last

    def _stopped(self, last: Held, rest: Held, wanted: Array) -> Held:
        """The way ends: no pose has what is wanted, or none that stands."""
        near = self.nearest(rest, wanted)
        if np.abs(near.missed / self.units).max() > REACHED:
            return near
        left = wanted - self.values(last.q)
        return replace(last, missed=left, status=Ended.UNSTABLE, message=UNSTABLE)

    def nearest(self, rest: Held, wanted: Array) -> Held:
        """The pose that misses least of what is wanted, by a holder that grows harder."""
        last, compliance, missed = rest, SOFTEST, np.inf * self.units
        while compliance > HARDEST:
            found = self.newton(last, wanted, compliance)
            if found is None:
                break
            last, compliance = found, HARDER * compliance
            if np.abs((found.missed - missed) / self.units).max() < STILL:
                break
            missed = found.missed
        if last is rest:
            pushes, missed = rest.pushes, wanted - self.values(rest.q)
            return Held(rest.q, pushes, missed, Ended.NOT_CONVERGED, UNREACHABLE, 0)
        pose = (last.q, last.pushes, last.missed)
        return Held(*pose, Ended.UNREACHABLE, UNREACHABLE, last.iterations, last.answers)
