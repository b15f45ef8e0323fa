"""Instruments that follow other joints or drift: worked by hand, slopes, stack beside engine.

Catches readings that follow the wrong joint, and derivatives lost between stack and engine.
"""

from dataclasses import replace

import numpy as np
import pytest
from effect_slopes import (
    assert_sensitivities,
    poses,
    reported,
    reported_by_parameters,
    slopes,
    system_with,
    unknowns,
)
from example_effects import loaded, scoped, spine
from sweeps import sweep

from spinepipe.effects import EffectKind, PlaceSpread, create
from spinepipe.effects.contract import MeasurementContext
from spinepipe.model import LoadCase, ScopedEffect
from spinepipe.statics import System, follow, observe
from spinepipe.statics.batched import Stack, poses_by, readings, readings_by
from spinepipe.statics.measurement_model import share_passed
from spinepipe.units import COORDINATES
from spinepipe.world import Chain

EFFECTS = {
    "skin from above": ("soft_tissue_artefact", {}, (0.4, 0.03)),
    "skin from below": (
        "soft_tissue_artefact",
        {"coordinate": "right_bending", "neighbour": "below"},
        (0.3, 0.02),
    ),
    "skin along": ("soft_tissue_artefact", {"coordinate": "anterior"}, (0.5, 2e-4)),
    "drift": ("neutral_pose_drift", {"coordinate": "left_rotation"}, (0.02, 0.4)),
    "even drift": ("neutral_pose_drift", {"coordinate": "right"}, (-3e-4, 12.0)),
}


def effect_of(name: str, on: bool = True, joints: tuple[int, ...] = (0, 1, 2)) -> ScopedEffect:
    kind, options, values = EFFECTS[name]
    return scoped(create(kind, options), joints, values if on else (0.0, values[1]))


def around(q: np.ndarray) -> MeasurementContext:
    above = np.vstack([q[1:], np.zeros(6)])
    below = np.vstack([np.zeros(6), q[:-1]])
    return MeasurementContext(above, below, np.linspace(0.0, 1.0, len(q)))


def with_times(times: tuple[float | None, ...]) -> LoadCase:
    case = loaded(spine(3), steps=len(times))
    steps = (replace(step, time=time) for step, time in zip(case.steps, times, strict=True))
    return replace(case, steps=tuple(steps))


@sweep(
    "times, expected",
    [
        ((0.0, 30.0, 60.0, 120.0), (0.0, 0.25, 0.5, 1.0)),
        ((10.0, 20.0, 50.0, 50.0), (0.0, 0.25, 1.0, 1.0)),
        ((None, None, None, None, None), (0.0, 0.25, 0.5, 0.75, 1.0)),
        ((0.0, 0.0, 0.0), (0.0, 0.5, 1.0)),
        ((None,), (0.0,)),
        ((30.0,), (0.0,)),
    ],
)
def test_a_test_passes_by_its_time_else_by_its_steps(
    times: tuple[float | None, ...], expected: tuple[float, ...]
) -> None:
    assert share_passed(with_times(times)).tolist() == pytest.approx(expected, abs=1e-15)


def test_skin_slips_as_the_neighbour_moves_and_no_further_than_its_reach() -> None:
    effect = create("soft_tissue_artefact", {"coordinate": "extension"})
    q, at = np.zeros((3, 6)), COORDINATES.index("extension")
    q[:, at] = (0.0, 0.001, -1e3)
    seen = effect.observe_beside(q, np.tile((0.4, 0.03), (3, 1)), around(q)).q - q
    assert seen[0, at] == pytest.approx(0.4 * 0.001, rel=1e-3)
    assert seen[1, at] == pytest.approx(-0.4 * 0.03, rel=1e-6)
    assert seen[2, at] == 0.0  # nothing is above the top joint
    assert not np.delete(seen, at, axis=1).any()


def test_drift_runs_from_nothing_to_all_of_it() -> None:
    q, at = np.zeros((5, 6)), COORDINATES.index("anterior")
    effect = create("neutral_pose_drift", {"coordinate": "anterior"})
    for pace, half in ((1e3, 0.5), (0.1, (1 - np.exp(-5.0)) / (1 - np.exp(-10.0)))):
        seen = effect.observe_beside(q, np.tile((2e-3, pace), (5, 1)), around(q)).q[:, at]
        np.testing.assert_allclose(seen[[0, 2, 4]], [0.0, 2e-3 * half, 2e-3], rtol=1e-3)


@sweep("on", [True, False])
@sweep("name", EFFECTS)
def test_derivatives_are_slopes(name: str, on: bool) -> None:
    q, here = poses(), effect_of(name, on)
    if "along" not in name:  # a reach of a fifth of a millimetre bends too much over a step of one
        effect, values, by = here.effect, np.tile(here.values[0], (len(q), 1)), around(q)
        seen = effect.observe_beside(q, values, by)
        by_q = slopes(lambda at: effect.observe_beside(at, values, by).q, q)
        np.testing.assert_allclose(seen.by_coordinate, by_q, rtol=0, atol=1e-9)
        for beside, found in (("above", seen.by_above), ("below", seen.by_below)):
            by_other = slopes(
                lambda at, b=beside: effect.observe_beside(q, values, replace(by, **{b: at})).q,
                getattr(by, beside),
            )
            expected = np.zeros((len(q), 6, 6)) if found is None else found
            np.testing.assert_allclose(expected, by_other, rtol=0, atol=1e-5)
    if on:
        joints = {"above": (0, 1), "below": (1, 2)}.get(name.rpartition(" ")[2], (0, 1))
        assert_sensitivities(system_with(effect_of(name, joints=joints)))


@sweep("name", EFFECTS)
def test_off_reads_the_motion_as_it_is(name: str) -> None:
    plain, off = (reported(system_with(*e)) for e in ((), (effect_of(name, on=False),)))
    np.testing.assert_array_equal(off, plain)
    assert np.abs(reported(system_with(effect_of(name))) - plain).max() > 1e-5


@sweep("joints", [(0, 1, 2), (0, 2), (1,)])
def test_a_stack_reads_as_the_engine_of_record_does(joints: tuple[int, ...]) -> None:
    """Instruments one behind the other, some of them ordinary, in two tests of different length."""
    tilt = scoped(create("marker_bias", {"form": "tilt"}), joints, (0.03, -0.02, 0.04))
    every = (tilt, *(effect_of(name, joints=joints) for name in EFFECTS))
    model = spine(3, effects=every)
    cases = [loaded(model), with_times((0.0, 5.0, 7.0, 20.0))]
    free = unknowns(model)
    stack = Stack.of([model], [(0, case) for case in cases])
    q = stack.solve().q
    seen, by_x = readings(stack, q), readings_by(stack, q, poses_by(stack, q, [free]), [free])
    systems = [System(Chain(model), model, case) for case in cases]
    expected = np.concatenate([reported(system) for system in systems])
    np.testing.assert_allclose(seen, expected, rtol=0, atol=1e-10)
    slope = np.concatenate([reported_by_parameters(system, free) for system in systems])
    size = np.maximum(np.abs(slope).max(axis=(0, 1, 2)), 1e-6)
    np.testing.assert_allclose(by_x / size, slope / size, rtol=0, atol=1e-8)


def test_who_reads_by_the_step_must_be_told_which() -> None:
    system = system_with(effect_of("drift"))
    q = follow(system)[0].equilibrium.q
    with pytest.raises(ValueError, match="neutral_pose_drift reads by the load step"):
        observe(system, q)


def test_what_is_looked_for() -> None:
    for name in ("soft_tissue_artefact", "neutral_pose_drift"):
        effect = create(name)
        assert effect.kind is EffectKind.MEASUREMENT
        assert effect.parameters[0].off == 0.0
        assert {dict(v)["coordinate"] for v in effect.trial.variants} == set(COORDINATES)
        assert PlaceSpread.SHARED in effect.trial.spreads
    with pytest.raises(ValueError, match="neighbour 'beside' is not one of above, below"):
        create("soft_tissue_artefact", {"neighbour": "beside"})


def test_nothing_that_moves_has_no_slope() -> None:
    """A model of which nothing is free is solved as well, as a search does with fixed bases."""
    model = replace(spine(3), effects=(*spine(3).effects, effect_of("skin from above")))
    stack = Stack.of([model], [(0, loaded(model, steps=3))])
    q = stack.solve().q
    dq = poses_by(stack, q, [()])
    assert readings_by(stack, q, dq, [()]).shape == (*q.shape, 0)
