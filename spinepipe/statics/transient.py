"""Damped motion under constant or ramped load: the papers' quasi-static and dynamic loading.

    M(q) q'' + bias(q, q') + C q' + holding(q) - applied(q, t) = 0

on PyBullet's mass matrix and bias loads, integrated implicitly: springs of this stiffness need
microsecond steps otherwise. The end is compared with the equilibrium under the final load.

The method is ROS34PW2, four-stage, third-order, L-stable and linearly implicit, for approximate
Jacobians (Rang and Angermann 2005, BIT 45:761-787, doi 10.1007/s10543-005-0035-y). A W-method keeps
its order when the Jacobian is only approximate, so the mass matrix may be taken as constant within
a step although it follows the pose.

Derivatives of the end are differences over the same steps in time. With its steps held the end is
smooth: on L1-L4 a difference is within 1e-6 of the derivative.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg.lapack import dgetrf, dgetrs, dpotrf, dpotrs

from spinepipe.effects.contract import Array
from spinepipe.statics.equilibrium import LARGEST_ROTATION, solve
from spinepipe.statics.joint_forces import NO_STATES
from spinepipe.statics.motion import ChainMotion
from spinepipe.statics.system import Loading, System
from spinepipe.status import Status


@dataclass(frozen=True)
class Program:
    """Loadings at times, straight lines in between, the last one held.

    Attributes
    ----------
    times : (T,) s, increasing, first 0.
    """

    times: tuple[float, ...]
    loadings: tuple[Loading, ...]

    @classmethod
    def constant(cls, loading: Loading) -> "Program":
        """The loading switched on at time zero and held."""
        return cls((0.0,), (loading,))

    def at(self, time: float) -> Loading:
        """Loading at a time in s."""
        later = int(np.searchsorted(self.times, time, side="right"))
        if later == len(self.times):
            return self.loadings[-1]
        start, end = self.times[later - 1], self.times[later]
        fraction = (time - start) / (end - start)
        return self.loadings[later - 1].towards(self.loadings[later], fraction)

    def corner_after(self, time: float) -> float:
        """The next time at which the load changes its rate; infinity after the last."""
        return next((t for t in self.times if t > time * (1.0 + 1e-12) + 1e-15), np.inf)


@dataclass(frozen=True)
class Course:
    """The time course of a load step: its load comes on, is held, and the pose is read.

    Attributes
    ----------
    duration_s : when the pose is read. ramp_s : how long the load grows, 0 for at once; weight
        acts from the start.
    steps_per_s : times per second at which the growing load is given, straight in between.
    """

    duration_s: float
    ramp_s: float = 0.0
    steps_per_s: float = 25.0

    def program(self, loading: Loading) -> Program:
        """The program that ends in a loading."""
        if self.ramp_s == 0.0:
            return Program.constant(loading)
        weight = replace(loading, forces=0.0 * loading.forces, moments=0.0 * loading.moments)
        shares = self.shares(self.corners)
        loadings = tuple(weight.towards(loading, share) for share in shares.tolist())
        return Program(tuple(self.corners.tolist()), loadings)

    @cached_property
    def corners(self) -> Array:
        """(T,) s, times at which the load is given, straight in between; the first is 0."""
        count = max(1, round(self.ramp_s * self.steps_per_s))
        return self.ramp_s * np.linspace(0.0, 1.0, count + 1) if self.ramp_s else np.zeros(1)

    def shares(self, times: Array) -> Array:
        """Share of the load that is on at each of the times."""
        return np.clip(times / self.ramp_s, 0.0, 1.0) if self.ramp_s else np.ones_like(times)

    def corners_after(self, times: Array) -> Array:
        """The next time at which the load changes its rate, for each of the times; or infinity."""
        corners = np.append(self.corners, np.inf)
        behind = times * (1.0 + 1e-12) + 1e-15  # of times that are a corner but for rounding
        following: Array = corners[np.searchsorted(corners, behind, side="right")]
        return following


GAMMA = 4.3586652150845900e-01
"""Diagonal coefficient of all stages, so that one factorisation serves all four."""

ALPHA = np.array(
    [
        [0.0, 0.0, 0.0, 0.0],
        [8.7173304301691801e-01, 0.0, 0.0, 0.0],
        [8.4457060015369423e-01, -1.1299064236484185e-01, 0.0, 0.0],
        [0.0, 0.0, 1.0, 0.0],
    ]
)
"""(4, 4) weights of earlier stages in the point at which a stage is evaluated."""

COUPLING = np.array(
    [
        [0.0, 0.0, 0.0, 0.0],
        [-8.7173304301691801e-01, 0.0, 0.0, 0.0],
        [-9.0338057013044082e-01, 5.4180672388095326e-02, 0.0, 0.0],
        [2.4212380706095346e-01, -1.2232505839045147e00, 5.4526025533510214e-01, 0.0],
    ]
)
"""(4, 4) weights of earlier stages in the Jacobian term (gamma_ij, j < i)."""

WEIGHTS = np.array([2.4212380706095346e-01, -1.2232505839045147e00, 1.5452602553351020e00, GAMMA])
EMBEDDED = np.array(
    [
        3.7810903145819369e-01,
        -9.6042292212423178e-02,
        5.0000000000000000e-01,
        2.1793326075422950e-01,
    ]
)
"""(4,) weights of the second-order result, for the error."""

ERROR_WEIGHTS = WEIGHTS - EMBEDDED
"""(4,) the third-order result less the embedded second-order one."""

STAGE_TIMES = ALPHA.sum(axis=1)
"""(4,) when a stage is evaluated, as a share of the step."""

TIME_WEIGHTS = COUPLING.sum(axis=1) + GAMMA
"""(4,) weight of the load's rate of change in each stage."""


MOST_STEPS = 20_000
FIRST_STEP_S = 1e-5
SMALLEST_STEP_S = 1e-12
RELATIVE_TOLERANCE = 4e-5
ABSOLUTE_TOLERANCE = np.array([4e-9] * 3 + [4e-7] * 3)
"""m and rad per step; keeps the trajectory within 0.1 % of its peak."""

END_ONLY = 10.0
"""Coarser tolerances where only the end counts: early errors decay. On L1-L4 after 1.5 s and after
a ramp of 1 s it moves the end by less than 1e-4 of any coordinate."""

STEP = 1e-6
"""Change of an unknown: well above rounding and well below where the retraced end bends."""

_WEIGHTLESS = np.zeros(3)  # where weight is part of the residual


@dataclass(frozen=True)
class TransientResult:
    """End of a settling run.

    Attributes
    ----------
    q, rate : (n,) pose and rate at the end.
    history : (len(times), n) poses at asked times, NaN where the run did not get there.
    remaining : (n,) equilibrium pose less end pose; None when there is no equilibrium, or when it
        was not looked for.
    sizes : s, the steps of time that were taken.
    """

    q: Array
    rate: Array
    history: Array
    remaining: Array | None
    status: Status
    message: str
    sizes: tuple[float, ...]


def settle(
    system: System, program: Program, duration: float, times: Sequence[float] = ()
) -> TransientResult:
    """Let the chain move from rest in the neutral pose for ``duration`` seconds.

    Status ``converged`` says that the run reached its end and that there is an equilibrium;
    ``remaining`` how far it still moves.
    """
    end = move(system, program, duration, times)
    if end.status is Status.REFUSED:
        return end
    final = program.at(duration)
    neutral = np.zeros(system.chain.n)
    equilibrium = solve(system, neutral, system.slots.unloaded(), final, NO_STATES, end.q)
    if equilibrium.status is Status.CONVERGED:
        return replace(end, remaining=equilibrium.q - end.q)
    if not end.status.usable:
        return end
    return replace(end, status=Status.UNSTABLE, message=f"moving away: {equilibrium.message}")


def move(
    system: System,
    program: Program,
    duration: float,
    times: Sequence[float] = (),
    coarseness: float = 1.0,
) -> TransientResult:
    """As `settle`, without looking for the equilibrium: ``converged`` means the end was reached.

    ``coarseness`` multiplies the tolerances, see `END_ONLY`.
    """
    refusal = no_settling(system)
    if refusal:
        nothing = np.zeros(system.chain.n)
        history = np.full((len(times), system.chain.n), np.nan)
        return TransientResult(nothing, nothing, history, None, Status.REFUSED, refusal, ())
    run = _Run(system, program, coarseness)
    history = run.to(duration, times)
    return TransientResult(
        run.q, run.rate, history, None, run.status, run.message, tuple(run.sizes)
    )


def retrace(system: System, program: Program, sizes: Sequence[float]) -> Array | None:
    """(n,) end pose after the very steps of another run, or None when they do not lead there.

    Steps of fixed size make the end a smooth function of the model, which it is not where each
    run chooses its own: the way to its derivative (internal numerical differentiation, Bock 1981).
    """
    run = _Run(system, program)
    for size in sizes:
        if not run.take(size):
            return None
    return run.q


def no_settling(system: System) -> str | None:
    """Why the chain cannot move in time, or None when it can."""
    if len(system.fixed):
        return (
            "a rig that fixes joint coordinates holds no spine that moves: use equilibrium loading"
        )
    if system.paths:
        return "path effects advance by load step, not in time: use equilibrium loading"
    _, singular = dpotrf(system.chain.mass_matrix(np.zeros(system.chain.n)), lower=True)
    if singular:
        return "every vertebra needs mass and inertia to move in time (bodies.csv)"
    return None


def new_size(size: float, error: float) -> float:
    """The step to try after one of that size and scaled error."""
    # the error of the second-order result grows with the cube of the step: usual step control, with
    # a safety factor, and no change to less than a fifth or more than six times (Hairer & Wanner)
    growth = 0.9 * max(error, 1e-3) ** (-1.0 / 3.0) if np.isfinite(error) else 0.2
    return size * float(np.clip(growth, 0.2, 6.0))


class _Run:
    """Integration state: pose, rate, time and step size."""

    def __init__(self, system: System, program: Program, coarseness: float = 1.0) -> None:
        self.system, self.program = system, program
        self.q, self.rate = np.zeros((2, system.chain.n))
        self.damping = system.model.damping.ravel()
        self.time, self.size, self.tries = 0.0, FIRST_STEP_S, 0
        self.sizes: list[float] = []
        self.status, self.message = Status.CONVERGED, ""
        self.absolute = coarseness * np.tile(ABSOLUTE_TOLERANCE, system.model.n_joints)
        self.relative = coarseness * RELATIVE_TOLERANCE

    def to(self, duration: float, times: Sequence[float]) -> Array:
        """Advance to the end; (len(times), n) poses at the asked times on the way."""
        history = np.full((len(times), len(self.q)), np.nan)
        while self.time < duration * (1.0 - 1e-12):
            before = (self.time, self.q, self.rate)
            if not self._advance(min(duration, self.program.corner_after(self.time))):
                break
            for index, time in enumerate(times):
                if before[0] <= time <= self.time:
                    history[index] = _between(before, (self.time, self.q, self.rate), time)
        return history

    def _advance(self, limit: float) -> bool:
        """One accepted step, not beyond the limit."""
        while True:
            self.tries += 1
            if self.tries > MOST_STEPS:
                return self._stop(Status.NOT_CONVERGED, f"not there after {MOST_STEPS} steps")
            if self.size < SMALLEST_STEP_S:
                return self._stop(Status.NOT_CONVERGED, "the step size went to zero")
            size = min(self.size, limit - self.time)
            q, rate, error = self._try(size)
            accepted = bool(np.isfinite(error)) and error <= 1.0
            if accepted:
                self._arrive(q, rate, size)
            self.size = new_size(size, error)
            if accepted:
                return self._within_motion()

    def take(self, size: float) -> bool:
        """One step of that size, whatever its error."""
        q, rate, error = self._try(size)
        if not np.isfinite(error):
            return self._stop(Status.NOT_CONVERGED, "the step leads nowhere")
        self._arrive(q, rate, size)
        return self._within_motion()

    def _arrive(self, q: Array, rate: Array, size: float) -> None:
        self.q, self.rate, self.time = q, rate, self.time + size
        self.sizes.append(size)

    def _within_motion(self) -> bool:
        if np.abs(self.q.reshape(-1, 6)[:, 3:]).max() < LARGEST_ROTATION:
            return True
        return self._stop(Status.UNSTABLE, f"tips over: beyond 80 degrees at {self.time:.3f} s")

    def _stop(self, status: Status, message: str) -> bool:
        self.status, self.message = status, message
        return False

    def _try(self, size: float) -> tuple[Array, Array, float]:
        """One ROS34PW2 step of that size: pose, rate and scaled error after it.

        The equations of motion M v' = F(q, v, t), q' = v are a system of twice the size with the
        mass matrix diag(1, M) and the Jacobian ((0, 1), (-K, -C)), in which K and C are the tangent
        and the damping; how M and the inertial loads change is left out, as a W-method allows.
        Stage i has rates of change (a, b) of pose and rate with

            a = v_i + h sum_(j<i) gamma_ij b_j + h gamma b,
            M b = F(q_i, v_i, t_i) - K h (sum_(j<i) gamma_ij a_j + gamma a)
                  - C h (sum_(j<i) gamma_ij b_j + gamma b) + h gamma_i F_t,

        at the point (q_i, v_i, t_i) that the ALPHA of earlier stages give. With the first put into
        the second, (M + h gamma C + (h gamma)^2 K) b is left to be solved for: size n, not 2 n.
        """
        balance = self.system.balance(self.q, self.program.at(self.time), NO_STATES)
        mass = self.system.chain.mass_matrix(self.q)
        implicit = size * GAMMA
        lu, pivots, _ = dgetrf(
            mass + np.diag(implicit * self.damping) + implicit**2 * balance.tangent
        )
        ramp = self._ramp(balance.residual)
        stage_q, stage_v = np.zeros((2, 4, len(self.q)))
        for i in range(4):
            q = self.q + size * (ALPHA[i] @ stage_q)
            rate = self.rate + size * (ALPHA[i] @ stage_v)
            coupled_q, coupled_v = COUPLING[i] @ stage_q, COUPLING[i] @ stage_v
            if i == 0:  # at the start, where the balance is known and the mass matrix is M itself
                force = self._force(q, rate, balance.residual)
            else:
                force = self._later_force(q, rate, self.time + STAGE_TIMES[i] * size, mass)
            # what is known of the Jacobian terms: all but those with this stage's own b
            drift = rate + size * coupled_v
            force -= balance.tangent @ (implicit * drift + size * coupled_q)
            force -= self.damping * (size * coupled_v)
            force += size * TIME_WEIGHTS[i] * ramp
            stage_v[i] = dgetrs(lu, pivots, force)[0]
            stage_q[i] = drift + implicit * stage_v[i]
        # third-order result, and how far the embedded second-order pose is from it
        error = size * (ERROR_WEIGHTS @ stage_q)
        q = self.q + size * (WEIGHTS @ stage_q)
        scale = self.absolute + self.relative * np.abs(q)
        return q, self.rate + size * (WEIGHTS @ stage_v), float(np.max(np.abs(error) / scale))

    def _force(self, q: Array, rate: Array, residual: Array) -> Array:
        """(n,) generalised force that accelerates the chain."""
        inertial = self.system.chain.bias(q, rate, _WEIGHTLESS)
        force: Array = -residual - inertial - self.damping * rate
        return force

    def _later_force(self, q: Array, rate: Array, time: float, mass: Array) -> Array:
        """The force of a later stage, for the mass matrix at the step's start: M0 M^-1 F.

        The method takes M as constant; so scaled, M0 v' = M0 M^-1 F is the motion that M has there.
        """
        system, loading = self.system, self.program.at(time)
        residual = system.weightless_residual(ChainMotion(system.chain, q), loading, NO_STATES)
        weight_and_inertia = system.chain.bias(q, rate, loading.share * system.model.gravity)
        force = -residual - weight_and_inertia - self.damping * rate
        lower, _ = dpotrf(system.chain.mass_matrix(q), lower=True)
        acceleration, _ = dpotrs(lower, force, lower=True)
        return mass @ acceleration

    def _ramp(self, residual: Array) -> Array:
        """(n,) rate of change of the applied load at this pose; the load is linear in time."""
        corner = self.program.corner_after(self.time)
        if corner == np.inf:
            return np.zeros_like(self.q)
        end = self.system.residual(self.q, self.program.at(corner), NO_STATES)
        ramp: Array = (residual - end) / (corner - self.time)
        return ramp


def _between(
    before: tuple[float, Array, Array], after: tuple[float, Array, Array], time: float
) -> Array:
    """(n,) pose at a time inside a step, by the cubic through both ends' poses and rates."""
    (t0, q0, v0), (t1, q1, v1) = before, after
    span = t1 - t0
    s = (time - t0) / span
    value: Array = (
        (1 + 2 * s) * (1 - s) ** 2 * q0
        + s * (1 - s) ** 2 * span * v0
        + s**2 * (3 - 2 * s) * q1
        + s**2 * (s - 1) * span * v1
    )
    return value
