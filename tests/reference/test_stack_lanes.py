"""A lane of a stack does not hang on those beside it, and bad pivots cost no digits.

Catches numbers that leak between lanes of a block, an order of sums that changes with the size of a
stack, and an elimination without pivoting that is believed where it has lost its digits.
"""

from collections.abc import Sequence

import numpy as np
import pytest
from sweeps import sweep

from spinepipe.effects import create
from spinepipe.effects.contract import Array
from spinepipe.model import LoadCase, ScopedEffect, SpineModel
from spinepipe.statics import free_parameters
from spinepipe.statics.batched import Stack, poses_by
from spinepipe.statics.batched.dynamics import tangents_of
from spinepipe.statics.batched.elimination import Changes, eliminate, solve_rates
from spinepipe.statics.batched.forward_kinematics import forward_kinematics
from spinepipe.statics.batched.vectors import blocks, lanes
from tests.reference import bridge
from tests.reference.peers import chain as chains

pytestmark = pytest.mark.numeric

COUNT = 11
"""Lanes: two blocks and most of a third."""


def models(n_joints: int) -> tuple[list[SpineModel], list[LoadCase]]:
    """Chains of their own that stiffen, in a test of one step each; one is too soft to stand."""
    rng = np.random.default_rng(n_joints)
    found, cases = [], []
    law = create("two_sided_exponential", {"coordinate": "extension"})
    for number in range(COUNT):
        chain = chains.random_chain(rng, n_joints)
        chain = chain.with_stiffness((1e-3 if number == 4 else 1.0) * np.asarray(chain.stiffness))
        model = bridge.spine_model(chain)
        values = np.tile([20.0, 8.0, 12.0], (n_joints, 1)) * rng.uniform(0.5, 2.0, (n_joints, 1))
        own = ScopedEffect(law, tuple(range(n_joints)), values, ("*",))
        found.append(model.with_effects((*model.effects, own)))
        cases.append(bridge.load_case(chain, 3.0 / n_joints))
    return found, cases


def solved(
    every: tuple[list[SpineModel], list[LoadCase]], chosen: Sequence[int]
) -> list[tuple[str, bytes, bytes]]:
    """Status, pose and its derivatives of some of the spines in a stack of their own."""
    some = [every[0][n] for n in chosen]
    stack = Stack.of(some, [(at, every[1][n]) for at, n in enumerate(chosen)])
    found = stack.solve(why=False)
    free = free_parameters(some[0], 0, ["extension_nm_per_rad"], "per_joint")
    there = np.nan_to_num(found.q)
    slopes = poses_by(stack, there, [free] * len(some))
    each = zip(found.status.tolist(), found.q, slopes, strict=True)
    return [(status, q.tobytes(), slope.tobytes()) for status, q, slope in each]


@sweep("n_joints", [1, 3, 6, 17])
def test_a_spine_has_the_same_bytes_in_every_stack(n_joints: int) -> None:
    every, rng = models(n_joints), np.random.default_rng(0)
    alone = [solved(every, [n])[0] for n in range(COUNT)]
    for size in (2, 3, 4, 5, 8, COUNT):
        chosen = rng.permutation(COUNT)[:size].tolist()
        assert solved(every, chosen) == [alone[n] for n in chosen]


def stiff(rng: np.random.Generator, count: int, n_joints: int) -> Array:
    """(N, J, 6, 6) tangents of joints, each with a positive symmetric part."""
    a = rng.normal(size=(count, n_joints, 6, 6))
    return a @ a.swapaxes(2, 3) + 20.0 * np.eye(6) + 3.0 * (a - a.swapaxes(2, 3))


@sweep("n_joints", [1, 4])
@sweep("small", [1e-6, 1e-14, 0.0])
def test_bad_pivots_cost_no_digits(n_joints: int, small: float) -> None:
    """Two coordinates that only hold each other: rows must be exchanged, in one lane of five."""
    rng = np.random.default_rng(1)
    chain = chains.random_chain(rng, n_joints)
    stack = Stack.of([bridge.spine_model(chain)], [(0, bridge.load_case(chain))] * 5)
    q, tangents = np.zeros((5, n_joints, 6)), stiff(rng, 5, n_joints)
    plain = forward_kinematics(stack.chains, stack.loads, q, tangents)
    sources = rng.normal(size=(5, n_joints, 6, 3))
    before, _ = eliminate(plain, Changes(sources))
    tangents[2, -1, :2] = tangents[2, -1, :, :2] = 0.0
    tangents[2, -1, 0, 1], tangents[2, -1, 1, 0] = 30.0, 40.0
    tangents[2, -1, 0, 0] = tangents[2, -1, 1, 1] = small
    seen = forward_kinematics(stack.chains, stack.loads, q, tangents)
    found, good = solve_rates(seen, Changes(sources))
    assert good.all()
    whole = tangents_of(seen)[2]
    missing = whole @ found[2].reshape(-1, 3) - sources[2].reshape(-1, 3)
    scale = np.abs(whole).max() * np.abs(found[2]).max()
    assert np.abs(missing).max() < 1e-14 * len(whole) * scale
    _, signs = eliminate(seen, Changes(sources[..., :0]), asked=True)
    assert signs[2] == np.sign(np.linalg.det(whole))
    others = [0, 1, 3, 4]
    np.testing.assert_array_equal(found[others], before[others])


@sweep("count", [0, 1, 4, 5])
def test_blocks_hold_every_lane(count: int) -> None:
    numbers = np.random.default_rng(count).normal(size=(count, 2, 3))
    found = blocks(numbers)
    assert found.shape == (-(-count // 4), 2, 3, 4)
    np.testing.assert_array_equal(lanes(found, count), numbers)
    if count:
        np.testing.assert_array_equal(found[-1, ..., -1], numbers[-1])
