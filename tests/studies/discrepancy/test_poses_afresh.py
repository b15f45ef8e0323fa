"""Poses that a fit follows against those that the loads lead to, and the engine of record."""

from dataclasses import replace

import numpy as np
import pytest
from held_out_cases import JOINTS, MOMENTS_NM, cases, chain
from sweeps import sweep

from spinepipe.effects.contract import Array
from spinepipe.statics import FreeParameter
from spinepipe.studies.discrepancy.search import prediction
from spinepipe.studies.discrepancy.search.prediction import (
    JointPrediction,
    NoEquilibrium,
    Predicted,
    PredictedSpecimen,
    SolvedSpecimen,
    solve_on_record,
)

STIFFNESS = {"a": 40.0, "b": 60.0}
EXTENSION = 3
FREE = (FreeParameter("extension", 0, EXTENSION, (0, 1), True),)


@pytest.fixture
def together() -> JointPrediction:
    """Two specimens, an unknown of the first: the logarithm of its stiffness in extension."""
    free = {"a": FREE, "b": ()}
    subjects = {
        name: PredictedSpecimen(chain(name, k), cases(("extension",)), free[name])
        for name, k in STIFFNESS.items()
    }
    return JointPrediction(subjects, False)


def at(move: float) -> dict[str, Array]:
    return {"a": np.array([move]), "b": np.zeros(0)}


def off(predicted: Predicted, by: float, step: int = 5) -> Predicted:
    """The same with one coordinate of one pose elsewhere."""
    (poses,) = predicted.poses
    moved = poses.copy()
    moved[step, EXTENSION] += by
    return replace(predicted, poses=(moved,))


@sweep("name", ["a", "b"])
@sweep("by, same", [(9e-8, True), (-9e-8, True), (1.2e-7, False), (-1.2e-7, False)])
def test_loads_lead_to_poses_that_are_a_ten_millionth_away(
    name: str, by: float, same: bool, together: JointPrediction
) -> None:
    found = together.at(at(0.2))
    assert together.leads_to(at(0.2), found)
    assert together.leads_to(at(0.2), found | {name: off(found[name], by)}) is same


def test_loads_of_a_stiffer_chain_lead_elsewhere(together: JointPrediction) -> None:
    assert not together.leads_to(at(0.3), together.at(at(0.2)))


def test_what_does_not_stand_is_led_to_by_nothing() -> None:
    """Thirty kilograms a joint: springs of 40 N m/rad hold them, those of 5 do not."""
    model = chain("a", 40.0)
    heavy = tuple(replace(body, mass=30.0) for body in model.bodies)
    model = replace(model, bodies=heavy, gravity=np.array([0.0, -9.81, 0.0]))
    together = JointPrediction({"a": PredictedSpecimen(model, cases(("extension",)), FREE)}, False)
    found = together.at({"a": np.zeros(1)})
    assert together.leads_to({"a": np.zeros(1)}, found)
    assert not together.leads_to({"a": np.array([-2.0])}, found)


def test_readings_and_slopes_are_of_each_specimen_by_its_own_unknowns(
    together: JointPrediction,
) -> None:
    """Moments over stiffness; by the logarithm of stiffness the angle once more, downwards."""
    first = together.at(at(0.0))
    for name, k in STIFFNESS.items():
        (seen,) = first[name].readings
        for joint in range(JOINTS):
            assert seen[:, joint, EXTENSION] == pytest.approx(MOMENTS_NM / k, rel=1e-6)
    (slope,) = first["a"].by_x
    assert slope.shape == (6, JOINTS, 6, 1)
    assert slope[:, 1, EXTENSION, 0] == pytest.approx(-MOMENTS_NM / 40.0, rel=1e-6)
    assert first["b"].by_x[0].shape == (6, JOINTS, 6, 0)


def test_the_next_poses_are_looked_for_along_the_slope(together: JointPrediction) -> None:
    """To first order from the last ones: for a step of 0.01, a fiftieth of a percent away."""
    assert together._guess(together._padded([np.zeros(1), np.zeros(0)])) is None
    together.at(at(0.1))
    guess = together._guess(together._padded([np.array([0.11]), np.zeros(0)]))
    assert guess is not None
    turned = guess[:6, 0, EXTENSION]
    there = MOMENTS_NM / (40.0 * np.exp(0.1))
    assert turned == pytest.approx(there * (1.0 - 0.01), rel=1e-6)
    assert guess[6:, 0, EXTENSION] == pytest.approx(MOMENTS_NM / 60.0, rel=1e-6)


def test_first_poses_are_looked_for_near_those_that_are_told() -> None:
    near = [np.full((6, JOINTS * 6), 0.25), np.full((6, JOINTS * 6), 0.5)]
    subjects = {"a": PredictedSpecimen(chain("a", 40.0), cases(("extension", "bending")), ())}
    told = JointPrediction(subjects, False, {"a": near})._guess(np.zeros((1, 0)))
    assert told is not None
    assert told.shape == (12, JOINTS, 6)
    assert (told[:6] == 0.25).all()
    assert (told[6:] == 0.5).all()


def test_the_engine_of_record_is_asked_beside(monkeypatch: pytest.MonkeyPatch) -> None:
    model, given = chain("a", 40.0), cases(("extension",))
    solve_on_record(model, given)
    asked = []

    def elsewhere(*told: object) -> None:
        asked.append(told)

    monkeypatch.setattr(prediction, "on_record", elsewhere)
    with pytest.raises(NoEquilibrium, match="a: the engine of record"):
        solve_on_record(model, given)
    ((_, _, (poses,), within),) = asked
    assert within == 1e-7
    expected = SolvedSpecimen(model, given, False).poses[0].reshape(6, -1)
    assert poses == pytest.approx(expected)


def test_zeroed_readings_begin_with_nought() -> None:
    """Counted from the first step, which is under load here."""
    (case,) = cases(("extension",))
    back = replace(case, steps=case.steps[:1:-1])
    plain, zeroed = (
        JointPrediction({"a": PredictedSpecimen(chain("a", 40.0), (back,), FREE)}, z).at(
            {"a": np.zeros(1)}
        )["a"]
        for z in (False, True)
    )
    assert np.abs(plain.readings[0][0]).max() > 0.01
    for one, other in ((plain.readings[0], zeroed.readings[0]), (plain.by_x[0], zeroed.by_x[0])):
        assert other == pytest.approx(one - one[:1], abs=1e-15)
    assert zeroed.poses[0] == pytest.approx(plain.poses[0])


def test_a_load_that_holds_moves_the_other_way() -> None:
    """A moment of 1 N m that holds a joint besides its spring turns it back by 1 / k."""
    model, given = chain("a", 40.0), cases(("extension", "bending"))
    solved = SolvedSpecimen(model, given, False)
    loads = [np.zeros((6, JOINTS, 1)) for _ in given]
    loads[1][3, 0, 0] = 1.0
    first, second = solved.by_loads(loads, 4)
    assert np.abs(first).max() < 1e-12
    assert second[3, 0, 4, 0] == pytest.approx(-1.0 / 40.0, rel=1e-6)
    assert np.abs(second[3, ..., 1:]).max() < 1e-12  # of the other joints
    assert np.abs(np.delete(second, 3, axis=0)).max() < 1e-12
