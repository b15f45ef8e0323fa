"""Figure: errors of films that models were fitted to and of films that they have not seen."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from spinepipe.cohort import Cohort
from spinepipe.effects.contract import Array
from spinepipe.report.glyphs import spread_out
from spinepipe.report.panels import explain_marks, head, side_by_side
from spinepipe.report.style import BLACK, GREY, WHITE, blank, note, saying
from spinepipe.report.words import count
from spinepipe.statistics import mean_of
from spinepipe.studies.scoliosis.errors import by_patient, errors_by_measure, reading_floor
from spinepipe.studies.scoliosis.figures.line_styles import DASHED, STYLES
from spinepipe.studies.scoliosis.settings import Scoliosis
from spinepipe.studies.scoliosis.tables import GROUPS
from spinepipe.studies.scoliosis.words import IN_WORDS, in_order

PANELS = {
    "rotation": ("Rotation of segments", "°"),
    "place": ("Place of vertebrae", "mm"),
    "tilt": ("Tilt of vertebrae", "°"),
    "ferguson": ("Ferguson angles of curves", "°"),
}

NOTHING_HELD_OUT = "Nothing is held out: no patient has a film besides erect and bending."

LEAST = 1e-3
"""Axes reach to this at least, where all errors are rounding."""

_TABLES = ("positions", "displacements", "curves")
_HEIGHT = {"held_out": 0.2, "fitted": -0.2}
"""Where each group of films stands in the row of a model."""

_STRIP, _ROW_MM, _AROUND_MM, _KEY_MM = 0.14, 9.0, 15.0, 16.0


def fitted_and_held_out_figure(
    study: Scoliosis, cohort: Cohort, tables: Mapping[str, pd.DataFrame]
) -> Figure:
    """A panel for each measure, a row for each model, fitted films below held-out ones."""
    found = errors_of_patients(*(tables[name] for name in _TABLES))
    if found.empty:
        return saying("No error can be shown: no model has a pose on any film.")
    models = in_order(found["model"])[::-1]
    fitted = tables["positions"]["fitted"]
    groups = [name for name in GROUPS if (fitted == (name == "fitted")).any()]
    down = -(-len(PANELS) // 2)
    figure = blank(down * (_ROW_MM * len(models) + _AROUND_MM) + _KEY_MM)
    axes = side_by_side(figure, len(PANELS), 2, sharey=True)
    for index, (axis, (measure, (title, unit))) in enumerate(
        zip(axes, PANELS.items(), strict=True)
    ):
        head(axis, index, title)
        axis.set_xlabel(f"root mean square error ({unit})")
        _rows(axis, models)
        rows = found[found["measure"] == measure]
        for name in models:
            _strips(axis, models.index(name), rows[rows["model"] == name], groups)
        floor = reading_floor(tables["accuracy"], measure)
        axis.axvline(floor, color=GREY, ls=DASHED, lw=0.9, zorder=1)
        largest = np.nanmax([*rows["error"].to_numpy(float), floor, LEAST])
        axis.set_xlim(0.0, 1.05 * float(largest))
    _explain(figure, groups, tables["accuracy"])
    return figure


def errors_of_patients(
    positions: pd.DataFrame, displacements: pd.DataFrame, curves: pd.DataFrame
) -> pd.DataFrame:
    """Columns films, measure, model, specimen, error: of patients with a pose on every film."""
    parts = []
    for group, measure, errors in errors_by_measure(positions, displacements, curves, PANELS):
        own = by_patient(errors)
        each = own.melt(ignore_index=False, var_name="model", value_name="error").dropna()
        each = each.rename_axis("specimen").reset_index()
        parts.append(each.assign(films=group, measure=measure))
    columns = ["films", "measure", "model", "specimen", "error"]
    return pd.concat(parts)[columns]


def _rows(axis: Axes, models: Sequence[str]) -> None:
    axis.set_yticks(range(len(models)), [IN_WORDS[name] for name in models])
    axis.set_ylim(-0.55, len(models) - 0.45)
    axis.spines["left"].set_visible(False)
    for y in range(len(models)):
        axis.axhline(y - 0.5, color=GREY, lw=0.2, zorder=0)


def _strips(axis: Axes, y: int, rows: pd.DataFrame, groups: Sequence[str]) -> None:
    """Patients of one model as dots, their mean and its interval."""
    for group in groups:
        values = rows.loc[rows["films"] == group, "error"].to_numpy(float)
        middle = y + (_HEIGHT[group] if len(groups) > 1 else 0.0)
        if not len(values):
            note(axis, 0.02, middle, "no patient has all poses", GREY)
            continue
        color = STYLES[str(rows["model"].iloc[0])].color
        face = color if group == "held_out" else WHITE
        heights = middle + _STRIP * spread_out(len(values))
        axis.plot(values, heights, "o", ms=3.0, mfc=face, mec=color, mew=0.6, alpha=0.7, zorder=3)
        _mean(axis, values, middle)


def _mean(axis: Axes, values: Array, y: float) -> None:
    found = mean_of(values)
    if found.interval is not None:
        ends = max(0.0, found.interval[0]), found.interval[1]
        axis.plot(ends, [y, y], color=BLACK, lw=1.1, solid_capstyle="butt", zorder=4)
    axis.plot([values.mean()], [y], "D", color=BLACK, ms=3.2, mec=WHITE, mew=0.4, zorder=5)


def _explain(figure: Figure, groups: Sequence[str], accuracy: pd.DataFrame) -> None:
    dot = {"color": GREY, "marker": "o", "ms": 3.0, "ls": "", "mew": 0.6}
    handles = [Line2D([], [], **dot, mfc=WHITE, label="a patient, fitted films")]  # type: ignore[arg-type]
    if "held_out" in groups:
        handles.append(Line2D([], [], **dot, mfc=GREY, label="a patient, held-out films"))  # type: ignore[arg-type]
    mean = "mean of patients with 95 % interval"
    handles.append(Line2D([], [], color=BLACK, marker="D", ms=3.2, mew=0, lw=1.1, label=mean))
    words = ["" if "held_out" in groups else NOTHING_HELD_OUT]
    if accuracy["reading_noise"].notna().any():
        handles.append(
            Line2D([], [], color=GREY, ls=DASHED, lw=0.9, label="what reading films alone makes")
        )
    else:
        words.append("How exactly the films are read is not known.")
    most = int(accuracy["n_patients"].max()) if len(accuracy) else 0
    words.append(f"{count(most, 'patient')}.")
    explain_marks(figure, handles, " ".join(word for word in words if word), len(handles))
