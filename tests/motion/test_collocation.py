"""Motions of least cost against CasADi and IPOPT, on a chain of two joints."""

from pathlib import Path

import numpy as np
import pytest
from short_chain import BODIES, INTERVALS, ask, by_ipopt, trial

from spinepipe.motion.objective import ForceCost
from spinepipe.motion.trajectory import solve
from spinepipe.status import Status


@pytest.mark.parametrize("cost", ["squared", "minus_gravity", "level_difference"])
def test_the_least_cost_is_that_of_collocation(cost: ForceCost, tmp_path: Path) -> None:
    """To 0.1 %, which is ten times by what a last step changes it."""
    seen = trial()
    found = solve(ask(cost), [seen], [np.zeros((INTERVALS + 3, 18, 6))])
    assert found.status is Status.CONVERGED
    reference = by_ipopt(cost, tmp_path)
    exponents = np.array([40.0, 40.0, 50.0]) * np.abs(reference.turns)
    assert exponents.max() < 5.0  # where the law goes on straight, which the reference does not
    assert found.cost == pytest.approx(reference.cost, rel=1e-3)
    turns = seen.grid.at_nodes(found.coefficients[0])[0][:, 1 : BODIES + 1, 3:]
    assert np.rad2deg(np.abs(turns - reference.turns)).max() < 0.1
