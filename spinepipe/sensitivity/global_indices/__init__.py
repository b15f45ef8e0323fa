"""Global sensitivity: designs of factors, indices of outputs with intervals, their noise floor."""

from spinepipe.sensitivity.global_indices.convergence import Stage, convergence
from spinepipe.sensitivity.global_indices.design import (
    DUMMY,
    Design,
    Method,
    design_problems,
    draw,
    run_count,
)
from spinepipe.sensitivity.global_indices.estimates import INDICES, Index, Known, Settings
from spinepipe.sensitivity.global_indices.indices import above_floor, indices, noise_floor
from spinepipe.sensitivity.global_indices.spread import (
    LogNormal,
    LogUniform,
    Normal,
    Spread,
    Uniform,
    values_of,
)

__all__ = [
    "DUMMY",
    "INDICES",
    "Design",
    "Index",
    "Known",
    "LogNormal",
    "LogUniform",
    "Method",
    "Normal",
    "Settings",
    "Spread",
    "Stage",
    "Uniform",
    "above_floor",
    "convergence",
    "design_problems",
    "draw",
    "indices",
    "noise_floor",
    "run_count",
    "values_of",
]
