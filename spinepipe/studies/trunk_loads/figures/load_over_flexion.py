"""Figure: loads of L4L5 while persons bend forwards, and the extensors that fall silent."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from spinepipe.cohort import Cohort
from spinepipe.muscles.trunk import GLOBAL_EXTENSORS
from spinepipe.report.panels import explain_marks, head, side_by_side
from spinepipe.report.style import BLACK, BLUE, VERMILLION, LineStyle, blank, saying
from spinepipe.report.words import plain, short
from spinepipe.studies.trunk_loads.figures.line_styles import key_of, look_of, scale
from spinepipe.studies.trunk_loads.selection import (
    courses_of,
    extensor_forces,
    of_person,
    shown_person,
)
from spinepipe.studies.trunk_loads.settings import TrunkLoads

LOADS = {
    "l4l5_compression_n": ("Compression of L4L5", "N"),
    "l4l5_shear_n": ("Shear of L4L5, forwards", "N"),
}
PARTS = {"active": (BLUE, "-"), "passive": (VERMILLION, (0, (4.0, 2.0)))}
NO_BENDS = "Nothing can be shown: no person has three angles of bending forwards that settled."

_HEIGHT_MM, _KEY_MM = 58.0, 18.0


def load_over_flexion_figure(
    study: TrunkLoads, cohort: Cohort, tables: Mapping[str, pd.DataFrame]
) -> Figure:
    """Loads of every person on top, forces of the global extensors of one below."""
    tasks = tables["tasks"]
    courses = courses_of(tasks, cohort)
    if not courses:
        return saying(NO_BENDS)
    looks = {name: look_of(k) for k, name in enumerate(courses)}
    bender = shown_person(study, tasks[tasks["specimen"].isin(courses)])
    forces = extensor_forces(of_person(tables["muscles"], bender), courses[str(bender)])
    forces = forces.groupby(["group", "flexion_deg"], as_index=False).sum()
    groups = [name for name in GLOBAL_EXTENSORS if name in set(forces["group"])]
    down = 2 if groups else 1
    figure = blank(down * _HEIGHT_MM + _KEY_MM)
    axes = side_by_side(figure, 2 * down, 2)
    for index, (axis, (column, (title, unit))) in enumerate(zip(axes, LOADS.items(), strict=False)):
        head(axis, index, title)
        _axes(axis, unit)
        for name, rows in courses.items():
            axis.plot(rows["flexion_deg"], rows[column].astype(float), **looks[name].line())
    for spare in axes[2 + len(groups) :]:
        spare.set_visible(False)
    for index, (axis, group) in enumerate(zip(axes[2:], groups, strict=False)):
        head(axis, 2 + index, f"{plain(group)}, both sides")
        _axes(axis, "N")
        own = forces[forces["group"] == group].sort_values("flexion_deg")
        for part, (color, dashes) in PARTS.items():
            axis.plot(
                own["flexion_deg"], own[part], color=color, ls=dashes, marker="o", ms=3, mew=0
            )
    lost = [name for name in dict.fromkeys(tasks["specimen"]) if name not in courses]
    _explain(figure, looks, str(bender), bool(groups), lost)
    return figure


def _axes(axis: Axes, unit: str) -> None:
    axis.set_xlabel("flexion of the trunk (°)")
    axis.set_ylabel(unit)
    axis.axhline(0.0, color=BLACK, lw=0.5, zorder=0)
    scale(axis)


def _explain(
    figure: Figure, looks: Mapping[str, LineStyle], bender: str, muscles: bool, lost: Sequence[str]
) -> None:
    handles = key_of({short(name): look for name, look in looks.items()})
    words = []
    if muscles:
        handles += [
            Line2D([], [], color=color, ls=dashes, marker="o", ms=3, mew=0, label=f"{part} force")
            for part, (color, dashes) in PARTS.items()
        ]
        words.append(f"Muscles: those of {bender}.")
    words.append("Only tasks whose forces settled.")
    if lost:
        words.append(f"Too few angles: {', '.join(lost)}.")
    explain_marks(figure, handles, " ".join(words), int(np.ceil(len(handles) / 2)))
