"""Figure: compression and shear from T11T12 down to L5S1 in a handful of tasks."""

from collections.abc import Mapping

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from spinepipe.cohort import Cohort
from spinepipe.muscles.trunk import LEVELS
from spinepipe.report.panels import explain_marks, head, side_by_side
from spinepipe.report.style import BLACK, GREY, blank, saying
from spinepipe.studies.trunk_loads.figures.line_styles import (
    HOLLOW_WORDS,
    key_of,
    look_of,
    task_label,
)
from spinepipe.studies.trunk_loads.selection import of_person, shown_person, some_tasks, sound
from spinepipe.studies.trunk_loads.settings import TrunkLoads

PANELS = {
    "compression_n": ("Compression", "along the disc's axis (N)"),
    "shear_anterior_n": ("Shear", "forwards (N)"),
    "shear_right_n": ("Shear sideways", "to the right (N)"),
}
_HEIGHT_MM, _KEY_MM = 78.0, 17.0
SEEN_N = 1.0
"""Sideways shear below this is not worth a panel."""


def load_by_level_figure(
    study: TrunkLoads, cohort: Cohort, tables: Mapping[str, pd.DataFrame]
) -> Figure:
    """A panel for each load; levels as they lie in a standing spine."""
    person = shown_person(study, tables["tasks"])
    tasks = of_person(tables["tasks"], person)
    shown = some_tasks(study, tasks) if len(tasks) else []
    rows = of_person(tables["levels"], person).dropna(subset=["compression_n"])
    if rows.empty or not shown:
        return saying("No load can be shown: no task could be posed.")
    drawn = rows[rows["task"].isin(shown)]
    aside = drawn["shear_right_n"].abs().max() > SEEN_N
    panels = [name for name in PANELS if name != "shear_right_n" or aside]
    figure = blank(_HEIGHT_MM + _KEY_MM)
    axes = side_by_side(figure, len(panels), len(panels), sharey=True)
    for index, (axis, column) in enumerate(zip(axes, panels, strict=True)):
        title, label = PANELS[column]
        head(axis, index, title)
        axis.set_xlabel(label)
        for _, other in rows[~rows["task"].isin(shown) & sound(rows)].groupby("task"):
            _course(axis, other, column, color=GREY, lw=0.35, alpha=0.6, zorder=1)
        for number, name in enumerate(shown):
            own = drawn[drawn["task"] == name]
            look = look_of(number).line(not sound(own).all(), zorder=3)
            _course(axis, own, column, **look)
        axis.axvline(0.0, color=BLACK, lw=0.5, zorder=0)
    axes[0].set_yticks(range(len(LEVELS)), LEVELS)
    axes[0].set_ylim(-0.4, len(LEVELS) - 0.6)
    _explain(figure, shown, str(person), bool(sound(drawn).all()))
    return figure


def _course(axis: Axes, rows: pd.DataFrame, column: str, **look: object) -> None:
    """One task from the lowest level up."""
    values = rows.set_index("level")[column].astype(float).reindex(list(LEVELS))
    axis.plot(values.to_numpy(), range(len(LEVELS)), **look)  # type: ignore[arg-type]


def _explain(figure: Figure, shown: list[str], person: str, all_sound: bool) -> None:
    handles = key_of({task_label(name): look_of(k) for k, name in enumerate(shown)})
    handles.append(Line2D([], [], color=GREY, lw=0.5, label="all other tasks"))
    words = f"Person: {person}. Forces of the upper vertebra on the lower one."
    words += "" if all_sound else f" {HOLLOW_WORDS}"
    explain_marks(figure, handles, words, 4)
