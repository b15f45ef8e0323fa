"""Equilibrium of a `prescribed_chain`: places of vertebrae prescribed, coordinates locked.

The pose is the end of the path of stable poses along which what is prescribed comes on. A law may
be infinite beyond its ends: a step that leaves them is halved.

Where no pose has all that is wanted, the pose is taken that misses it least: the holder is given a
compliance, W^2 e, which is let go to nothing (W: 1 mm, 1 deg).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeGuard

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.statics.equilibrium import (
    FIRST_INCREMENT,
    LARGEST_ROTATION,
    SMALLEST_FRACTION,
    STEP_TOLERANCE,
)
from spinepipe.statics.prescribed_chain import (
    Ask,
    Flags,
    NewtonStep,
    NewtonTrial,
    PrescribedChain,
    newton_steps,
)
from spinepipe.status import PrescribedStatus

MOST_ITERATIONS = 40
"""Newton's, halved steps among them."""

PUSH_TOLERANCE, SMALL_PUSH = 1e-9, 1.0
"""Newton has arrived when pushes change by less than this share of the largest; N and N m."""

LONGEST_CORRECTION = 0.1 / STEP_TOLERANCE[3]
"""Newton's first step from a prediction is no longer than 0.1 rad, in its tolerances."""

CONTRACTION = 0.5
"""Each further one is so much shorter, as Newton's are near a solution,"""

ROUNDED = 100.0
"""unless it is so few tolerances long that it may be rounding."""

SMALLEST_STEP = 2.0**-10
"""Share of the way: where the chain snaps is told to a thousandth."""

SOFTEST, HARDEST = 1e4, 1e-4
"""Compliances of a holder: units squared that it gives way per N m of work."""

HARDER = 10.0 ** (-0.5)

STILL = 1e-4
"""Units: the miss has settled when a harder holder changes it by less."""

REACHED = 0.1
"""Units: what a hard holder misses by less can be had."""

UNREACHABLE = "no pose has all that is prescribed"
UNSTABLE = "the spine buckles out of what is prescribed"
SNAPS = (
    "the spine snaps at {:.1f} % of the straight way to its place: the pose is one of several that "
    "stand there"
)


@dataclass(frozen=True)
class PrescribedResult:
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
    status: PrescribedStatus
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


def answered(asked: Sequence[tuple[int, NewtonTrial]]) -> list[NewtonStep | None]:
    """The steps of searches that advance in lockstep (`calibrate.lockstep`)."""
    return newton_steps([trial for _, trial in asked])


def alone(trial: NewtonTrial) -> NewtonStep | None:
    """The step of one chain."""
    return newton_steps([trial])[0]


def hold_at(
    chain: PrescribedChain, wanted: Array, start: PrescribedResult | None = None, ask: Ask = alone
) -> PrescribedResult:
    """The pose in which a chain is held.

    It is the end of the path of stable poses along which all that is prescribed comes on in
    proportion, from the neutral pose. Where the chain snaps on that way the message says so, and
    the pose is one that stands where it is wanted: Newton's from the last pose of the path, else
    from the neutral pose.

    Parameters
    ----------
    wanted : (k,) m and rad, value of each prescription.
    start : a pose near by, with its pushes, for searches: Newton's from there is taken, which may
        be on another path; without, or where Newton leads nowhere, the above.
    """
    problem = _Problem(chain, ask)
    rest = PrescribedResult(
        np.zeros(len(chain.free)), np.zeros(len(wanted)), wanted, PrescribedStatus.CONVERGED, "", 0
    )
    if start is not None:
        found = problem.newton(start, wanted, 0.0)
        if _stood(found):
            return found
    last, share = problem.followed(rest, wanted)
    if share == 1.0:
        return last
    snaps = SNAPS.format(100.0 * share)
    for near in (last, rest):
        found = problem.newton(near, wanted, 0.0)
        if _stood(found):
            return replace(found, message=snaps)
    found = problem.led(rest, wanted)
    return replace(found, message=snaps) if _stood(found) else found


def _stood(found: PrescribedResult | None) -> TypeGuard[PrescribedResult]:
    return found is not None and found.status is PrescribedStatus.CONVERGED


class _Problem:
    """The equations of a held chain."""

    def __init__(self, chain: PrescribedChain, ask: Ask) -> None:
        self.chain, self.free, self.ask = chain, chain.free, ask
        self.count = int(chain.free.sum())
        self.tolerance = np.tile(STEP_TOLERANCE, len(chain.free) // 6)[chain.free]
        self.units = chain.units

    def newton(
        self, start: PrescribedResult, wanted: Array, compliance: float, on_path: bool = False
    ) -> PrescribedResult | None:
        """From a pose near by; None where the steps lead nowhere.

        Parameters
        ----------
        on_path : whether the start is on the path but for a small error, so that Newton contracts.
        """
        q, pushes = start.q.copy(), start.pushes.copy()
        step, allowed = np.zeros(self.count + len(wanted)), LONGEST_CORRECTION
        for iteration in range(1, MOST_ITERATIONS + 1):
            found = self.ask(NewtonTrial(self.chain, q, pushes, wanted, compliance))
            if found is None and on_path:
                return None
            if found is None:  # beyond the ends of a law: half of the last step is taken back
                step = 0.5 * step
                q[self.free] -= step[: self.count]
                pushes -= step[self.count :]
                continue
            step = found.step
            # on a path Newton must contract from its first step on (Deuflhard's monotonicity test)
            size = float((np.abs(step[: self.count]) / self.tolerance).max(initial=0.0))
            if on_path and not size <= allowed:
                return None
            allowed = max(CONTRACTION * size, ROUNDED)
            q[self.free] += step[: self.count]
            pushes += step[self.count :]
            if not np.abs(q.reshape(-1, 6)[:, 3:]).max() < LARGEST_ROTATION:
                return None
            # arrived, when neither a coordinate nor a push has moved by more than its tolerance
            largest = max(float(np.abs(pushes).max(initial=0.0)), SMALL_PUSH)
            pushed = float(np.abs(step[self.count :]).max(initial=0.0))
            if (
                pushed < PUSH_TOLERANCE * largest
                and (np.abs(step[: self.count]) < self.tolerance).all()
            ):
                missed, answers = wanted - self.chain.reached(q), Answers(found.matrix, self.free)
                status, message = PrescribedStatus.CONVERGED, ""
                if not self._stands(found.matrix):
                    status, message = PrescribedStatus.UNSTABLE, UNSTABLE
                return PrescribedResult(q, pushes, missed, status, message, iteration, answers)
        return None

    def _stands(self, matrix: Array) -> bool:
        """Whether the work grows along all that the prescriptions leave open.

        Second-order condition of a minimum under constraints: the tangent is positive definite on
        the null space of the prescriptions' slopes (the columns of Q behind the first k), or, where
        the holder gives way, with its springs (slope' slope / compliance) added.
        """
        tangent, by_q = matrix[: self.count, : self.count], matrix[self.count :, : self.count]
        given = np.diagonal(matrix)[self.count :]
        if given.any():
            work = tangent + by_q.T @ (by_q / given[:, None])
        else:
            left_open = np.linalg.qr(by_q.T, mode="complete").Q[:, len(by_q) :]
            work = left_open.T @ tangent @ left_open
        try:
            np.linalg.cholesky(0.5 * (work + work.T))
        except np.linalg.LinAlgError:
            return False
        return True

    def followed(self, rest: PrescribedResult, wanted: Array) -> tuple[PrescribedResult, float]:
        """The last pose of the path on which what is wanted comes on, and the share that did.

        Predictor along the tangent, Newton as corrector. A step is a piece of the path where Newton
        contracts from its first step on and the end stands (Deuflhard 2011, chapter 5,
        doi:10.1007/978-3-642-23899-4); it is halved until it is.
        """
        first = self.chain.reached(rest.q)
        last, share, step = self.newton(rest, first, 0.0), 0.0, FIRST_INCREMENT
        if not _stood(last):
            return rest, 0.0
        while share < 1.0 and step > SMALLEST_STEP:
            target = min(1.0, share + step)
            assert last.answers is not None  # a pose that stands has them
            onward = (target - share) * (wanted - first)
            q, pushes = last.answers.to(np.zeros((len(last.q), 1)), onward[:, None])
            ahead = replace(last, q=last.q + q[:, 0], pushes=last.pushes + pushes[:, 0])
            found = self.newton(ahead, first + target * (wanted - first), 0.0, on_path=True)
            if _stood(found):
                last, share, step = found, target, 2.0 * step
            else:
                step *= 0.5
        return last, share

    def led(self, rest: PrescribedResult, wanted: Array) -> PrescribedResult:
        """What is wanted in fractions, from the neutral pose; the nearest where the way ends."""
        first, last = self.chain.reached(rest.q), rest
        reached, increment = 0.0, FIRST_INCREMENT
        while reached < 1.0:
            target = min(1.0, reached + increment)
            found = self.newton(last, first + target * (wanted - first), 0.0)
            if _stood(found):
                last, reached, increment = found, target, 2.0 * increment
            elif increment > SMALLEST_FRACTION:
                increment *= 0.5
            else:  # the way ends: no pose has what is wanted, or none that stands
                near = self.nearest(rest, wanted)
                if np.abs(near.missed / self.units).max() > REACHED:
                    return near
                left, lost = wanted - self.chain.reached(last.q), PrescribedStatus.UNSTABLE
                return replace(last, missed=left, status=lost, message=UNSTABLE)
        return last

    def nearest(self, rest: PrescribedResult, wanted: Array) -> PrescribedResult:
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
            pushes, missed = rest.pushes, wanted - self.chain.reached(rest.q)
            return PrescribedResult(
                rest.q, pushes, missed, PrescribedStatus.NOT_CONVERGED, UNREACHABLE, 0
            )
        pose = (last.q, last.pushes, last.missed)
        return PrescribedResult(
            *pose, PrescribedStatus.UNREACHABLE, UNREACHABLE, last.iterations, last.answers
        )
