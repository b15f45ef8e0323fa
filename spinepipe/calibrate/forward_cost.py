"""The cost of a calibration problem by forward runs: all that a published optimiser was given."""

from dataclasses import replace

import numpy as np

from spinepipe.calibrate.forward_run import forward_run
from spinepipe.calibrate.problem import Evaluator, Problem
from spinepipe.effects.contract import Array
from spinepipe.model import LoadStep, RefusedModel
from spinepipe.statics import System, moved, no_settling

LOST = 1e6
"""Cost (mm2, deg2) of a point whose run is lost: any optimiser turns back there."""


class OutOfRuns(Exception):
    """The optimiser has had all the runs it may have."""


class ForwardCost(Evaluator):
    """The cost of a problem by forward runs; each point is run once."""

    def __init__(self, problem: Problem, duration_s: float, accuracy: float, most: int) -> None:
        """Load the chain; ``most`` points may be run.

        Raises
        ------
        RefusedModel
            When nothing that was measured has a weight, or the model cannot move in time.
        """
        super().__init__(replace(problem, course=None))
        self.duration_s, self.accuracy, self.most = duration_s, accuracy, most
        self.costs: dict[bytes, float] = {}
        refusal = no_settling(self._systems[0])
        if refusal:
            raise RefusedModel(refusal)

    def cost(self, x: Array) -> float:
        """Sum of weight times squared error (mm2, deg2) with the unknowns at x (m,).

        Raises
        ------
        OutOfRuns
            For a new point when as many as allowed have been run.
        """
        point = x.tobytes()
        if point not in self.costs:
            if len(self.costs) >= self.most:
                raise OutOfRuns
            self.costs[point] = self._run(x)
        return self.costs[point]

    def end(self, system: System, step: LoadStep) -> Array | None:
        """(n,) pose at the end of the run under a load step; None when the run is lost."""
        loading = system.slots.loading(step.wrenches)
        return forward_run(system, loading, self.duration_s, self.accuracy)

    def _run(self, x: Array) -> float:
        model = moved(self.problem.model, self.problem.free, x)
        known: dict[tuple[object, ...], Array | None] = {}  # cycles repeat their loads
        total = 0.0
        for number, system in enumerate(self._systems):
            there = system.with_model(model)
            ends = []
            for step in there.case.steps:
                loading = there.slots.loading(step.wrenches)
                key = (there.case.test, there.slots, loading.key)
                if key not in known:
                    known[key] = self.end(there, step)
                ends.append(known[key])
            poses = [end for end in ends if end is not None]
            if len(poses) < len(ends):
                return LOST
            residual = self._residual(number, there, np.stack(poses))
            total += float(residual @ residual)
        return min(total, LOST)
