"""How far a logarithmic axis of stiffness reaches."""

import numpy as np
import pandas as pd

from spinepipe.report.cohort.chosen import doubted
from spinepipe.report.spread import finite, quartiles

FARTHEST = 10.0
"""What lies farther than this factor from the quartiles is shown at the edge."""

_MARGIN, _LEAST = 0.06, 0.09
"""Room at either end: a share of the axis, and at least so many decades."""


def reach(rows: pd.DataFrame, more: object = ()) -> tuple[float, float]:
    """Ends of the axis.

    Parameters
    ----------
    rows : with stiffness and interval; those the data do not hold count only where all are such.
    more : further values that are on the axis if they are near.
    """
    held = rows[~doubted(rows)]
    chosen = held if len(held) else rows
    values = finite(chosen["stiffness"])
    middle = quartiles(values)
    near = np.concatenate([finite(chosen[name]) for name in ("stiffness", "low", "high")])
    near = np.concatenate([near, finite(more)])
    near = near[(near > middle.low / FARTHEST) & (near < middle.high * FARTHEST)]
    low, high = float(near.min()), float(near.max())
    margin = 10.0 ** max(_LEAST, _MARGIN * np.log10(high / low))
    return low / margin, high * margin
