"""Panels of figures: how they stand, their rows, letters and axes, and what explains them."""

import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import floor, log10
from typing import Any

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FixedLocator, LogLocator, MaxNLocator, NullFormatter, NullLocator

from spinepipe.report.glyphs import BAR_PT
from spinepipe.report.style import GREY, blank
from spinepipe.report.words import tick

_STEPS: tuple[tuple[float, ...], ...] = ((1.0, 2.0, 5.0), (1.0, 3.0), (1.0,))

MOST_ROWS = 40
"""More rows than this on one page cannot be read: then specimens are pooled."""

MOST_ROWS_WITH_NUMBERS = 8
EVERY_JOINT = "*"
_ABOVE_AND_BELOW_MM = 14.0
_KEY_MM = 17.0
_CROWDED_MM = 4.2
_LINE_LENGTH = 150
_START_LINE: tuple[int, tuple[int, int]] = (0, (4, 2))

MOST_ACROSS = 3


@dataclass(frozen=True)
class PanelRows:
    """Rows of a panel from the bottom up; ``note`` says what was pooled, or nothing."""

    labels: tuple[str, ...]
    frames: tuple[pd.DataFrame, ...]
    note: str

    def __len__(self) -> int:
        """Number of rows."""
        return len(self.labels)

    @property
    def with_numbers(self) -> bool:
        """Whether there is room to write numbers beside each row."""
        return len(self) <= MOST_ROWS_WITH_NUMBERS


def rows_of(frame: pd.DataFrame, specimens: Sequence[str], joints: Sequence[str]) -> PanelRows:
    """Split rows with columns ``specimen`` and ``joint``; combinations without rows are left out.

    Parameters
    ----------
    specimens : in the order in which they are read, from the top.
    joints : caudal to cranial, or ``("*",)`` where all joints share a row.
    """
    keys = [(joint, specimen) for joint in joints for specimen in reversed(specimens)]
    pooled = len(keys) > MOST_ROWS and len(specimens) > 1
    if pooled:
        keys = [(joint, EVERY_JOINT) for joint in joints]
    found = [(key, _part(frame, *key)) for key in keys]
    kept = [(key, part) for key, part in found if len(part)]
    labels = tuple(_label(joint, specimen, len(specimens)) for (joint, specimen), _ in kept)
    note = f"{len(specimens)} specimens pooled" if pooled else ""
    return PanelRows(labels, tuple(part for _, part in kept), note)


def _part(frame: pd.DataFrame, joint: str, specimen: str) -> pd.DataFrame:
    chosen = frame["joint"] == joint
    if specimen != EVERY_JOINT:
        chosen &= frame["specimen"] == specimen
    return frame[chosen]


def _label(joint: str, specimen: str, n_specimens: int) -> str:
    if joint == EVERY_JOINT:
        return "all specimens" if specimen == EVERY_JOINT else specimen
    if specimen == EVERY_JOINT or n_specimens == 1:
        return joint
    return f"{specimen}  {joint}"


def row_height(rows: PanelRows, with_numbers_mm: float) -> float:
    """Height of a row, mm."""
    return with_numbers_mm if rows.with_numbers else _CROWDED_MM


def grid(
    n: int, rows: PanelRows, row_mm: float, most_across: int = MOST_ACROSS
) -> tuple[list[Axes], Figure]:
    """``n`` panels of the same rows, so many side by side at most, and their figure."""
    across = across_of(n, most_across)
    down = -(-n // across)
    height = down * (len(rows) * row_mm + _ABOVE_AND_BELOW_MM) + _KEY_MM
    figure = blank(max(height, 45.0))
    return side_by_side(figure, n, across), figure


def label_rows(axis: Axes, rows: PanelRows, below: float, above: float) -> None:
    """Names of the rows on the left panels; room for what is drawn below and above each row."""
    axis.set_ylim(-below, len(rows) - 1 + above)
    axis.set_yticks(range(len(rows)), rows.labels)
    place = axis.get_subplotspec()
    axis.tick_params(labelleft=place is None or place.is_first_col())
    axis.spines["left"].set_visible(False)


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


def across_of(n: int, most: int = MOST_ACROSS) -> int:
    """How many of n panels stand side by side, so that the lines are about equally long."""
    return -(-n // -(-n // most))


def side_by_side(figure: Figure, n: int, across: int, **how: Any) -> list[Axes]:
    """``n`` panels line by line, so many side by side; ``how`` goes to ``subplots``."""
    lines = lines_of(figure, n, across, **how)
    return [panel for line in lines for panel in line][:n]


def lines_of(figure: Figure, n: int, across: int, **how: Any) -> list[list[Axes]]:
    """The same by lines, the last with its spare panels, which do not show."""
    lines = figure.subplots(-(-n // across), across, squeeze=False, **how)
    for spare in list(lines.ravel())[n:]:
        spare.set_visible(False)
    return [list(line) for line in lines]


def head(axis: Axes, index: int, words: str) -> None:
    """Letter and heading of a panel."""
    axis.set_title(lettered(index, words))


def head_line(axis: Axes, index: int, words: str, above_pt: float) -> None:
    """Letter and heading of several panels, so far above the first of them."""
    axis.annotate(
        lettered(index, words),
        (0.0, 1.0),
        (0.0, above_pt),
        va="bottom",
        xycoords="axes fraction",
        textcoords="offset points",
        fontsize=7.5,
        fontweight="bold",
        annotation_clip=False,
        in_layout=False,
    )


def lettered(index: int, words: str) -> str:
    """A heading with the letter of a panel, from 0 on."""
    return f"{chr(ord('a') + index)}   {words}"


def mark_start(axis: Axes, x: float) -> None:
    """The dashed line of the value that a fit starts from."""
    axis.axvline(x, color=GREY, lw=0.7, ls=_START_LINE, zorder=1)


def log_ticks(axis: Axis, low: float, high: float, most: int = 4) -> None:
    """Few ticks with plain numbers: even ones within half a decade, else 1, 2, 5 or fewer.

    Where even decades are more than ``most``, only some of them have a number.
    """
    decades = log10(high / low)
    if decades < 0.5:
        even = [x for x in MaxNLocator(most).tick_values(low, high) if low <= x <= high]
        axis.set_major_locator(FixedLocator(even))
        axis.set_minor_locator(NullLocator())
    else:
        subs = next((s for s in _STEPS if len(_within(low, high, s)) <= most), _STEPS[-1])
        axis.set_major_locator(LogLocator(subs=subs, numticks=most if subs == _STEPS[-1] else None))
        axis.set_minor_locator(LogLocator(subs=range(1, 10)))
    axis.set_major_formatter(lambda x, _: tick(x))
    axis.set_minor_formatter(NullFormatter())


def _within(low: float, high: float, subs: Sequence[float]) -> list[float]:
    """Multiples of the decades from low to high."""
    ends = floor(log10(low)), floor(log10(high)) + 1
    found = [s * 10.0**decade for decade in range(*ends) for s in subs]
    return [x for x in found if low <= x <= high]


def explain(figure: Figure, bars: Mapping[str, str], words: str, dashed: str = "") -> None:
    """Below the panels: what each colour is, what a dashed line is, and a few words more."""
    handles = [
        Line2D([], [], color=color, lw=BAR_PT, solid_capstyle="butt", label=meaning)
        for color, meaning in bars.items()
    ]
    if dashed:
        handles.append(Line2D([], [], color=GREY, lw=0.7, ls=_START_LINE, label=dashed))
    explain_marks(figure, handles, words, len(handles))


def explain_marks(
    figure: Figure, handles: Sequence[Line2D | Patch], words: str, across: int
) -> None:
    """Below the panels: a few words, and each mark with its label, so many side by side."""
    legend = figure.legend(
        handles=list(handles),
        title=textwrap.fill(words, _LINE_LENGTH),
        loc="outside lower center",
        ncols=across,
        fontsize=6.5,
        title_fontsize=6.0,
        handlelength=1.6,
        columnspacing=2.0,
        borderaxespad=0.2,
    )
    legend.get_title().set_multialignment("center")
