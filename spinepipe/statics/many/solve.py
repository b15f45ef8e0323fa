"""Equilibria of many spines that differ in numbers alone.

Those that Newton reaches at once and that are stable for sure are solved together, in numpy. All
others, and models with effects that are not laws of single joints, go to the engine of record.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects import Kind
from spinepipe.effects.contract import Array
from spinepipe.model import RefusedModel, ScopedEffect
from spinepipe.statics.holding import hold
from spinepipe.statics.many.balance import Loads, held
from spinepipe.statics.many.motion import moved
from spinepipe.statics.many.newton import arrive
from spinepipe.statics.many.spines import Cases, Spines
from spinepipe.statics.many.steady import surely_stable
from spinepipe.statics.path import follow
from spinepipe.statics.status import Status
from spinepipe.statics.system import System
from spinepipe.world import Chain

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
