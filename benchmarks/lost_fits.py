"""How many fits the published way loses with OpenSim's own runs: the paper's count, redone."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from benchmarks.identification import PERCENT, OpenSimCost, problems
from spinepipe.calibration import fit
from spinepipe.calibration.forward_runs import DEFAULT_STEP, fit_by_cost
from spinepipe.studies.joint_pose_sensitivity.filters import near_start

POSES = tuple(range(40))
ARRIVED = 1.01
"""Cost relative to the exact fit's up to which a fit has arrived."""


@dataclass(frozen=True)
class Lost:
    """What became of the fits of many poses in one way.

    Attributes
    ----------
    all_near, any_near : fits with all, or any, free stiffness within 1 % of the start.
    """

    method: str
    fits: int
    claim_success: int
    all_near: int
    any_near: int
    arrived: int
    cost_ratio_median: float
    runs_median: float


def counts() -> Iterator[Lost]:
    """OpenSim's CPodes runs, differences with the default step, in scaled and in raw units."""
    posed = [problem for name, problem in problems(POSES) if name.startswith("sampled")]
    exact = [fit(problem).cost for problem in posed]
    for words, raw in (("stiffness over its start", False), ("stiffness in SI units", True)):
        found = [fit_by_cost(OpenSimCost(problem), DEFAULT_STEP, raw) for problem in posed]
        ends = np.exp(np.array([one.x for one in found]))
        near = near_start(ends, np.ones_like(ends), PERCENT)
        ratio = np.array([one.cost for one in found]) / np.array(exact)
        yield Lost(
            f"OpenSim CPodes run, default step, {words}",
            len(found),
            sum(one.claims_success for one in found),
            int(near.all(axis=1).sum()),
            int(near.any(axis=1).sum()),
            int((ratio <= ARRIVED).sum()),
            float(np.median(ratio)),
            float(np.median([one.evaluations for one in found])),
        )
