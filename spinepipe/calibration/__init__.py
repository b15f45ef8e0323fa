"""Calibration: stiffness from measured motion, with its uncertainty and its honest status."""

from spinepipe.calibration.fit import Fit, Optimum, fit, fit_alike
from spinepipe.calibration.pooling import CohortSpread, Pooled, PooledSpecimen, pool
from spinepipe.calibration.problem import Evaluation, Evaluator, Problem, needed, side_by_side
from spinepipe.calibration.solvers import by_record
from spinepipe.calibration.uncertainty import Uncertainty
from spinepipe.model import MeasuredCase

__all__ = [
    "CohortSpread",
    "Evaluation",
    "Evaluator",
    "Fit",
    "MeasuredCase",
    "Optimum",
    "Pooled",
    "PooledSpecimen",
    "Problem",
    "Uncertainty",
    "by_record",
    "fit",
    "fit_alike",
    "needed",
    "pool",
    "side_by_side",
]
