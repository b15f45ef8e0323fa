"""A chain of joint laws with places of vertebrae prescribed: its equations and Newton's steps.

Each prescription is a number g that the pose decides: how far a point lies along a direction, how
far a line is tilted in a plane. The holder pushes along the slope of g with what it takes to keep g
where it shall be, so equilibrium is

    F(q) - sum_k p_k dg_k/dq = 0 on the free coordinates,    g_k(q) = wanted_k

with F what the joints hold less what is applied (Lagrange's multipliers p). Newton takes the exact
tangents of both. With a compliance c the holder gives way: g_k(q) + c_k p_k = wanted_k.

Newton asks for one step at a time. Whoever holds many chains may answer many such questions at once
(`newton_steps`, `calibrate.lockstep`); what is answered does not hang on what stands beside it.
"""

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass
from typing import NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects import EffectKind, JointLaw
from spinepipe.effects.contract import Array
from spinepipe.model import SpineModel
from spinepipe.statics.batched.dynamics import add_cross
from spinepipe.statics.batched.forward_kinematics import unloaded_kinematics
from spinepipe.statics.batched.vectors import Plain, compiled
from spinepipe.statics.joint_forces import NO_STATES, ActiveLaw, assemble_joint_forces
from spinepipe.statics.joint_kinematics import JointKinematics

Flags = NDArray[np.bool_]


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
def _value_and_wrench(
    is_tilt: bool, vectors: Array, turned: Array, shifted: Array, wrench: Array, by_twist: Array
) -> float:
    """Value of a prescription; its wrench (6,) on the vertebra and the slope (3, 6) of that.

    The work of the wrench, moment about the origin of ground and force, is what the value grows by.
    By the vertebra's twist (angular, linear) only the moment changes.
    """
    # the point, or the line (which shifts do not move), as the vertebra carries it
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
    if not is_tilt:  # g = point . direction: a unit force along the direction at the point
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
    # g = atan2(line . aside, line . up): a moment alone, line x gradient of the angle by the line
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
        for r in range(3):  # second derivatives of atan2, symmetric and without trace
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
        # what is missing begins with what the joints hold
        matrix[:] = 0.0
        for i in range(count):
            missing[i] = loads[n, free[i]]
        own[:] = 0.0
        turning[:] = 0.0
        for p in range(len(bodies)):
            b, push = bodies[p], every_push[n, p]
            value = _value_and_wrench(
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
                if free[i] // 6 > b:  # a joint above the vertebra does not move it
                    continue
                # row: spatial cross product of the axis with the wrench, S x* W (as C of
                # `forward_kinematics`); work: slope of g along the axis
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
        # second derivatives of all p g, and the joints' own tangents on the diagonal blocks
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


class PrescribedChain:
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

    def with_values(self, values: Sequence[Array]) -> "PrescribedChain":
        """The same with other values of the laws."""
        other = copy(self)
        other.values = tuple(values)
        return other

    def motion(self, q: Array) -> tuple[Array, Array, Array]:
        """(J, 6, 6) axes and displacements of vertebrae at q (n,), as of `KinematicsAndLoads`."""
        rotations, origins = self.frames
        axes, turned, shifted = unloaded_kinematics(
            rotations[None], origins[None], q.reshape(1, -1, 6)
        )
        return axes[0], turned[0], shifted[0]

    def reached(self, q: Array) -> Array:
        """(k,) m and rad, what is prescribed as it is at q (n,)."""
        (_, turned, shifted), (tilts, bodies, _) = self.motion(q), self.asked
        wrench, by_twist = np.empty(6), np.empty((3, 6))
        each = zip(tilts, bodies, self.vectors, strict=True)
        return np.array(
            [_value_and_wrench(t, v, turned[b], shifted[b], wrench, by_twist) for t, b, v in each]
        )


class NewtonTrial(NamedTuple):
    """A pose q (n,) and pushes (k,) of a chain, where one of Newton's steps is asked for.

    Attributes
    ----------
    wanted : (k,) m and rad, value of each prescription. compliance : of the holder.
    """

    chain: PrescribedChain
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
    motion = unloaded_kinematics(rotations, origins, q.reshape(len(q), -1, 6))
    load, tangent = _joint_forces(chains, q)
    asked = (tilts, bodies, np.array([one.vectors for one in chains]), free)
    size = len(free) + len(bodies)
    missing, matrix = np.empty((len(q), size)), np.empty((len(q), size, size))
    given = np.array([one.compliance for one in trials])[:, None] * first.units**2
    holder = (pushes, wanted, given)
    _assemble(motion, asked, holder, (load, tangent), (missing, matrix))
    beyond = np.unique(np.nonzero(~np.isfinite(load))[0]).tolist()
    if beyond:
        matrix[beyond], missing[beyond] = np.eye(size), 0.0  # have no step
    each = enumerate(zip(_solve_stack(matrix, -missing), matrix, strict=True))
    return [None if number in beyond else NewtonStep(*one) for number, one in each]


def _joint_forces(chains: Sequence[PrescribedChain], q: Array) -> tuple[Array, Array]:
    """Loads (N, n) and tangents (N, J, 6, 6) of the joints of all chains at q (N, n)."""
    joints, laws = q.shape[1] // 6, []
    for number, scoped in enumerate(chains[0].effects):
        values = np.concatenate([chain.values[number] for chain in chains])
        if not scoped.effect.per_joint:
            values = np.repeat(values, len(scoped.joints), axis=0)
        at = (joints * np.arange(len(chains))[:, None] + np.array(scoped.joints)).ravel()
        laws.append(ActiveLaw(cast(JointLaw, scoped.effect), number, at, values, per_joint=True))
    seen = JointKinematics.unmoved(q.reshape(-1, 6))
    held = assemble_joint_forces(seen, laws, NO_STATES, moved=False)
    return held.load.reshape(q.shape), held.tangent.reshape(len(q), joints, 6, 6)


def _solve_stack(matrices: Array, right: Array) -> Array:
    """(N, m) solutions of matrices (N, m, m), NaN of singular ones."""
    try:
        return np.asarray(np.linalg.solve(matrices, right[..., None]), dtype=np.float64)[..., 0]
    except np.linalg.LinAlgError:
        if len(matrices) == 1:
            return np.full(right.shape, np.nan)
        each = zip(matrices, right, strict=True)
        return np.concatenate([_solve_stack(one[None], other[None]) for one, other in each])
