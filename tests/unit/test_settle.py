"""Settling: closed forms of one joint, agreement with statics, and honest ends.

Catches settling that is not its equation's, and a fall that is called settled.
"""

from dataclasses import replace

import numpy as np
import pytest
from example_effects import NOWHERE, Relaxation, loaded, massless, scoped, spine, top_heavy

from spinepipe.effects import Wrench
from spinepipe.model import LoadCase, LoadStep
from spinepipe.statics import Program, System, follow, settle
from spinepipe.statics.transient import ALPHA, COUPLING, ERROR_WEIGHTS, GAMMA, WEIGHTS
from spinepipe.status import Status
from spinepipe.world import Chain

ACCURACY = 2e-5
"""rad over a run: some twenty steps that may each err by 3e-4 of 0.1 rad at most, mostly less."""


def one_joint(damping: float) -> tuple[System, float, float]:
    """A weightless joint about its centre of mass under 5 N m of extension; inertia, stiffness."""
    model = spine(1, gravity=False)
    body = replace(model.bodies[0], com=model.frames[0].origin)
    model = replace(model, bodies=(body,), damping=np.array([[200.0] * 3 + [damping] * 3]))
    axis = model.frames[0].rotation[:, 2]
    case = LoadCase("test", 1, (LoadStep(0, (Wrench(0, NOWHERE, NOWHERE, 5.0 * axis),)),))
    system = System(Chain(model), model, case)
    return system, float(axis @ body.inertia @ axis), float(model.effects[0].values[0, 3])


def full(system: System) -> Program:
    return Program.constant(system.slots.loading(system.case.steps[0].wrenches))


@pytest.mark.parametrize(("damping", "share_off"), [(0.35, 2e-3), (1.0, 2e-3), (0.05, 1e-2)])
def test_one_joint_follows_its_closed_form(damping: float, share_off: float) -> None:
    """inertia a'' + damping a' + stiffness a = moment from rest, over- and underdamped."""
    system, inertia, stiffness = one_joint(damping)
    times = np.array([0.001, 0.005, 0.02, 0.1])
    one, other = np.roots([inertia, damping, stiffness]).astype(complex)
    share = (one * np.exp(other * times) - other * np.exp(one * times)) / (one - other)
    found = settle(system, full(system), 0.1, times)
    expected = 5.0 / stiffness * (1.0 - share.real)
    # relative tolerance 3e-4 a step, of which errors an underdamped run collects some thirty
    off = share_off * 5.0 / stiffness
    np.testing.assert_allclose(found.history[:, 3], expected, rtol=0, atol=off)
    assert found.status is Status.CONVERGED


def test_the_end_agrees_with_what_is_said_to_remain() -> None:
    model = spine(3)
    system = System(Chain(model), model, loaded(model))
    end = follow(system)[0].equilibrium.q
    for duration in (0.02, 3.0):
        found = settle(system, full(system), duration)
        np.testing.assert_allclose(found.q + found.remaining, end, rtol=0, atol=1e-12)
    assert np.abs(found.remaining.reshape(3, 6)[:, 3:]).max() < ACCURACY
    assert np.abs(found.rate).max() < 1e-3


def test_a_slow_ramp_is_followed_quasi_statically() -> None:
    model = spine(2, gravity=False)
    system = System(Chain(model), model, loaded(model, 1))
    loading = system.slots.loading(system.case.steps[0].wrenches)
    start = replace(system.slots.unloaded(), share=1.0)
    program = Program((0.0, 20.0), (start, loading))
    half = start.towards(loading, 0.5)
    np.testing.assert_array_equal(program.at(10.0).forces, half.forces)
    assert (program.corner_after(0.0), program.corner_after(20.0)) == (20.0, np.inf)
    found = settle(system, program, 20.0, (20.0,))
    # it lags by damping over stiffness, 0.03 s of 20 s: 0.2 % of some 0.1 rad
    end = follow(system)[0].equilibrium.q
    np.testing.assert_allclose(found.history[0], end, rtol=0, atol=3e-4)


def test_path_effects_and_massless_chains_are_refused() -> None:
    model = spine(2, effects=(scoped(Relaxation(), (0,)),))
    system = System(Chain(model), model, loaded(model))
    refused = settle(system, full(system), 1.0, (0.5,))
    assert refused.status is Status.REFUSED
    assert "load step" in refused.message
    bare = massless()
    system = System(Chain(bare), bare, loaded(bare))
    refused = settle(system, full(system), 1.0)
    assert refused.status is Status.REFUSED
    assert "bodies.csv" in refused.message
    assert refused.remaining is None


def tipping() -> System:
    model = top_heavy()
    return System(Chain(model), model, loaded(model, 1))


def test_a_chain_that_tips_over_ends_unstable() -> None:
    system = tipping()
    soon, late = settle(system, full(system), 0.002), settle(system, full(system), 5.0)
    for found in (soon, late):
        assert found.status is Status.UNSTABLE
        assert found.remaining is None
        assert np.isfinite(found.q).all()
    assert "moving away" in soon.message
    assert "tips over" in late.message


def test_times_that_a_falling_chain_never_reached_are_not_neutral_poses() -> None:
    system = tipping()
    found = settle(system, full(system), 5.0, (0.01, 4.9))
    assert found.history[1].any() or np.isnan(found.history[1]).all()


def test_history_is_in_the_order_of_the_asked_times() -> None:
    system, *_ = one_joint(1.0)
    up, down = (settle(system, full(system), 0.1, t).history for t in ((0.01, 0.05), (0.05, 0.01)))
    np.testing.assert_array_equal(down, up[::-1])


def test_the_method_has_the_order_it_says() -> None:
    """Order conditions of a third-order Rosenbrock method (Hairer and Wanner, IV.7)."""
    beta, alpha = ALPHA + COUPLING, ALPHA.sum(axis=1)
    total = beta.sum(axis=1)
    assert WEIGHTS.sum() == pytest.approx(1.0, abs=1e-14)
    assert ERROR_WEIGHTS.sum() == pytest.approx(0.0, abs=1e-14)
    assert WEIGHTS @ total == pytest.approx(0.5 - GAMMA, abs=1e-14)
    assert WEIGHTS @ alpha**2 == pytest.approx(1.0 / 3.0, abs=1e-14)
    third = 1.0 / 6.0 - GAMMA + GAMMA**2
    assert WEIGHTS @ (beta @ total) == pytest.approx(third, abs=1e-14)
    assert WEIGHTS @ (ALPHA @ alpha) == pytest.approx(1.0 / 6.0, abs=1e-14)  # any Jacobian
