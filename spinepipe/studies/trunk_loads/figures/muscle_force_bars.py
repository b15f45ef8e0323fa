"""Figure: what every muscle pulls in a handful of tasks, by both sides, active and passive."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from spinepipe.cohort import Cohort
from spinepipe.muscles.trunk import SIDES
from spinepipe.report.panels import across_of, explain_marks, head, lines_of
from spinepipe.report.style import BLUE, GREEN, GREY, WHITE, blank, saying
from spinepipe.report.words import plain
from spinepipe.studies.trunk_loads.figures.line_styles import task_label
from spinepipe.studies.trunk_loads.selection import (
    grouped,
    of_person,
    shown_person,
    some_tasks,
    sound,
)
from spinepipe.studies.trunk_loads.settings import TrunkLoads

SAME_SHARE = 0.02
"""Sides that differ by less than this, of the largest force of the task, are drawn as one."""

_ROW_MM, _AROUND_MM, _KEY_MM = 5.2, 13.0, 16.0
_COLORS = {"right": BLUE, "left": GREEN}


def muscle_force_bars_figure(
    study: TrunkLoads, cohort: Cohort, tables: Mapping[str, pd.DataFrame]
) -> Figure:
    """A panel for each task, a row for each muscle."""
    person = shown_person(study, tables["tasks"])
    tasks = of_person(tables["tasks"], person)
    shown = some_tasks(study, tasks) if len(tasks) else []
    rows = of_person(tables["muscles"], person)
    rows = rows[rows["task"].isin(shown)]
    if rows.empty or rows["force_n"].isna().all():
        return saying("No muscle force can be shown: no task could be posed.")
    groups = list(dict.fromkeys(rows["group"]))[::-1]
    across = across_of(len(shown))
    down = -(-len(shown) // across)
    figure = blank(down * (_ROW_MM * len(groups) + _AROUND_MM) + _KEY_MM)
    lines = lines_of(figure, len(shown), across, sharex=True, sharey=True)
    axes = [axis for line in lines for axis in line][: len(shown)]
    unlike = False
    for index, (axis, task) in enumerate(zip(axes, shown, strict=True)):
        own, name = tasks[tasks["task"] == task], task_label(task)
        ended = plain(str(own["status"].iloc[0]))
        head(axis, index, name if sound(own).all() else f"{name} ({ended})")
        forces = grouped(rows[rows["task"] == task], ("force_n", "passive_n"))
        unlike |= _bars(axis, forces, groups)
    _scales(axes, groups, across)
    _explain(figure, str(person), unlike)
    return figure


def _bars(axis: Axes, forces: pd.DataFrame, groups: Sequence[str]) -> bool:
    """Bars of a task; whether its sides differ."""
    sides = {
        side: forces[forces["side"] == side].set_index("group").reindex(list(groups)).fillna(0.0)
        for side in SIDES
    }
    right, left = (sides[side]["force_n"].to_numpy(float) for side in SIDES)
    unlike = bool(np.abs(right - left).max() > SAME_SHARE * max(right.max(), left.max(), 1e-9))
    drawn = SIDES if unlike else SIDES[:1]
    height = 0.76 / len(drawn)
    for place, side in enumerate(drawn):
        y = np.arange(len(groups)) + 0.38 - (place + 0.5) * height
        color = _COLORS[side] if unlike else GREY
        total, passive = (sides[side][name].to_numpy(float) for name in ("force_n", "passive_n"))
        active = total - passive
        look: dict[str, Any] = {"height": 0.9 * height, "edgecolor": color, "lw": 0.6}
        axis.barh(y, active, color=color, zorder=3, **look)
        axis.barh(y, passive, left=active, color=WHITE, hatch="//////", zorder=3, **look)
    return unlike


def _scales(axes: Sequence[Axes], groups: Sequence[str], across: int) -> None:
    for number, axis in enumerate(axes):
        axis.set_yticks(range(len(groups)), [plain(group) for group in groups])
        axis.set_ylim(-0.6, len(groups) - 0.4)
        axis.spines["left"].set_visible(False)
        if number + across >= len(axes):
            axis.set_xlabel("force of one side (N)")
            axis.tick_params(labelbottom=True)
    axes[0].set_xlim(left=0.0)


def _explain(figure: Figure, person: str, unlike: bool) -> None:
    handles = [Patch(facecolor=GREY, label="active, each side alike")]
    if unlike:
        handles += [Patch(facecolor=_COLORS[side], label=f"active, {side}") for side in SIDES]
    look: dict[str, Any] = {"facecolor": WHITE, "edgecolor": GREY, "hatch": "//////"}
    handles.append(Patch(**look, label="passive: of being stretched"))
    explain_marks(
        figure, handles, f"Person: {person}. Sum of the fascicles of a muscle.", len(handles)
    )
