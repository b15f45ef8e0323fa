"""Joint laws in a whole spine: derivatives of its motion against motion solved afresh.

Catches a law's derivative that is lost or misplaced among the joints of a spine.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from example_effects import loaded, scoped, spine
from joint_law_cases import DEFAULT, VARIANTS, defaults, law_of, off, title
from sweeps import one_of_each, sweep

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
    with_parameters,
)
from spinepipe.units import TRANSLATIONS
from spinepipe.world import Chain

NONE = np.zeros(0)

REACHED = [
    (name, options)
    for name, options in VARIANTS
    if options.get("coordinate") not in TRANSLATIONS
    or (name != "facet_contact" and options.get("shape") != "bilinear")
]
"""Without gaps and breaks of translations: these loads shift joints by less. Their slopes by
themselves, at every place, are in `test_joint_law_slopes`."""

EVERY = pytest.mark.parametrize(
    "variants",
    [
        pytest.param(one_of_each(REACHED, lambda variant: variant), id="few"),
        pytest.param(REACHED, id="every", marks=pytest.mark.full),
    ],
)


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
    solved = follow(system.with_model(with_parameters(system.model, free, x)))
    assert all(step.usable for step in solved)
    return np.stack([step.equilibrium.q for step in solved])


def inward_slope(function: Callable[[float], Array], step: float) -> Array:
    """Derivative at zero by a difference of fourth order to one side only."""
    weights = np.array([-25.0, 48.0, -36.0, 16.0, -3.0]) / (12.0 * step)
    return np.tensordot(weights, np.stack([function(n * step) for n in range(5)]), axes=1)


def check_sensitivities(system: System, mixtures: int = 1) -> None:
    """Derivatives of the solved poses against re-solved ones, along a mixture of all unknowns."""
    free = unknowns(system)
    found = np.stack(by_parameters(system, follow(system), free))
    for mixed in np.random.default_rng(7).uniform(0.3, 1.0, (mixtures, len(free))):
        along = mixed * [inward(system, unknown) for unknown in free]

        def motion(h: float, along: Array = along) -> Array:
            return poses(system, free, h * along)

        expected = inward_slope(motion, 1e-4)
        # poses are good to 1e-14 m and rad
        limit = 1e-14 / 1e-4 + 3e-6 * np.abs(expected).max()
        np.testing.assert_allclose(found @ along, expected, rtol=0, atol=limit)
    strengths = found[..., : len(system.model.joints)]
    assert np.abs(strengths).max(axis=(0, 1)).all()


def inward(system: System, unknown: FreeParameter) -> float:
    """A prior SD, away from a bound: 1e-4 of it steps over no corner by much."""
    parameter = declared(system.model, unknown)
    here = system.model.effects[1].values[unknown.rows[0], unknown.column]
    return parameter.prior_scale * (-1.0 if here == parameter.high else 1.0)


def narrowed(law: JointLaw, values: Array) -> Array:
    """Zones, gaps and breaks a tenth as wide, inside their bounds: small loads reach their ends."""
    narrow = values.copy()
    for column, p in enumerate(law.parameters):
        if p.off is None and not p.family:
            narrow[:, column] = np.clip(0.1 * values[:, column], p.low, p.high)
    return narrow


@EVERY
def test_sensitivities_are_slopes_of_solved_motion(variants) -> None:
    @sweep("variant", variants, title)
    def slopes(variant) -> None:
        law = law_of(variant)
        check_sensitivities(system_with(scoped(law, (0, 1, 2), *narrowed(law, defaults(law, 3)))))

    slopes()


@EVERY
def test_what_an_effect_would_do_is_known_while_it_is_off(variants) -> None:
    plain = poses(system_with())

    @sweep("variant", variants, title)
    def off_but_known(variant) -> None:
        law = law_of(variant)
        system = system_with(scoped(law, (0, 1, 2), *narrowed(law, off(law, 3))))
        np.testing.assert_array_equal(poses(system), plain)
        check_sensitivities(system)

    off_but_known()


@DEFAULT
def test_a_typical_effect_moves_a_joint_by_more_than_is_measured(name: str) -> None:
    with_it = poses(system_with(scoped(law_of((name, {})), (0, 1, 2))))
    change = with_it - poses(system_with())
    assert np.abs(change.reshape(-1, 6)[:, 3:]).max() > np.deg2rad(0.1)
