"""The bounded tangent law: what its equations say of it, derivatives, solves near its ends.

Catches a wrong sign, bound or derivative of the law, and solves lost near its ends.
"""

import numpy as np
import pytest
from example_effects import NOWHERE, scoped, slope, spine
from sweeps import sweep

from spinepipe.effects import Wrench, create
from spinepipe.effects.contract import Array
from spinepipe.model import LoadCase, LoadStep, SpineModel
from spinepipe.statics import System, follow
from spinepipe.statics.batched import Stack
from spinepipe.units import COORDINATES
from spinepipe.world import Chain

BENDING = COORDINATES.index("right_bending")
LAW = create("bounded_tangent", {})
LEAST = 1e-4
"""N m/rad, the least that a bushing may have; the law carries the rest."""

ENDS = ((-0.11, 0.21), (-0.2, 0.2), (-0.35, 0.05))


def load(q: float, stretch: float, lower: float, upper: float) -> float:
    pose = np.zeros((1, 6))
    pose[0, BENDING] = q
    response = LAW.respond(pose, np.array([[stretch, lower, upper]]), np.zeros((1, 6)))
    return float(response.load[0, BENDING])


@sweep("ends", ENDS)
def test_it_carries_nothing_at_the_neutral_pose(ends: tuple[float, float]) -> None:
    assert load(0.0, 7.0, *ends) == 0.0


def test_bending_by_five_sixths_of_the_way_takes_what_jalalian_s_ends_imply() -> None:
    """Ends at 1.2 times the motion of the films, the same to both sides: consistency check J6."""
    bent, stretch = 0.14, 5.0
    ends = (-1.2 * bent, 1.2 * bent)
    assert load(bent, stretch, *ends) == pytest.approx(3.732 * stretch, rel=1e-4)
    first = load(1e-7, stretch, *ends) / 1e-7
    assert load(bent, stretch, *ends) / bent / first == pytest.approx(2.85, abs=5e-3)


@sweep("ends", ENDS)
def test_load_grows_without_limit_towards_both_ends_and_is_infinite_beyond(
    ends: tuple[float, float],
) -> None:
    for end, sign in zip(ends, (-1.0, 1.0), strict=True):
        near = [sign * load(end * (1.0 - 10.0**-k), 3.0, *ends) for k in range(1, 8)]
        assert np.all(np.diff(near) > 0.0)
        assert near[-1] > 1e6
        assert load(1.0001 * end, 3.0, *ends) == sign * np.inf
        assert load(1.0001 * end, 0.0, *ends) == 0.0


@sweep("ends", ENDS)
def test_derivatives_are_those_of_the_load(ends: tuple[float, float]) -> None:
    for share in (-0.9, -0.3, 0.2, 0.85):
        q = share * (ends[1] if share > 0.0 else -ends[0])
        values = np.array([4.0, *ends])
        pose = np.zeros((1, 6))
        pose[0, BENDING] = q
        response = LAW.respond(pose, values[None], np.zeros((1, 6)))
        by_q = slope(lambda step, q=q, v=values: np.array(load(q + step, *v)), 1e-5)
        assert response.tangent[0, BENDING, BENDING] == pytest.approx(by_q, rel=1e-7)
        found = LAW.by_parameter(pose, values[None], np.zeros((1, 6)))[0]
        for column, size in enumerate((1e-3, 1e-5, 1e-5)):
            step = size * np.eye(3)[column]
            by_value = slope(
                lambda s, q=q, v=values, d=step: np.array(load(q, *(v + s / np.abs(d).max() * d))),
                size,
            )
            assert found[BENDING, column] == pytest.approx(by_value, rel=1e-6, abs=1e-9)
        assert not np.delete(found, BENDING, axis=0).any()


def bent(
    moment_nm: float, ends: tuple[float, float], joints: int = 1
) -> tuple[SpineModel, LoadCase]:
    """Joints of which each bears the moment about its own bending axis, springs of no account."""
    model = spine(joints, gravity=False)
    springs = model.effects[0].values.copy()
    springs[:, BENDING] = LEAST
    law = scoped(LAW, tuple(range(joints)), *((6.0, *ends),) * joints)
    model = model.with_effects((model.effects[0].with_values(springs), law))
    axis = model.frames[0].rotation[:, 0]
    top = joints - 1
    step = LoadStep(0, (Wrench(top, NOWHERE, NOWHERE, moment_nm * axis),))
    return model, LoadCase("bent", 1, (step,))


def expected(moment_nm: float, lower: float, upper: float) -> float:
    """The law solved for its angle: (arctan(M / A + tan C) - C) / B."""
    b = np.pi / (upper - lower)
    c = -0.5 * b * (upper + lower)
    return float((np.arctan(moment_nm / 6.0 + np.tan(c)) - c) / b)


@sweep("ends", ENDS)
@sweep("moment_nm", [-3000.0, -40.0, 2.0, 60.0, 5000.0])
def test_a_joint_under_any_moment_stays_between_its_ends(
    moment_nm: float, ends: tuple[float, float]
) -> None:
    """However large the step that Newton would take from the neutral pose."""
    model, case = bent(moment_nm, ends)
    (found,) = follow(System(Chain(model), model, case))
    assert found.usable, found.equilibrium.message
    angle = found.equilibrium.q[BENDING]
    assert ends[0] < angle < ends[1]
    assert angle == pytest.approx(expected(moment_nm, *ends), abs=1e-6)


def test_stacks_of_it_end_where_the_engine_of_record_ends() -> None:
    runs = [bent(moment, ends) for moment in (-300.0, 5.0, 80.0) for ends in ENDS]
    stack = Stack.of([model for model, _ in runs], [(n, case) for n, (_, case) in enumerate(runs)])
    found = stack.solve()
    assert not found.by_engine.any()
    for (model, case), q in zip(runs, found.q, strict=True):
        (record,) = follow(System(Chain(model), model, case))
        np.testing.assert_allclose(q.ravel(), record.equilibrium.q, rtol=0, atol=1e-11)


def test_other_laws_may_act_beside_it() -> None:
    """A pose is the same with the moment shared between the tangent and a spring."""
    model, case = bent(20.0, ENDS[0])
    springs: Array = model.effects[0].values.copy()
    springs[:, BENDING] = 55.0
    both = model.with_effects((model.effects[0].with_values(springs), model.effects[1]))
    (found,) = follow(System(Chain(both), both, case))
    angle = float(found.equilibrium.q[BENDING])
    assert 55.0 * angle + load(angle, 6.0, *ENDS[0]) == pytest.approx(20.0, rel=1e-9)
