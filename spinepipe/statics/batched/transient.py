"""Many runs that settle, in lockstep: the integrator of `statics.transient`, lane by lane.

A lane that others follow chooses its steps of time by its own error; the others take the very same
steps, so that their ends are smooth functions of what they differ in.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects.contract import Array, Indices
from spinepipe.statics.batched.dynamics import BatchedLUFactors, Moving, tangents_of
from spinepipe.statics.batched.effects import Bound
from spinepipe.statics.batched.forward_kinematics import forward_kinematics
from spinepipe.statics.batched.loads import Loads, part, with_dead_loads
from spinepipe.statics.batched.stack import Stack
from spinepipe.statics.equilibrium import LARGEST_ROTATION
from spinepipe.statics.transient import (
    ABSOLUTE_TOLERANCE,
    ALPHA,
    COUPLING,
    END_ONLY,
    ERROR_WEIGHTS,
    FIRST_STEP_S,
    GAMMA,
    MOST_STEPS,
    RELATIVE_TOLERANCE,
    SMALLEST_STEP_S,
    STAGE_TIMES,
    TIME_WEIGHTS,
    WEIGHTS,
    Course,
    new_size,
)

Flags = NDArray[np.bool_]

TOO_MANY = f"not there after {MOST_STEPS} steps"
TOO_SMALL = "the step size went to zero"
LOST = "the steps of the run that it follows lead it nowhere"


@dataclass(frozen=True, eq=False)
class CourseEnds:
    """Where lanes are at the end of their course.

    Attributes
    ----------
    q : (L, J, 6); NaN where the end was not reached.
    trouble : by lane, why not. sizes : by leading lane, its steps of time, s.
    """

    q: Array
    trouble: dict[int, str]
    sizes: dict[int, tuple[float, ...]]


def settle(stack: Stack, course: Course, leads: Indices) -> CourseEnds:
    """Let all lanes move from rest in the neutral pose until the course ends.

    Parameters
    ----------
    stack : its runs have one step each, masses, and no laws that remember.
    leads : (L,) the lane whose steps of time each one takes; its own number for a leading one.
    """
    if stack.loads.supports.there:
        raise ValueError("a rig that fixes joint coordinates holds no spine that moves")
    runs = _Runs(stack, course, leads)
    while len(lanes := runs.on_their_way()):
        runs.advance(lanes)
    q = runs.q.copy()
    q[list(runs.trouble)] = np.nan
    sizes = {lane: tuple(runs.sizes[lane]) for lane in np.unique(leads).tolist()}
    return CourseEnds(q, runs.trouble, sizes)


@dataclass(frozen=True, eq=False)
class _Acting:
    """What acts on some lanes: loads without and with the listed ones, and laws."""

    lanes: Indices
    bare: Loads
    full: Loads
    bound: Bound

    def at(self, share: Array) -> Loads:
        """The loads with a share (N,) of the listed ones."""
        if (share == 1.0).all():
            return self.full
        part = share[:, None, None]
        return self.full._replace(
            forces=self.bare.forces + part * (self.full.forces - self.bare.forces),
            moments=self.bare.moments + part * (self.full.moments - self.bare.moments),
        )


class _Runs:
    """Integration state of all lanes: poses, rates; times and step sizes of the leading ones."""

    def __init__(self, stack: Stack, course: Course, leads: Indices) -> None:
        self.stack, self.course, self.leads = stack, course, leads
        self.q = np.zeros((len(leads), stack.joints, 6))
        self.rates = np.zeros_like(self.q)
        self.time = np.zeros(len(leads))
        self.size = np.full(len(leads), FIRST_STEP_S)
        self.tries = 0
        self.trouble: dict[int, str] = {}
        self.sizes: dict[int, list[float]] = {lane: [] for lane in np.unique(leads).tolist()}
        self.tolerance = END_ONLY * ABSOLUTE_TOLERANCE
        self._now: _Acting | None = None
        # what acts when none of the listed loads does
        forces, moments = 0.0 * stack.listed.forces, 0.0 * stack.listed.moments
        off = stack.listed._replace(forces=forces, moments=moments)
        self._bare = with_dead_loads(stack.effects.dead, stack.chains, off, stack.run)

    def on_their_way(self) -> Indices:
        """Lanes that have not arrived, are in no trouble, and whose leading lanes are neither."""
        going = self.time < self.course.duration_s * (1.0 - 1e-12)
        going[list(self.trouble)] = False
        alone = np.ones(len(going), dtype=bool)
        alone[list(self.trouble)] = False
        return np.flatnonzero(going[self.leads] & alone)

    def acting(self, lanes: Indices) -> _Acting:
        """What acts on lanes; bound anew only where others are on their way than before."""
        if self._now is None or not np.array_equal(self._now.lanes, lanes):
            bound = self.stack.bound(lanes, {})
            bare, full = part(self._bare, lanes), part(self.stack.loads, lanes)
            self._now = _Acting(lanes, bare, full, bound)
        return self._now

    def advance(self, lanes: Indices) -> None:
        """One try of a step by every lane on its way."""
        leads = self.leads[lanes]
        self.tries += 1
        corner = np.minimum(self.course.corners_after(self.time[leads]), self.course.duration_s)
        size = np.minimum(self.size[leads], corner - self.time[leads])
        with np.errstate(all="ignore"):  # lanes that are lost are told by their errors
            q, rates, error = _RosenbrockStep(self, lanes, self.time[leads], size).taken()
        # those that follow take what their leading lane accepts
        own = np.full(len(self.leads), np.inf)
        own[lanes] = error
        accepted = own[leads] <= 1.0
        there = lanes[accepted]
        self.q[there], self.rates[there] = q[accepted], rates[accepted]
        for lane, step, good in zip(lanes.tolist(), size.tolist(), accepted.tolist(), strict=True):
            if lane == self.leads[lane]:
                self._arrive(lane, step, float(own[lane]), good)
        # lanes that the step led nowhere, or beyond joint motion
        turned = np.abs(self.q[there][..., 3:]).max(axis=(1, 2), initial=0.0)
        for lane in there[~np.isfinite(error[accepted])].tolist():
            self.trouble[lane] = LOST
        for lane in there[~(turned < LARGEST_ROTATION)].tolist():
            when = self.time[self.leads[lane]]
            self.trouble.setdefault(lane, f"tips over: beyond 80 degrees at {when:.3f} s")

    def _arrive(self, lane: int, size: float, error: float, accepted: bool) -> None:
        """A leading lane's time and next step size."""
        if accepted:
            self.time[lane] += size
            self.sizes[lane].append(size)
        self.size[lane] = new_size(size, error)
        if accepted:
            return
        if self.tries >= MOST_STEPS:
            self.trouble[lane] = TOO_MANY
        elif self.size[lane] < SMALLEST_STEP_S:
            self.trouble[lane] = TOO_SMALL


class _RosenbrockStep:
    """One step of N lanes by the four stages of ROS34PW2."""

    def __init__(self, runs: _Runs, lanes: Indices, time: Array, size: Array) -> None:
        self.runs, self.time = runs, time
        self.acting = runs.acting(lanes)
        self.chain = self.acting.full.chain
        self.damping = runs.stack.chains.damping[self.chain].reshape(len(lanes), -1)
        self.q0, self.v0 = (
            numbers[lanes].reshape(len(lanes), -1) for numbers in (runs.q, runs.rates)
        )
        self.size = size[:, None]

    def taken(self) -> tuple[Array, Array, Array]:
        """Poses, rates and errors at its end; the equations are told in `statics.transient`."""
        size, implicit = self.size, self.size * GAMMA
        moving, force = self._force(self.q0, self.v0, self.time)
        tangents, identity = tangents_of(moving.seen), np.eye(self.q0.shape[1])
        square = implicit[..., None]
        lu = BatchedLUFactors(
            moving.mass + identity * (implicit * self.damping)[:, None] + square**2 * tangents
        )
        ramp = self._ramp(moving)
        stages = np.zeros((4, 2, *self.q0.shape))  # rates of change of pose and rate
        for i in range(4):
            (coupled_q, coupled_v), (along, gained) = (
                size * _mixed(weights[i], stages) for weights in (COUPLING, ALPHA)
            )
            rate = self.v0 + gained
            if i:
                time = self.time + STAGE_TIMES[i] * size[:, 0]
                force = self._later_force(self.q0 + along, rate, time, moving)
            # the Jacobian's terms of earlier stages, and of this one's own known part
            drift = rate + coupled_v
            pulled = (tangents @ (implicit * drift + coupled_q)[..., None])[..., 0]
            load = force - pulled - self.damping * coupled_v
            stages[i, 1] = lu.solve(load + size * TIME_WEIGHTS[i] * ramp)
            stages[i, 0] = drift + implicit * stages[i, 1]
        moved, gained = size * _mixed(WEIGHTS, stages)
        shape = (len(size), -1, 6)
        q, v = (self.q0 + moved).reshape(shape), (self.v0 + gained).reshape(shape)
        error = np.abs(size * _mixed(ERROR_WEIGHTS, stages)[0]).reshape(shape)
        scale = self.runs.tolerance + END_ONLY * RELATIVE_TOLERANCE * np.abs(q)
        return q, v, (error / scale).max(axis=(1, 2))

    def _force(self, q: Array, rate: Array, time: Array) -> tuple[Moving, Array]:
        """Lanes at q (N, n) and the generalised force (N, n) that accelerates them."""
        stack, pose = self.runs.stack, q.reshape(len(q), -1, 6)
        held = self.acting.bound.joint_forces(pose)
        loads = self.acting.at(self.runs.course.shares(time))
        seen = forward_kinematics(stack.chains, loads, pose, held.tangent)
        moving = Moving.of(stack.chains, self.chain, seen)
        missing = (seen.applied - held.load).reshape(q.shape)
        inertial = moving.velocity_product_forces(rate.reshape(len(q), -1, 6)).reshape(q.shape)
        return moving, missing - inertial - self.damping * rate

    def _later_force(self, q: Array, rate: Array, time: Array, start: Moving) -> Array:
        """The force of a later stage, for the mass matrix at the step's start: M0 M^-1 F."""
        moving, force = self._force(q, rate, time)
        found: Array = (start.mass @ moving.accelerations(force)[..., None])[..., 0]
        return found

    def _ramp(self, moving: Moving) -> Array:
        """(N, n) rate of change of the applied load at the start; the load is linear in time."""
        course = self.runs.course
        ramp = np.zeros_like(self.q0)
        if (course.shares(self.time) == 1.0).all():
            return ramp
        # difference to what is applied at the next corner, at the same pose
        corner = course.corners_after(self.time)
        on = np.isfinite(corner)
        if not on.any():
            return ramp
        loads = self.acting.at(course.shares(np.where(on, corner, self.time)))
        pose = self.q0.reshape(len(ramp), -1, 6)
        then = forward_kinematics(self.runs.stack.chains, loads, pose, np.zeros((*pose.shape, 6)))
        change = (then.applied - moving.seen.applied).reshape(ramp.shape)
        ramp[on] = change[on] / (corner - self.time)[on, None]
        return ramp


def _mixed(weights: Array, stages: Array) -> Array:
    """(2, N, n) weighted sum of stages (4, 2, N, n)."""
    found: Array = weights @ stages.reshape(4, -1)
    return found.reshape(stages.shape[1:])
