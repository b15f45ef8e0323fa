"""Figure: what each output hangs on, factor by factor, beside the noise floor."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from spinepipe.cohort import Cohort
from spinepipe.report.panels import MOST_ACROSS, explain_marks
from spinepipe.report.style import BLACK, GREY, INK, TALLEST_MM, WHITE
from spinepipe.report.words import count, number
from spinepipe.sensitivity_analysis.global_indices.design import DUMMY
from spinepipe.sensitivity_analysis.global_indices.floor import NEGLIGIBLE
from spinepipe.studies.global_sensitivity.figures.panels import (
    COLORS,
    NAME,
    OUTPUT,
    Measures,
    Panel,
    above_floor,
    choose_panels,
    factor_name,
    floor_seen,
    footnote,
    leading,
    no_index,
    pool,
    screened,
    sections_of,
    shown_outputs,
    title,
    unit_of,
)
from spinepipe.studies.global_sensitivity.settings import GlobalSensitivity

MOST, FEWEST = 24, 6
SMALL = 0.01
"""Part of a panel's largest index below which an effect cannot be seen in a picture."""


def drawn_factors(found: Sequence[Panel], measures: Measures) -> tuple[list[str], str]:
    """Factors from the top down, and what is said of those that are not drawn."""
    order = leading(found, measures)
    own = [name for name in order if name != DUMMY]
    seen = _seen(found, measures)
    worth = [name for name in own if name in seen][:MOST]
    kept = worth
    if len(worth) < FEWEST:  # the fewest rows, in their order
        others = [name for name in own if name not in worth][: FEWEST - len(worth)]
        kept = [name for name in own if name in worth or name in others]
    drawn = kept + [DUMMY] * (DUMMY in order)
    return drawn, _of_others([name for name in own if name not in kept], found, measures)


def _seen(found: Sequence[Panel], measures: Measures) -> set[str]:
    """Factors that are above the floor, where there is one, and not small, in any panel."""
    names: set[str] = set()
    for panel in found:
        main = panel.rows[panel.rows["index"] == measures.main]
        means = pool(main, ["factor"]).set_index("factor")["estimate"]
        large = set(means.index[means >= SMALL * means.max()])
        floor = main["noise_floor"].notna().any()
        names |= large & above_floor(main) if floor else large
    return names


def _of_others(names: Sequence[str], found: Sequence[Panel], measures: Measures) -> str:
    rows = pd.concat([panel.rows for panel in found])
    left = rows[rows["factor"].isin(list(names)) & (rows["index"] == measures.main)]
    if left.empty:
        return ""
    many, largest = count(len(names), "more factor"), float(left["estimate"].max())
    if largest <= 0.0:
        return f"{many} without any effect"
    size = "small" if measures.in_units else f"at most {number(largest, 2)}"
    return f"{many}, {size}, only in the table"


_ROW_MM, _LEAST_ROW_MM, _AROUND_MM, _KEY_MM = 5.0, 3.0, 17.0, 18.0
_BARS = 0.78
"""Share of a row that its bars fill."""

_DOT_FROM = 0.005
"""Part of the largest index below which a dot would only blur the line at 0."""


def indices_figure(
    study: GlobalSensitivity, cohort: Cohort, tables: Mapping[str, pd.DataFrame]
) -> Figure:
    """A panel for each output, a row for each factor, a bar for each index, from ``indices``."""
    indices = tables["indices"]
    found, measures = shown_outputs(cohort, indices)
    if not found or measures is None:
        return no_index(indices)
    orders = {name: drawn_factors(part, measures) for name, part in _by_output(found).items()}
    rows = {name: len(order) for name, (order, _) in orders.items()}
    # as many panels as a page holds, if every line of them is as high as the mean
    line = _LEAST_ROW_MM * sum(rows.values()) / len(rows) + _AROUND_MM
    most = MOST_ACROSS * max(len(rows), int((TALLEST_MM - _KEY_MM) // line))
    kept = choose_panels(found, cohort.joint_names, most)
    lines = {name: -(-len(part) // MOST_ACROSS) for name, part in _by_output(kept).items()}
    room = TALLEST_MM - _KEY_MM - _AROUND_MM * sum(lines.values())
    row = min(_ROW_MM, room / sum(n * rows[name] for name, n in lines.items()))
    heights = {name: n * row + _AROUND_MM for name, n in rows.items()}
    panels, figure = sections_of(kept, heights, _KEY_MM)
    for index, (axis, panel) in enumerate(zip(panels, kept, strict=True)):
        _draw(axis, panel, orders[panel.output][0], measures)
        axis.set_title(title(index, panel))
        label = "share of variance" if measures.of_variance else "index"
        if measures.in_units:
            label = f"μ*, σ ({unit_of(panel.output, panel.coordinate)})"
        axis.set_xlabel(label)
    _scale(panels, measures)
    for name, part in _by_output(kept).items():
        axes = [axis for axis, panel in zip(panels, kept, strict=True) if panel.output == name]
        _name(axes, part, orders[name][0], measures)
    handles = _handles(kept, measures)
    # what is said of factors without a row, output by output where that differs
    others = {name: words for name, (_, words) in orders.items() if words}
    missing = next(iter(others.values()), "")
    if len(set(others.values())) > 1:
        missing = "; ".join(f"{OUTPUT[name]}: {words}" for name, words in others.items())
    explain_marks(figure, handles, footnote(kept, found, missing), len(handles))
    return figure


def _by_output(panels: Sequence[Panel]) -> dict[str, list[Panel]]:
    names = dict.fromkeys(panel.output for panel in panels)
    return {name: [panel for panel in panels if panel.output == name] for name in names}


def _draw(axis: Axes, panel: Panel, order: Sequence[str], measures: Measures) -> None:
    """Bars with their intervals; the first factor on top."""
    known = [name for name in measures.shown if name in set(panel.rows["index"])]
    height = _BARS / len(known)
    for place, index in enumerate(known):
        rows = panel.rows[panel.rows["index"] == index]
        at = _BARS / 2.0 - (place + 0.5) * height
        color = COLORS[measures.shown.index(index)]
        _bars(axis, rows, order, at, 0.86 * height, color)
        _floor(axis, rows, color, index == measures.main)
    if screened(panel.rows):
        axis.axvline(NEGLIGIBLE, color=BLACK, lw=0.6, ls=(0, (1, 1.5)), zorder=5)
    axis.axvline(0.0, color=BLACK, lw=0.6, zorder=5)
    axis.set_ylim(-0.6, len(order) - 0.4)
    axis.spines["left"].set_visible(False)


def _bars(
    axis: Axes, rows: pd.DataFrame, order: Sequence[str], at: float, height: float, color: str
) -> None:
    """One index: bars, lines for their intervals, dots for single joints where several are one."""
    one = pool(rows).set_index("factor").reindex(list(order)).dropna(subset="estimate")
    y = np.array([len(order) - 1 - order.index(name) for name in one.index], dtype=float) + at
    axis.barh(y, one["estimate"], height=height, color=color, lw=0, zorder=3)
    for at_y, low, high in zip(y, one["low"], one["high"], strict=True):
        if np.isfinite([low, high]).all():
            axis.plot(
                [low, high], [at_y, at_y], color=BLACK, lw=0.8, solid_capstyle="butt", zorder=4
            )
    if (one["places"] > 1).any():
        places = dict(zip(one.index, y, strict=True))
        far = rows["estimate"].abs() > _DOT_FROM * rows["estimate"].abs().max()
        dots = rows[rows["factor"].isin(one.index) & far]
        axis.plot(
            dots["estimate"],
            dots["factor"].map(places),
            "o",
            ms=1.7,
            mfc=WHITE,
            mec=BLACK,
            mew=0.35,
            ls="",
            zorder=6,
        )


def _floor(axis: Axes, rows: pd.DataFrame, color: str, main: bool) -> None:
    """The noise floor: its upper end dashed in the index's colour, of the main one its interval."""
    if not floor_seen(rows):
        return
    floor = rows["noise_floor"].max()
    if main:
        low = rows["noise_floor_low"].min()
        axis.axvspan(min(max(low, 0.0), floor), floor, color=GREY, alpha=0.3, lw=0, zorder=1)
    axis.axvline(floor, color=INK[color], lw=0.8, ls=(0, (3, 2)), zorder=2)


def _scale(axes: Sequence[Axes], measures: Measures) -> None:
    """From 0, or the lowest interval; indices without a unit have the same scale in all panels."""
    ends = [axis.dataLim.intervalx for axis in axes]
    for axis, (low, high) in zip(axes, ends, strict=True):
        if not measures.in_units:
            low, high = min(end[0] for end in ends), max(end[1] for end in ends)
        axis.set_xlim(min(low, 0.0) - 0.01 * high, 1.03 * high)


def _name(
    panels: Sequence[Axes], kept: Sequence[Panel], order: Sequence[str], measures: Measures
) -> None:
    """Names of factors on the left; grey are those that are negligible, or above no floor."""
    rows = pd.concat([panel.rows for panel in kept])
    main = rows[rows["index"] == measures.main]
    # factors that matter, or may, at any place
    above = above_floor(main)
    if screened(main):
        above = set(main.loc[main["negligible"].eq(False), "factor"])
    known = bool(main["noise_floor"].notna().any()) or screened(main)
    for axis in panels:
        axis.set_yticks(range(len(order)), [factor_name(name) for name in order[::-1]])
        place = axis.get_subplotspec()
        for label, name in zip(axis.get_yticklabels(), order[::-1], strict=True):
            label.set_color(BLACK if name in above or not known else GREY)
        axis.tick_params(labelleft=place is None or place.is_first_col())


def _handles(kept: Sequence[Panel], measures: Measures) -> list[Line2D | Patch]:
    rows = pd.concat([panel.rows for panel in kept])
    there = set(rows["index"])
    handles: list[Line2D | Patch] = [
        Patch(facecolor=COLORS[place], lw=0, label=NAME[index])
        for place, index in enumerate(measures.shown)
        if index in there
    ]
    if rows["ci_low"].notna().any():
        handles.append(Line2D([], [], color=BLACK, lw=0.8, label="interval"))
    if any(panel.places > 1 for panel in kept):
        handles.append(
            Line2D(
                [],
                [],
                marker="o",
                ms=2.5,
                mfc=WHITE,
                mec=BLACK,
                mew=0.4,
                lw=0,
                label="single joint",
            )
        )
    if floor_seen(rows):
        label = "noise floor, an interval; dashed: upper end, of each index"
        handles.append(Patch(facecolor=GREY, alpha=0.3, lw=0, label=label))
    if screened(rows):
        handles.append(
            Line2D([], [], color=BLACK, lw=0.6, ls=(0, (1, 1.5)), label="1 %: negligible below")
        )
    return handles
