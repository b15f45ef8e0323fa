"""Stiffness from motion with OpenSim as the model: least squares on differenced derivatives."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from . import opensim_peer
from .chain import Chain, Load

Array = NDArray[np.float64]
Case = Sequence[Load]
Predictor = Callable[[Array], Array]

FIXED = -1
"""Group of a stiffness that is not calibrated."""

ROTATIONS = np.array([0.0, 0.0, 0.0, 1.0, 1.0, 1.0])
"""Weights that count the three angles of a joint, in rad, and no translation."""


@dataclass(frozen=True)
class Fit:
    """What a calibration found.

    Attributes
    ----------
    stiffness : (J, 6) N/m and N m/rad.
    factors : (P,) found stiffness of each group over its start value.
    cost : half the sum of squared weighted errors.
    success : what the optimiser reports of itself, right or wrong.
    n_predictions : how often all load cases were predicted.
    cpu_seconds : processor time, building the models excluded.
    """

    stiffness: Array
    factors: Array
    cost: float
    success: bool
    n_predictions: int
    cpu_seconds: float


def one_per_axis(n_joints: int) -> NDArray[np.int_]:
    """Groups of three unknowns: each rotational stiffness, the same at every level."""
    return np.tile([FIXED, FIXED, FIXED, 0, 1, 2], (n_joints, 1))


def static_predictor(chain: Chain, cases: Sequence[Case], tol: float = 1e-12) -> Predictor:
    """Stiffness (J, 6) -> equilibria (C, J, 6), each begun where the last one of its case ended."""
    models = [opensim_peer.build(chain.with_loads(*case), ramp_time=1.0) for case in cases]
    poses = [np.zeros(6 * chain.n_joints) for _ in cases]

    def predict(stiffness: Array) -> Array:
        for case, model in enumerate(models):
            opensim_peer.set_stiffness(model, stiffness)
            poses[case] = opensim_peer.equilibrium_of(model, tol, poses[case])
        return np.reshape(poses, (len(models), -1, 6))

    return predict


def forward_predictor(
    chain: Chain,
    cases: Sequence[Case],
    duration: float = 1.5,
    integrator: opensim_peer.Integrator = "cpodes",
    accuracy: float = 1e-5,
) -> Predictor:
    """Stiffness (J, 6) -> poses (C, J, 6) reached after ``duration`` s of forward dynamics."""
    models = [opensim_peer.build(chain.with_loads(*case)) for case in cases]

    def predict(stiffness: Array) -> Array:
        poses = []
        for model in models:
            opensim_peer.set_stiffness(model, stiffness)
            reached = opensim_peer.settle_of(model, duration, integrator, accuracy=accuracy)
            poses.append(reached.reshape(-1, 6))
        return np.array(poses)

    return predict


def calibrate(
    predict: Predictor,
    start: Array,
    observed: Array,
    groups: NDArray[np.int_],
    weights: Array = ROTATIONS,
    difference_step: float = 1e-6,
    tolerance: float = 1e-8,
) -> Fit:
    """Fit log-stiffness factors so that ``predict`` meets the observed coordinates.

    Parameters
    ----------
    predict : `static_predictor` or `forward_predictor`.
    start : (J, 6) start values; those in group `FIXED` keep them.
    observed : (C, J, 6) m and rad; NaN where not measured.
    groups : (J, 6) number of the unknown that scales each stiffness, or `FIXED`.
    weights : broadcast to ``observed``; 0 leaves a coordinate out.
    difference_step : step in log-stiffness of the forward differences. Forward runs need 1e-3:
        at 1.5e-8, an optimiser's usual choice, integrator noise hides the derivative.
    tolerance : relative change of cost and of log-stiffness at which to stop. The gradient does
        not decide: it falls with the cost.
    """
    counted = np.isfinite(observed) & (np.broadcast_to(weights, observed.shape) != 0)
    scale = np.broadcast_to(weights, observed.shape)[counted]
    asked: dict[bytes, Array] = {}

    def errors(logs: Array) -> Array:
        """Ask once per point: the optimiser wants each point again for its derivative."""
        point = logs.tobytes()
        if point not in asked:
            asked[point] = (predict(_scaled(start, groups, logs)) - observed)[counted] * scale
        return asked[point]

    def jacobian(logs: Array) -> Array:
        here = errors(logs)
        moves = difference_step * np.eye(len(logs))
        return np.array([(errors(logs + move) - here) / difference_step for move in moves]).T

    began = time.process_time()
    logs = np.zeros(groups.max() + 1)
    found = least_squares(errors, logs, jacobian, xtol=tolerance, ftol=tolerance, gtol=None)
    return Fit(
        stiffness=_scaled(start, groups, found.x),
        factors=np.exp(found.x),
        cost=float(found.cost),
        success=bool(found.success),
        n_predictions=len(asked),
        cpu_seconds=time.process_time() - began,
    )


def _scaled(start: Array, groups: NDArray[np.int_], logs: Array) -> Array:
    """A trailing factor of one stands at index -1, for the group `FIXED`."""
    return start * np.append(np.exp(logs), 1.0)[groups]
