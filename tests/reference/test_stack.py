"""Stacks of runs against the engine of record: poses, readings, derivatives, effect by effect.

Catches a stack whose poses, readings or derivatives are not the engine's, for any effect.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import random_stacks as draw
from example_effects import ExtraWeight
from sweeps import sweep

from spinepipe.effects import Effect, EffectKind, Parameter
from spinepipe.effects.contract import Array
from spinepipe.model import LoadCase, ScopedEffect, SpineModel
from spinepipe.statics import (
    FreeParameter,
    System,
    by_parameters,
    follow,
    observe,
    observed_by_parameters,
)
from spinepipe.statics.batched import (
    Acting,
    Answering,
    Idle,
    Stack,
    poses_by,
    readings,
    readings_by,
)
from spinepipe.statics.batched.lanes import bind_effects
from spinepipe.statics.batched.loads import Flags
from spinepipe.status import Status
from spinepipe.world import Chain

pytestmark = pytest.mark.numeric

AGREEMENT = 1e-10
"""m and rad; of derivatives, of the largest by each unknown."""

VARIANTS, FEW = draw.variants(), draw.few()
EVERY = pytest.mark.parametrize(
    "effects",
    [pytest.param(FEW, id="few"), pytest.param(VARIANTS, id="every", marks=pytest.mark.full)],
)
"""All forms at one place each; laws at every place are in `tests/unit/test_joint_law_slopes`."""

Run = tuple[SpineModel, LoadCase]


def by_engine(model: SpineModel, case: LoadCase, free: Sequence[FreeParameter]) -> list[np.ndarray]:
    """Poses (T, J, 6), what is reported, and derivatives of both by the unknowns."""
    system = System(Chain(model), model, case)
    solved = draw.solved(system)
    poses, shape = [step.equilibrium.q for step in solved], (len(solved), model.n_joints, 6)
    dq = by_parameters(system, solved, free)
    by_x = [
        observed_by_parameters(system, q, d, free, k)
        for k, (q, d) in enumerate(zip(poses, dq, strict=True))
    ]
    return [
        np.reshape(poses, shape),
        np.array([observe(system, q, k) for k, q in enumerate(poses)]),
        np.reshape(dq, (*shape, len(free))),
        np.array(by_x),
    ]


def standing(drawn: Sequence[Run]) -> tuple[list[Run], np.ndarray]:
    """The runs that stand in all steps, and which of all runs the engine had to solve."""
    stack = stack_of(drawn)
    poses = stack.solve()
    ends = np.split(poses.status == Status.CONVERGED.value, stack.first[1:-1])
    return [run for run, good in zip(drawn, ends, strict=True) if good.all()], poses.by_engine


def stack_of(runs: Sequence[Run]) -> Stack:
    return Stack.of([model for model, _ in runs], [(n, case) for n, (_, case) in enumerate(runs)])


def compare(runs: Sequence[Run]) -> None:
    """All that the stack says of the runs is what the engine says of each."""
    stack, free = stack_of(runs), [draw.unknowns(model) for model, _ in runs]
    q = stack.solve().q
    dq = poses_by(stack, q, free)
    found = (q, readings(stack, q), dq, readings_by(stack, q, dq, free))
    for number, (model, case) in enumerate(runs):
        lanes, m = stack.lanes(np.array([number])), len(free[number])
        expected = by_engine(model, case, free[number])
        for one, other in zip(found[:2], expected[:2], strict=True):
            np.testing.assert_allclose(one[lanes], other, rtol=0, atol=AGREEMENT)
        for one, other in zip(found[2:], expected[2:], strict=True):
            largest = np.abs(other).max(axis=(0, 1, 2), initial=0.0)
            tolerance = AGREEMENT * np.maximum(largest, 1e-3)
            assert (np.abs(one[lanes][..., :m] - other) <= tolerance).all()
            assert not one[lanes][..., m:].any()


@EVERY
def test_each_effect_alone(effects: Sequence[Effect]) -> None:
    @sweep("effect", effects, str)
    def alone(effect: Effect) -> None:
        rng = np.random.default_rng(len(str(effect)))
        runs, by_engine = standing([draw.model(rng, 3, [effect], 0.5) for _ in range(5)])
        assert len(runs) >= 3
        assert not by_engine.all()
        compare(runs[:2])

    alone()


@pytest.mark.parametrize("n_joints", [1, 2, 4, 8, pytest.param(17, marks=pytest.mark.full)])
def test_random_effects_beside_each_other(n_joints: int) -> None:
    """Models of one stack differ in effects, joints in scope and order."""
    rng = np.random.default_rng(n_joints)
    drawn = []
    for _ in range(8):
        chosen = rng.choice(len(VARIANTS), int(rng.integers(1, 5)), replace=False)
        drawn.append(draw.model(rng, n_joints, [VARIANTS[k] for k in chosen], 3.0 / (n_joints + 5)))
    runs, _ = standing(drawn)
    assert len(runs) >= 4
    compare(runs)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("n_joints", "share"), [(1, 20.0), (3, 10.0), pytest.param(8, 5.0, marks=pytest.mark.full)]
)
def test_loads_that_do_not_come_on_at_once(
    n_joints: int, share: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Loads that some chains carry only in fractions, and others not at all: as the engine says."""
    rng = np.random.default_rng(40 + n_joints)
    without_memory = [
        e for e in VARIANTS if e.kind not in (EffectKind.PATH, EffectKind.MEASUREMENT)
    ]
    names = sorted({effect.name for effect in without_memory})
    drawn = []
    for _ in range(16):
        name = names[int(rng.integers(len(names)))]
        variants = [effect for effect in without_memory if effect.name == name]
        effect = variants[int(rng.integers(len(variants)))]
        drawn.append(draw.model(rng, n_joints, [effect], share))
    stack, continued = stack_of(drawn), []
    at_once = Stack._continued

    def counted(self: Stack, *rest: Any) -> tuple[Array, Flags]:
        q, good = at_once(self, *rest)
        continued.extend(good.tolist())
        return q, good

    monkeypatch.setattr(Stack, "_continued", counted)
    found = stack.solve(why=False)
    assert not found.by_engine.any()
    standing = 0
    for number, (model, case) in enumerate(drawn):
        lanes = stack.lanes(np.array([number]))
        solved = follow(System(Chain(model), model, case))
        stands = all(step.usable for step in solved)
        assert (found.status[lanes] == Status.CONVERGED.value).all() == stands
        if stands:
            standing += 1
            expected = np.reshape([step.equilibrium.q for step in solved], found.q[lanes].shape)
            np.testing.assert_allclose(found.q[lanes], expected, rtol=0, atol=AGREEMENT)
        else:
            assert np.isnan(found.q[lanes]).all()
    assert 4 <= standing < len(drawn)
    assert any(continued) or n_joints == 1  # where one joint stands, one step brings it there
    assert not all(continued)


def test_guesses_change_nothing() -> None:
    rng = np.random.default_rng(3)
    effects = [effect for effect in VARIANTS if effect.name in ("hysteresis", "neutral_zone")]
    runs, _ = standing([draw.model(rng, 3, [effect]) for effect in effects])
    stack = stack_of(runs)
    cold = stack.solve()
    warm = stack.solve(cold.q + rng.normal(0.0, 1e-4, cold.q.shape))
    assert not warm.by_engine.any()
    np.testing.assert_allclose(warm.q, cold.q, rtol=0, atol=AGREEMENT)


def test_other_values_in_the_same_stack() -> None:
    rng = np.random.default_rng(4)
    (model, case), _ = draw.model(rng, 2, [VARIANTS[0]]), None
    values = [replace(one, values=one.values * 1.1) for one in model.effects]
    other = model.with_effects(tuple(values))
    moved = stack_of([(model, case)]).with_models([other]).solve()
    np.testing.assert_array_equal(moved.q, stack_of([(other, case)]).solve().q)


def test_an_effect_that_takes_no_stack_is_solved_by_the_engine() -> None:
    rng = np.random.default_rng(5)
    (model, case), plain = (draw.model(rng, 2, []) for _ in range(2))
    weight = ScopedEffect(ExtraWeight(((0.0, 0.1, 0.0),)), (0,), np.array([[20.0]]))
    heavy = model.with_effects((*model.effects, weight))
    poses = stack_of([(heavy, case), plain]).solve()
    assert poses.by_engine.tolist() == [True, False]
    expected = by_engine(heavy, case, ())[0]
    np.testing.assert_array_equal(poses.q[: len(expected)], expected)


BEFORE = (
    "nonlinear_stiffening",
    "axes_tilt",
    "hysteresis",
    "creep",
    "marker_bias",
    "follower_load",
)


def named(*names: str) -> list[Effect]:
    return [next(one for one in VARIANTS if one.name == name) for name in names]


@pytest.mark.slow
@pytest.mark.parametrize("before", [("nonlinear_stiffening",), BEFORE], ids=["laws", "every kind"])
@EVERY
def test_what_idle_effects_would_do(effects: Sequence[Effect], before: tuple[str, ...]) -> None:
    """Without solving anew: as the derivatives of a model that has them, switched off."""
    rng = np.random.default_rng(8)
    run = draw.model(rng, 3, named(*before), 0.5)
    plain = stack_of([run])
    q = plain.solve().q
    answering = Answering.of(plain, q)
    assert answering is not None

    @sweep("effect", [effect for effect in effects if isinstance(effect, Acting)], str)
    def idle(effect: Effect) -> None:
        as_switched_off(run, q, answering, effect)

    idle()


def as_switched_off(run: Run, q: Array, answering: Answering, effect: Effect) -> None:
    """What an effect would do in a stack of one run, against a stack that has it, off."""
    (model, case), parameters = run, effect.parameters
    off = np.array([p.default if p.off is None else p.off for p in parameters])
    values = np.stack([off, [_elsewhere(p, x) for p, x in zip(parameters, off, strict=True)]])
    strengths = [number for number, p in enumerate(parameters) if p.off is not None]
    ((by_points),) = answering.by_strengths([Idle(effect, values)])
    reached = 0.0
    for point, at in enumerate(values):
        idle = ScopedEffect(effect, (0, 1, 2), np.tile(at, (3, 1)))
        full = model.with_effects((*model.effects, idle))
        free = [
            FreeParameter("", len(model.effects), column, (joint,), False)
            for column in strengths
            for joint in range(3)
        ]
        stack = stack_of([(full, case)])
        expected = readings_by(stack, q, poses_by(stack, q, [free]), [free])
        found = np.moveaxis(by_points[..., point, strengths], (2, 3), (1, 2))
        largest = np.maximum(np.abs(expected).max(axis=(0, 1, 2)), 1e-9)
        found = found.reshape(expected.shape)
        np.testing.assert_allclose(found / largest, expected / largest, rtol=0, atol=1e-11)
        reached = max(reached, np.abs(expected).max())
    late = effect.name == "facet_contact" or getattr(effect, "shape", "") == "bilinear"
    assert reached > 0.0 or late  # a gap, or a break, not reached here


def _elsewhere(parameter: Parameter, off: float) -> float:
    """Off still, but of another shape."""
    if parameter.off is not None:
        return off
    return float(np.clip(off * 1.1 + 0.1 * parameter.prior_scale, parameter.low, parameter.high))


def test_runs_for_the_engine_are_not_answered() -> None:
    rng = np.random.default_rng(9)
    model, case = draw.model(rng, 2, [])
    weight = ScopedEffect(ExtraWeight(((0.0, 0.1, 0.0),)), (0,), np.array([[20.0]]))
    stack = stack_of([(model.with_effects((*model.effects, weight)), case)])
    assert Answering.of(stack, np.zeros((len(stack.run), 2, 6))) is None


def test_effects_are_bound_as_a_double_loop_over_runs_and_joints_binds_them() -> None:
    """Catches a joint bound to values of another one, where effects, scopes and tests differ."""
    rng = np.random.default_rng(21)
    (plain, _), joints = draw.model(rng, 3, []), range(3)
    bushing = plain.effects[0].effect
    models = []
    for _ in range(7):
        effects = []
        for effect in (bushing, *rng.permutation(named("power_term", "axes_tilt", "load_gain"))):
            scope = tuple(n for n in joints if rng.random() < 0.6) or (2,)
            rows = len(scope) if effect.per_joint else 1
            start = np.array([p.default for p in effect.parameters])
            values = start + 1e-3 * rng.random((rows, len(start)))
            tests = ("*",) if rng.random() < 0.5 else ("bend",)
            effects.append(ScopedEffect(effect, scope, values, tests))
        models.append(replace(plain, effects=()).with_effects(tuple(effects[: rng.integers(1, 5)])))
    runs = [(int(rng.integers(7)), test) for test in ("bend", "turn") * 8]
    found: dict[tuple[int, int, int], tuple[Effect, list[float]]] = {}
    for one in bind_effects(models, runs):
        places, at = one.on(np.arange(len(runs)))
        np.testing.assert_array_equal(places, np.arange(len(one.joint)))
        for run, joint, row in zip(at.tolist(), one.joint.tolist(), one.row.tolist(), strict=True):
            assert (run, one.place, joint) not in found
            found[run, one.place, joint] = one.effect, one.values[row].tolist()
    expected = {}
    for run, (number, test) in enumerate(runs):
        for place, scoped in enumerate(models[number].effects):
            for row, joint in enumerate(scoped.joints if scoped.in_scope(test) else ()):
                values = scoped.values[row if scoped.effect.per_joint else 0]
                expected[run, place, joint] = scoped.effect, values.tolist()
    assert found == expected
