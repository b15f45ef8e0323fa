"""Steps of a case: warm starts, failures in between, path states, slots and shares of loads.

Catches warm starts, states or shares of loads that leak from one step into the next.
"""

from dataclasses import replace

import numpy as np
import pytest
from example_effects import NOWHERE, Relaxation, loaded, scoped, spine

from spinepipe.effects import Wrench, create
from spinepipe.model import LoadCase, LoadStep, ScopedEffect
from spinepipe.statics import Slots, System, follow
from spinepipe.status import Status
from spinepipe.world import Chain


def test_guesses_change_the_way_but_not_the_pose() -> None:
    model = spine(3)
    system = System(Chain(model), model, loaded(model))
    cold = follow(system)
    poses = [step.equilibrium.q for step in cold]
    warm = follow(system, poses)
    far = follow(system, [pose + 0.3 for pose in poses])
    lost = follow(system, [np.full(18, 1.3)] * 3)  # from where only the load path leads back
    for one, near, *others in zip(cold, warm, far, lost, strict=True):
        assert near.equilibrium.iterations <= one.equilibrium.iterations
        for found in (near, *others):
            np.testing.assert_allclose(found.equilibrium.q, one.equilibrium.q, atol=1e-12)


def tipping(n_steps: int = 4, effects: tuple[ScopedEffect, ...] = ()) -> System:
    """The second step presses 500 times harder than the spine stands; the rest would stand."""
    model = spine(2, effects=effects)
    top = model.bodies[1].com
    sizes = [30.0, 5e4, 30.0, 0.0][:n_steps]
    steps = [
        LoadStep(i, (Wrench(1, top, np.array([0.0, -size, 0.0]), NOWHERE),))
        for i, size in enumerate(sizes)
    ]
    return System(Chain(model), model, LoadCase("press", 1, tuple(steps)))


def test_steps_after_a_failure_say_so_and_keep_finite_numbers() -> None:
    stood, fell, *after = follow(tipping())
    assert stood.usable
    assert fell.equilibrium.status is Status.UNSTABLE
    assert 0.0 <= fell.equilibrium.reached < 0.5
    for step in after:
        assert step.equilibrium.status is Status.UNSTABLE
        assert step.equilibrium.message == "an earlier load step failed"
        assert not step.usable
        np.testing.assert_array_equal(step.equilibrium.q, fell.equilibrium.q)
    assert np.isfinite(fell.equilibrium.q).all()


@pytest.mark.parametrize("effect", ["hysteresis", "creep"])
def test_what_tips_over_does_so_with_path_effects_too(effect: str) -> None:
    stood, *after = follow(tipping(effects=(scoped(create(effect), (0, 1)),)))
    assert stood.usable
    assert [step.equilibrium.status for step in after] == [Status.UNSTABLE] * 3
    np.testing.assert_array_equal(after[2].equilibrium.q, after[0].equilibrium.q)


def test_unloading_without_path_effects_returns_to_where_it_was() -> None:
    model = spine(3)
    steps = follow(System(Chain(model), model, loaded(model, steps=4)))
    np.testing.assert_allclose(steps[3].equilibrium.q, steps[0].equilibrium.q, rtol=0, atol=1e-12)


def test_a_path_effect_remembers_the_way() -> None:
    model = spine(3, effects=(scoped(Relaxation(), (0, 1, 2)),))
    steps = follow(System(Chain(model), model, loaded(model, steps=4)))
    change = steps[3].equilibrium.q - steps[0].equilibrium.q
    assert np.abs(change).max() > np.deg2rad(0.1)


def test_a_path_effect_goes_by_the_time_each_step_took() -> None:
    """A held load creeps: what a step adds to the state shows in the steps after it."""
    model = spine(1, gravity=False, effects=(scoped(Relaxation(), (0,), (25.0, 3.0)),))
    held = Wrench(0, NOWHERE, NOWHERE, 2.0 * model.frames[0].rotation[:, 2])
    steps = tuple(LoadStep(i, (held,), time) for i, time in enumerate((0.5, 1.0, 4.0, 4.0)))
    solved = follow(System(Chain(model), model, LoadCase("hold", 1, steps)))
    spring, state = model.effects[0].values[0, 3], 0.0
    for step, took in zip(solved, (0.5, 0.5, 3.0, 0.0), strict=True):
        angle = step.equilibrium.q[3]
        assert angle == pytest.approx((2.0 + 25.0 * state) / (spring + 25.0), rel=1e-12)
        state += (1.0 - np.exp(-took / 3.0)) * (angle - state)


def test_slots_sum_the_wrenches_at_one_place() -> None:
    point, force, turning = np.array([0.0, 0.1, 0.0]), np.array([1.0, 2.0, 3.0]), np.ones(3)
    steps = (
        LoadStep(0, (Wrench(0, point, force, NOWHERE), Wrench(0, point, force, turning))),
        LoadStep(1, (Wrench(1, point, force, turning),)),
    )
    slots = Slots.of(LoadCase("test", 1, steps))
    assert slots.places == ((0, (0.0, 0.1, 0.0)), (1, (0.0, 0.1, 0.0)))
    first, second = (slots.loading(step.wrenches) for step in steps)
    np.testing.assert_array_equal(first.forces, [2.0 * force, NOWHERE])
    np.testing.assert_array_equal(first.moments, [turning, NOWHERE])
    assert (first.share, slots.unloaded().share) == (1.0, 0.0)
    between = first.towards(second, 0.25)
    np.testing.assert_array_equal(between.forces, [1.5 * force, 0.25 * force])
    assert slots.unloaded().towards(first, 0.5).share == 0.5
    assert [w.body for w in slots.wrenches(first)] == [0, 1]


def test_splitting_a_wrench_changes_nothing() -> None:
    model = spine(2)
    case = loaded(model, 1)
    parts = tuple(
        replace(w, force=share * w.force, moment=share * w.moment)
        for w in case.steps[0].wrenches
        for share in (0.25, 0.75)
    )
    split = replace(case, steps=(LoadStep(0, parts),))
    chain = Chain(model)
    one, other = (follow(System(chain, model, c))[0].equilibrium.q for c in (case, split))
    np.testing.assert_allclose(other, one, rtol=0, atol=1e-13)
