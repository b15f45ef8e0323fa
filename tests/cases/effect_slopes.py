"""Derivatives that effects state, against differences: of their own values, of solved motion."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from example_effects import loaded, slope, spine

from spinepipe.effects import GeometryEffect
from spinepipe.effects.contract import Array
from spinepipe.model import LoadCase, ScopedEffect, SpineModel
from spinepipe.statics import (
    FreeParameter,
    System,
    by_parameters,
    declared,
    follow,
    free_parameters,
    observe,
    observed_by_parameters,
    with_parameters,
)
from spinepipe.world import Chain

STEP = 1e-3
"""m and rad: fourth-order differences over it are good to 1e-12 of smooth functions of order 1."""


def system_with(*effects: ScopedEffect, case: LoadCase | None = None) -> System:
    """Three tilted joints under gravity and three load steps, with effects."""
    model = spine(3, effects=effects)
    return System(Chain(model), model, case or loaded(model))


def fresh(system: System) -> System:
    """The system on a chain loaded anew: loading another model leaves earlier ones stale."""
    return System(Chain(system.model), system.model, system.case)


def poses(n: int = 4) -> Array:
    """(n, 6) motions of some mm and up to half a radian, and the neutral pose."""
    rng = np.random.default_rng(3)
    moves = np.hstack([rng.uniform(-5e-3, 5e-3, (n, 3)), rng.uniform(-0.5, 0.5, (n, 3))])
    return np.vstack([moves, np.zeros(6)])


def slopes(function: Callable[[Array], Array], at: Array) -> Array:
    """(…, K) derivatives by each column of ``at`` (J, K), which all rows move along together."""
    directions = np.eye(at.shape[1])
    each = [slope(lambda h, along=d: function(at + h * along), STEP) for d in directions]
    return np.stack(each, axis=-1)


def assert_placement_derivatives(effect: GeometryEffect, q: Array, values: Array) -> None:
    """First and second derivatives by q, and both placements' derivatives by the parameters."""
    placed, by_parameter = effect.place(q, values), effect.by_parameter(q, values)
    for found, expected in (
        (placed.by_coordinate, slopes(lambda at: effect.place(at, values).q, q)),
        (placed.by_coordinates, slopes(lambda at: effect.place(at, values).by_coordinate, q)),
        (by_parameter.q, slopes(lambda at: effect.place(q, at).q, values)),
        (by_parameter.by_coordinate, slopes(lambda at: effect.place(q, at).by_coordinate, values)),
    ):
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9)


def assert_tangent(system: System) -> None:
    """The tangent is the slope of the residual at a bent pose, under the second step's load."""
    q = np.tile([1e-3] * 3 + [0.15] * 3, 3) * np.random.default_rng(1).normal(size=18)
    system = fresh(system)
    loading = system.slots.loading(system.case.steps[1].wrenches)
    states = system.initial_states()
    tangent = system.balance(q, loading, states).tangent
    for column, size in enumerate(np.tile([1e-4] * 3 + [1e-3] * 3, 3)):
        along = size * np.eye(18)[column]
        expected = slope(lambda h, a=along: system.balance(q + h * a, loading, states).residual, 1)
        # fourth-order differences: 1e-12 of loads up to 1e3, over a step of 1e-4 m or 1e-3 rad
        np.testing.assert_allclose(tangent[:, column], expected / size, rtol=1e-7, atol=1e-4)


def unknowns(model: SpineModel) -> tuple[FreeParameter, ...]:
    """All parameters of all effects but the springs', joint by joint."""
    return tuple(
        unknown
        for number, here in enumerate(model.effects)
        if number
        for unknown in free_parameters(
            model, number, [p.name for p in here.effect.parameters], "per_joint"
        )
    )


def reported(system: System, free: tuple[FreeParameter, ...] = (), x: Array | None = None) -> Array:
    """(T, J, 6) solved afresh and reported, with the unknowns moved by x."""
    other = fresh(system).with_model(
        with_parameters(system.model, free, np.zeros(0) if x is None else x)
    )
    steps = follow(other)
    assert all(step.usable for step in steps)
    return np.stack([observe(other, step.equilibrium.q, k) for k, step in enumerate(steps)])


def reported_by_parameters(system: System, free: tuple[FreeParameter, ...]) -> Array:
    """(T, J, 6, m) sensitivities of what is reported."""
    system = fresh(system)
    solved = follow(system)
    each = enumerate(zip(solved, by_parameters(system, solved, free), strict=True))
    return np.stack(
        [observed_by_parameters(system, step.equilibrium.q, dq, free, k) for k, (step, dq) in each]
    )


def assert_sensitivities(system: System, mixtures: int = 1) -> None:
    """Sensitivities are slopes of motion solved afresh, along a mixture of all parameters.

    Inwards: most strengths that are off stand at the end of what is allowed.
    """
    free = unknowns(system.model)
    found = reported_by_parameters(system, free)
    for column, unknown in enumerate(free):
        # a shape says nothing while the strengths are off
        assert found[..., column].any() or declared(system.model, unknown).off is None
    sizes = np.array([_inwards(system.model, unknown) for unknown in free])
    for mixed in np.random.default_rng(7).uniform(0.3, 1.0, (mixtures, len(free))):
        along = mixed * sizes
        # forward difference of fourth order; poses are solved to 1e-13 rad
        weights, step = (-25.0, 48.0, -36.0, 16.0, -3.0), 0.01
        each = [w * reported(system, free, k * step * along) for k, w in enumerate(weights)]
        expected = sum(each) / (12.0 * step)
        scale = np.abs(expected).max()
        np.testing.assert_allclose(found @ along, expected, rtol=0, atol=1e-6 * scale)


def assert_each_test_has_its_own_values(effect: ScopedEffect) -> None:
    """Two copies in scope of a test each: the one acts and is felt, the other is not there."""
    mine = replace(effect, tests=("all ways",))
    other = replace(effect, tests=("another",), values=2.0 * mine.values)
    both = system_with(mine, other)
    np.testing.assert_array_equal(reported(both), reported(system_with(effect)))
    renamed = system_with(mine, other, case=replace(both.case, test="another"))
    alone = system_with(replace(other, tests=("*",)))
    np.testing.assert_array_equal(reported(renamed), reported(alone))
    free = unknowns(both.model)
    for place, system in ((1, both), (2, renamed)):
        felt = np.abs(reported_by_parameters(system, free)).max(axis=(0, 1, 2)) > 0.0
        assert felt.tolist() == [unknown.effect == place for unknown in free]


def _inwards(model: SpineModel, unknown: FreeParameter) -> float:
    """A prior SD away from the end that the value may stand at."""
    parameter = declared(model, unknown)
    here = model.effects[unknown.effect].values[list(unknown.rows), unknown.column]
    return parameter.prior_scale * (-1.0 if here.max() >= parameter.high else 1.0)
