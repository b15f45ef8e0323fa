"""Panels of range-of-motion figures: one for each test, a row for each joint."""

import textwrap
from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from spinepipe.report.style import blank

EVERY = "*"
_MOST_ACROSS = 3
_ABOVE_AND_BELOW_MM, _KEY_MM = 14.0, 17.0
_LINE_LENGTH = 150


def panels(tests: Sequence[str], joints: Sequence[str], row_mm: float) -> tuple[list[Axes], Figure]:
    """A panel for each test with names of joints, caudal to cranial from the bottom up."""
    down = -(-len(tests) // _MOST_ACROSS)
    across = -(-len(tests) // down)
    figure = blank(down * (len(joints) * row_mm + _ABOVE_AND_BELOW_MM) + _KEY_MM)
    axes = figure.subplots(down, across, squeeze=False, sharey=True)
    found = list(axes.ravel())
    for spare in found[len(tests) :]:
        spare.set_visible(False)
    for number, (axis, test) in enumerate(zip(found, tests, strict=False)):
        axis.set_title(f"{chr(ord('a') + number)}   {test.replace('_', ' ').capitalize()}")
        axis.set_ylim(-0.7, len(joints) - 0.3)
        axis.set_yticks(range(len(joints)), joints)
        axis.spines["left"].set_visible(False)
    return found[: len(tests)], figure


def key(figure: Figure, handles: Sequence[Line2D], words: str) -> None:
    """Below the panels: what is what, and a few words more."""
    legend = figure.legend(
        handles=list(handles),
        title=textwrap.fill(words, _LINE_LENGTH),
        loc="outside lower center",
        ncols=len(handles),
        fontsize=6.5,
        title_fontsize=6.0,
        columnspacing=2.0,
        borderaxespad=0.2,
    )
    legend.get_title().set_multialignment("center")
