"""Descents along bounds, against scipy's linear and general bounded solvers.

Catches a descent that leaves its bounds or stops before it must.
"""

import numpy as np
import pytest
from scipy.optimize import lsq_linear, minimize

from spinepipe.calibrate.descent import DescentTolerances, descend_along
from spinepipe.effects.contract import Array

pytestmark = pytest.mark.numeric

TIGHT = DescentTolerances(cost=1e-13, step=1e-10, slope=0.0, evaluations=200)


def test_a_linear_problem_ends_on_the_bounds_that_scipy_finds() -> None:
    rng = np.random.default_rng(4)
    for _ in range(20):
        matrix, target = rng.normal(size=(15, 8)), rng.normal(size=15)
        bounds = (np.full(8, -0.05), np.full(8, 0.2))
        expected = lsq_linear(matrix, target, bounds, "bvls")
        ended = descend_along(
            lambda x, a=matrix, b=target: (a @ x - b, a), np.zeros(8), bounds, np.ones(8), TIGHT
        )
        assert ended.arrived
        assert ended.half_cost == pytest.approx(expected.cost, rel=1e-9)
        np.testing.assert_allclose(ended.x, expected.x, atol=1e-5)
        assert ((expected.active_mask != 0) == ((ended.x == -0.05) | (ended.x == 0.2))).all()


def rosenbrock(x: Array) -> tuple[Array, Array]:
    """Chained, a curved valley; (2 (m - 1),) residuals."""
    m = len(x)
    curve, off = 10.0 * (x[1:] - x[:-1] ** 2), 1.0 - x[:-1]
    jacobian = np.zeros((2 * (m - 1), m))
    for k in range(m - 1):
        jacobian[k, k], jacobian[k, k + 1] = -20.0 * x[k], 10.0
        jacobian[m - 1 + k, k] = -1.0
    return np.append(curve, off), jacobian


@pytest.mark.parametrize("most", [0.5, 0.9, 3.0])
def test_a_curved_valley_cut_off_by_bounds(most: float) -> None:
    bounds, scale = (np.full(4, -0.2), np.full(4, most)), np.array([1.0, 0.3, 2.0, 1.0])
    ended = descend_along(rosenbrock, np.zeros(4), bounds, scale, TIGHT)
    expected = minimize(
        lambda x: 0.5 * float(rosenbrock(x)[0] @ rosenbrock(x)[0]),
        np.zeros(4),
        method="L-BFGS-B",
        bounds=list(zip(*bounds, strict=True)),
        options={"ftol": 1e-15, "gtol": 1e-10, "maxiter": 5000},
    )
    assert ended.arrived
    np.testing.assert_allclose(ended.x, expected.x, atol=1e-4)
    assert ended.half_cost <= expected.fun + 1e-9


def test_where_nothing_stands_a_shorter_step_is_tried() -> None:
    """Beyond 0.7 there is no equilibrium: it ends before, and does not say it has arrived."""

    def point(x: Array) -> tuple[Array, Array] | None:
        return None if x[0] > 0.7 else (x - 1.0, np.eye(1))

    bounds = (np.zeros(1), np.full(1, 2.0))
    ended = descend_along(point, np.full(1, 0.1), bounds, np.ones(1), TIGHT)
    assert 0.5 < ended.x[0] <= 0.7
    assert not ended.arrived or ended.half_cost > 0.0
    nowhere = descend_along(lambda x: None, np.zeros(1), bounds, np.ones(1), TIGHT)
    assert not nowhere.arrived
