"""Figures: how far every joint moves in every test, and what that hangs on."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from spinepipe.cohort import Cohort
from spinepipe.report.glyphs import BAR_PT, KEY, THIN_BAR_PT, draw_bar
from spinepipe.report.panels import across_of, explain, explain_marks, head, side_by_side
from spinepipe.report.style import BEST, BLACK, BLUE, GREEN, GREY, OURS, VERMILLION, blank, saying
from spinepipe.report.words import AXIS, POSITIVE, case, count
from spinepipe.studies.range_of_motion.settings import RangeOfMotion
from spinepipe.studies.range_of_motion.tables import EVERY
from spinepipe.units import COORDINATES

_ABOVE_AND_BELOW_MM, _KEY_MM = 14.0, 17.0


def panels(tests: Sequence[str], joints: Sequence[str], row_mm: float) -> tuple[list[Axes], Figure]:
    """A panel for each test with names of joints, caudal to cranial from the bottom up."""
    across = across_of(len(tests))
    down = -(-len(tests) // across)
    figure = blank(down * (len(joints) * row_mm + _ABOVE_AND_BELOW_MM) + _KEY_MM)
    found = side_by_side(figure, len(tests), across, sharey=True)
    for index, (axis, test) in enumerate(zip(found, tests, strict=True)):
        head(axis, index, case(test))
        axis.set_ylim(-0.7, len(joints) - 0.3)
        axis.set_yticks(range(len(joints)), joints)
        axis.spines["left"].set_visible(False)
    return found, figure


_LEVEL_MM, _ROW_MM_OF_MANY = 7.0, 4.6
_FEW_ROWS = 8


def levels_figure(
    study: RangeOfMotion, cohort: Cohort, tables: Mapping[str, pd.DataFrame]
) -> Figure:
    """Motion in the loaded coordinate per joint and test, from ``rom_summary``."""
    summary = tables["rom_summary"]
    loaded = summary[(summary["role"] == "loaded") & (summary["n"] > 0)]
    if loaded.empty:
        return saying("No motion can be shown: no run has an equilibrium.")
    tests = list(dict.fromkeys(loaded["test"]))
    several = len(cohort.specimen_names) > 1  # then their medians stand beneath all runs
    joints = cohort.joint_names
    height = _LEVEL_MM if len(joints) <= _FEW_ROWS else _ROW_MM_OF_MANY
    axes, figure = panels(tests, joints, height)
    for axis, test in zip(axes, tests, strict=True):
        _draw_levels(axis, loaded[loaded["test"] == test], joints, several)
    meaning = {OURS: "all joint frames and stiffness sets" + " of all specimens" * several}
    if several:
        meaning[BEST] = "medians of the specimens"
    # each run has a row per coordinate and joint: it is counted in one of them
    every = summary[summary["specimen"] == EVERY] if several else summary
    one = every[every["coordinate"] == COORDINATES[0]].drop_duplicates("test")
    runs, without = int(np.sum(one["n"] + one["n_without"])), int(np.sum(one["n_without"]))
    total = f"{count(runs, 'run')} of {count(len(one), 'test')}"
    words = f"{KEY}; {total}, {without or 'none'} without an equilibrium"
    explain(figure, meaning, words)
    return figure


def _draw_levels(axis: Axes, rows: pd.DataFrame, joints: tuple[str, ...], several: bool) -> None:
    """One test: a bar of all runs and, below it, one of the specimens' medians."""
    thick = BAR_PT if len(joints) <= _FEW_ROWS else THIN_BAR_PT
    axis.axvline(0.0, color=GREY, lw=0.6, zorder=1)
    whole = rows[rows["specimen"] == EVERY] if several else rows
    for y, joint in enumerate(joints):
        for row in whole[whole["joint"] == joint].to_dict("records"):
            # the bar of `draw_bar` from quantiles
            at = [y + 0.17 * several] * 2
            ends = [row["percentile_5"], row["percentile_95"]]
            axis.plot(ends, at, color=OURS, lw=0.8, solid_capstyle="butt", zorder=3)
            quartiles = [row["low_quartile"], row["high_quartile"]]
            axis.plot(quartiles, at, color=OURS, lw=thick, solid_capstyle="butt", zorder=4)
            tick: dict[str, Any] = {"color": BLACK, "ms": 1.6 * thick + 0.6, "mew": 1.0}
            axis.plot([row["median"]], at[:1], "|", **tick, zorder=5)
        own = rows[(rows["joint"] == joint) & (rows["specimen"] != EVERY)]
        if several and len(own):
            draw_bar(axis, own["median"].to_numpy(float), y - 0.2, BEST, thick)
    coordinate = rows["coordinate"].iloc[0]
    axis.set_xlabel(f"{AXIS[coordinate].lower()} (°), + is {POSITIVE[coordinate]}")


_FACTOR_MM = 6.5
_MARKS: dict[str, tuple[str, str, str]] = {
    "specimen": (BLUE, "o", "specimen"),
    "pose": (GREEN, "s", "joint frames"),
    "stiffness": (VERMILLION, "D", "stiffness"),
    "rest": (GREY, "^", "rest"),
}
"""Colour, shape and name of each factor: shapes tell them apart without colours."""


def variance_figure(
    study: RangeOfMotion, cohort: Cohort, tables: Mapping[str, pd.DataFrame]
) -> Figure:
    """Shares with intervals per joint and test, from ``rom_variance``.

    Of several specimens those of the cohort, or of the first where the cohort has none.
    """
    variance = tables["rom_variance"]
    done = variance[variance["status"] == "done"]
    whole = done[done["specimen"] == EVERY]
    shown = whole if len(whole) else done[done["specimen"] == done["specimen"].min()]
    if shown.empty:
        why = "; ".join(dict.fromkeys(variance["message"].iloc[:1]))
        return saying(f"No shares of variance can be shown: {why}.")
    tests = list(dict.fromkeys(shown["test"]))
    axes, figure = panels(tests, cohort.joint_names, _FACTOR_MM)
    factors = [name for name in _MARKS if shown[f"{name}_share"].notna().any()]
    for axis, test in zip(axes, tests, strict=True):
        _draw_shares(axis, shown[shown["test"] == test], cohort.joint_names, factors)
    handles = [
        Line2D([], [], color=color, marker=shape, ms=3.5, lw=0.8, label=words)
        for color, shape, words in (_MARKS[name] for name in factors)
    ]
    first = shown.iloc[0]
    whose = "each" if first["specimen"] == EVERY else f"of {first['specimen']}"
    poses = f"{count(int(first['n_poses']), 'drawn pose')} {whose}"
    sets = count(int(first["n_stiffness"]), "drawn stiffness set")
    specimens = count(int(first["n_specimens"]), "specimen")
    words = f"symbol: estimate, line: 95 % interval; {specimens}, {poses}, {sets}"
    explain_marks(figure, handles, words, len(handles))
    return figure


def _draw_shares(
    axis: Axes, rows: pd.DataFrame, joints: tuple[str, ...], factors: list[str]
) -> None:
    """One test: the factors of a joint one below the other."""
    for y, joint in enumerate(joints):
        axis.axhline(y - 0.5, color=GREY, lw=0.2, zorder=1)
        for row in rows[rows["joint"] == joint].to_dict("records"):
            for number, name in enumerate(factors):
                color, shape, _ = _MARKS[name]
                at = y + 0.3 - 0.6 * number / (len(factors) - 1)
                ends = [100.0 * row[f"{name}_low"], 100.0 * row[f"{name}_high"]]
                axis.plot(ends, [at, at], color=color, lw=0.8, solid_capstyle="butt", zorder=3)
                symbol: dict[str, Any] = {"ms": 2.6, "mew": 0.0, "clip_on": False, "zorder": 4}
                axis.plot([100.0 * row[f"{name}_share"]], [at], shape, color=color, **symbol)
    axis.set_xlim(0.0, 100.0)
    axis.set_xlabel("share of variance (%)")
