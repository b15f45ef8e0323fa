"""Equilibrium with places of vertebrae prescribed and joint coordinates locked.

Each prescription is a number g that the pose decides: how far a point lies along a direction, how
far a line is tilted in a plane. The holder pushes along the slope of g with what it takes to keep g
where it shall be, so equilibrium is

    F(q) - sum_k p_k dg_k/dq = 0 on the free coordinates,    g_k(q) = wanted_k

with F what the joints hold less what is applied (Lagrange's multipliers p). Newton takes the exact
tangents of both. A law may be infinite beyond its ends: a step that leaves them is halved.

Where no pose has all that is wanted, the pose is taken that misses it least: the holder is given a
compliance, W^2 e, which is let go to nothing (W: 1 mm, 1 deg).

Newton asks for one step at a time. Whoever holds many chains may answer many such questions at once
(`newton_steps`, `calibrate.lockstep`); what is answered does not hang on what stands beside it.
"""

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass, replace
from typing import NamedTuple, TypeGuard, cast

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects import EffectKind, JointLaw
from spinepipe.effects.contract import Array, Indices
from spinepipe.model import SpineModel
from spinepipe.statics.batched.dynamics import add_cross
from spinepipe.statics.batched.forward_kinematics import Plain, compiled, placed
from spinepipe.statics.equilibrium import (
    FIRST_INCREMENT,
    LARGEST_ROTATION,
    SMALLEST_FRACTION,
    STEP_TOLERANCE,
)
from spinepipe.status import PrescribedStatus

Flags = NDArray[np.bool_]

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


@dataclass(frozen=True, eq=False)
class PrescribedPlace:
    """How far a vertebra's point lies along a direction, m.

    Attributes
    ----------
    point : (3,) m in ground, neutral pose. direction : (3,) unit vector in ground.
    """

    body: int
    point: Array
    direction: Array

    unit = 1e-3
    is_tilt = False

    @property
    def vectors(self) -> Array:
        """(3, 3) of which the last row means nothing."""
        return np.array([self.point, self.direction, self.direction])


@dataclass(frozen=True, eq=False)
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
    is_tilt = True

    @property
    def vectors(self) -> Array:
        """(3, 3) line, up and aside."""
        return np.array([self.line, self.up, self.aside])


Prescription = PrescribedPlace | Tilt
"""A number that the pose decides; ``unit``, m or rad, is a miss by which others are told."""


@compiled
def _pull(
    is_tilt: bool, vectors: Array, turned: Array, shifted: Array, wrench: Array, by_twist: Array
) -> float:
    """Value of a prescription; its wrench (6,) on the vertebra and the slope (3, 6) of that.

    The work of the wrench, moment about the origin of ground and force, is what the value grows by.
    By the vertebra's twist (angular, linear) only the moment changes.
    """
    now, arm = np.empty(3), np.zeros(3)
    for r in range(3):
        now[r] = 0.0 if is_tilt else shifted[r]
        for c in range(3):
            now[r] += turned[r, c] * vectors[0, c]
    wrench[:] = 0.0
    by_twist[:] = 0.0
    first, second = 0.0, 0.0
    for r in range(3):
        first += now[r] * vectors[1, r]
        second += now[r] * vectors[2, r]
    if not is_tilt:
        force = vectors[1]
        add_cross(now, force, 1.0, wrench[:3])
        for r in range(3):
            wrench[3 + r] = force[r]
            by_twist[r, r] -= first  # (w x now) x force = now (force . w) - w (force . now)
            for c in range(3):
                by_twist[r, c] += now[r] * force[c]
            arm[:] = 0.0
            arm[r] = 1.0
            add_cross(arm, force, 1.0, by_twist[:, 3 + r])
        return first
    square = first * first + second * second
    gradient, moved, bent = np.empty(3), np.empty(3), np.empty(3)
    for r in range(3):  # of the angle by the line
        gradient[r] = (first * vectors[2, r] - second * vectors[1, r]) / square
    add_cross(now, gradient, 1.0, wrench[:3])
    mixed, twice = second * second - first * first, 2.0 * first * second
    for k in range(3):  # turning about axis k moves the line, and the gradient with it
        arm[:] = 0.0
        arm[k] = 1.0
        moved[:] = 0.0
        add_cross(arm, now, 1.0, moved)
        along, aside = 0.0, 0.0
        for r in range(3):
            along += moved[r] * vectors[1, r]
            aside += moved[r] * vectors[2, r]
        for r in range(3):
            to_up, to_aside = twice * along + mixed * aside, mixed * along - twice * aside
            bent[r] = (to_up * vectors[1, r] + to_aside * vectors[2, r]) / (square * square)
        add_cross(moved, gradient, 1.0, by_twist[:, k])
        add_cross(now, bent, 1.0, by_twist[:, k])
    return np.arctan2(second, first)


@compiled
def _assemble(motion: Plain, asked: Plain, holder: Plain, held: Plain, found: Plain) -> None:
    """Fill what is missing (N, f + k) and its derivative (N, f + k, f + k).

    An axis changes by ad(t) s, t the twist of each coordinate below it, s its own (Featherstone
    2008, doi 10.1007/978-1-4899-7560-7); a second derivative is symmetric, its lower half is taken.
    """
    every_axes, every_turned, every_shifted = motion
    is_tilt, bodies, every_vectors, free = asked
    missings, matrices = found
    loads, tangents = held
    every_push, wanted, given = holder
    count, wrench, by_twist = len(free), np.empty(6), np.empty((3, 6))
    own, turning, row = np.empty((count, 6)), np.empty((count, 6)), np.empty(6)
    for n in range(len(matrices)):
        axes, matrix, missing = every_axes[n], matrices[n], missings[n]
        matrix[:] = 0.0
        for i in range(count):
            missing[i] = loads[n, free[i]]
        own[:] = 0.0
        turning[:] = 0.0
        for p in range(len(bodies)):
            b, push = bodies[p], every_push[n, p]
            value = _pull(
                is_tilt[p],
                every_vectors[n, p],
                every_turned[n, b],
                every_shifted[n, b],
                wrench,
                by_twist,
            )
            missing[count + p] = value - wanted[n, p] + given[n, p] * push
            matrix[count + p, count + p] = given[n, p]
            for i in range(count):
                if free[i] // 6 > b:
                    continue
                s = axes[free[i] // 6, free[i] % 6]
                row[:] = 0.0
                add_cross(s[:3], wrench[:3], 1.0, row[:3])
                add_cross(s[3:], wrench[3:], 1.0, row[:3])
                add_cross(s[:3], wrench[3:], 1.0, row[3:])
                work = 0.0
                for c in range(6):
                    work += s[c] * wrench[c]
                    turning[i, c] += push * row[c]
                    for r in range(3):
                        own[i, c] += push * s[r] * by_twist[r, c]
                matrix[count + p, i], matrix[i, count + p] = work, -work
                missing[i] -= push * work
        for i in range(count):
            joint, at = free[i] // 6, free[i] % 6
            for j in range(i + 1):
                lower = free[j] // 6
                other = axes[lower, free[j] % 6]
                bend = 0.0
                for c in range(6):
                    bend += (own[i, c] + (turning[i, c] if j < i else 0.0)) * other[c]
                matrix[i, j] = matrix[j, i] = -bend
                if lower == joint:
                    matrix[i, j] += tangents[n, joint, at, free[j] % 6]
                    if j < i:
                        matrix[j, i] += tangents[n, joint, free[j] % 6, at]


class HeldChain:
    """An unloaded, weightless chain on joint laws, and what is prescribed of its poses.

    Attributes
    ----------
    free : (n,) coordinates that may move; the others stay zero.
    values : (R, P) of each law, as of the model's effects.
    frames : (J, 3, 3) and (J, 3) m, of the joints.
    vectors, units : (k, 3, 3) and (k,) m or rad, of the prescriptions.
    asked : (k,) which prescriptions are tilts, and their bodies; (f,) free coordinates.
    """

    def __init__(
        self, model: SpineModel, prescriptions: tuple[Prescription, ...], free: Flags
    ) -> None:
        if any(scoped.effect.kind is not EffectKind.JOINT_LAW for scoped in model.effects):
            raise ValueError("a chain is held in place on joint laws alone")
        self.effects, self.free, self.prescriptions = model.effects, free, prescriptions
        self.values = tuple(scoped.values for scoped in model.effects)
        self.frames = (
            np.array([frame.rotation for frame in model.frames]),
            np.array([frame.origin for frame in model.frames]),
        )
        self.vectors = np.array([one.vectors for one in prescriptions])
        self.units = np.array([one.unit for one in prescriptions])
        self.asked = (
            np.array([one.is_tilt for one in prescriptions]),
            np.array([one.body for one in prescriptions]),
            np.flatnonzero(free),
        )

    def with_values(self, values: Sequence[Array]) -> "HeldChain":
        """The same with other values of the laws."""
        other = copy(self)
        other.values = tuple(values)
        return other

    def motion(self, q: Array) -> tuple[Array, Array, Array]:
        """(J, 6, 6) axes and displacements of vertebrae at q (n,), as of `statics.many.Survey`."""
        rotations, origins = self.frames
        axes, turned, shifted = placed(rotations[None], origins[None], q.reshape(1, -1, 6))
        return axes[0], turned[0], shifted[0]

    def reached(self, q: Array) -> Array:
        """(k,) m and rad, what is prescribed as it is at q (n,)."""
        (_, turned, shifted), (tilts, bodies, _) = self.motion(q), self.asked
        wrench, by_twist = np.empty(6), np.empty((3, 6))
        each = zip(tilts, bodies, self.vectors, strict=True)
        return np.array([_pull(t, v, turned[b], shifted[b], wrench, by_twist) for t, b, v in each])


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


class NewtonTrial(NamedTuple):
    """A pose q (n,) and pushes (k,) of a chain, where one of Newton's steps is asked for.

    Attributes
    ----------
    wanted : (k,) m and rad, value of each prescription. compliance : of the holder.
    """

    chain: HeldChain
    q: Array
    pushes: Array
    wanted: Array
    compliance: float


class NewtonStep(NamedTuple):
    """Change (f + k,) of the free coordinates and the pushes, NaN where the equations have none.

    Attributes
    ----------
    matrix : (f + k, f + k) derivative of the equations.
    """

    step: Array
    matrix: Array


Ask = Callable[[NewtonTrial], NewtonStep | None]
"""One of Newton's steps; None beyond the ends of a law."""


def newton_steps(trials: Sequence[NewtonTrial]) -> list[NewtonStep | None]:
    """Newton's steps from N poses of chains that differ in numbers alone, at once."""
    chains = [one.chain for one in trials]
    first, (tilts, bodies, free) = chains[0], chains[0].asked
    q, pushes, wanted = (np.array([one[at] for one in trials]) for at in (1, 2, 3))
    rotations, origins = (np.array([one.frames[at] for one in chains]) for at in (0, 1))
    motion, (load, tangent) = placed(rotations, origins, q.reshape(len(q), -1, 6)), _held(chains, q)
    asked = (tilts, bodies, np.array([one.vectors for one in chains]), free)
    size = len(free) + len(bodies)
    missing, matrix = np.empty((len(q), size)), np.empty((len(q), size, size))
    given = np.array([one.compliance for one in trials])[:, None] * first.units**2
    holder = (pushes, wanted, given)
    _assemble(motion, asked, holder, (load, tangent), (missing, matrix))
    beyond = np.unique(np.nonzero(~np.isfinite(load))[0]).tolist()
    if beyond:
        matrix[beyond], missing[beyond] = np.eye(size), 0.0  # have no step
    each = enumerate(zip(_solved(matrix, -missing), matrix, strict=True))
    return [None if number in beyond else NewtonStep(*one) for number, one in each]


def _held(chains: Sequence[HeldChain], q: Array) -> tuple[Array, Array]:
    """Loads (N, n) and tangents (N, J, 6, 6) of the joints of all chains at q (N, n)."""
    seen, joints = q.reshape(-1, 6), q.shape[1] // 6
    load, tangent = np.zeros(seen.shape), np.zeros((*seen.shape, 6))
    for number, scoped in enumerate(chains[0].effects):
        values = np.concatenate([chain.values[number] for chain in chains])
        if not scoped.effect.per_joint:
            values = np.repeat(values, len(scoped.joints), axis=0)
        at: slice | Indices = slice(None)
        if scoped.joints != tuple(range(joints)):
            at = (joints * np.arange(len(chains))[:, None] + np.array(scoped.joints)).ravel()
        response = cast(JointLaw, scoped.effect).respond(seen[at], values, load[at])
        if response.by_carried is not None:
            tangent[at] += response.by_carried @ tangent[at]
        tangent[at] += response.tangent
        load[at] += response.load
    return load.reshape(q.shape), tangent.reshape(len(q), joints, 6, 6)


def _solved(matrices: Array, right: Array) -> Array:
    """(N, m) solutions of matrices (N, m, m), NaN of singular ones."""
    try:
        return np.asarray(np.linalg.solve(matrices, right[..., None]), dtype=np.float64)[..., 0]
    except np.linalg.LinAlgError:
        if len(matrices) == 1:
            return np.full(right.shape, np.nan)
        each = zip(matrices, right, strict=True)
        return np.concatenate([_solved(one[None], other[None]) for one, other in each])


def answered(asked: Sequence[tuple[int, NewtonTrial]]) -> list[NewtonStep | None]:
    """The steps of searches that advance in lockstep (`calibrate.lockstep`)."""
    return newton_steps([trial for _, trial in asked])


def alone(trial: NewtonTrial) -> NewtonStep | None:
    """The step of one chain."""
    return newton_steps([trial])[0]


def hold_at(
    chain: HeldChain, wanted: Array, start: PrescribedResult | None = None, ask: Ask = alone
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

    def __init__(self, chain: HeldChain, ask: Ask) -> None:
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
            if found is None:  # beyond the ends of a law
                step = 0.5 * step
                q[self.free] -= step[: self.count]
                pushes -= step[self.count :]
                continue
            step = found.step
            size = float((np.abs(step[: self.count]) / self.tolerance).max(initial=0.0))
            if on_path and not size <= allowed:
                return None
            allowed = max(CONTRACTION * size, ROUNDED)
            q[self.free] += step[: self.count]
            pushes += step[self.count :]
            if not np.abs(q.reshape(-1, 6)[:, 3:]).max() < LARGEST_ROTATION:
                return None
            if self._arrived(step, pushes):
                return self._ended(q, pushes, wanted, found.matrix, iteration)
        return None

    def _arrived(self, step: Array, pushes: Array) -> bool:
        moved, pushed = step[: self.count], step[self.count :]
        largest = max(float(np.abs(pushes).max(initial=0.0)), SMALL_PUSH)
        near = float(np.abs(pushed).max(initial=0.0)) < PUSH_TOLERANCE * largest
        return near and bool((np.abs(moved) < self.tolerance).all())

    def _ended(
        self, q: Array, pushes: Array, wanted: Array, matrix: Array, iterations: int
    ) -> PrescribedResult:
        missed = wanted - self.chain.reached(q)
        answers = Answers(matrix, self.free)
        if self._stands(matrix):
            return PrescribedResult(
                q, pushes, missed, PrescribedStatus.CONVERGED, "", iterations, answers
            )
        return PrescribedResult(
            q, pushes, missed, PrescribedStatus.UNSTABLE, UNSTABLE, iterations, answers
        )

    def _stands(self, matrix: Array) -> bool:
        """Whether the work grows along all that the prescriptions leave open."""
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
            if found is not None and found.status is PrescribedStatus.CONVERGED:
                last, reached, increment = found, target, 2.0 * increment
            elif increment > SMALLEST_FRACTION:
                increment *= 0.5
            else:
                return self._stopped(last, rest, wanted)
        return last

    def _stopped(
        self, last: PrescribedResult, rest: PrescribedResult, wanted: Array
    ) -> PrescribedResult:
        """The way ends: no pose has what is wanted, or none that stands."""
        near = self.nearest(rest, wanted)
        if np.abs(near.missed / self.units).max() > REACHED:
            return near
        left = wanted - self.chain.reached(last.q)
        return replace(last, missed=left, status=PrescribedStatus.UNSTABLE, message=UNSTABLE)

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
