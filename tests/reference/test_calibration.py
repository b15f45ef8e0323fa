"""Calibration on motion that OpenSim made: the stiffness it was made with comes back.

Catches a fit that does not find back stiffness of motion made elsewhere.
"""

import numpy as np
import pytest

from spinepipe.calibration import MeasuredCase, Problem, fit
from spinepipe.statics import free_parameters
from spinepipe.status import Status
from spinepipe.units import STIFFNESS_COLUMNS
from tests.reference import bridge
from tests.reference.peers import chain as chains
from tests.reference.peers import opensim_calibration as calibration
from tests.reference.peers.chain import Load

MOMENTS = 7.5 * np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
"""N m: flexion, left rotation, right bending."""

ROTATIONS_ONLY = np.array([0.0, 0.0, 0.0, 1.0, 1.0, 1.0])


@pytest.mark.parametrize(("grouping", "unknowns"), [("per_specimen", 3), ("per_joint", 18)])
def test_stiffness_comes_back(grouping: str, unknowns: int) -> None:
    start = chains.t12_s1_chain()
    rng = np.random.default_rng(unknowns)
    factors = np.ones((6, 6))
    factors[:, 3:] = np.exp(rng.uniform(-0.7, 0.7, (1 if unknowns == 3 else 6, 3)))
    loads = [(Load(5, moment=moment),) for moment in MOMENTS]
    seen = calibration.static_predictor(start, loads)(factors * start.stiffness)
    model = bridge.spine_model(start)
    free = free_parameters(model, 0, STIFFNESS_COLUMNS[3:], grouping)
    cases = tuple(
        MeasuredCase(bridge.load_case(start.with_loads(*load), test=f"test {n}"), pose[None])
        for n, (load, pose) in enumerate(zip(loads, seen, strict=True))
    )
    bounds = np.full(unknowns, np.log(100.0))
    found = fit(Problem(model, cases, free, ROTATIONS_ONLY, -bounds, bounds))
    assert found.status is Status.CONVERGED
    rows = [(p.rows[0], p.column) for p in free]
    expected = [np.log(factors[at]) for at in rows]
    # both engines' poses agree to 1e-15 rad; the fit stops at steps of 1e-9 and converges squarely
    np.testing.assert_allclose(found.x, expected, rtol=0, atol=1e-9)
