"""Bounds of unknowns, drawn in to what the effects declare for their parameters."""

from collections.abc import Sequence

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.model import SpineModel
from spinepipe.statics import FreeParameter, declared


def within_declared(
    model: SpineModel, free: Sequence[FreeParameter], lower: Array, upper: Array
) -> tuple[Array, Array]:
    """Lower and upper bounds (m,) of the unknowns that keep every row they move as declared."""
    lower, upper = lower.copy(), upper.copy()
    for index, parameter in enumerate(free):
        limits = declared(model, parameter)
        values = model.effects[parameter.effect].values
        for value in values[list(parameter.rows), parameter.column]:
            low, high = limits.low - value, limits.high - value
            if parameter.logarithmic:
                low = np.log(limits.low / value) if limits.low > 0.0 else -np.inf
                high = np.log(limits.high / value)
            lower[index], upper[index] = max(lower[index], low), min(upper[index], high)
    return lower, upper
