"""Figure: how far every joint moves in every test, and how far specimens differ."""

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from spinepipe.cohort import Cohort
from spinepipe.report.range_of_motion.panels import EVERY, key, panels
from spinepipe.report.spread import BAR_PT, KEY, THIN_BAR_PT, draw_bar
from spinepipe.report.style import BEST, BLACK, GREY, OURS, saying
from spinepipe.report.words import AXIS, POSITIVE, count
from spinepipe.units import COORDINATES

_ROW_MM, _ROW_MM_OF_MANY = 7.0, 4.6
_FEW_ROWS = 8


def levels_figure(cohort: Cohort, summary: pd.DataFrame) -> Figure:
    """Motion in the loaded coordinate per joint and test, from ``rom_summary``."""
    loaded = summary[(summary["role"] == "loaded") & (summary["n"] > 0)]
    if loaded.empty:
        return saying("No motion can be shown: no run has an equilibrium.")
    tests = list(dict.fromkeys(loaded["test"]))
    several = len(cohort.specimen_names) > 1
    joints = cohort.joint_names
    height = _ROW_MM if len(joints) <= _FEW_ROWS else _ROW_MM_OF_MANY
    axes, figure = panels(tests, joints, height)
    for axis, test in zip(axes, tests, strict=True):
        _draw(axis, loaded[loaded["test"] == test], joints, several)
    key(figure, _handles(several), _words(summary, several))
    return figure


def _draw(axis: Axes, rows: pd.DataFrame, joints: tuple[str, ...], several: bool) -> None:
    """One test: a bar of all runs and, below it, one of the specimens' medians."""
    thick = BAR_PT if len(joints) <= _FEW_ROWS else THIN_BAR_PT
    axis.axvline(0.0, color=GREY, lw=0.6, zorder=1)
    whole = rows[rows["specimen"] == EVERY] if several else rows
    for y, joint in enumerate(joints):
        for row in whole[whole["joint"] == joint].to_dict("records"):
            _quantile_bar(axis, row, y + 0.17 * several, thick)
        own = rows[(rows["joint"] == joint) & (rows["specimen"] != EVERY)]
        if several and len(own):
            draw_bar(axis, own["median"].to_numpy(float), y - 0.2, BEST, thick)
    coordinate = rows["coordinate"].iloc[0]
    axis.set_xlabel(f"{AXIS[coordinate].lower()} (°), + is {POSITIVE[coordinate]}")


def _quantile_bar(axis: Axes, row: dict[Any, Any], y: float, thick_pt: float) -> None:
    """The bar of `draw_bar` from quantiles."""
    ends = [row["percentile_5"], row["percentile_95"]]
    axis.plot(ends, [y, y], color=OURS, lw=0.8, solid_capstyle="butt", zorder=3)
    quartiles = [row["low_quartile"], row["high_quartile"]]
    axis.plot(quartiles, [y, y], color=OURS, lw=thick_pt, solid_capstyle="butt", zorder=4)
    axis.plot([row["median"]], [y], "|", color=BLACK, ms=1.6 * thick_pt + 0.6, mew=1.0, zorder=5)


def _handles(several: bool) -> list[Line2D]:
    meaning = {OURS: "all joint frames and stiffness sets" + " of all specimens" * several}
    if several:
        meaning[BEST] = "medians of the specimens"
    return [
        Line2D([], [], color=color, lw=BAR_PT, solid_capstyle="butt", label=words)
        for color, words in meaning.items()
    ]


def _words(summary: pd.DataFrame, several: bool) -> str:
    rows = summary[summary["specimen"] == EVERY] if several else summary
    one = rows[(rows["coordinate"] == COORDINATES[0])].drop_duplicates("test")
    runs, without = int(np.sum(one["n"] + one["n_without"])), int(np.sum(one["n_without"]))
    total = f"{count(runs, 'run')} of {count(len(one), 'test')}"
    return f"{KEY}; {total}, {without or 'none'} without an equilibrium"
