"""Least stress: against another solver, closed forms, and what is said beyond strength."""

from dataclasses import replace

import clarabel
import numpy as np
import pytest
from scipy import sparse
from trunk_person import held_task

from spinepipe.muscles.forces import STRESS_PA, Demand, least_stress
from spinepipe.muscles.strength import most_along


def by_clarabel(demand: Demand) -> np.ndarray:
    """The same quadratic programme by an interior-point method."""
    unit = demand.pcsa * STRESS_PA
    many = len(unit)
    rows = [demand.arms * unit, -np.eye(many), np.eye(many), -demand.sheath * unit]
    limits = [demand.required, -demand.least / unit, demand.most / unit, np.zeros(2)]
    cones = [
        clarabel.ZeroConeT(len(demand.required)),
        clarabel.NonnegativeConeT(2 * many + 2),
    ]
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-11
    solved = clarabel.DefaultSolver(
        sparse.csc_matrix(np.eye(many)),
        np.zeros(many),
        sparse.csc_matrix(np.vstack(rows)),
        np.concatenate(limits),
        cones,
        settings,
    ).solve()
    return np.array(solved.x) * unit


@pytest.mark.parametrize("task", ["standing", "flexion_50", "full_flexion", "forward_100"])
def test_two_solvers_agree(task: str) -> None:
    demand = held_task(task).demand
    ours = least_stress(demand)
    assert ours.enough
    assert ours.forces == pytest.approx(by_clarabel(demand), abs=1e-3)


def test_rows_are_met_to_rounding() -> None:
    demand = held_task("full_flexion").demand
    found = least_stress(demand).forces
    assert demand.arms @ found == pytest.approx(demand.required, abs=1e-9)
    assert np.all(demand.sheath @ found > -1e-6)
    assert np.all((found >= demand.least) & (found <= demand.most))


def two(required: float, most: float = 1000.0, least: float = 0.0) -> Demand:
    """Two muscles at one joint, arms 0.05 and 0.02 m, cross-sections 2 and 1 cm2."""
    return Demand(
        np.array([[0.05, 0.02]]),
        np.array([required]),
        np.full(2, least),
        np.full(2, most),
        np.array([2e-4, 1e-4]),
        np.zeros((2, 2)),
    )


def test_two_muscles_share_by_arm_and_cross_section_squared() -> None:
    """Least (f/A)^2 under sum a f = m: f is proportional to a A^2."""
    weights = np.array([0.05 * 4.0, 0.02 * 1.0])
    forces = 10.0 * weights / (np.array([0.05, 0.02]) @ weights)
    assert least_stress(two(10.0)).forces == pytest.approx(forces, rel=1e-9)


def test_a_muscle_at_its_limit_leaves_the_rest_to_the_other() -> None:
    found = least_stress(two(10.0, most=180.0))
    assert found.enough
    assert found.forces == pytest.approx([180.0, 50.0], rel=1e-9)


def test_what_cannot_be_made_is_told() -> None:
    found = least_stress(two(10.0, most=100.0))
    assert not found.enough
    assert found.forces == pytest.approx([100.0, 100.0], rel=1e-4)
    assert found.slack == pytest.approx([3.0], abs=1e-4)


def test_strength_left_is_what_muscles_can_make_less_what_they_do() -> None:
    demand = two(10.0, most=300.0)
    assert most_along(demand, np.ones(1), demand.required) == pytest.approx(11.0)
    assert most_along(demand, demand.required, np.zeros(1)) == pytest.approx(2.1)
    assert most_along(two(10.0, most=100.0), np.ones(1), np.array([10.0])) is None


def test_a_sheath_is_never_pushed() -> None:
    """The cheaper muscle would push: the other one has to draw as much."""
    demand = replace(two(10.0), sheath=np.array([[-1.0, 1.0], [0.0, 0.0]]))
    found = least_stress(demand)
    assert found.forces == pytest.approx([10.0 / 0.07, 10.0 / 0.07], rel=1e-6)
