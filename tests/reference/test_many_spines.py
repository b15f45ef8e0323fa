"""Many spines at once against the engine of record, spine by spine, on random chains.

Catches a stack that solves a spine otherwise than the engine of record.
"""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from example_effects import ExtraWeight

from spinepipe.effects import Wrench, create
from spinepipe.model import LoadCase, LoadStep, ScopedEffect, SpineModel
from spinepipe.statics import System, follow
from spinepipe.statics.batched import Cases, Spines, solve_many
from spinepipe.statics.batched import spines as batched_spines
from spinepipe.statics.joint_forces import assemble_joint_forces
from spinepipe.status import Status
from spinepipe.world import Chain
from tests.reference import bridge
from tests.reference.peers import chain as chains

AGREEMENT = 1e-10
"""m and rad."""

COUNT = 40


def varied(model: SpineModel, rng: np.random.Generator) -> Spines:
    """Spines that differ in frames, bodies, damping and stiffness."""
    spines = Spines.of(model, COUNT)
    shape = spines.origins.shape
    scale = np.exp(rng.normal(0.0, 0.2, (COUNT, shape[1])))
    return replace(
        spines,
        origins=spines.origins + rng.normal(0.0, 2e-3, shape),
        masses=spines.masses * scale,
        inertias=spines.inertias * scale[..., None, None],
        coms=spines.coms + rng.normal(0.0, 3e-3, shape),
        damping=spines.damping * np.exp(rng.normal(0.0, 0.3, spines.damping.shape)),
        values=(
            spines.values[0] * np.exp(rng.normal(0.0, 0.2, spines.values[0].shape)),
            *spines.values[1:],
        ),
    )


def loaded(case: LoadCase, rng: np.random.Generator, share: float = 1.0) -> Cases:
    """Loads that differ in size, direction and point."""
    cases = Cases.of(case, COUNT)
    size = np.exp(rng.normal(0.0, 0.2, (COUNT, 1, 1, 1)))
    return replace(
        cases,
        points=cases.points + rng.normal(0.0, 2e-3, cases.points.shape),
        forces=cases.forces * size,
        moments=cases.moments * size + share * rng.normal(0.0, 0.05, cases.moments.shape),
    )


def by_engine(model: SpineModel, case: LoadCase) -> tuple[np.ndarray, np.ndarray, list[Status]]:
    """(T, J, 6) poses and joint loads of the engine of record, and how each step ended."""
    system = System(Chain(model), model, case)
    solved = follow(system)
    q = np.array([step.equilibrium.q.reshape(-1, 6) for step in solved])
    load = np.array(
        [
            assemble_joint_forces(
                system.joint_kinematics(step.equilibrium.q, False), system.laws, step.states, False
            ).load
            for step in solved
        ]
    )
    return q, load, [step.equilibrium.status for step in solved]


@pytest.mark.parametrize(
    ("seed", "n_joints", "share"), [(1, 1, 1.0), (2, 3, 1.0), (3, 6, 1.0), (4, 17, 0.1)]
)
def test_random_spines_are_where_the_engine_puts_them(
    seed: int, n_joints: int, share: float
) -> None:
    rng = np.random.default_rng(seed)
    chain = chains.random_chain(rng, n_joints)
    spines = varied(bridge.spine_model(chain), rng)
    cases = loaded(bridge.load_case(chain, 0.5 * share, share), rng, share)
    found = solve_many(spines, cases)
    assert found.by_engine.mean() < 0.5  # or this would compare the engine with itself
    for number in np.flatnonzero(~found.by_engine)[:12]:
        q, load, status = by_engine(spines.model(number), cases.case(number))
        assert status == [Status.CONVERGED] * 2
        np.testing.assert_allclose(found.q[number], q, rtol=0, atol=AGREEMENT)
        np.testing.assert_allclose(found.load[number], load, rtol=1e-8, atol=1e-8)


def test_laws_of_single_joints_act_in_their_order() -> None:
    rng = np.random.default_rng(7)
    chain = chains.random_chain(rng, 4)
    model = bridge.spine_model(chain)
    stiffening = create("nonlinear_stiffening", {"coordinate": "extension"})
    coupling = create("bending_rotation_coupling")
    laws = (
        ScopedEffect(stiffening, (0, 2), np.array([[10.0], [30.0]])),
        ScopedEffect(coupling, (1, 3), np.array([[5.0], [-8.0]])),
    )
    spines = varied(model.with_effects((*model.effects, *laws)), rng)
    cases = loaded(bridge.load_case(chain), rng)
    found = solve_many(spines, cases)
    assert not found.by_engine.any()
    without = solve_many(replace(spines, like=model, values=spines.values[:1]), cases)
    assert np.abs(found.q - without.q).max() > 1e-4
    for number in range(8):
        q, _, _ = by_engine(spines.model(number), cases.case(number))
        np.testing.assert_allclose(found.q[number], q, rtol=0, atol=AGREEMENT)


def test_an_effect_that_takes_no_stack_goes_to_the_engine() -> None:
    rng = np.random.default_rng(8)
    chain = chains.random_chain(rng, 2)
    model = bridge.spine_model(chain)
    weight = ScopedEffect(ExtraWeight(((0.0, 0.1, 0.0),)), (0,), np.array([[20.0]]))
    spines = Spines.of(model.with_effects((*model.effects, weight)), 3)
    found = solve_many(spines, Cases.of(bridge.load_case(chain), 3))
    assert found.by_engine.all()
    q, _, _ = by_engine(spines.model(0), bridge.load_case(chain))
    np.testing.assert_allclose(found.q[2], q, rtol=0, atol=1e-13)


def test_a_spine_that_tips_over_is_a_row_with_a_reason() -> None:
    """Soft joints under their weight buckle; the others of the same chunk are none the worse."""
    rng = np.random.default_rng(9)
    chain = chains.random_chain(rng, 3)
    spines = Spines.of(bridge.spine_model(chain), 4)
    soft = spines.values[0].copy()
    soft[2] *= 1e-4
    cases = Cases.of(bridge.load_case(chain), 4)
    found = solve_many(replace(spines, values=(soft,)), cases)
    whole = solve_many(spines, cases)
    assert found.status[2, 0] == Status.UNSTABLE
    assert found.messages[2, 0]
    assert np.isnan(found.q[2]).all()
    assert np.isnan(found.load[2]).all()
    np.testing.assert_array_equal(found.q[[0, 1, 3]], whole.q[[0, 1, 3]])
    assert (found.status[[0, 1, 3]] == Status.CONVERGED).all()


def test_an_impossible_spine_is_refused_and_the_others_solved() -> None:
    rng = np.random.default_rng(10)
    chain = chains.random_chain(rng, 2)
    spines = Spines.of(bridge.spine_model(chain), 3)
    values = spines.values[0].copy()
    values[1] = np.nan
    found = solve_many(replace(spines, values=(values,)), Cases.of(bridge.load_case(chain), 3))
    assert found.status[:, 0].tolist() == ["converged", "refused", "converged"]
    assert "linear_bushing" in found.messages[1, 0]
    assert np.isfinite(found.q[[0, 2]]).all()


def test_parts_and_single_spines_are_what_they_were() -> None:
    rng = np.random.default_rng(11)
    chain = chains.random_chain(rng, 3)
    model, case = bridge.spine_model(chain), bridge.load_case(chain, 0.2, 1.0)
    spines, cases = Spines.of(model, 5), Cases.of(case, 5)
    again = spines.part(slice(1, 3)).model(1)
    np.testing.assert_array_equal(again.effects[0].values, model.effects[0].values)
    for step, other in zip(cases.part(slice(4, 5)).case(0).steps, case.steps, strict=True):
        for wrench, same in zip(step.wrenches, other.wrenches, strict=True):
            np.testing.assert_array_equal(wrench.moment, same.moment)
            np.testing.assert_array_equal(wrench.point, same.point)


def bent(case: LoadCase, steps: int, beside: float) -> LoadCase:
    """The load in so many steps after one of weight alone, on a way that is bent."""
    (last,) = case.steps
    shares = np.linspace(0.0, 1.0, steps + 1)
    return replace(
        case,
        steps=tuple(
            LoadStep(
                number,
                tuple(
                    replace(
                        one,
                        force=share * one.force,
                        moment=share * one.moment
                        + beside * share * (1.0 - share) * np.roll(one.moment, 1),
                    )
                    for one in last.wrenches
                ),
            )
            for number, share in enumerate(shares.tolist())
        ),
    )


@pytest.mark.parametrize(
    ("n_joints", "share", "beside", "least", "most"),
    [(6, 0.5, 0.1, 1.0, 1.0), (4, 12.0, 0.2, 0.9, 1.0), (2, 25.0, 0.1, 0.1, 0.5), (3, 1, 4, 0, 0)],
    ids=["straight", "past critical loads", "some tip over", "bent"],
)
def test_steps_that_nobody_asks_for_are_passed_as_if_solved(
    n_joints: int,
    share: float,
    beside: float,
    least: float,
    most: float,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Catches a spine that is led past steps which would have led it elsewhere, or nowhere."""
    rng = np.random.default_rng(30 + n_joints)
    chain = chains.random_chain(rng, n_joints)
    spines = varied(bridge.spine_model(chain), rng)
    cases = Cases.of(bent(bridge.load_case(chain, share), 6, beside), COUNT)
    whole, asked, own = solve_many(spines, cases), [0, 3, 6], batched_spines._passed
    at_once: list[bool] = []

    def counted(*rest: Any) -> np.ndarray:
        found = own(*rest)
        at_once.extend(found.tolist())
        return found

    monkeypatch.setattr(batched_spines, "_passed", counted)
    found = solve_many(spines, cases, asked)
    assert least <= np.mean(at_once) <= most
    np.testing.assert_allclose(found.q, whole.q[:, asked], rtol=0, atol=AGREEMENT)
    np.testing.assert_allclose(found.load, whole.load[:, asked], rtol=1e-8, atol=1e-8)
    np.testing.assert_array_equal(found.status, whole.status[:, asked])
    np.testing.assert_array_equal(found.by_engine, whole.by_engine)
    told = {(n, asked.index(s)): why for (n, s), why in whole.messages.items() if s in asked}
    assert found.messages == told


def test_a_push_between_the_asked_steps_decides_the_side_of_a_column() -> None:
    """Past its critical load it stays where it was pushed, whoever asks for that step."""
    stiffness, height = 50.0, 0.15
    chain = chains.random_chain(np.random.default_rng(1), 1)
    rigid = [1e10, 1e10, 1e10, stiffness, 1e4, 1e4]
    upright = replace(
        chain,
        origins=np.zeros((1, 3)),
        rotations=np.eye(3)[None],
        masses=np.zeros(1),
        inertias=np.zeros((1, 3, 3)),
        stiffness=np.array([rigid]),
        gravity=np.zeros(3),
    )
    top, down = np.array([0.0, height, 0.0]), np.array([0.0, -1.2 * stiffness / height, 0.0])
    model = bridge.spine_model(upright)
    steps = tuple(
        LoadStep(number, (Wrench(0, top, share * down, np.array([0.0, 0.0, push])),))
        for number, (share, push) in enumerate([(0.0, 0.0), (0.5, 1.0), (1.0, -0.1)])
    )
    cases = Cases.of(LoadCase("test", 1, steps), 2)
    whole = solve_many(Spines.of(model, 2), cases)
    found = solve_many(Spines.of(model, 2), cases, [0, 2])
    assert whole.q[0, 2, 0, 3] > 0.5
    np.testing.assert_allclose(found.q, whole.q[:, [0, 2]], rtol=0, atol=AGREEMENT)
    straight = solve_many(Spines.of(model, 2), cases.steps([0, 2]))
    assert straight.q[0, 1, 0, 3] < -0.5  # the way that is not stated leads to the other side
