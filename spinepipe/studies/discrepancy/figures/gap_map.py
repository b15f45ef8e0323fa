"""Figure: where model and measurement disagree, joint by coordinate, for each test.

Its heat map, numbers as colours with the number in each cell where there is room, serves other
figures of the kind too.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.patches import Patch, Rectangle
from numpy.typing import NDArray

from spinepipe.cohort import Cohort
from spinepipe.report.glyphs import Array, finite
from spinepipe.report.panels import explain_marks, head_line, lines_of
from spinepipe.report.style import (
    BLACK,
    EMPTY,
    GREY,
    HATCH,
    TALLEST_MM,
    WHITE,
    WIDTH_MM,
    blank,
    saying,
)
from spinepipe.report.words import case, count, fixed, short
from spinepipe.studies.discrepancy.settings import Discrepancy
from spinepipe.tables import StudyTables
from spinepipe.units import COORDINATES

COLORS = LinearSegmentedColormap.from_list("gap", (WHITE, "#FEC44F", "#D95F0E", "#662506"))
"""From white to brown: it darkens steadily, for all kinds of eyes and for print."""

_EDGE = "#C4C4C4"
_DARK = 0.62


def draw_heat(
    axis: Axes,
    grid: Array,
    scale: Normalize,
    decimals: int | None,
    pale: NDArray[np.bool_] | None = None,
) -> AxesImage:
    """Cells of a grid (rows, columns), NaN hatched; no numbers where ``decimals`` is None.

    Parameters
    ----------
    pale : (rows, columns) cells that stay white, their numbers grey.
    """
    quiet = np.zeros(grid.shape, dtype=bool) if pale is None else pale
    axis.set_facecolor(EMPTY)
    hatched: dict[str, Any] = {"hatch": "//////", "facecolor": "none", "edgecolor": HATCH}
    axis.add_patch(Rectangle((-0.5, -0.5), grid.shape[1], grid.shape[0], lw=0, zorder=0, **hatched))
    image = axis.imshow(
        np.ma.masked_invalid(np.where(quiet, 0.0, grid)),
        cmap=COLORS,
        norm=scale,
        aspect="auto",
        zorder=1,
    )
    for row, column in np.argwhere(np.isfinite(grid)) if decimals is not None else ():
        value = grid[row, column]
        words = fixed(value, decimals or 0) if value else "0"
        color = GREY if quiet[row, column] else WHITE if scale(value) > _DARK else BLACK
        how: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": 5.0, "color": color}
        axis.text(column, row, words, zorder=3, in_layout=False, **how)
    for side in axis.spines.values():
        side.set(visible=True, color=_EDGE, linewidth=0.5)
    axis.tick_params(length=0.0, pad=2.0, labelsize=6.0)
    return image


def name_cells(axis: Axes, rows: Sequence[str], columns: Sequence[str], turned: bool) -> None:
    """Names of the rows and columns of a grid."""
    axis.set_yticks(range(len(rows)), list(rows))
    axis.set_xticks(range(len(columns)), list(columns))
    if turned:
        for label in axis.get_xticklabels():
            label.set(rotation=40.0, ha="right", rotation_mode="anchor")


def empty_cell(label: str) -> Patch:
    """The hatched cell as the key shows it."""
    return Patch(facecolor=EMPTY, edgecolor=HATCH, hatch="//////", lw=0, label=label)


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


def gap_map_figure(study: Discrepancy, cohort: Cohort, tables: StudyTables) -> Figure:
    """For each test the base model on the left, the model with the named effects on the right."""
    where = tables["where"]
    rows = where[where["by"] == "joint x coordinate x test"]
    if not len(finite(rows["gap"])):
        return saying("No gap can be shown: no model has a pose.")
    tests = _widest(rows, cohort.tests)
    columns = [name for name in COORDINATES if name in set(rows["coordinate"])]
    models = _models(rows)
    joints = cohort.joint_names[::-1]  # cranial to caudal
    across = min(len(tests), 3 if len(columns) <= _FEW_COORDINATES else 2)
    figure, axes = _grid(len(tests), across, len(models), len(joints))
    scale = Normalize(0.0, max(_LEAST_SCALE, float(finite(rows["gap"]).max())))

    # whether a number can be read in each cell, so many panels side by side
    panels = across * len(models)
    cell_mm = (WIDTH_MM - 7.0 * panels) / (panels * len(columns))
    low_enough = len(joints) * _ROW_WITH_NUMBER_MM <= TALLEST_MM / 2.0
    decimals = 1 if cell_mm >= _CELL_WITH_NUMBER_MM and low_enough else None

    for place, test in enumerate(tests):
        line, first = axes[place // across], len(models) * (place % across)
        for side, model in enumerate(models):
            axis = line[first + side]
            part = rows[(rows["test"] == test) & (rows["model"] == model)]
            grid, low = (_square(part, name, joints, columns) for name in ("gap", "gap_low"))
            image = draw_heat(axis, grid, scale, decimals, low <= 0.0)
            shown = [short(name, 10) for name in joints]
            name_cells(axis, shown, [SHORT[name] for name in columns], True)
            axis.tick_params(labelleft=side == 0)
            title = f" \n{MODELS[model]}"
            axis.set_title(title, fontweight="normal", fontsize=6.5, linespacing=1.7)
        head_line(line[first], place, short(case(test), 96 // across), 13.0)
    bar = figure.colorbar(
        image,
        ax=[axis for line in axes for axis in line],
        location="bottom",
        aspect=60,
        shrink=0.6,
        pad=0.02,
    )
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
    return figure, lines_of(figure, models * n, models * across)


def _square(rows: pd.DataFrame, value: str, joints: Sequence[str], columns: Sequence[str]) -> Array:
    """(J, C) of one of the table's values, cranial to caudal; NaN where there is none."""
    wide = rows.pivot_table(value, "joint", "coordinate", aggfunc="first")
    return wide.reindex(index=list(joints), columns=list(columns)).to_numpy(float)


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
