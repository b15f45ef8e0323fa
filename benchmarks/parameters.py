"""Calibration on T12-S1 by number of unknowns: spinepipe and OpenSim on the same numbers."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from benchmarks.engine import Result, off, with_moments
from benchmarks.timing import cpu_seconds
from spinepipe.calibration import MeasuredCase, Problem, fit
from spinepipe.model import LoadCase, SpineModel
from spinepipe.statics import FreeParameter, System, follow, with_parameters
from spinepipe.units import STIFFNESS_COLUMNS
from spinepipe.world import Chain
from tests.reference.bridge import load_case, spine_model
from tests.reference.peers import opensim_calibration
from tests.reference.peers.chain import Chain as PeerChain
from tests.reference.peers.chain import t12_s1_chain

REGIONS = (1, 2, 3, 6)
"""Parts of the spine whose joints share their three rotational stiffnesses."""


def calibrations() -> Iterator[Result]:
    """Rotational stiffness from three load cases with exact data: 3 shared to 18 per level."""
    chain = t12_s1_chain()
    for regions in REGIONS:
        yield _calibration(chain, regions)


def _calibration(chain: PeerChain, regions: int) -> Result:
    loaded, groups = with_moments(chain), _groups(chain.n_joints, regions)
    rng = np.random.default_rng(5)
    unknowns = int(groups.max()) + 1
    factors = np.append(np.exp(rng.normal(0.0, 0.3, unknowns)), 1.0)
    truth = chain.stiffness * factors[groups]
    problem = _problem(chain, loaded, groups, truth)
    ours = cpu_seconds(lambda: fit(problem), 20)
    found = with_parameters(problem.model, problem.free, fit(problem).x).effects[0].values
    observed = np.concatenate([case.measured for case in problem.cases])
    predict = opensim_calibration.static_predictor(chain, [case.loads for case in loaded])
    peer = opensim_calibration.calibrate(predict, chain.stiffness, observed, groups)
    return Result(
        f"calibration of {unknowns} stiffnesses, three load cases",
        ours.median,
        "OpenSim static root-find + least squares",
        peer.cpu_seconds,
        f"off truth by {off(found, truth)}, OpenSim by {off(peer.stiffness, truth)}",
    )


def _groups(joints: int, regions: int) -> NDArray[np.int_]:
    """(J, 6) number of the unknown that scales each stiffness."""
    groups = np.full((joints, 6), opensim_calibration.FIXED)
    region = np.arange(joints) * regions // joints
    groups[:, 3:] = 3 * region[:, None] + np.arange(3)
    return groups


def _problem(
    chain: PeerChain, loaded: list[PeerChain], groups: NDArray[np.int_], truth: np.ndarray
) -> Problem:
    """Exact motion of a spine of the true stiffness, to be fitted from the chain's own."""
    cases = [load_case(case, test=str(number)) for number, case in enumerate(loaded)]
    true_model = spine_model(chain.with_stiffness(truth))
    measured = tuple(_measured(true_model, case) for case in cases)
    free = tuple(_unknown(groups, number) for number in range(groups.max() + 1))
    reach = np.full(len(free), np.log(1000.0))
    model = spine_model(chain)
    return Problem(model, measured, free, np.array([0, 0, 0, 1, 1, 1.0]), -reach, reach)


def _unknown(groups: NDArray[np.int_], number: int) -> FreeParameter:
    rows, columns = np.nonzero(groups == number)
    column = int(columns[0])
    name = f"{STIFFNESS_COLUMNS[column]}@{number}"
    return FreeParameter(name, 0, column, tuple(rows.tolist()), True)


def _measured(model: SpineModel, case: LoadCase) -> MeasuredCase:
    solved = follow(System(Chain(model), model, case))
    return MeasuredCase(case, np.stack([s.equilibrium.q.reshape(-1, 6) for s in solved]))
