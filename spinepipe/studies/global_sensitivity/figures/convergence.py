"""Figure: how indices settle with the number of runs."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from spinepipe.cohort import Cohort
from spinepipe.report.panels import explain_marks, log_ticks
from spinepipe.report.style import BLACK, BLUE, GREEN, GREY, SMALL_PT, VERMILLION, saying
from spinepipe.sensitivity_analysis.global_indices.design import DUMMY
from spinepipe.studies.global_sensitivity.figures.panels import (
    NAME,
    OUTPUT,
    Measures,
    Panel,
    choose_panels,
    factor_name,
    leading,
    no_index,
    pool,
    sections_of,
    shown_outputs,
    title,
    unit_of,
    with_results,
)
from spinepipe.studies.global_sensitivity.settings import GlobalSensitivity

MOST_PANELS = 9
_STYLES: tuple[Mapping[str, Any], ...] = (
    {"color": BLUE, "marker": "o"},
    {"color": VERMILLION, "marker": "s"},
    {"color": GREEN, "marker": "^"},
)
"""Of the first, second and third factor of a panel."""

_DUMMY_STYLE: Mapping[str, Any] = {"color": GREY, "marker": "x", "ls": "--"}
_PANEL_MM, _KEY_MM = 56.0, 10.0
_ROOM_FOR_KEY = 0.55
"""Height for the names of factors, as a part of the height of the lines."""

Styles = dict[str, Mapping[str, Any]]


def convergence_figure(
    study: GlobalSensitivity, cohort: Cohort, tables: Mapping[str, pd.DataFrame]
) -> Figure:
    """The main index of each panel's leading factors against the runs, from ``convergence``."""
    convergence, indices = tables["convergence"], tables["indices"]
    found, measures = shown_outputs(cohort, indices)
    if not found or measures is None:
        return no_index(indices)
    grown = with_results(convergence, measures)
    grown = grown[grown["index"] == measures.main]
    if grown["runs"].nunique() < 2:
        return saying("No convergence can be shown: this design has no smaller part of its own.")
    kept = choose_panels(found, cohort.joint_names, MOST_PANELS)
    panels, figure = sections_of(kept, dict.fromkeys(OUTPUT, _PANEL_MM), _KEY_MM)
    for index, (axis, panel) in enumerate(zip(panels, kept, strict=True)):
        factors = leading([panel], measures)
        first = [name for name in factors if name != DUMMY]
        styles: Styles = dict(zip(first, _STYLES, strict=False))
        if DUMMY in factors:
            styles[DUMMY] = _DUMMY_STYLE
        _draw(axis, panel.of(grown), styles, measures)
        axis.set_title(title(index, panel))
    words = f"Line: {NAME[measures.main]} of the panel's leading factors, band: its interval"
    if any(panel.places > 1 for panel in kept):
        words += "; means over joints and specimens"
    explain_marks(figure, [], f"{words}.", 1)
    return figure


def _draw(axis: Axes, panel: Panel, styles: Styles, measures: Measures) -> None:
    rows = pool(panel.rows, ["factor", "runs"]).sort_values("runs", kind="stable")
    for name, style in styles.items():
        one = rows[rows["factor"] == name]
        axis.fill_between(
            one["runs"], one["low"], one["high"], color=style["color"], alpha=0.18, lw=0, zorder=2
        )
        axis.plot(
            one["runs"],
            one["estimate"],
            ms=2.8,
            mew=0.6,
            lw=1.0,
            zorder=3,
            label=factor_name(name),
            **style,
        )
    axis.axhline(0.0, color=BLACK, lw=0.5, zorder=1)
    axis.set_xscale("log")
    log_ticks(axis.xaxis, float(rows["runs"].min()), float(rows["runs"].max()))
    axis.set_xlabel("runs")
    unit = f" ({unit_of(panel.output, panel.coordinate)})" if measures.in_units else ""
    axis.set_ylabel(f"{NAME[measures.main]}{unit}")
    axis.tick_params(axis="y", length=2.5)
    _limit(axis, rows[rows["factor"].isin(list(styles))])
    axis.legend(
        loc="upper right", fontsize=SMALL_PT, handlelength=2.2, labelspacing=0.25, borderaxespad=0.0
    )


def _limit(axis: Axes, rows: pd.DataFrame) -> None:
    """Limits of the estimates with some room: intervals of few runs may reach far beyond."""
    ends = rows[["estimate"]].to_numpy(float)
    late = rows[rows["runs"] > np.sqrt(rows["runs"].min() * rows["runs"].max())]
    ends = np.concatenate([ends.ravel(), late[["low", "high"]].to_numpy(float).ravel(), [0.0]])
    low, high = np.nanmin(ends), np.nanmax(ends)
    room = (high - low) or 1.0
    axis.set_ylim(low - 0.06 * room, high + _ROOM_FOR_KEY * room)
