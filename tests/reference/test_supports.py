"""Joint coordinates that a rig fixes: closed forms, one engine against the other, differences.

Catches a rig's reaction, or its derivative, that is not what holds the joint.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
import random_stacks as draw
from sweeps import sweep

from spinepipe.effects import Effect, EffectKind, Wrench, create
from spinepipe.effects.contract import Array
from spinepipe.frames import Pose
from spinepipe.model import (
    Body,
    LoadCase,
    LoadStep,
    RefusedModel,
    ScopedEffect,
    SpineModel,
    Support,
)
from spinepipe.statics import (
    FreeParameter,
    System,
    by_parameters,
    follow,
    no_settling,
    reaction,
    reactions_by,
    with_parameters,
)
from spinepipe.statics.batched import (
    Answering,
    Idle,
    Stack,
    poses_by,
    reactions,
    readings,
    readings_by,
)
from spinepipe.statics.batched import (
    reactions_by as stack_reactions_by,
)
from spinepipe.statics.batched.derive import answered
from spinepipe.status import Status
from spinepipe.world import Chain

pytestmark = pytest.mark.numeric

NOWHERE, UP = np.zeros(3), np.array([0.0, 0.1, 0.0])
ANTERIOR, EXTENSION, BENDING, ROTATION = 0, 3, 4, 5
STIFFNESS = np.array([4e5, 9e5, 4e5, 110.0, 90.0, 200.0])
COUPLING, MOMENT = 40.0, 5.0
VARIANTS = draw.variants()

Run = tuple[SpineModel, LoadCase]


def one_joint(*effects: ScopedEffect) -> SpineModel:
    """A weightless vertebra on a bushing whose frame is that of ground."""
    bushing = ScopedEffect(create("linear_bushing"), (0,), STIFFNESS[None])
    return SpineModel(
        specimen="one",
        joints=("L4L5",),
        frames=(Pose(np.eye(3), np.zeros(3)),),
        bodies=(Body("L4", 0.0, np.zeros(3), np.zeros((3, 3))),),
        gravity=np.zeros(3),
        damping=np.ones((1, 6)),
        effects=(bushing, *effects),
    )


def coupled() -> SpineModel:
    """Bending and rotation load each other."""
    return one_joint(
        ScopedEffect(create("bending_rotation_coupling"), (0,), np.array([[COUPLING]]))
    )


def twisted(supports: Sequence[Support] = ()) -> LoadCase:
    """A moment about x, which bends to the right."""
    turn = Wrench(0, NOWHERE, NOWHERE, MOMENT * np.eye(3)[0])
    return LoadCase("bend", 1, (LoadStep(0, (turn,), None, tuple(supports)),))


def solved(model: SpineModel, case: LoadCase) -> tuple[Array, Array, Array, Array]:
    """Poses and reactions (T, J, 6) by the engine of record and by a stack."""
    system = System(Chain(model), model, case)
    steps = follow(system)
    shape = (len(steps), model.n_joints, 6)
    stack = Stack.of([model], [(0, case)])
    found = stack.solve()
    assert not found.by_engine.any()
    return (
        np.reshape([step.equilibrium.q for step in steps], shape),
        np.reshape([reaction(system, step) for step in steps], shape),
        found.q,
        reactions(stack, found.q),
    )


def test_a_coupled_bushing_is_stiffer_with_its_rotation_held() -> None:
    """Free k11 - k12^2 / k22, held k11; the rig holds k12 times the bending then."""
    k11, k22 = STIFFNESS[BENDING], STIFFNESS[ROTATION]
    free, none, free_too, none_too = solved(coupled(), twisted())
    held, load, held_too, load_too = solved(coupled(), twisted([Support(0, ROTATION, 0.0)]))
    for q in (free, free_too):
        assert q[0, 0, BENDING] == pytest.approx(MOMENT / (k11 - COUPLING**2 / k22), rel=1e-12)
    for q, r in ((held, load), (held_too, load_too)):
        assert q[0, 0, BENDING] == pytest.approx(MOMENT / k11, rel=1e-12)
        assert q[0, 0, ROTATION] == 0.0
        assert r[0, 0, ROTATION] == pytest.approx(COUPLING * MOMENT / k11, rel=1e-12)
        assert not np.delete(r.ravel(), ROTATION).any()
    assert not none.any()
    assert not none_too.any()


def test_a_prescribed_rotation_bends_by_the_coupling() -> None:
    """With no load, q1 = -k12 / k11 q2, and the rig holds (k22 - k12^2 / k11) q2."""
    k11, k22, wanted = STIFFNESS[BENDING], STIFFNESS[ROTATION], 0.07
    case = LoadCase("turn", 1, (LoadStep(0, (), None, (Support(0, ROTATION, wanted),)),))
    one, load, other, load_too = solved(coupled(), case)
    for q, r in ((one, load), (other, load_too)):
        assert q[0, 0, ROTATION] == wanted
        assert q[0, 0, BENDING] == pytest.approx(-COUPLING / k11 * wanted, rel=1e-12)
        expected = (k22 - COUPLING**2 / k11) * wanted
        assert r[0, 0, ROTATION] == pytest.approx(expected, rel=1e-12)


def test_a_solve_starts_where_the_rig_has_the_joint() -> None:
    """Nothing hangs on a fixed coordinate, so all steps have to be taken with it in its place."""
    model, places = coupled(), np.arange(6) == ROTATION
    values = (0.1, -0.37)
    steps = [LoadStep(k, (), None, (Support(0, ROTATION, v),)) for k, v in enumerate(values)]
    system = System(Chain(model), model, LoadCase("turn", 2, tuple(steps)))
    anywhere = np.linspace(-0.2, 0.3, 6)
    for step, value in zip(steps, values, strict=True):
        start = system.start(anywhere, system.loading(step))
        np.testing.assert_array_equal(start, np.where(places, value, anywhere))
        assert anywhere[ROTATION] == 0.3  # the pose that was given is left alone
    assert [step.equilibrium.q[ROTATION] for step in follow(system)] == list(values)
    assert system.free is not None
    np.testing.assert_array_equal(system.free, np.flatnonzero(~places))
    assert System(Chain(model), model, twisted()).free is None


def test_what_a_rig_fixes_is_missing_by_how_far_it_is_off() -> None:
    """Its row of the balance is q - value, in its unit, and changes as q does."""
    model = coupled()
    system = System(Chain(model), model, twisted([Support(0, ROTATION, 0.1)]))
    loading, states = system.loading(system.case.steps[0]), system.initial_states()
    found = system.balance(np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.4]), loading, states)
    assert found.residual[ROTATION] == pytest.approx(0.3, rel=1e-15)
    np.testing.assert_array_equal(found.tangent[ROTATION], np.eye(6)[ROTATION])
    np.testing.assert_array_equal(found.tangent[:, ROTATION], np.eye(6)[ROTATION])


def test_a_measured_load_that_is_listed_leaves_no_reaction() -> None:
    """Prescribed to where the listed load brings it, the joint needs no rig."""
    free, *_ = solved(coupled(), twisted())
    there = Support(0, BENDING, float(free[0, 0, BENDING]))
    prescribed, load, _, load_too = solved(coupled(), twisted([there]))
    np.testing.assert_allclose(prescribed, free, rtol=0, atol=1e-14)
    assert np.abs(load).max() < 1e-11
    assert np.abs(load_too).max() < 1e-11


def test_a_column_that_tips_stands_where_its_rotations_are_held() -> None:
    """A force F down at height h tips a joint with less than F h of rotational stiffness."""
    model = one_joint()
    down = 1.5 * STIFFNESS[BENDING] / UP[1] * np.array([0.0, -1.0, 0.0])
    press = (Wrench(0, UP, down, NOWHERE),)
    rig = (Support(0, EXTENSION, 0.0), Support(0, BENDING, 0.0), Support(0, ROTATION, 0.0))
    free, held = (LoadCase("press", 1, (LoadStep(0, press, None, s),)) for s in ((), rig))
    stack = Stack.of([model], [(0, free), (0, held)])
    found = stack.solve(why=False)
    assert found.status.tolist() == [Status.UNSTABLE.value, Status.CONVERGED.value]
    assert found.q[1, 0, 1] == pytest.approx(down[1] / STIFFNESS[1], rel=1e-12)
    for case, stands in ((free, False), (held, True)):
        assert follow(System(Chain(model), model, case))[0].usable == stands


def test_what_is_held_does_not_hide_what_tips_beside_it() -> None:
    model = one_joint()
    down = 1.5 * STIFFNESS[BENDING] / UP[1] * np.array([0.0, -1.0, 0.0])
    held = (Support(0, EXTENSION, 0.0),)
    case = LoadCase("press", 1, (LoadStep(0, (Wrench(0, UP, down, NOWHERE),), None, held),))
    assert Stack.of([model], [(0, case)]).solve(why=False).status[0] == Status.UNSTABLE.value
    assert not follow(System(Chain(model), model, case))[0].usable


def with_rig(rng: np.random.Generator, run: Run, read_as: float | None = None) -> Run:
    """The run with a few coordinates fixed, each at zero or at a value that changes by step."""
    model, case = run
    count = int(rng.integers(1, 2 * model.n_joints + 1))
    places = sorted(rng.choice(6 * model.n_joints, count, replace=False).tolist())
    size = np.where(np.array(places) % 6 < 3, 5e-4, 0.02) * rng.choice([0.0, 1.0], count)
    steps = []
    for number, step in enumerate(case.steps):
        values = size * np.sin(number + np.arange(count))
        rig = tuple(
            Support(place // 6, place % 6, float(value), read_as)
            for place, value in zip(places, values, strict=True)
        )
        steps.append(replace(step, supports=rig))
    return model, replace(case, steps=tuple(steps))


def by_engine(model: SpineModel, case: LoadCase, free: Sequence[FreeParameter]) -> list[Array]:
    """Poses, reactions (T, J, 6) and their derivatives."""
    system = System(Chain(model), model, case)
    steps = draw.solved(system)
    shape = (len(steps), model.n_joints, 6)
    return [
        np.reshape([step.equilibrium.q for step in steps], shape),
        np.reshape([reaction(system, step) for step in steps], shape),
        np.reshape(by_parameters(system, steps, free), (*shape, len(free))),
        np.reshape(reactions_by(system, steps, free), (*shape, len(free))),
    ]


@pytest.mark.slow
@pytest.mark.parametrize(
    "effects",
    [
        pytest.param(draw.few(), id="few"),
        pytest.param(VARIANTS, id="every", marks=pytest.mark.full),
    ],
)
def test_the_stack_says_what_the_engine_says(effects: Sequence[Effect]) -> None:
    """Of every form of every effect at one place, and of all of them at every place."""
    sweep("effect", effects, str)(as_the_engine_says)()


def as_the_engine_says(effect: Effect) -> None:
    """Beside runs that no rig holds; agreement as of free chains, reactions by their size."""
    rng = np.random.default_rng(70 + len(str(effect)))
    drawn = [draw.model(rng, 3, [effect], 0.5) for _ in range(3)]
    runs = [with_rig(rng, run) if n else run for n, run in enumerate(drawn)]
    free = [draw.unknowns(model) for model, _ in runs]
    stack = Stack.of([model for model, _ in runs], [(n, case) for n, (_, case) in enumerate(runs)])
    solution = stack.solve()
    standing = np.logical_and.reduceat(solution.status == "converged", stack.first[:-1])
    q = np.where(np.isnan(solution.q), 0.0, solution.q)
    dq = poses_by(stack, q, free)
    found = (q, reactions(stack, q), dq, stack_reactions_by(stack, q, dq, free))
    compared = 0
    for number, (model, case) in enumerate(runs):
        lanes, m = stack.lanes(np.array([number])), len(free[number])
        if not standing[number]:
            continue
        compared += 1
        expected = by_engine(model, case, free[number])
        for one, other, least in zip(found, expected, (1.0, 1.0, 1e-3, 1.0), strict=True):
            largest = np.abs(other).max(axis=(0, 1, 2), initial=0.0)
            here = one[lanes] if one.ndim == 3 else one[lanes][..., :m]
            np.testing.assert_allclose(
                here / np.maximum(largest, least), other / np.maximum(largest, least), atol=1e-9
            )
    assert compared >= 1


@pytest.mark.parametrize("name", ["nonlinear_stiffening", "hysteresis", "creep", "load_gain"])
def test_derivatives_are_those_of_differences(name: str) -> None:
    """Of poses, and of readings with reactions in the place of what is fixed."""
    rng = np.random.default_rng(len(name))
    effect = next(one for one in VARIANTS if one.name == name)
    model, case = with_rig(rng, draw.model(rng, 2, [effect], 0.4), read_as=1e-4)
    free = draw.unknowns(model)
    stack = Stack.of([model], [(0, case)])
    q = stack.solve().q
    dq = poses_by(stack, q, [free])
    found = readings_by(stack, q, dq, [free])
    for column, one in enumerate(free):
        size = np.abs(model.effects[one.effect].values[list(one.rows), one.column]).max()
        h = 1e-5 * (1.0 if one.logarithmic else max(size, 1e-3))
        ends = []
        for sign in (1.0, -1.0):
            there = stack.with_models([with_parameters(model, [one], np.array([sign * h]))])
            ends.append(readings(there, there.solve(q).q))
        expected = (ends[0] - ends[1]) / (2.0 * h)
        largest = max(np.abs(expected).max(), 1e-6)
        np.testing.assert_allclose(found[..., column], expected, atol=2e-5 * largest)


def test_what_is_off_moves_reactions_too() -> None:
    """Idle laws and loads besides: as the derivatives of a model that has them, switched off."""
    rng = np.random.default_rng(9)
    model, case = with_rig(rng, draw.model(rng, 3, [], 0.5), read_as=1e-4)
    effect = next(one for one in VARIANTS if one.name == "neutral_zone")
    off = np.array([p.default if p.off is None else p.off for p in effect.parameters])
    full = model.with_effects(
        (*model.effects, ScopedEffect(effect, (0, 1, 2), np.tile(off, (3, 1))))
    )
    column = next(n for n, p in enumerate(effect.parameters) if p.off is not None)
    free = [FreeParameter("", len(model.effects), column, (joint,), False) for joint in range(3)]
    plain, other = Stack.of([model], [(0, case)]), Stack.of([full], [(0, case)])
    q = plain.solve().q
    answering = Answering.of(plain, q)
    assert answering is not None
    (found,) = answering.by_strengths([Idle(effect, off[None])])
    by_strength = found[..., 0, column]  # lanes, joints, n
    expected = readings_by(other, q, poses_by(other, q, [free]), [free])
    found = np.moveaxis(by_strength, 1, 2).reshape(expected.shape)
    np.testing.assert_allclose(found, expected, atol=1e-11 * np.abs(expected).max())
    push = rng.normal(size=(*q.shape, 1))
    small = answered(plain, q, push)
    assert np.abs(small[plain.loads.supports.fixed]).max() > 0.0


def test_coordinates_are_fixed_in_all_steps_or_none() -> None:
    rig = (Support(0, BENDING, 0.0),)
    with pytest.raises(RefusedModel, match="the same ones in all steps"):
        LoadCase("test", 1, (LoadStep(0, (), None, rig), LoadStep(1, ())))
    with pytest.raises(RefusedModel, match="no finite value"):
        LoadCase("test", 1, (LoadStep(0, (), None, (Support(0, BENDING, np.nan),)),))


def test_what_moves_in_time_has_no_rig() -> None:
    model = coupled()
    told = no_settling(System(Chain(model), model, twisted([Support(0, ROTATION, 0.0)])))
    assert told is not None
    assert "use equilibrium loading" in told


def test_effects_cover_what_remembers() -> None:
    """The comparisons above mean something only while laws with a state are among the variants."""
    assert any(effect.kind is EffectKind.PATH for effect in VARIANTS)
