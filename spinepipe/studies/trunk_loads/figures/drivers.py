"""Figure: how far answers can be trusted, and which inputs that hangs on."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from spinepipe.cohort import Cohort
from spinepipe.report.glyphs import draw_interval
from spinepipe.report.panels import explain_marks, head, sections
from spinepipe.report.style import BLACK, BLUE, GREEN, GREY, note, saying
from spinepipe.report.words import count, fixed, listed
from spinepipe.studies.trunk_loads.figures.line_styles import task_label
from spinepipe.studies.trunk_loads.selection import MOST_TASKS
from spinepipe.studies.trunk_loads.settings import TrunkLoads
from spinepipe.studies.trunk_loads.words import factor

SHOWN = "l4l5_pressure_mpa"
PANELS = {SHOWN: "Pressure in L4L5 (MPa)", "l4l5_compression_n": "Compression of L4L5 (N)"}
INDICES = {
    "total": (BLUE, 0.16, "with its part in interactions"),
    "first_order": (GREEN, -0.16, "by itself"),
}
SHOWN_TO = 1.3
"""Indices are shares: those estimated above this are written down, not drawn."""

_ROW_MM, _TASK_MM, _AROUND_MM, _KEY_MM = 4.6, 5.5, 16.0, 17.0
_APART = 1.6
_UNKNOWN = "not known: too few samples held"


def drivers_figure(study: TrunkLoads, cohort: Cohort, tables: Mapping[str, pd.DataFrame]) -> Figure:
    """Intervals of all sampled tasks, then a panel of indices for each of the first ones."""
    intervals, drivers = tables["intervals"], tables["drivers"]
    known = drivers[(drivers["quantity"] == SHOWN)].dropna(subset=["total"])
    if intervals["low"].isna().all() and known.empty:
        return saying("Nothing is known of how far answers can be trusted: no sample held.")
    places = _places(intervals)
    shown = _places(known)[:MOST_TASKS]
    # factors, the largest total index on average last, so that it stands on top
    means = known.groupby("factor", sort=False)["total"].mean()
    factors = [str(name) for name in means.sort_values(kind="stable").index]
    heights = [(len(PANELS), _TASK_MM * len(places) + _AROUND_MM)]
    if shown:
        heights.append((len(shown), _ROW_MM * len(factors) + _AROUND_MM))
    panels, figure = sections(heights, _KEY_MM)
    several = intervals["specimen"].nunique() > 1
    for index, (axis, (quantity, title)) in enumerate(zip(panels[0], PANELS.items(), strict=True)):
        head(axis, index, title)
        _intervals(axis, intervals[intervals["quantity"] == quantity], places, several)
    for number, (axis, place) in enumerate(zip(panels[1] if shown else (), shown, strict=True)):
        head(axis, len(PANELS) + number, _named(place, several))
        own = (known["specimen"] == place[0]) & (known["task"] == place[1])
        _indices(axis, known[own], factors)
    lost = [_named(place, several) for place in places if place not in set(_places(known))]
    _explain(figure, intervals, len(shown), lost)
    return figure


def _places(rows: pd.DataFrame) -> list[tuple[str, str]]:
    """Person and task of rows, each once."""
    return list(dict.fromkeys(zip(rows["specimen"], rows["task"], strict=True)))


def _named(place: tuple[str, str], several: bool) -> str:
    return f"{place[0]}, {task_label(place[1])}" if several else task_label(place[1])


def _intervals(
    axis: Axes, rows: pd.DataFrame, places: Sequence[tuple[str, str]], several: bool
) -> None:
    """Median and middle 95 % of the samples, and the answer itself."""
    found = {(row["specimen"], row["task"]): row for row in rows.to_dict("records")}
    for y, place in enumerate(reversed(places)):
        axis.axhline(y - 0.5, color=GREY, lw=0.2, zorder=0)
        row = found[place]
        if pd.isna(row["low"]) or pd.isna(row["high"]):
            note(axis, 0.02, y, _UNKNOWN, GREY)
        else:
            draw_interval(axis, row["median"], (row["low"], row["high"]), y, BLUE)
        if pd.notna(row["nominal"]):
            axis.plot([row["nominal"]], [y], "|", color=BLACK, ms=8.0, mew=1.1, zorder=5)
    axis.set_yticks(range(len(places)), [_named(place, several) for place in reversed(places)])
    axis.tick_params(labelleft=axis.get_subplotspec().is_first_col())  # type: ignore[union-attr]
    axis.set_ylim(-0.55, len(places) - 0.45)
    axis.set_xlim(left=min(0.0, axis.get_xlim()[0]))
    axis.spines["left"].set_visible(False)


def _indices(axis: Axes, rows: pd.DataFrame, factors: Sequence[str]) -> None:
    found = {row["factor"]: row for row in rows.to_dict("records")}
    for y, name in enumerate(factors):
        axis.axhline(y - 0.5, color=GREY, lw=0.2, zorder=0)
        row = found.get(name, {})
        for index, (color, aside, _) in INDICES.items():
            value, *ends = (
                float(row.get(f"{index}{end}", np.nan)) for end in ("", "_low", "_high")
            )
            if not np.isfinite([value, *ends]).all():
                continue
            if not -SHOWN_TO < value < SHOWN_TO:
                told = f"{fixed(value)} ({fixed(ends[0])} to {fixed(ends[1])})"
                note(axis, 0.98, y + _APART * aside, told, color, ha="right")
                continue
            draw_interval(axis, value, (ends[0], ends[1]), y + aside, color)
    axis.axvline(0.0, color=BLACK, lw=0.5, zorder=1)
    low, high = axis.get_xlim()
    axis.set_xlim(max(min(-0.05, low), -SHOWN_TO), min(max(1.0, high), SHOWN_TO))
    axis.set_yticks(range(len(factors)), [factor(name) for name in factors])
    axis.tick_params(labelleft=axis.get_subplotspec().is_first_col())  # type: ignore[union-attr]
    axis.set_ylim(-0.6, len(factors) - 0.4)
    axis.set_xticks([0.0, 0.5, 1.0], ["0", "0.5", "1"])
    axis.set_xlabel("share of the pressure's variance")
    axis.spines["left"].set_visible(False)


def _explain(figure: Figure, intervals: pd.DataFrame, shown: int, lost: Sequence[str]) -> None:
    dot: dict[str, Any] = {"marker": "o", "ms": 4.0, "mew": 0.0, "lw": 1.2}
    handles = [
        Line2D([], [], color=BLUE, **dot, label="median and middle 95 % of samples"),
        Line2D([], [], color=BLACK, marker="|", ls="", ms=8.0, mew=1.1, label="nominal answer"),
    ]
    if shown:
        handles += [
            Line2D([], [], color=color, **dot, label=f"factor {words}")
            for color, _, words in INDICES.values()
        ]
    failed = int(intervals["n_failed"].max()) if len(intervals) else 0
    most = int((intervals["n_samples"] + intervals["n_failed"]).max()) if len(intervals) else 0
    words = f"{count(most, 'sample')} of a task; at most {failed} of them did not hold."
    if lost:
        words += f" Without indices, as too few samples held: {listed(lost)}."
    explain_marks(figure, handles, words, len(handles))
