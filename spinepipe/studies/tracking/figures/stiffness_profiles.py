"""Figure: what it costs to hold the stiffness of a region at so many times the generic one."""

from collections.abc import Mapping
from itertools import product
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from spinepipe.cohort import Cohort
from spinepipe.report.panels import explain_marks, head, log_ticks, side_by_side
from spinepipe.report.style import BLACK, GREY, SMALL_PT, WHITE, LineStyle, blank, saying
from spinepipe.report.words import AXIS, capital, plain, short, tick
from spinepipe.studies.tracking.figures.line_styles import looks_of, scale
from spinepipe.studies.tracking.profile import PROFILED, REGIONS
from spinepipe.studies.tracking.settings import Tracking
from spinepipe.studies.tracking.tables import LIMIT
from spinepipe.studies.tracking.words import VERDICTS

MOST_PERSONS = 4
MOST_PANELS = 9
_HEIGHT_MM, _KEY_MM, _ACROSS = 50.0, 17.0, 3
_TOP = 4.0
"""Top of a panel, times the limit; what costs more leaves it."""

_ROOM = 1.22
"""Top of the axis over that, for words."""

_BAR = -0.35
"""Where the first bar of what is not excluded lies, times the limit; the others below it."""

_STEP = 0.28


def stiffness_profiles_figure(
    study: Tracking, cohort: Cohort, tables: Mapping[str, pd.DataFrame]
) -> Figure:
    """A panel for each coordinate and region, a line for each person."""
    points, ends = tables["profile_points"], tables["profiles"]
    if points.empty:
        return saying("Nothing can be shown: nobody's markers were asked for stiffness.")
    persons = [str(name) for name in dict.fromkeys(points["specimen"])]
    looks = looks_of(persons[:MOST_PERSONS])
    named = places_of(points)
    across = min(_ACROSS, len(named))
    figure = blank(-(-len(named) // across) * _HEIGHT_MM + _KEY_MM)
    axes = side_by_side(figure, len(named), across, sharey=True)
    for index, (axis, (coordinate, region)) in enumerate(zip(axes, named, strict=True)):
        head(axis, index, capital(plain(region)))
        axis.set_xlabel(f"{AXIS[coordinate].lower()}: stiffness over generic (–)")
        _panel(axis, _of(points, coordinate, region), _of(ends, coordinate, region), looks)
    for axis in axes[::across]:
        axis.set_ylabel("cost over the least (–)")
    _explain(figure, looks, len(persons), bool(points["cost_over_best"].isna().any()))
    return figure


def places_of(points: pd.DataFrame) -> list[tuple[str, str]]:
    """(coordinate, region) in the order of the profiles, regions from below."""
    there = set(zip(points["coordinate"].astype(str), points["region"].astype(str), strict=True))
    ordered = [place for place in product(PROFILED, REGIONS) if place in there]
    return [*ordered, *sorted(there - set(ordered))][:MOST_PANELS]


def _of(rows: pd.DataFrame, coordinate: str, region: str) -> pd.DataFrame:
    if rows.empty:
        return rows
    return rows[(rows["coordinate"] == coordinate) & (rows["region"] == region)]


def _panel(
    axis: Axes, points: pd.DataFrame, ends: pd.DataFrame, looks: Mapping[str, LineStyle]
) -> None:
    low, high = float(points["ratio"].min()), float(points["ratio"].max())
    reach = (0.75 * low, 1.33 * high)
    axis.set_xscale("log")
    axis.set_xlim(*reach)
    log_ticks(axis.xaxis, *reach, most=6)
    axis.axhline(LIMIT, color=GREY, lw=0.7, ls=(0, (4, 2)), zorder=1)
    axis.axvline(1.0, color=GREY, lw=0.5, zorder=0)
    axis.set_ylim((_BAR - _STEP * len(looks)) * LIMIT, _ROOM * _TOP * LIMIT)
    axis.set_yticks(range(0, int(_TOP * LIMIT) + 1, 5))
    scale(axis)
    for k, (name, look) in enumerate(looks.items()):
        _course(axis, points[points["specimen"] == name], look)
        told = ends[ends["specimen"] == name] if len(ends) else ends
        if len(told):
            _interval(axis, told.iloc[0], (_BAR - _STEP * k) * LIMIT, look, reach)
    if len(looks) == 1 and len(ends):
        words = _verdict(points, ends.iloc[0])
        how: dict[str, Any] = {"ha": "right", "va": "top", "fontsize": SMALL_PT}
        how["bbox"] = {"facecolor": WHITE, "edgecolor": "none", "alpha": 0.8, "pad": 0.4}
        axis.text(0.97, 0.97, words, transform=axis.transAxes, **how)


def _verdict(points: pd.DataFrame, row: "pd.Series[Any]") -> str:
    """What a profile says, and whether its least cost lies at the end of what was tried."""
    best = row["best_ratio"]
    if pd.isna(best):
        return "not known: no fit settled"
    settled = points.dropna(subset=["cost_over_best"])["ratio"]
    at_end = best in (settled.min(), settled.max())
    said = VERDICTS[str(row["verdict"])]
    return f"{said}\nleast cost at {tick(float(best))}" + (", an end" if at_end else "")


def _course(axis: Axes, points: pd.DataFrame, look: LineStyle) -> None:
    """The curve; arrows where it leaves the panel, crosses where no fit settled."""
    points = points.sort_values("ratio")
    cost = points["cost_over_best"].to_numpy(float)
    ratio = points["ratio"].to_numpy(float)
    top = _TOP * LIMIT
    inside = np.isfinite(cost) & (cost <= top)
    axis.plot(ratio, cost, **look.line(marker="", zorder=3))
    axis.plot(ratio[inside], cost[inside], **look.line(ls="", zorder=4))
    over = np.isfinite(cost) & (cost > top)
    edge = np.full(int(over.sum()), 0.97 * top)
    axis.plot(ratio[over], edge, "^", color=look.color, ms=3.4, zorder=4)
    lost = ~np.isfinite(cost)
    axis.plot(ratio[lost], np.full(int(lost.sum()), LIMIT), "x", color=look.color, ms=4.0)


def _interval(
    axis: Axes, row: "pd.Series[float]", y: float, look: LineStyle, reach: tuple[float, float]
) -> None:
    """What is not excluded, as a bar; an open end has an arrow out of the panel."""
    if pd.isna(row["best_ratio"]):
        return
    low = reach[0] if pd.isna(row["low"]) else float(row["low"])
    high = reach[1] if pd.isna(row["high"]) else float(row["high"])
    axis.plot([low, high], [y, y], color=look.color, lw=2.2, solid_capstyle="butt", zorder=3)
    for at, is_open, marker in ((low, row["open_below"], "<"), (high, row["open_above"], ">")):
        mark = marker if is_open else "|"
        shift = {"<": 1.06, ">": 1.0 / 1.06}.get(mark, 1.0)
        axis.plot([at * shift], [y], mark, color=look.color, ms=5.0, mew=1.0, zorder=4)


def _explain(figure: Figure, looks: Mapping[str, LineStyle], persons: int, lost: bool) -> None:
    handles = [Line2D([], [], **look.line(), label=short(name)) for name, look in looks.items()]
    grey: dict[str, Any] = {"color": GREY, "lw": 0.7, "ls": (0, (4, 2))}
    handles.append(Line2D([], [], **grey, label=f"limit of 95 %, {LIMIT}"))
    bar: dict[str, Any] = {"color": looks[next(iter(looks))].color, "lw": 2.2}
    handles.append(Line2D([], [], **bar, label="not excluded; arrow: open end"))
    if lost:
        handles.append(
            Line2D([], [], color=BLACK, marker="x", ls="", ms=4.0, label="did not settle")
        )
    words = "Triangles at the top: the cost is beyond the panel."
    if persons > len(looks):
        words += f" The first {len(looks)} of {persons} persons."
    explain_marks(figure, handles, words, 5)
