"""Joint laws in a whole spine: derivatives of its motion against motion solved afresh."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from example_effects import loaded, scoped, slope, spine
from joint_law_cases import DEFAULT, VARIANTS, defaults, law_of, off, title

from spinepipe.effects import JointLaw
from spinepipe.effects.contract import Array
from spinepipe.model import LoadCase, LoadStep, ScopedEffect
from spinepipe.statics import (
    FreeParameter,
    System,
    by_parameters,
    declared,
    follow,
    free_parameters,
    moved,
)
from spinepipe.units import TRANSLATIONS
from spinepipe.world import Chain

NONE = np.zeros(0)

REACHED = pytest.mark.parametrize(
    "variant",
    [
        (name, options)
        for name, options in VARIANTS
        if options.get("coordinate") not in TRANSLATIONS
        or (name != "facet_contact" and options.get("shape") != "bilinear")
    ],
    ids=title,
)
"""Without gaps and breaks of translations: these loads shift joints by less. Their slopes by
themselves are in `test_joint_law_slopes`."""


def both_ways(case: LoadCase) -> LoadCase:
    """Each step, and the same with all loads reversed."""
    loads = [
        tuple(replace(w, force=way * w.force, moment=way * w.moment) for w in step.wrenches)
        for step in case.steps
        for way in (1.0, -1.0)
    ]
    return replace(case, steps=tuple(LoadStep(n, wrenches) for n, wrenches in enumerate(loads)))


def system_with(*effects: ScopedEffect) -> System:
    """Three tilted joints under gravity and six load steps, all six coordinates loaded."""
    model = spine(3, effects=effects)
    return System(Chain(model), model, both_ways(loaded(model)))


def unknowns(system: System) -> tuple[FreeParameter, ...]:
    names = [p.name for p in system.model.effects[1].effect.parameters]
    return free_parameters(system.model, 1, names, "per_joint")


def poses(system: System, free: tuple[FreeParameter, ...] = (), x: Array = NONE) -> Array:
    solved = follow(system.with_model(moved(system.model, free, x)))
    assert all(step.usable for step in solved)
    return np.stack([step.equilibrium.q for step in solved])


def inward_slope(function: Callable[[float], Array], step: float) -> Array:
    """Derivative at zero by a difference of fourth order to one side only."""
    weights = np.array([-25.0, 48.0, -36.0, 16.0, -3.0]) / (12.0 * step)
    return np.tensordot(weights, np.stack([function(n * step) for n in range(5)]), axes=1)


def check_sensitivities(system: System) -> None:
    """Derivatives of the solved poses against re-solved ones, one unknown at a time."""
    free = unknowns(system)
    found = np.stack(by_parameters(system, follow(system), free))
    for at, (along, unknown) in enumerate(zip(np.eye(len(free)), free, strict=True)):
        size, difference = step_of(system, unknown)

        def motion(h: float, along: Array = along) -> Array:
            return poses(system, free, h * along)

        expected = difference(motion, size)
        # poses are good to 1e-14 m and rad
        limit = 1e-14 / abs(size) + 3e-6 * np.abs(expected).max()
        np.testing.assert_allclose(found[..., at], expected, rtol=0, atol=limit)
    strengths = found[..., : len(system.model.joints)]
    assert np.abs(strengths).max(axis=(0, 1)).all()


def step_of(system: System, unknown: FreeParameter) -> tuple[float, Callable]:
    """1e-4 of a prior SD, away from a bound: no corner is stepped over by much."""
    parameter = declared(system.model, unknown)
    size = 1e-4 * parameter.prior_scale
    here = system.model.effects[1].values[unknown.rows[0], unknown.column]
    if parameter.low < here < parameter.high:
        return size, slope
    return (size if here == parameter.low else -size), inward_slope


def narrowed(law: JointLaw, values: Array) -> Array:
    """Zones, gaps and breaks a tenth as wide, inside their bounds: small loads reach their ends."""
    narrow = values.copy()
    for column, p in enumerate(law.parameters):
        if p.off is None and not p.family:
            narrow[:, column] = np.clip(0.1 * values[:, column], p.low, p.high)
    return narrow


@REACHED
def test_sensitivities_are_slopes_of_solved_motion(variant) -> None:
    law = law_of(variant)
    check_sensitivities(system_with(scoped(law, (0, 1, 2), *narrowed(law, defaults(law, 3)))))


@REACHED
def test_what_an_effect_would_do_is_known_while_it_is_off(variant) -> None:
    law, plain = law_of(variant), poses(system_with())
    system = system_with(scoped(law, (0, 1, 2), *narrowed(law, off(law, 3))))
    np.testing.assert_array_equal(poses(system), plain)
    check_sensitivities(system)


@DEFAULT
def test_a_typical_effect_moves_a_joint_by_more_than_is_measured(name: str) -> None:
    with_it = poses(system_with(scoped(law_of((name, {})), (0, 1, 2))))
    change = with_it - poses(system_with())
    assert np.abs(change.reshape(-1, 6)[:, 3:]).max() > np.deg2rad(0.1)
