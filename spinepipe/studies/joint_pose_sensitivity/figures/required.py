"""A required landmark SD in words."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from spinepipe.report.words import fixed, tick


def required_words(row: pd.Series, sampled: Sequence[float]) -> str:
    """``1.20 mm (1.05–1.40)``, or why there is no such SD.

    An end of the interval that lies outside the sampled SDs, mm, is told as such:
    ``0.95 mm (0.65 to above 4 mm)``.
    """
    if not np.isfinite(row["sd_mm"]):
        return str(row["message"]) or "none"
    low, high = row["sd_low_mm"], row["sd_high_mm"]
    if np.isfinite(low) and np.isfinite(high):
        return f"{fixed(row['sd_mm'])} mm ({fixed(low)}–{fixed(high)})"
    start = fixed(low) if np.isfinite(low) else f"below {tick(min(sampled))}"
    end = f"{fixed(high)} mm" if np.isfinite(high) else f"above {tick(max(sampled))} mm"
    return f"{fixed(row['sd_mm'])} mm ({start} to {end})"
