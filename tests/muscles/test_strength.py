"""Strength that is left: what can be held by some forces, and what by none, asked of HiGHS."""

import numpy as np
import pytest
from scipy.optimize import linprog
from trunk_person import held_task

from spinepipe.muscles.muscle_equilibrium import SolvedTask
from spinepipe.muscles.strength import capacity_left, load_factor

JUST = 1e-5


def can_be_held(held: SolvedTask, required: np.ndarray) -> bool:
    """Whether forces within their bounds make the moments (21,) N m, no sheath being pushed."""
    demand = held.demand
    solved = linprog(
        np.zeros(len(demand.pcsa)),
        A_eq=demand.arms,
        b_eq=required,
        A_ub=-demand.sheath,
        b_ub=np.zeros(2),
        bounds=list(zip(demand.least, demand.most, strict=True)),
        method="highs",
    )
    assert solved.status in (0, 2)
    return bool(solved.status == 0)


def of_loads(held: SolvedTask) -> np.ndarray:
    """(7, 3) N m of all loads above each joint about its centre, one by one."""
    loads, found = held.applied, np.zeros((7, 3))
    for level, centre in enumerate(held.poses.centres):
        for body, at, push in zip(loads.bodies, loads.at, loads.pushes, strict=True):
            if body > level:
                found[level] += np.cross(at - centre, push)
        found[level] += loads.turning[level + 1 :].sum(axis=0)
    return found


@pytest.mark.parametrize("task", ["standing", "flexion_70_with_load"])
def test_loads_grow_as_far_as_some_forces_hold_them(task: str) -> None:
    held = held_task(task)
    loads = of_loads(held)
    joints = np.array([d @ m for d, m in zip(held.poses.discs, held.joint_moments, strict=True)])
    np.testing.assert_allclose(held.demand.required, -(loads + joints).ravel(), atol=1e-9)
    factor = load_factor(held)
    assert factor is not None
    assert (factor >= 1.0) == held.found.enough
    assert can_be_held(held, -(factor * (1.0 - JUST) * loads + joints).ravel())
    assert not can_be_held(held, -(factor * (1.0 + JUST) * loads + joints).ravel())


def test_flexion_is_added_at_a_level_as_far_as_some_forces_hold_it() -> None:
    held = held_task("standing")
    capacity = capacity_left(held)
    assert capacity is not None
    made = held.demand.required - held.found.slack
    for level, most in enumerate(capacity):
        assert most > 0.0
        extension = np.zeros((7, 3))
        extension[level] = held.poses.discs[level][:, 2]
        assert can_be_held(held, made + (1.0 - JUST) * most * extension.ravel())
        assert not can_be_held(held, made + (1.0 + JUST) * most * extension.ravel())
    assert capacity_left(held_task("exertion_flexion")) is None
