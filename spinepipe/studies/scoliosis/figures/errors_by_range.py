"""Figure: errors of rotations by how near segments come to the published ends."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from spinepipe.cohort import Cohort
from spinepipe.effects.contract import Array
from spinepipe.report.glyphs import finite
from spinepipe.report.panels import explain_marks, head, side_by_side
from spinepipe.report.style import BLACK, GREY, blank, saying
from spinepipe.studies.scoliosis.errors import of_rotations, reading_floor
from spinepipe.studies.scoliosis.figures.line_styles import DASHED, STYLES, axis_lines
from spinepipe.studies.scoliosis.settings import Scoliosis
from spinepipe.studies.scoliosis.tables import BEYOND, GROUPS, RANGES
from spinepipe.studies.scoliosis.words import IN_WORDS, OF_FILMS, in_order

OPPOSITE = "opposite"
CLASSES = {
    "below_0.2": "below\n20 %",
    "0.2_to_0.8": "20 to\n80 %",
    "0.8_to_1": "80 to\n100 %",
    BEYOND: "beyond\nthe end",
    OPPOSITE: "against\na bend",
}
"""Sizes of a rotation over the published end of its side; segments of no such side apart."""

FEWEST_FOR_A_BOX = 5
WHISKERS = (5.0, 95.0)

_WIDTH, _HEIGHT_MM, _KEY_MM = 0.8, 70.0, 18.0


def errors_by_range_figure(
    study: Scoliosis, cohort: Cohort, tables: Mapping[str, pd.DataFrame]
) -> Figure:
    """A panel for each group of films, a cluster of boxes for each class."""
    rows = classified(tables["displacements"])
    if rows.empty:
        return saying("No error of a rotation can be shown: no model has a pose on any film.")
    models = in_order(rows["model"])
    groups = [name for name in GROUPS if (rows["films"] == name).any()]
    figure = blank(_HEIGHT_MM + _KEY_MM)
    axes = side_by_side(figure, len(groups), len(groups), sharey=True)
    floor = reading_floor(tables["accuracy"], "rotation")
    for index, (axis, group) in enumerate(zip(axes, groups, strict=True)):
        head(axis, index, OF_FILMS[group])
        axis_lines(axis)
        _boxes(axis, rows[rows["films"] == group], models)
        axis.axhline(floor, color=GREY, ls=DASHED, lw=0.9, zorder=1)
        axis.set_xlabel("size of the rotation on the film, share of the published end")
    axes[0].set_ylabel("size of the error (°)")
    axes[0].set_ylim(bottom=0.0)
    _explain(figure, models, groups, floor)
    return figure


def classified(displacements: pd.DataFrame) -> pd.DataFrame:
    """Columns films, range, model, error (deg, without sign) of all segments with a pose."""
    error = of_rotations(displacements).abs()
    share = displacements["share_of_range"].to_numpy(float)
    names = [*RANGES, BEYOND]
    tops = [high for _, high in RANGES.values()]
    at = np.searchsorted(tops, share, side="right")
    ranges = np.where(displacements["opposite"], OPPOSITE, np.array(names)[at])
    films = np.where(displacements["fitted"], "fitted", "held_out")
    found = displacements[["model"]].assign(films=films, range=ranges, error=error)
    return found.dropna(subset=["error"])


def _boxes(axis: Axes, rows: pd.DataFrame, models: Sequence[str]) -> None:
    """Boxes of every class that has rotations; dots where they are few."""
    classes = [name for name in CLASSES if (rows["range"] == name).any()]
    step = _WIDTH / len(models)
    labels = []
    for x, name in enumerate(classes):
        there = rows[rows["range"] == name]
        for number, model in enumerate(models):
            values = finite(there.loc[there["model"] == model, "error"])
            at = x + (number - 0.5 * (len(models) - 1)) * step
            _box(axis, values, at, 0.8 * step, STYLES[model].color)
        most = int(there.groupby("model").size().max())
        labels.append(f"{CLASSES[name]}\nn = {most}")
    axis.set_xticks(range(len(classes)), labels)
    axis.set_xlim(-0.55, len(classes) - 0.45)


def _box(axis: Axes, values: Array, x: float, width: float, color: str) -> None:
    if len(values) < FEWEST_FOR_A_BOX:
        axis.plot(np.full(len(values), x), values, "o", color=color, ms=2.5, mew=0, zorder=3)
        return
    line = {"color": color, "lw": 0.9}
    axis.boxplot(
        values,
        positions=[x],
        widths=width,
        whis=WHISKERS,
        showfliers=False,
        showcaps=False,
        manage_ticks=False,
        patch_artist=True,
        boxprops={"facecolor": color, "edgecolor": color, "alpha": 0.55},
        whiskerprops=line,
        medianprops={"color": BLACK, "lw": 1.2},
        zorder=3,
    )


def _explain(figure: Figure, models: Sequence[str], groups: Sequence[str], floor: float) -> None:
    handles = [
        Patch(facecolor=STYLES[name].color, alpha=0.55, label=IN_WORDS[name]) for name in models
    ]
    words = "In each cluster the models in this order. Box: middle half, whiskers: middle 90 %."
    if "held_out" not in groups:
        words += " Nothing is held out: there are no films besides erect and bending."
    if np.isfinite(floor):
        words += " Dashed: root mean square error that reading films alone makes."
    explain_marks(figure, handles, words, len(handles))
