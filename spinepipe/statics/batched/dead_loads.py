"""Dead loads of many lanes: the wrenches that effects add to the listed ones, and derivatives."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from spinepipe.effects.contract import Array, Indices, Neutral
from spinepipe.effects.dead_load import DeadLoad, Wrenches
from spinepipe.statics.batched.forward_kinematics import Chains, Loads
from spinepipe.statics.batched.lanes import Acting, ranges


@dataclass(frozen=True, eq=False)
class _DeadLoadLanes:
    """A dead load on lanes (n,) on which it acts on the same joints; values (n, P)."""

    effect: DeadLoad
    lanes: Indices
    rows: Indices
    joints: Indices
    values: Array
    listed: Wrenches
    neutral: Neutral


def with_dead_loads(
    effects: Sequence[Acting], chains: Chains, listed: Loads, run: Indices
) -> Loads:
    """The listed loads of all lanes and those that effects add; ``run`` (L,) of each lane."""
    found = listed
    for one in effects:
        for part in _parts(one, chains, listed, run):
            added = part.effect.wrenches(part.listed, part.neutral, part.joints, part.values)
            found = _and(found, part.lanes, added)
    return found


def _parts(one: Acting, chains: Chains, listed: Loads, run: Indices) -> Iterator[_DeadLoadLanes]:
    """An effect's lanes by the joints that it acts on."""
    count = np.diff(one.first)[run]
    places, at = one.on(run)
    every = np.full((len(run), count.max(initial=0)), -1)
    every[at, ranges(np.zeros_like(count), count)] = one.joint[places]
    lanes = np.flatnonzero(count)
    groups, which = np.unique(every[lanes], axis=0, return_inverse=True)
    neutral = Neutral(chains.rotations, chains.origins, chains.coms)
    assert isinstance(one.effect, DeadLoad)
    for number, joints in enumerate(groups):
        there = lanes[which == number]
        rows = one.row[one.first[run[there]]]
        wrenches = Wrenches(
            listed.bodies[there], listed.points[there], listed.forces[there], listed.moments[there]
        )
        yield _DeadLoadLanes(
            one.effect,
            there,
            rows,
            joints[joints >= 0],
            one.values[rows],
            wrenches,
            neutral.part(listed.chain[there]),
        )


def _and(loads: Loads, lanes: Indices, added: Wrenches) -> Loads:
    """The loads with those added on some lanes."""
    count, most = len(loads.chain), added.bodies.shape[1]
    bodies = np.full((count, most), -1)
    numbers = np.zeros((3, count, most, 3))
    bodies[lanes] = added.bodies
    numbers[:, lanes] = added.points, added.forces, added.moments
    points, forces, moments = numbers
    return Loads(
        loads.chain,
        np.concatenate([loads.bodies, bodies], axis=1),
        np.concatenate([loads.points, points], axis=1),
        np.concatenate([loads.forces, forces], axis=1),
        np.concatenate([loads.moments, moments], axis=1),
        loads.supports,
    )


def pushes(
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
        for part in _parts(one, chains, listed, run):
            asked = (part.listed, part.neutral, part.joints, part.values)
            added, by_value = part.effect.wrenches(*asked), part.effect.slopes(*asked)
            for place, body in enumerate(added.bodies.T):
                there = body >= 0
                lanes, bodies = part.lanes[there], body[there]
                where = turned[lanes, bodies] @ added.points[there, place, :, None]
                point = where + shifted[lanes, bodies][..., None]
                force, moment = by_value.forces[there, place], by_value.moments[there, place]
                turning = np.cross(point, force, axis=1) + moment
                both = np.concatenate([turning, force], axis=1)
                found[lanes, bodies] += both @ slope[part.rows[there]]
    return found
