"""Figure: where model and measurement disagree, joint by coordinate, for each test.

Figure: measured less modelled motion along the load steps, where they disagree most.

Grids of numbers as colours, with the number in each cell where there is room.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from spinepipe.cohort import Cohort
from spinepipe.report.glyphs import Array, finite
from spinepipe.report.panels import explain_marks, head, head_line, lines_of, sections
from spinepipe.report.style import (
    BLACK,
    EMPTY,
    GREY,
    HATCH,
    INK,
    OURS,
    SMALL_PT,
    TALLEST_MM,
    THEIRS,
    WHITE,
    WIDTH_MM,
    blank,
    saying,
)
from spinepipe.report.words import AXIS, case, count, fixed, number, short, unit
from spinepipe.studies.discrepancy.figures.load_displacement import CLEARLY, LABELS, models_shown
from spinepipe.studies.discrepancy.settings import Discrepancy
from spinepipe.tables import StudyTables
from spinepipe.units import COORDINATES

MOST_PLACES, FEWEST_PLACES = 6, 3

PLACE = ["specimen", "test", "joint", "coordinate"]

LINES: dict[str, dict[str, Any]] = {
    "base": {"color": THEIRS, "ls": "--", "lw": 1.0, "marker": "s", "ms": 3.0, "mew": 0.0},
    "with_effects": {"color": OURS, "ls": "-", "lw": 1.2, "marker": "o", "ms": 2.6, "mew": 0.0},
    "with_table": {"color": BLACK, "ls": ":", "lw": 1.2, "marker": "d", "ms": 2.6, "mew": 0.0},
}
"""How each model is drawn."""

_PANEL_MM, _STEPS_KEY_MM = 50.0, 17.0
_BAND_SD = 1.96


def gap_by_step_figure(study: Discrepancy, cohort: Cohort, tables: StudyTables) -> Figure:
    """A panel for each of the places where the base model is farthest off."""
    gap = tables["gap"]
    places = worst_places(gap)
    if not places:
        return saying("No motion can be shown: the base model has no pose.")
    lines = models_shown(gap)
    (panels,), figure = sections([(len(places), _PANEL_MM)], _STEPS_KEY_MM)
    for index, (axis, place) in enumerate(zip(panels, places, strict=True)):
        rows = gap[(gap[PLACE] == list(place)).all(axis=1)].sort_values("step")
        _draw(axis, rows, lines)
        _label_steps(axis, index, place, len(cohort.specimen_names))
        _reach(axis, rows["measured"].to_numpy(float), unit(place[-1]))
    explain_marks(figure, _handles(lines), _words_of_steps(places, gap), 4)
    return figure


def worst_places(gap: pd.DataFrame) -> list[tuple[Any, ...]]:
    """Places of the largest residual of the base in noise SD, of like places the worst specimen."""
    rows = gap[gap["base"].notna() & (gap["noise_sd"] > 0.0)]
    squares = ((rows["measured"] - rows["base"]) / rows["noise_sd"]) ** 2
    size = squares.groupby([rows[key] for key in PLACE], sort=False).mean().rename("size")
    ordered = size.sort_values(ascending=False, kind="stable").reset_index()
    like = ordered.drop_duplicates(PLACE[1:]).head(MOST_PLACES).reset_index()
    like = like[(like.index < FEWEST_PLACES) | (like["size"] > CLEARLY**2)]
    return [tuple(row) for row in like[PLACE].itertuples(index=False)]


def _draw(axis: Axes, rows: pd.DataFrame, lines: Sequence[str]) -> None:
    x, measured = rows["step"].to_numpy(float), rows["measured"].to_numpy(float)
    band = _BAND_SD * rows["noise_sd"].to_numpy(float)
    axis.fill_between(x, -band, band, color=GREY, alpha=0.25, lw=0, zorder=1)
    axis.axhline(0.0, color=BLACK, lw=0.5, zorder=2)
    for name in lines:
        axis.plot(x, measured - rows[name].to_numpy(float), zorder=3, **LINES[name])
    axis.set_xlim(float(x.min()) - 0.3, float(x.max()) + 0.3)


def _label_steps(axis: Axes, index: int, place: tuple[Any, ...], specimens: int) -> None:
    specimen, test, joint, coordinate = place
    whose = f", {short(str(specimen), 14)}" if specimens > 1 else ""
    head(axis, index, f"{joint}{whose}\n{short(case(str(test)), 34)}")
    axis.set_ylabel(f"{AXIS[coordinate].lower()} ({unit(coordinate)})")
    axis.set_xlabel("load step")
    axis.xaxis.set_major_locator(MaxNLocator(6, integer=True))
    axis.tick_params(axis="y", length=2.5)


def _reach(axis: Axes, measured: np.ndarray, of: str) -> None:
    """How far the joint moved: the size of the motion that the difference is a part of."""
    ends = (number(float(end), 2) for end in (measured.min(), measured.max()))
    words = f"moved {' to '.join(ends)}{of if of == '°' else f' {of}'}"
    axis.text(
        0.02,
        1.0,
        words,
        transform=axis.transAxes,
        va="top",
        fontsize=SMALL_PT,
        color=INK[GREY],
        in_layout=False,
    )
    axis.margins(y=0.18)


def _handles(lines: Sequence[str]) -> list[Line2D | Patch]:
    handles: list[Line2D | Patch] = [
        Patch(facecolor=GREY, alpha=0.25, lw=0, label="noise of the mean of the cycles, 95 %"),
    ]
    return handles + [
        Line2D([], [], label=f"measured less {LABELS[name]}", **LINES[name]) for name in lines
    ]


def _words_of_steps(places: list[tuple[Any, ...]], gap: pd.DataFrame) -> str:
    rows = gap[(gap[PLACE] == list(places[0])).all(axis=1)]
    off = ((rows["measured"] - rows["base"]) / rows["noise_sd"]).to_numpy(float)
    worst = float(np.sqrt(np.nanmean(off**2)))
    return (
        "The places where the base model is farthest off, each in the specimen where it is worst; "
        f"in a the base is off by {number(worst, 2)} noise SD (root mean square)."
    )


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
    axis.add_patch(
        Rectangle(
            (-0.5, -0.5),
            grid.shape[1],
            grid.shape[0],
            hatch="//////",
            lw=0,
            facecolor="none",
            edgecolor=HATCH,
            zorder=0,
        )
    )
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
        axis.text(
            column,
            row,
            words,
            ha="center",
            va="center",
            fontsize=5.0,
            zorder=3,
            color=color,
            in_layout=False,
        )
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
