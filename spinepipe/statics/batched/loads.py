"""Chains and what acts on them as arrays: of models and load cases, with dead loads of effects.

A lane is a chain under one set of loads.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects.contract import Array, Indices, Neutral
from spinepipe.effects.dead_load import DeadLoad, Wrenches
from spinepipe.model import LoadCase, LoadStep, SpineModel
from spinepipe.statics.batched.lanes import Acting, ranges

Flags = NDArray[np.bool_]


class Chains(NamedTuple):
    """M chains of J joints; SI, ground axes, neutral pose.

    Attributes
    ----------
    rotations, origins : (M, J, 3, 3) and (M, J, 3) m, joint frames.
    masses, coms, inertias : (M, J) kg, (M, J, 3) m, (M, J, 3, 3) kg m2 about it.
    damping : (M, J, 6) N s/m and N m s/rad. gravity : (M, 3) m/s2.
    """

    rotations: Array
    origins: Array
    masses: Array
    coms: Array
    inertias: Array
    damping: Array
    gravity: Array

    @property
    def neutral(self) -> Neutral:
        """Where the chains are in their neutral pose."""
        return Neutral(self.rotations, self.origins, self.coms)


class Supports(NamedTuple):
    """Which joint coordinates of each of N lanes a rig fixes; none anywhere when N is 0.

    Attributes
    ----------
    fixed : (N, J, 6). values : (N, J, 6) m and rad, where they are fixed.
    read_as : (N, J, 6) m per N or rad per N m by which the reaction is read, 0 where it is not.
    """

    fixed: Flags
    values: Array
    read_as: Array

    @property
    def there(self) -> bool:
        """Whether any lane may have one."""
        return len(self.fixed) > 0

    def part(self, chosen: Indices) -> "Supports":
        """Those of some lanes."""
        if not self.there:
            return self
        return Supports(self.fixed[chosen], self.values[chosen], self.read_as[chosen])

    def towards(self, later: "Supports", share: Array) -> "Supports":
        """The values a share (N,) of the way to those of a later step."""
        if not self.there:
            return self
        part = share[:, None, None]
        return later._replace(values=self.values + part * (later.values - self.values))

    def on(self, q: Array) -> Array:
        """The poses q (N, J, 6) with fixed coordinates where they are fixed."""
        return np.where(self.fixed, self.values, q) if self.there else q.copy()


FREE = Supports(np.zeros((0, 0, 6), dtype=bool), np.zeros((0, 0, 6)), np.zeros((0, 0, 6)))
"""No supports."""


class Loads(NamedTuple):
    """What acts on each of N lanes; a lane is a chain under one set of loads.

    Attributes
    ----------
    chain : (N,) which chain it is.
    bodies : (N, W) vertebra of each wrench, -1 for none. points : (N, W, 3) m, neutral pose.
    forces, moments : (N, W, 3) N and N m, fixed in ground.
    supports : joint coordinates that a rig fixes.
    """

    chain: Indices
    bodies: Indices
    points: Array
    forces: Array
    moments: Array
    supports: Supports = FREE

    def with_wrenches(
        self, bodies: Indices, points: Array, forces: Array, moments: Array
    ) -> "Loads":
        """The same with more wrenches behind, shaped as its own."""
        return self._replace(
            bodies=np.concatenate([self.bodies, bodies], axis=1),
            points=np.concatenate([self.points, points], axis=1),
            forces=np.concatenate([self.forces, forces], axis=1),
            moments=np.concatenate([self.moments, moments], axis=1),
        )


def part(loads: Loads, chosen: Indices) -> Loads:
    """The loads of some lanes."""
    chain, bodies, points, forces, moments, supports = loads
    wrenches = (bodies[chosen], points[chosen], forces[chosen], moments[chosen])
    return Loads(chain[chosen], *wrenches, supports.part(chosen))


def scale_loads(loads: Loads, lanes: Indices, share: Array) -> Loads:
    """A share (N,) of the loads of some lanes."""
    some, on = part(loads, lanes), share[:, None, None]
    return some._replace(forces=some.forces * on, moments=some.moments * on)


def chains_of(models: Sequence[SpineModel]) -> Chains:
    """The numbers of models with equally many joints."""
    frames, bodies = [one.frames for one in models], [one.bodies for one in models]
    numbers = (
        [[frame.rotation for frame in own] for own in frames],
        [[frame.origin for frame in own] for own in frames],
        [[body.mass for body in own] for own in bodies],
        [[body.com for body in own] for own in bodies],
        [[body.inertia for body in own] for own in bodies],
        [model.damping for model in models],
        [model.gravity for model in models],
    )
    return Chains(*(np.array(one, dtype=float) for one in numbers))


def wrenches_of(steps: Sequence[LoadStep]) -> tuple[Indices, Array, Array, Array]:
    """Bodies (N, W) and points, forces, moments (N, W, 3) of load steps, as of `Loads`."""
    count = np.array([len(step.wrenches) for step in steps], dtype=np.int64)
    wrenches = [wrench for step in steps for wrench in step.wrenches]
    vectors = [vector for one in wrenches for vector in (one.point, one.force, one.moment)]
    at = np.repeat(np.arange(len(steps)), count), ranges(np.zeros_like(count), count)
    bodies = np.full((len(steps), count.max(initial=0)), -1)
    numbers = np.zeros((3, *bodies.shape, 3))
    bodies[at] = [wrench.body for wrench in wrenches]
    numbers[:, *at] = np.reshape(vectors, (-1, 3, 3)).swapaxes(0, 1)
    points, forces, moments = numbers
    return bodies, points, forces, moments


def supports_of(steps: Sequence[LoadStep], joints: int) -> Supports:
    """What rigs fix in load steps on chains of J joints."""
    if not any(step.supports for step in steps):
        return FREE
    found = Supports(
        np.zeros((len(steps), joints, 6), dtype=bool), *np.zeros((2, len(steps), joints, 6))
    )
    for lane, step in enumerate(steps):
        for one in step.supports:
            at = (lane, one.joint, one.coordinate)
            found.fixed[at], found.values[at] = True, one.value
            found.read_as[at] = one.read_as or 0.0
    return found


def durations(case: LoadCase) -> Array:
    """(T,) duration of each step; zero where the test records no time."""
    clock, found = 0.0, []
    for step in case.steps:
        time = clock if step.time is None else step.time
        found.append(time - clock)
        clock = time
    return np.array(found)


def with_dead_loads(
    effects: Sequence[Acting], chains: Chains, listed: Loads, run: Indices
) -> Loads:
    """The listed loads of all lanes and those that effects add; ``run`` (L,) of each lane."""
    found = listed
    for one in effects:
        for some in _alike(one, chains, listed, run):
            added = some.effect.wrenches(some.listed, some.neutral, some.joints, some.values)
            # as many places for all lanes; nobody's where the effect does not act
            bodies = np.full((len(run), added.bodies.shape[1]), -1)
            numbers = np.zeros((3, *bodies.shape, 3))
            bodies[some.lanes] = added.bodies
            numbers[:, some.lanes] = added.points, added.forces, added.moments
            found = found.with_wrenches(bodies, *numbers)
    return found


def dead_loads_by(
    effects: Sequence[tuple[Acting, Array]],
    chains: Chains,
    listed: Loads,
    run: Indices,
    turned: Array,
    shifted: Array,
) -> Array:
    """(N, J, 6, m) derivative of the wrench on each vertebra, moment about the origin of ground.

    Parameters
    ----------
    effects : each with the derivatives (V, P, m) of its values by the unknowns.
    listed, run : of N lanes. turned, shifted : (N, J, 3, 3), (N, J, 3) displacements there.
    """
    m = effects[0][1].shape[2] if effects else 0
    found = np.zeros((*shifted.shape[:2], 6, m))
    for one, slope in effects:
        for some in _alike(one, chains, listed, run):
            given = (some.listed, some.neutral, some.joints, some.values)
            added, by_value = some.effect.wrenches(*given), some.effect.slopes(*given)
            for place, body in enumerate(added.bodies.T):
                there = body >= 0
                lanes, bodies = some.lanes[there], body[there]
                # the point as the vertebra carries it, and the force's moment about the origin
                where = turned[lanes, bodies] @ added.points[there, place, :, None]
                point = where + shifted[lanes, bodies][..., None]
                force, moment = by_value.forces[there, place], by_value.moments[there, place]
                turning = np.cross(point, force, axis=1) + moment
                both = np.concatenate([turning, force], axis=1)
                found[lanes, bodies] += both @ slope[some.rows[there]]
    return found


@dataclass(frozen=True, eq=False)
class _DeadLoadLanes:
    """A dead load on lanes (n,) on which it acts on the same joints; rows of values (n, P)."""

    effect: DeadLoad
    lanes: Indices
    rows: Indices
    joints: Indices
    values: Array
    listed: Wrenches
    neutral: Neutral


def _alike(one: Acting, chains: Chains, listed: Loads, run: Indices) -> Iterator[_DeadLoadLanes]:
    """An effect's lanes by the joints that it acts on."""
    assert isinstance(one.effect, DeadLoad)
    # the joints of each lane, -1 behind the last, so that lanes with the same have equal rows
    count = np.diff(one.first)[run]
    places, at = one.on(run)
    every = np.full((len(run), count.max(initial=0)), -1)
    every[at, ranges(np.zeros_like(count), count)] = one.joint[places]
    lanes = np.flatnonzero(count)
    groups, which = np.unique(every[lanes], axis=0, return_inverse=True)
    for number, joints in enumerate(groups):
        there = lanes[which == number]
        rows = one.row[one.first[run[there]]]
        wrenches = Wrenches(*(numbers[there] for numbers in listed[1:5]))
        neutral = chains.neutral.part(listed.chain[there])
        own = (rows, joints[joints >= 0], one.values[rows], wrenches, neutral)
        yield _DeadLoadLanes(one.effect, there, *own)
