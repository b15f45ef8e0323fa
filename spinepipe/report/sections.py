"""Sections of panels below each other, each with rows of its own."""

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from spinepipe.report.style import blank

MOST_ACROSS = 3


def across_of(n: int, most: int = MOST_ACROSS) -> int:
    """How many of n panels stand side by side, so that the lines are about equally long."""
    return -(-n // -(-n // most))


def sections(
    parts: Sequence[tuple[int, float]], key_mm: float, most_across: int = MOST_ACROSS
) -> tuple[list[list[Axes]], Figure]:
    """Panels of each section, and their figure.

    Parameters
    ----------
    parts : of each section, the number of panels and the height of one, mm.
    key_mm : height below all panels for what explains them.
    most_across : most panels side by side.
    """
    across = across_of(max(n for n, _ in parts), most_across)
    heights = [height for n, height in parts for _ in range(-(-n // across))]
    figure = blank(sum(heights) + key_mm)
    lines = figure.subplots(len(heights), across, squeeze=False, height_ratios=heights)
    found: list[list[Axes]] = []
    first = 0
    for n, _ in parts:
        down = -(-n // across)
        panels = list(lines[first : first + down].ravel())
        for spare in panels[n:]:
            spare.set_visible(False)
        found.append(panels[:n])
        first += down
    return found, figure
