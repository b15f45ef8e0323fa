"""How single results are drawn in a row: every one as a dot, their range and their median."""

import numpy as np
from matplotlib.axes import Axes

from spinepipe.report.spread import Array
from spinepipe.report.style import BLACK

STRIP_KEY = "dot: one fit, line: range, tick: median"

_GOLDEN = 0.5 * (5.0**0.5 - 1.0)
_MOST_OUTLINES = 400
"""More dots than this become a picture inside the SVG, which stays small."""


def draw_strip(
    panel: Axes, values: Array, y: float, color: str, height: float = 0.3, size_pt: float = 2.0
) -> None:
    """Dots spread over a height around y, always alike; finite values (n,), n at least 1."""
    shift = (np.arange(len(values)) * _GOLDEN % 1.0 - 0.5) * height
    panel.plot(
        values, y + shift, "o", color=color, ms=size_pt, mew=0.0, alpha=0.45, zorder=3,
        rasterized=len(values) > _MOST_OUTLINES,
    )  # fmt: skip
    panel.plot([values.min(), values.max()], [y, y], color=color, lw=0.8, zorder=4)
    panel.plot([np.median(values)], [y], "|", color=BLACK, ms=7.0, mew=1.0, zorder=5)
