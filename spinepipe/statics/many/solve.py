"""Equilibria of many spines that differ in numbers alone, solved together in numpy.

Newton runs on all chains at once, each until it has arrived, as the engine judges. Those that it
does not reach at once or that are not stable for sure, and models with effects that are not laws of
single joints, go to the engine of record.

Stable for sure: in coordinates where damping is one, M x'' + x' + (S + A) x = 0, with the tangent's
symmetric and skew parts S and A. Both tests stand on an energy whose decay proves stability:

V = x'.Mx' / 2 + e x'.Mx + x.(S + e) x / 2,  dV/dt = -x'.(1 - e M) x' - x'.A x - e x.S x,

so that motion decays if S - A^T (1 - e M)^-1 A / (4 e) is positive definite for any e < 1 / |M|.
With e = 1 / (2 |M|) it is enough that S - |A|^2 |M| is, which needs no mass matrix: |M| is at most
its trace. Those that fail this are tried with the whole mass matrix.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects import Kind
from spinepipe.effects.contract import Array, Indices
from spinepipe.model import RefusedModel, ScopedEffect
from spinepipe.statics.equilibrium import LARGEST_ROTATION, MOST_ITERATIONS, STEP_TOLERANCE
from spinepipe.statics.holding import hold
from spinepipe.statics.many.motion import Loads, ManyMotion, balance, held, moved
from spinepipe.statics.many.spines import Cases, Spines
from spinepipe.statics.path import follow
from spinepipe.statics.system import System
from spinepipe.status import Status
from spinepipe.world import Chain

Flags = NDArray[np.bool_]

SHARE = 0.75
"""e times the norm of M. Of L1-L4 and T12-S1 under moments, 0.6 to 0.9 prove about as many."""

CHUNK = 40_000
"""Numbers in the tangents that are worked on together: they should stay in a core's cache."""


@dataclass(frozen=True, eq=False)
class ManySolved:
    """Poses and joint loads of M spines in T steps.

    Attributes
    ----------
    q : (M, T, J, 6) m and rad; NaN where there is no equilibrium.
    load : (M, T, J, 6) N and N m that the joints carry, conjugate to q; NaN likewise.
    status : (M, T) `Status`. messages : why not, or a warning, by (spine, step).
    by_engine : (M,) whether the engine of record solved the spine.
    """

    q: Array
    load: Array
    status: NDArray[np.str_]
    messages: dict[tuple[int, int], str]
    by_engine: NDArray[np.bool_]


def solve_many(spines: Spines, cases: Cases) -> ManySolved:
    """The same test of many spines, its steps one after the other."""
    count, steps = len(spines), len(cases.like.steps)
    joints = spines.like.n_joints
    q, load = np.full((2, count, steps, joints, 6), np.nan)
    found = ManySolved(
        q,
        load,
        np.full((count, steps), Status.CONVERGED.value, dtype="U20"),
        {},
        np.zeros(count, dtype=bool),
    )
    laws = _laws(spines, cases)
    size = max(1, CHUNK // (36 * joints**2))
    for first in range(0, count, size):
        part = slice(first, min(first + size, count))
        if laws is None:
            found.by_engine[part] = True
        else:
            found.by_engine[part] = ~_together(
                spines.part(part), cases.part(part), laws, q[part], load[part]
            )
    for number in np.flatnonzero(found.by_engine):
        _alone(spines, cases, int(number), found)
    return found


def _laws(spines: Spines, cases: Cases) -> list[tuple[int, ScopedEffect]] | None:
    """The effects at work with their places; None where one is not a law of single joints."""
    at_work = [
        (index, scoped)
        for index, scoped in enumerate(spines.like.effects)
        if scoped.in_scope(cases.like.test)
    ]
    plain = all(scoped.effect.kind is Kind.JOINT_LAW for _, scoped in at_work)
    return at_work if plain else None


def _together(
    spines: Spines,
    cases: Cases,
    laws: list[tuple[int, ScopedEffect]],
    q: Array,
    load: Array,
) -> NDArray[np.bool_]:
    """Enter poses and loads of a chunk; which of its spines are solved in all steps."""
    good = np.ones(len(spines), dtype=bool)
    pose = np.zeros(q[:, 0].shape)
    for number, step in enumerate(cases.like.steps):
        bodies = tuple(wrench.body for wrench in step.wrenches)
        those = (
            part[:, number, : len(bodies)] for part in (cases.points, cases.forces, cases.moments)
        )
        pose, tangents, arrived = arrive(spines, laws, Loads(bodies, *those), pose)
        tangents[~arrived] = np.eye(tangents.shape[1])
        good &= arrived & surely_stable(spines, moved(spines, pose), tangents)
        pose = np.where(good[:, None, None], pose, 0.0)
        q[:, number] = pose
        load[:, number] = held(spines, laws, pose).load
    return good


def _alone(spines: Spines, cases: Cases, number: int, found: ManySolved) -> None:
    """Enter poses and loads of one spine as the engine of record has them."""
    found.q[number], found.load[number] = np.nan, np.nan
    try:
        model = spines.model(number)
        system = System(Chain(model), model, cases.case(number))
        solved = follow(system)
    except RefusedModel as refusal:
        found.status[number] = Status.REFUSED.value
        found.messages[number, 0] = str(refusal)
        return
    for place, step in enumerate(solved):
        found.status[number, place] = step.equilibrium.status.value
        if step.equilibrium.message:
            found.messages[number, place] = step.equilibrium.message
        if step.usable:
            pose = step.equilibrium.q
            found.q[number, place] = pose.reshape(-1, 6)
            seen = system.placed(pose, with_parameters=False)
            carried = hold(seen, system.laws, step.states, moved=bool(system.geometry)).load
            found.load[number, place] = carried


def arrive(
    spines: Spines, effects: Sequence[tuple[int, ScopedEffect]], loads: Loads, start: Array
) -> tuple[Array, Array, Flags]:
    """Poses (M, J, 6), tangents there (M, n, n) and which chains have arrived (M,).

    A chain whose steps do not contract, or that leaves joint motion, is given up.
    """
    q = start.copy()
    count, n = len(q), 6 * q.shape[1]
    tangents = np.zeros((count, n, n))
    arrived = np.zeros(count, dtype=bool)
    open_ones: Indices = np.arange(count)
    last = np.full(count, np.inf)
    for _ in range(MOST_ITERATIONS):
        whole = len(open_ones) == count
        some = spines if whole else spines.part(open_ones)
        residual, tangent = balance(
            some, effects, loads if whole else loads.part(open_ones), q[open_ones]
        )
        step, solved = _step(tangent, residual)
        sizes = (np.abs(step) / STEP_TOLERANCE).max(axis=(1, 2))
        q[open_ones] += step
        inside = np.abs(q[open_ones][..., 3:]).max(axis=(1, 2)) <= LARGEST_ROTATION
        going = solved & inside & (sizes < 4.0 * last)
        there = going & (sizes < 1.0)
        arrived[open_ones[there]] = True
        tangents[open_ones[there]] = tangent[there]
        left = going & ~there
        open_ones, last = open_ones[left], sizes[left]
        if not len(open_ones):
            break
    return q, tangents, arrived


def _step(tangent: Array, residual: Array) -> tuple[Array, Flags]:
    """Newton steps (M, J, 6), and which tangents could be solved."""
    count, n = residual.shape
    good: Flags = np.asarray(np.isfinite(residual).all(axis=1))
    try:
        step = np.linalg.solve(tangent, -residual[:, :, None])[:, :, 0]
    except np.linalg.LinAlgError:  # one singular tangent stops all of them
        step = np.zeros((count, n))
        for number in np.flatnonzero(good):
            try:
                step[number] = np.linalg.solve(tangent[number], -residual[number])
            except np.linalg.LinAlgError:
                good[number] = False
    good &= np.isfinite(step).all(axis=1)
    return np.where(good[:, None], step, 0.0).reshape(count, -1, 6), good


def surely_stable(spines: Spines, motion: ManyMotion, tangents: Array) -> Flags:
    """(M,) False where nothing is proven; tangents (M, n, n)."""
    damping = spines.damping.reshape(len(tangents), -1)
    scale = 1.0 / np.sqrt(damping)
    scaled = tangents * scale[:, :, None] * scale[:, None, :]
    symmetric = 0.5 * (scaled + scaled.transpose(0, 2, 1))
    skew = scaled - symmetric
    twist = 0.5 * np.einsum("mij,mij->m", skew, skew)
    shift = twist * (_inertia(spines, motion).reshape(damping.shape) / damping).sum(axis=1)
    found = _positive(symmetric - shift[:, None, None] * np.eye(damping.shape[1]))
    doubt = np.flatnonzero(~found)
    if len(doubt):
        mass = _mass(spines.part(doubt), motion.part(doubt))
        mass *= scale[doubt, :, None] * scale[doubt, None, :]
        found[doubt] = _energy_decays(mass, symmetric[doubt], skew[doubt])
    return found


def _energy_decays(mass: Array, symmetric: Array, skew: Array) -> Flags:
    """The test with the whole mass matrix; the Frobenius norm is no less than |M|."""
    share = SHARE / np.linalg.norm(mass, axis=(1, 2))[:, None, None]
    room = np.eye(mass.shape[1]) - share * mass
    twist = skew.transpose(0, 2, 1) @ np.linalg.solve(room, skew) / (4.0 * share)
    return _positive(symmetric - twist)


def _positive(symmetric: Array) -> Flags:
    """Which matrices are positive definite."""
    found = np.ones(len(symmetric), dtype=bool)
    try:
        np.linalg.cholesky(symmetric)
    except np.linalg.LinAlgError:
        found = np.linalg.eigvalsh(symmetric)[:, 0] > 0.0
    return found


def _inertia(spines: Spines, motion: ManyMotion) -> Array:
    """(M, J, 6) no less than the diagonal of the mass matrix."""
    centres = motion.points(spines.coms)
    largest = np.trace(spines.inertias, axis1=2, axis2=3)
    count, joints = spines.masses.shape
    found = np.zeros((count, joints, 6))
    for body in range(joints):
        arms = centres[:, None, body] - motion.pivots[:, : body + 1]
        mass = spines.masses[:, body, None]
        found[:, : body + 1, :3] += mass[..., None]
        turned = mass * np.sum(arms**2, axis=2) + largest[:, None, body]
        found[:, : body + 1, 3:] += turned[..., None]
    return found


def _mass(spines: Spines, motion: ManyMotion) -> Array:
    """(M, n, n) mass matrices, kg, kg m and kg m2."""
    centres = motion.points(spines.coms)
    count, joints = spines.masses.shape
    found = np.zeros((count, 6 * joints, 6 * joints))
    for body in range(joints):
        velocities = motion.velocities(body, centres[:, body])
        found += spines.masses[:, body, None, None] * velocities @ velocities.transpose(0, 2, 1)
        turned, axes = motion.rotations[:, body], motion.axes(body)
        inertia = turned @ spines.inertias[:, body] @ turned.transpose(0, 2, 1)
        found += axes @ inertia @ axes.transpose(0, 2, 1)
    return found
