"""The same test of many spines that differ in numbers alone: numbers as arrays, names once."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects import Wrench
from spinepipe.effects.contract import Array, Indices
from spinepipe.frames import Pose
from spinepipe.model import Body, LoadCase, SpineModel
from spinepipe.statics.batched.equilibrium import stands
from spinepipe.statics.batched.lanes import Effects
from spinepipe.statics.batched.loads import (
    Chains,
    Flags,
    Loads,
    chains_of,
    durations,
    part,
    supports_of,
    wrenches_of,
)
from spinepipe.statics.batched.stack import Stack
from spinepipe.statics.equilibrium import RADIANS, SPACING
from spinepipe.status import Status

_NUMBERS = ("rotations", "origins", "masses", "coms", "inertias", "damping")
"""What spines share with `Chains`, by the same names."""


@dataclass(frozen=True, eq=False)
class Spines:
    """M spines that differ in numbers alone.

    Attributes
    ----------
    like : names and effects; the arrays take the place of its numbers.
    rotations, origins : (M, J, 3, 3) and (M, J, 3) m, joint frames in ground, neutral pose.
    masses, coms, inertias : (M, J) kg, (M, J, 3) m, (M, J, 3, 3) kg m2, as of `Body`.
    damping : (M, J, 6) N s/m and N m s/rad.
    values : of each effect of ``like`` (M, R, P).
    """

    like: SpineModel
    rotations: Array
    origins: Array
    masses: Array
    coms: Array
    inertias: Array
    damping: Array
    values: tuple[Array, ...]

    def __len__(self) -> int:
        return len(self.origins)

    @classmethod
    def of(cls, model: SpineModel, count: int) -> "Spines":
        """The same spine that many times."""
        chain = chains_of([model])._asdict()
        numbers = {name: _repeated(chain[name][0], count) for name in _NUMBERS}
        values = tuple(_repeated(scoped.values, count) for scoped in model.effects)
        return cls(like=model, **numbers, values=values)

    def part(self, chosen: slice | Indices) -> "Spines":
        """Some of them."""
        numbers = {name: getattr(self, name)[chosen] for name in _NUMBERS}
        return replace(self, **numbers, values=tuple(values[chosen] for values in self.values))

    def model(self, i: int) -> SpineModel:
        """One of them as a model of its own.

        Raises
        ------
        RefusedModel
            For numbers that no solver should be given.
        """
        bodies = zip(self.like.bodies, self.masses[i], self.coms[i], self.inertias[i], strict=True)
        effects = zip(self.like.effects, self.values, strict=True)
        return replace(
            self.like,
            frames=tuple(map(Pose, self.rotations[i], self.origins[i])),
            bodies=tuple(Body(b.name, float(m), c, inertia) for b, m, c, inertia in bodies),
            damping=self.damping[i],
            effects=tuple(scoped.with_values(values[i]) for scoped, values in effects),
        )


@dataclass(frozen=True, eq=False)
class Cases:
    """One test of M spines, with the same steps and loaded vertebrae.

    Attributes
    ----------
    like : names, steps, times and bodies; the arrays take the place of its numbers.
    points, forces, moments : (M, T, W, 3) m, N and N m in ground, of each step's wrenches; where
        a step has fewer than W, the last ones are zero and nobody's.
    """

    like: LoadCase
    points: Array
    forces: Array
    moments: Array

    def __len__(self) -> int:
        return len(self.points)

    @classmethod
    def of(cls, case: LoadCase, count: int) -> "Cases":
        """The same loads that many times."""
        _, *numbers = wrenches_of(case.steps)
        points, forces, moments = (_repeated(part, count) for part in numbers)
        return cls(case, points, forces, moments)

    def part(self, chosen: slice | Indices) -> "Cases":
        """Some of them."""
        return Cases(self.like, self.points[chosen], self.forces[chosen], self.moments[chosen])

    def steps(self, chosen: Sequence[int]) -> "Cases":
        """Some of the steps, by their places."""
        like = replace(self.like, steps=tuple(self.like.steps[place] for place in chosen))
        return Cases(like, self.points[:, chosen], self.forces[:, chosen], self.moments[:, chosen])

    def case(self, i: int) -> LoadCase:
        """One of them as a load case of its own."""
        steps = []
        for row, step in enumerate(self.like.steps):
            at = (self.points[i, row], self.forces[i, row], self.moments[i, row])
            every = zip(step.wrenches, *at, strict=False)  # where a step has fewer, the rest is 0
            wrenches = tuple(Wrench(one.body, *numbers) for one, *numbers in every)
            steps.append(replace(step, wrenches=wrenches))
        return replace(self.like, steps=tuple(steps))


def stack_spines(spines: Spines, cases: Cases) -> Stack:
    """The same test of many spines, a run each."""
    count, steps = len(spines), len(cases.like.steps)
    like, test = spines.like, cases.like
    # copies, which may be written to: kernels are compiled for such arrays alone
    numbers = {name: np.array(getattr(spines, name), order="C") for name in _NUMBERS}
    chains = Chains(**numbers, gravity=np.array(_repeated(like.gravity, count), order="C"))
    row = np.tile(np.arange(steps), count)
    bodies = wrenches_of(test.steps)[0][row]
    points, forces, moments = (
        np.array(one, order="C").reshape(*bodies.shape, 3)
        for one in (cases.points, cases.forces, cases.moments)
    )
    supports = supports_of(test.steps, like.n_joints).part(row)
    chain = np.repeat(np.arange(count), steps)
    listed = Loads(chain, bodies, points, forces, moments, supports)
    return Stack.made(
        spines.model,
        cases.case,
        chains,
        Effects.of([like], [(0, test.test)]).repeated(spines.values),
        listed,
        np.full(count, steps),
        durations(test)[row],
    )


def _repeated(one: object, count: int) -> Array:
    """(count, ...) of the same numbers, kept once."""
    values = np.asarray(one, dtype=float)
    return np.broadcast_to(values, (count, *values.shape))


@dataclass(frozen=True, eq=False)
class ManySolved:
    """Poses and joint loads of M spines in A steps.

    Attributes
    ----------
    q : (M, A, J, 6) m and rad, of the steps that were asked for; NaN without equilibrium.
    load : (M, A, J, 6) N and N m that the joints carry, conjugate to q; NaN likewise.
    status : (M, A) `Status`. messages : why not, or a warning, by (spine, step).
    by_engine : (M,) whether the engine of record solved the spine.
    """

    q: Array
    load: Array
    status: NDArray[np.str_]
    messages: dict[tuple[int, int], str]
    by_engine: NDArray[np.bool_]


NEARLY_STRAIGHT = 0.05
"""Share of the way of a load by which those on it may lie beside it, where none of them is asked
for: what load cells read beside a moment that is meant to be pure."""


def solve_many(spines: Spines, cases: Cases, asked: Sequence[int] | None = None) -> ManySolved:
    """The same test of many spines, its steps one after the other.

    Parameters
    ----------
    asked : places of the T steps that are wanted, the first of all among them; None: all of them.
        Those between may be passed at once, see `_passed`.
    """
    every = range(len(cases.like.steps))
    asked = list(every if asked is None else asked)
    count, steps = len(spines), len(asked)
    short = stack_spines(spines, cases.steps(asked))
    q = np.full((count, steps, short.joints, 6), np.nan)
    status = np.full((count, steps), Status.CONVERGED.value, dtype="U20")
    messages: dict[tuple[int, int], str] = {}
    by_engine = np.zeros(count, dtype=bool)
    if count and steps < len(every):
        q = short.solve(why=False).q.reshape(q.shape)
        q[~_passed(stack_spines(spines, cases), short, q, asked)] = np.nan
        told = short.past_critical(
            q.reshape(-1, *q.shape[2:]), np.zeros(len(short.run), dtype=bool)
        )
        messages = {divmod(lane, steps): why for lane, why in told.items()}
    rest = np.flatnonzero(np.isnan(q[:, 0, 0, 0]))
    if len(rest):
        found = stack_spines(spines.part(rest), cases.part(rest)).solve()
        shape = (len(rest), len(every))
        q[rest] = found.q.reshape(*shape, *q.shape[2:])[:, asked]
        status[rest] = found.status.reshape(shape)[:, asked]
        by_engine[rest] = found.by_engine
        for lane, why in found.messages.items():
            number, step = divmod(lane, len(every))
            if step in asked:
                messages[int(rest[number]), asked.index(step)] = why
    load = carried(short, q.reshape(-1, *q.shape[2:])).reshape(q.shape)
    return ManySolved(q, load, status, messages, by_engine)


def _passed(stack: Stack, short: Stack, q: Array, asked: Sequence[int]) -> Flags:
    """(M,) which spines came to their asked steps, at poses q (M, A, J, 6), past all of theirs.

    A certified step follows the load on the straight way. It is taken for the way of all steps
    where their loads lie beside it by a twentieth at most, and where the chain, at places along the
    step, stands under the loads of both its ends even if softened by all that the others may do.
    """
    count, steps = len(q), len(stack.run) // len(q)
    good = ~np.isnan(q[:, :, 0, 0]).any(axis=1) & ~stack.remembers & (stack.spacing >= SPACING)
    if stack.loads.supports.there or not good.any():
        return np.zeros(count, dtype=bool)
    bodies, points, forces, moments = (
        one.reshape(count, steps, len(one[0]), -1) for one in stack.loads[1:5]
    )
    for places in (bodies, points):
        good &= (places == places[:, :1]).all(axis=(1, 2, 3))
    arms = points[:, 0, None] - stack.chains.origins[:, :, None]
    lever = np.linalg.norm(arms, axis=3).max(axis=1)
    loads, states = np.concatenate([forces, moments], axis=3), stack.initial_states()
    for place, (begin, end) in enumerate(pairwise(asked)):
        # how far the loads between lie beside the straight way from one asked step to the next
        way, done = loads[:, end] - loads[:, begin], loads[:, begin + 1 : end] - loads[:, [begin]]
        square = np.maximum((way * way).sum(axis=(1, 2)), np.finfo(float).tiny)
        share = np.clip((done * way[:, None]).sum(axis=(2, 3)) / square[:, None], 0.0, 1.0)
        off = done - share[..., None, None] * way[:, None]
        force, moment = (one.max(axis=1, initial=0.0) for one in _sizes(off, lever))
        good &= moment <= NEARLY_STRAIGHT * _sizes(way[:, None], lever)[1][:, 0]
        # the chain so much softened, at places no further apart than `SPACING`
        softer = _softer(force, moment, stack.joints)
        moved = q[:, place + 1] - q[:, place]
        parts = np.ceil(np.abs(moved * RADIANS).max(axis=(1, 2)) / SPACING)
        for runs in stack.chunks(np.flatnonzero(good), stepwise=True):
            lanes = len(asked) * runs + place
            for number in range(int(parts[runs].max()) + 1):
                share = np.minimum(number / np.maximum(parts[runs], 1.0), 1.0)
                there = q[runs, place] + share[:, None, None] * moved[runs]
                tangents = short.bound(lanes, states).joint_forces(there).tangent
                weak = tangents - softer[runs, None, :, None] * np.eye(6)
                for step in (begin, end):
                    under = part(stack.loads, steps * runs + step)
                    good[runs] &= stands(stack.chains, under, there, weak)
    return good


def _sizes(loads: Array, lever: Array) -> tuple[Array, Array]:
    """(M, K) N, N m of wrenches (M, K, W, 6): forces, and moments with forces at levers (M, W)."""
    pull, turn = np.linalg.norm(loads[..., :3], axis=3), np.linalg.norm(loads[..., 3:], axis=3)
    return pull.sum(axis=2), (turn + lever[:, None] * pull).sum(axis=2)


def _softer(force: Array, moment: Array, joints: int) -> Array:
    """(M, 6) N/m and N m/rad by which loads (M,) N, N m soften a joint's coordinates at most.

    A turn of a joint changes what a load does to a rotation above by no more than its moment there,
    and to a translation by no more than its force; half of either is symmetric. A row of these over
    the 3 J coordinates of a kind bounds the form (Gershgorin), 1 cm counting as 1 rad.
    """
    per_metre = RADIANS[0]
    kinds = per_metre * force, moment + force / per_metre
    return 1.5 * joints * np.repeat(np.stack(kinds, axis=1), 3, axis=1)


def carried(stack: Stack, q: Array) -> Array:
    """(L, J, 6) N and N m that the joints' laws hold at poses q (L, J, 6), NaN where these are."""
    load = np.full(q.shape, np.nan)
    for lanes, bound in stack.walked(q):
        load[lanes] = bound.law_forces(q[lanes]).load.reshape(-1, *q.shape[1:])
    return load
