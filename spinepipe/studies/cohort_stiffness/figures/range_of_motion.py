"""Figure: range of motion, neutral zone and lost work of each curve, simulated over measured."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from spinepipe.cohort import Cohort
from spinepipe.experiment.double_sigmoid import Zone
from spinepipe.report.panels import across_of, explain_marks, head, side_by_side
from spinepipe.report.style import BLACK, OURS, WHITE, blank, saying
from spinepipe.report.words import case, count, short, tick
from spinepipe.studies.cohort_stiffness.loop_rows import CURVE_KEY, paired_curves
from spinepipe.studies.cohort_stiffness.settings import CohortStiffness
from spinepipe.studies.cohort_stiffness.tables import MEASURED

_PANEL_MM, _KEY_MM = 58.0, 17.0
_MOST_INTERVALS = 150
_MOST_PANELS = 9
MJ_PER_J = 1000.0


@dataclass(frozen=True)
class ComparisonPanel:
    """What a panel compares: points with columns as of `paired_curves`, in the unit of its axes."""

    title: str
    unit: str
    points: pd.DataFrame


def range_of_motion_figure(
    study: CohortStiffness, cohort: Cohort, tables: Mapping[str, pd.DataFrame]
) -> Figure:
    """A panel per test for the range of motion, then neutral zones and lost work, where read."""
    panels = comparison_panels(tables["load_displacement"])
    shown = panels[:_MOST_PANELS]
    if not shown:
        return saying("No range of motion was both measured and simulated.")
    across = across_of(len(shown))
    figure = blank(-(-len(shown) // across) * _PANEL_MM + _KEY_MM)
    for index, (panel, axis) in enumerate(
        zip(shown, side_by_side(figure, len(shown), across), strict=True)
    ):
        head(axis, index, panel.title)
        _draw(axis, panel)
    _explain(figure, panels)
    return figure


def comparison_panels(rows: pd.DataFrame) -> list[ComparisonPanel]:
    """What there is to compare; a curve without a neutral zone of the model has one of 0 there."""
    if rows.empty:
        return []
    found = []
    ranges = paired_curves(rows, "range_of_motion", "deg").dropna(subset=["measured", "simulated"])
    for test, points in ranges.groupby("test", sort=False):
        found.append(ComparisonPanel(short(case(str(test)), 32), "range of motion (°)", points))
    zones = paired_curves(rows, "neutral_zone", "deg").dropna(subset="measured")
    none = rows[(rows["source"] != MEASURED) & (rows["neutral_zone"] == Zone.NOT_MEANINGFUL)]
    without = zones.merge(none[CURVE_KEY].assign(none=True), on=CURVE_KEY, how="left")[
        "none"
    ].notna()
    for name in ("simulated", "simulated_way"):
        zones[name] = zones[name].where(~without.to_numpy(), 0.0)
    zones = zones.dropna(subset="simulated")
    if len(zones):
        found.append(ComparisonPanel("Neutral zone", "neutral zone (°)", zones))
    work = paired_curves(rows, "hysteresis_area", "j").dropna(subset=["measured", "simulated"])
    if len(work):
        numbers = MJ_PER_J * work.drop(columns=CURVE_KEY).astype(float)
        found.append(
            ComparisonPanel("Work lost in a cycle", "work lost (mJ)", work[CURVE_KEY].join(numbers))
        )
    return found


def _draw(axis: Axes, panel: ComparisonPanel) -> None:
    points = panel.points
    x, y = (points[name].to_numpy(float) for name in ("measured", "simulated"))
    across, up = (points[f"{name}_way"].to_numpy(float) for name in ("measured", "simulated"))
    sure = np.isfinite(across) & np.isfinite(up)
    across, up = np.nan_to_num(across), np.nan_to_num(up)
    ends = np.concatenate([x - across, x + across, y - up, y + up, [0.0]])
    room = 0.04 * (float(np.ptp(ends)) or 1.0)
    low, high = float(ends.min()) - room, float(ends.max()) + room
    axis.plot([low, high], [low, high], color=BLACK, lw=0.6, zorder=1)
    if len(points) <= _MOST_INTERVALS:
        axis.errorbar(x, y, up, across, fmt="none", ecolor=OURS, elinewidth=0.5, alpha=0.5)
    for some, face in ((sure, OURS), (~sure, WHITE)):
        axis.plot(x[some], y[some], "o", color=OURS, mfc=face, ms=3.0, mew=0.6, alpha=0.8, zorder=3)
    axis.set_xlim(low, high)
    axis.set_ylim(low, high)
    axis.set_aspect("equal", adjustable="box")
    axis.set_xlabel(f"measured {panel.unit}")
    axis.set_ylabel("simulated")
    for side in (axis.xaxis, axis.yaxis):
        side.set_major_locator(MaxNLocator(4))
        side.set_major_formatter(lambda value, _: tick(round(value, 10)))
    axis.tick_params(axis="y", length=2.5)


def _explain(figure: Figure, panels: list[ComparisonPanel]) -> None:
    handles = [
        Line2D([], [], color=OURS, marker="o", ms=3.0, lw=0.5, label="a joint in one cycle, 95 %"),
        Line2D([], [], color=BLACK, lw=0.6, label="the model moves as the joint"),
    ]
    loose = any(p.points[["measured_way", "simulated_way"]].isna().any().any() for p in panels)
    if loose:
        hollow = {"color": OURS, "marker": "o", "mfc": WHITE, "ms": 3.0, "lw": 0}
        handles.insert(1, Line2D([], [], **hollow, label="an interval is missing"))  # type: ignore[arg-type]
    more = len(panels) - _MOST_PANELS
    rest = f" {count(more, 'further panel')} not shown." if more > 0 else ""
    words = (
        "Simulated: the model with stiffness fitted to all load cases, under the same loads. Lines "
        "of measured numbers: noise of readings; of simulated: the stiffness. Above "
        f"{_MOST_INTERVALS} points a panel has no lines.{rest}"
    )
    explain_marks(figure, handles, words, len(handles))
