"""Figure: where model and measurement disagree, joint by coordinate, for each test."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from spinepipe.cohort import Cohort
from spinepipe.report.cohort.named import short
from spinepipe.report.discrepancy.heat import draw_heat, empty_cell, name_cells
from spinepipe.report.discrepancy.verdict import Verdict
from spinepipe.report.discrepancy.words import capital, plain
from spinepipe.report.layout import explain_marks
from spinepipe.report.spread import Array, finite
from spinepipe.report.style import TALLEST_MM, WIDTH_MM, blank, saying
from spinepipe.report.words import count
from spinepipe.units import COORDINATES

MOST_TESTS = 6
MODELS = {"base": "base", "with_effects": "with effects"}
"""The models in words."""

SHORT = {
    "anterior": "ant.",
    "superior": "sup.",
    "right": "right",
    "extension": "flex.–ext.",
    "right_bending": "bending",
    "left_rotation": "rotation",
}
"""Coordinates where there is little room."""

_ROW_MM, _LEAST_ROW_MM, _AROUND_MM, _KEY_MM = 6.0, 2.2, 19.0, 26.0
_CELL_WITH_NUMBER_MM, _ROW_WITH_NUMBER_MM = 5.0, 2.6
_FEW_COORDINATES = 3
_LEAST_SCALE = 2.0
"""The scale reaches at least so many noise SD: noise must not look like physics."""


def gap_map_figure(cohort: Cohort, verdict: Verdict, tables: Mapping[str, pd.DataFrame]) -> Figure:
    """For each test the base model on the left, the model with the named effects on the right."""
    where = tables["where"]
    rows = where[where["by"] == "joint x coordinate x test"]
    if not len(finite(rows["gap"])):
        return saying("No gap can be shown: no model has a pose.")
    tests = _widest(rows, cohort.tests)
    columns = [name for name in COORDINATES if name in set(rows["coordinate"])]
    models = _models(rows)
    across = min(len(tests), 3 if len(columns) <= _FEW_COORDINATES else 2)
    figure, axes = _grid(len(tests), across, len(models), len(cohort.joint_names))
    scale = Normalize(0.0, max(_LEAST_SCALE, float(finite(rows["gap"]).max())))
    numbers = _room(across * len(models), len(columns), len(cohort.joint_names))
    for place, test in enumerate(tests):
        line, first = axes[place // across], len(models) * (place % across)
        for side, model in enumerate(models):
            axis = line[first + side]
            part = rows[(rows["test"] == test) & (rows["model"] == model)]
            grid, low = (
                _square(part, name, cohort.joint_names[::-1], columns)
                for name in ("gap", "gap_low")
            )
            image = draw_heat(axis, grid, scale, 1 if numbers else None, low <= 0.0)
            _label(axis, cohort.joint_names[::-1], columns, MODELS[model], side == 0)
        _heading(line[first], place, test, across)
    bar = figure.colorbar(image, ax=[axis for line in axes for axis in line], location="bottom",
                          aspect=60, shrink=0.6, pad=0.02)  # fmt: skip
    bar.set_label("gap: discrepancy above the noise (noise SD)")
    bar.outline.set_linewidth(0.4)
    explain_marks(figure, [empty_cell("not measured, or no pose")], _words(rows, tests, models), 1)
    return figure


def _widest(rows: pd.DataFrame, tests: Sequence[str]) -> list[str]:
    """Tests that were measured, in their order; of many those with the largest gaps."""
    base = rows[rows["model"] == "base"].groupby("test")["gap"].max()
    kept = set(base.sort_values(ascending=False, kind="stable").index[:MOST_TESTS])
    return [test for test in tests if test in kept]


def _models(rows: pd.DataFrame) -> list[str]:
    """Both models where they differ, else the base alone."""
    keys = ["joint", "coordinate", "test"]
    gaps = {model: rows[rows["model"] == model].set_index(keys)["gap"] for model in MODELS}
    base, other = gaps.values()
    same = other.empty or base.reindex(other.index).fillna(-1.0).equals(other.fillna(-1.0))
    return ["base"] if same else list(MODELS)


def _grid(n: int, across: int, models: int, joints: int) -> tuple[Figure, list[list[Axes]]]:
    down = -(-n // across)
    room = (TALLEST_MM - _KEY_MM) / down - _AROUND_MM
    row = min(_ROW_MM, max(_LEAST_ROW_MM, room / joints))
    figure = blank(down * (joints * row + _AROUND_MM) + _KEY_MM)
    axes = [list(line) for line in figure.subplots(down, models * across, squeeze=False)]
    spare = [axis for line in axes for axis in line][models * n :]
    for axis in spare:
        axis.set_visible(False)
    return figure, axes


def _room(panels: int, columns: int, joints: int) -> bool:
    """Whether a number can be read in each cell, so many panels side by side."""
    cell_mm = (WIDTH_MM - 7.0 * panels) / (panels * columns)
    return cell_mm >= _CELL_WITH_NUMBER_MM and joints * _ROW_WITH_NUMBER_MM <= TALLEST_MM / 2.0


def _square(rows: pd.DataFrame, value: str, joints: Sequence[str], columns: Sequence[str]) -> Array:
    """(J, C) of one of the table's values, cranial to caudal; NaN where there is none."""
    wide = rows.pivot_table(value, "joint", "coordinate", aggfunc="first")
    return wide.reindex(index=list(joints), columns=list(columns)).to_numpy(float)


def _label(
    axis: Axes, joints: Sequence[str], columns: Sequence[str], model: str, leftmost: bool
) -> None:
    name_cells(axis, [short(name, 10) for name in joints], [SHORT[c] for c in columns], True)
    axis.tick_params(labelleft=leftmost)
    axis.set_title(f" \n{model}", fontweight="normal", fontsize=6.5, linespacing=1.7)


def _heading(axis: Axes, place: int, test: str, across: int) -> None:
    """Letter and test above the pair of panels."""
    words = f"{chr(ord('a') + place)}   {short(capital(plain(test)), 96 // across)}"
    axis.annotate(words, (0.0, 1.0), (0.0, 13.0), xycoords="axes fraction", va="bottom",
                  textcoords="offset points", fontsize=7.5, fontweight="bold",
                  annotation_clip=False, in_layout=False)  # fmt: skip


def _words(rows: pd.DataFrame, tests: Sequence[str], models: Sequence[str]) -> str:
    every = rows["test"].nunique()
    told = ["White: noise may be all (its 95 % interval reaches 0); all specimens and steps"]
    if len(models) == 1:
        told.append("no effect was added, so there is one model")
    if every > len(tests):
        told.append(f"the {len(tests)} of {count(every, 'test')} with the largest gaps")
    largest = float(np.max(finite(rows["gap"])))
    told.append(f"largest gap {largest:.1f}")
    return "; ".join(told) + "."
