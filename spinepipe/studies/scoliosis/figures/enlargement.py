"""Figure: what two choices that films do not settle do to the published tangent model.

A segment's moment grows as a tangent and is infinite at two rotations, its *ends*. Enlargement: by
how many percent the ends lie beyond the rotations on the bending films. Scale: factor of the
lateral stiffness of all segments, other rotations unchanged; films tell stiffness of segments over
each other and not its size.
"""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from spinepipe.cohort import Cohort
from spinepipe.report.panels import explain_marks, head, log_ticks, side_by_side
from spinepipe.report.style import BLACK, BLUE, GREY, VERMILLION, WHITE, Dashes, blank, saying
from spinepipe.studies.scoliosis.figures.line_styles import axis_lines
from spinepipe.studies.scoliosis.settings import Scoliosis
from spinepipe.studies.scoliosis.tables import GROUPS
from spinepipe.studies.scoliosis.words import OF_FILMS

ROTATION, MOVED = "rotation_rmse_deg", "moved_deg"
"""Columns of the table `variation`: root mean square error of all segments' rotations against the
films, and largest change of one of them from the model as the study has it."""

_STYLES: Mapping[str, tuple[str, str, Dashes]] = {
    "fitted": (VERMILLION, "s", (0, (4, 2))),
    "held_out": (BLUE, "o", "-"),
}
"""Colour, marker and dashes by group of films: those the model was fitted to, and the others."""

LEAST_DEG = 1e-3
"""Upper end of a vertical axis at least: smaller values are rounding and would fill the panel."""

_TITLES = {
    ("enlargement", ROTATION): "Ends beyond the films",
    ("scale", ROTATION): "Scale: error",
    ("scale", MOVED): "Scale: largest change",
}
"""Of panels, by what is varied and the column that is shown."""

_HEIGHT_MM, _KEY_MM = 62.0, 16.0
"""Of the panels, and of the explanation of the marks."""


def enlargement_figure(
    study: Scoliosis, cohort: Cohort, tables: Mapping[str, pd.DataFrame]
) -> Figure:
    """Errors over the enlargement, then errors and largest change over the scale.

    A panel whose column is empty, as nothing was varied or nobody has a pose, is left out.
    """
    rows = tables["variation"]
    parts = {
        name: rows[rows["varied"] == name].sort_values("value", kind="stable")
        for name in ("enlargement", "scale")
    }
    panels = [(name, column) for name, column in _TITLES if parts[name][column].notna().any()]
    if not panels:
        return saying("Nothing was varied, or no patient has a pose on every film.")
    figure = blank(_HEIGHT_MM + _KEY_MM)
    axes = side_by_side(figure, len(panels), len(panels))
    groups = [name for name in GROUPS if (rows["films"] == name).any()]
    for index, (axis, (name, column)) in enumerate(zip(axes, panels, strict=True)):
        head(axis, index, _TITLES[name, column])
        axis_lines(axis)
        for group in groups:
            _line(axis, parts[name], group, column)
        _axes(axis, parts[name], name, column, 100.0 * (study.enlargement - 1.0))
    _explain(figure, groups, rows)
    return figure


def _line(axis: Axes, rows: pd.DataFrame, group: str, column: str) -> None:
    """A line of one group of films, a ring at its least error; nothing where nobody has a pose.

    Only errors have a best value: of the largest change no least is marked.
    """
    color, marker, dashes = _STYLES[group]
    own = rows[rows["films"] == group].dropna(subset=[column])
    values = own[column].to_numpy(float)
    axis.plot(own["value"], values, color=color, ls=dashes, marker=marker, ms=3.5, mew=0)
    if column == ROTATION and len(values):
        least = int(np.argmin(values))
        place = [float(own["value"].iloc[least])], [values[least]]
        axis.plot(*place, marker, ms=6.5, mfc=WHITE, mec=color, mew=1.2, zorder=4)


def _axes(axis: Axes, rows: pd.DataFrame, name: str, column: str, studied: float) -> None:
    """Scales and labels, and a grey line at the study's own choice.

    ``studied`` : the study's enlargement, percent; its scale is 1.
    """
    if name == "scale":
        ends = float(rows["value"].min()), float(rows["value"].max())
        axis.set_xscale("log")
        axis.set_xlim(ends[0] / 1.3, ends[1] * 1.3)
        log_ticks(axis.xaxis, *ends)
        axis.set_xlabel("lateral stiffness of all segments, times")
        axis.axvline(1.0, color=GREY, lw=0.6, zorder=0)
    else:
        axis.set_xlabel("enlargement of the ends (%)")
        axis.set_xticks(sorted(rows["value"].unique()))
        axis.axvline(studied, color=GREY, lw=0.6, zorder=0)
    axis.set_ylim(0.0, 1.1 * max(float(rows[column].max()), LEAST_DEG))
    axis.set_ylabel(
        "rotation, root mean square error (°)" if column == ROTATION else "rotation moves by (°)"
    )


def _explain(figure: Figure, groups: Sequence[str], rows: pd.DataFrame) -> None:
    handles = [
        Line2D([], [], color=c, marker=m, ls=dashes, ms=3.5, mew=0, label=OF_FILMS[g].lower())
        for g, (c, m, dashes) in _STYLES.items()
        if g in groups
    ]
    handles.append(
        Line2D([], [], color=BLACK, marker="o", mfc=WHITE, ls="", ms=6.0, label="least error")
    )
    handles.append(Line2D([], [], color=GREY, lw=0.6, label="as the study has it"))
    words = ["" if "held_out" in groups else "Nothing is held out."]
    # a point pools the patients with a pose on every film of its group: fewer at some values
    lost = rows["n_patients"].max() - rows["n_patients"].min()
    if lost:
        words.append(
            "Where fewer patients have a pose, points are of those alone; see the table variation."
        )
    explain_marks(figure, handles, " ".join(word for word in words if word), len(handles))
