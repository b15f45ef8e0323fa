"""Derivatives of where a settling run ends: differences over the same steps in time.

With its steps held the end is smooth: on L1-L4 a difference is within 1e-6 of the derivative.
"""

from collections.abc import Sequence

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.statics.free import FreeParameter, moved
from spinepipe.statics.program import Program
from spinepipe.statics.settling import Settled, retrace
from spinepipe.statics.system import System

STEP = 1e-6
"""Change of an unknown: well above rounding and well below where the retraced end bends."""


def settled_by_parameters(
    system: System, program: Program, settled: Settled, free: Sequence[FreeParameter]
) -> Array | None:
    """(n, m) derivative of the end pose by the unknowns; None where a retraced run is lost."""
    columns = []
    for number in range(len(free)):
        x = np.zeros(len(free))
        x[number] = STEP
        there = retrace(system.with_model(moved(system.model, free, x)), program, settled.sizes)
        if there is None:
            return None
        columns.append((there - settled.q) / STEP)
    return np.column_stack(columns)
