"""Figure: what four wrong simplifications do to the compression of L4L5, and to balance."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from spinepipe.cohort import Cohort
from spinepipe.report.panels import explain_marks, head, log_ticks, side_by_side
from spinepipe.report.style import BLACK, GREY, LineStyle, blank, saying
from spinepipe.studies.trunk_loads.figures.line_styles import (
    HOLLOW_WORDS,
    key_of,
    look_of,
    task_label,
)
from spinepipe.studies.trunk_loads.selection import of_person, shown_person, sound
from spinepipe.studies.trunk_loads.settings import TrunkLoads
from spinepipe.studies.trunk_loads.words import SIMPLIFIED

PERCENT, IMBALANCE = "percent", "imbalance_nm"
LEAST_NM = 1e-2
"""Moments out of balance below this are drawn here."""

_ROW_MM, _AROUND_MM, _KEY_MM = 5.0, 18.0, 15.0


def cost_of_simplifications_figure(
    study: TrunkLoads, cohort: Cohort, tables: Mapping[str, pd.DataFrame]
) -> Figure:
    """A row for each task, a mark for each simplification."""
    rows = tables["simplified"]
    own = costs(of_person(rows, shown_person(study, rows)))
    if own.empty:
        return saying("No simplification can be shown: no task has forces in the whole model.")
    tasks = list(dict.fromkeys(own["task"]))[::-1]
    names = [name for name in SIMPLIFIED if (own["simplification"] == name).any()]
    looks = {name: look_of(k) for k, name in enumerate(names)}
    figure = blank(_ROW_MM * len(tasks) + _AROUND_MM + _KEY_MM)
    axes = side_by_side(figure, 2, 2, sharey=True)
    head(axes[0], 0, "Compression of L4L5")
    head(axes[1], 1, "Moment out of balance")
    _marks(axes[0], own, tasks, looks, PERCENT)
    axes[0].axvline(0.0, color=BLACK, lw=0.6, zorder=1)
    axes[0].set_xlabel("more than in the whole model (%)")
    _marks(axes[1], own, tasks, looks, IMBALANCE)
    moments = np.maximum(own[IMBALANCE].to_numpy(float), LEAST_NM)
    low, high = 0.8 * float(np.nanmin(moments)), 1.25 * float(np.nanmax(moments))
    axes[1].set_xscale("log")
    axes[1].set_xlim(low, high)
    log_ticks(axes[1].xaxis, low, high)
    axes[1].set_xlabel("when the forces act on the whole model (N m)")
    axes[0].set_yticks(range(len(tasks)), [task_label(task) for task in tasks])
    axes[0].set_ylim(-0.6, len(tasks) - 0.4)
    handles = key_of({SIMPLIFIED[name]: look for name, look in looks.items()})
    for handle in handles:
        handle.set_linestyle("")
    words = f"Person: {own['specimen'].iloc[0]}."
    words += "" if own["sound"].all() else f" {HOLLOW_WORDS}"
    explain_marks(figure, handles, words, len(handles))
    return figure


def costs(rows: pd.DataFrame) -> pd.DataFrame:
    """Rows of simplifications with `percent`, more compression than without, and `sound`.

    Tasks that have no forces in the whole model are left out; `sound` says whether both settled.
    """
    whole = rows[rows["simplification"] == "none"].dropna(subset=["l4l5_compression_n"])
    whole = whole[whole["l4l5_compression_n"] > 0.0]
    base = whole.set_index(["specimen", "task"])
    keys = pd.MultiIndex.from_frame(rows[["specimen", "task"]])
    kept = (rows["simplification"] != "none") & keys.isin(base.index)
    found = rows[kept].dropna(subset=["l4l5_compression_n"])
    beside = base.reindex(pd.MultiIndex.from_frame(found[["specimen", "task"]]))
    ratio = found["l4l5_compression_n"].to_numpy(float) / beside["l4l5_compression_n"].to_numpy(
        float
    )
    both = sound(found).to_numpy() & sound(beside).to_numpy()
    return found.assign(**{PERCENT: 100.0 * (ratio - 1.0), "sound": both})


def _marks(
    axis: Axes,
    rows: pd.DataFrame,
    tasks: Sequence[str],
    looks: Mapping[str, LineStyle],
    column: str,
) -> None:
    for y in range(len(tasks)):
        axis.axhline(y, color=GREY, lw=0.2, zorder=0)
    for name, look in looks.items():
        for good in (True, False):
            own = rows[(rows["simplification"] == name) & (rows["sound"] == good)]
            x = own[column].to_numpy(float)
            if column == IMBALANCE:
                x = np.maximum(x, LEAST_NM)
            places = [tasks.index(task) for task in own["task"]]
            axis.plot(x, places, **look.line(not good, ls="", zorder=3))
    axis.spines["left"].set_visible(False)
