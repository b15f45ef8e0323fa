"""Calibration: stiffness from measured motion, with its uncertainty and its honest status."""

from spinepipe.calibrate.fit import Fit, Optimum, fit, fit_alike
from spinepipe.calibrate.pooling import CohortSpread, Pooled, PooledSpecimen, pool
from spinepipe.calibrate.problem import Evaluation, Evaluator, Problem, needed, side_by_side
from spinepipe.calibrate.solvers import by_record
from spinepipe.calibrate.uncertainty import Uncertainty
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
