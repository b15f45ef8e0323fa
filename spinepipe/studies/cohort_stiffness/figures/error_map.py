"""Figure: signed error at the largest load, specimen by level, for each load case and stage."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.patches import Patch, Rectangle

from spinepipe.cohort import Cohort
from spinepipe.report.glyphs import Array, finite
from spinepipe.report.panels import explain_marks, head_line, lines_of
from spinepipe.report.style import BLACK, EMPTY, HATCH, TALLEST_MM, WHITE, WIDTH_MM, blank, saying
from spinepipe.report.words import POSITIVE, SIGNS, after_number, case, count, fixed, short
from spinepipe.studies.cohort_stiffness.representations import (
    ASKED_FOR,
    IN_WORDS,
    OF_JOINTS,
    POOLED,
    PUBLISHED,
    SHARED,
)
from spinepipe.studies.cohort_stiffness.settings import NOTHING, CohortStiffness
from spinepipe.studies.cohort_stiffness.stages import compared_motion, joint_label_of, unit_of

MANY_SPECIMENS = 16
"""With more of them only three stages have room."""

_BY_WHOM = {
    "literature": "",
    "fitted": ", fitted to this specimen",
    "left_out_specimen": ", from the other specimens",
}
_FEW = (
    (PUBLISHED[0], "literature"),
    (OF_JOINTS[0], "fitted"),
    (POOLED[0], "left_out_specimen"),
)
_ALL = (
    _FEW[0],
    (SHARED[0], "fitted"),
    _FEW[1],
    (OF_JOINTS[0], "left_out_specimen"),
    _FEW[2],
)
_INSTEAD = tuple(sorted((*OF_JOINTS[::-1], *SHARED), key=ASKED_FOR.__contains__))


@dataclass(frozen=True, eq=False)
class PanelLine:
    """One line of panels: what it is called and its rows of the table ``errors``."""

    title: str
    rows: pd.DataFrame


def stages(loaded: pd.DataFrame, specimens: int) -> list[PanelLine]:
    """Stages that the study has, from published to predicted; another where one is absent.

    Parameters
    ----------
    loaded : rows of ``errors`` in the loaded coordinate, at least one.
    """
    label = joint_label_of(loaded)
    chosen = loaded[loaded["fitted_to"].isin([label, NOTHING])]
    wanted = list(_FEW if specimens > MANY_SPECIMENS else _ALL)
    for stage in ("fitted", "left_out_specimen"):
        there = set(chosen.loc[chosen["stage"] == stage, "representation"])
        if not any(name in there and at == stage for name, at in wanted):
            wanted += [(name, stage) for name in _INSTEAD if name in there][:1]
    return [
        PanelLine(words[:1].upper() + words[1:], rows)
        for name, stage in wanted
        for words in [f"{IN_WORDS[name]}{_BY_WHOM[stage]}"]
        if len(rows := chosen[(chosen["representation"] == name) & (chosen["stage"] == stage)])
    ]


COLORS = "PuOr_r"
"""Purple to orange over white: colour-blind readers tell its ends apart."""

_MISSING: dict[str, Any] = {"hatch": "//////", "lw": 0, "edgecolor": HATCH}
"""What stands behind cells without a number."""

_FRAME: dict[str, Any] = {"edgecolor": BLACK, "lw": 1.3, "clip_on": False}
"""Of a place whose measured motion goes against the load."""

MOST_CASES = 6
_ROW_MM, _LEAST_ROW_MM, _HEAD_MM, _KEY_MM, _NAMES_MM = 4.6, 1.0, 8.0, 34.0, 14.0
_CELL_WITH_NUMBER_MM, _LINE_MM = 6.4, 2.6
_LABEL_MM, _LETTERS, _NAME = 2.7, 135, 14
_FAR = 2.0
"""Where the largest error is more than this times the 95th percentile, the scale ends there."""


def error_map_figure(
    study: CohortStiffness, cohort: Cohort, tables: Mapping[str, pd.DataFrame]
) -> Figure:
    """A column of panels per load case, a line of panels per stage."""
    errors, signs = tables["errors"], tables["sign_checks"]
    loaded = errors[errors["loaded"].astype(bool)] if len(errors) else errors
    loaded = compared_motion(loaded) if len(loaded) else loaded  # one unit, one scale
    cases = list(dict.fromkeys(loaded["test"])) if len(loaded) else []
    found = stages(loaded, len(cohort.specimen_names)) if cases else []
    values = finite(loaded["peak_error"]) if cases else np.array([])
    if not found or not len(values):
        total = count(len(errors), "row")
        return saying(f"No error in a loaded direction can be shown: none of {total} has one.")
    lines, across = len(found), min(len(cases), MOST_CASES)
    rows_mm = len(cohort.specimen_names) * _line_mm(cohort, lines)
    figure = blank(lines * (rows_mm + _HEAD_MM) + _NAMES_MM + _KEY_MM)
    axes = lines_of(figure, lines * across, across)
    # A number is written in each cell where it can be read.
    broad = _cell_mm(cohort, across) >= _CELL_WITH_NUMBER_MM
    numbers = broad and _line_mm(cohort, lines) >= _LINE_MM
    image = None
    scale = _scale(found)
    flipped = (
        signs[signs["verdict"] == "flipped"] if len(signs) else signs.assign(test=[], joint=[])
    )
    for line, stage in enumerate(found):
        for column, test in enumerate(cases[:MOST_CASES]):
            axis = axes[line][column]
            # (S, J) errors, NaN where there is none; levels from cranial to caudal
            here = stage.rows[stage.rows["test"] == test]
            wide = here.pivot_table("peak_error", "specimen", "joint", aggfunc="first")
            wide = wide.reindex(index=cohort.specimen_names, columns=cohort.joint_names[::-1])
            grid = wide.to_numpy(float)
            image = _draw(axis, grid, scale, numbers)
            # A frame around each place whose measured motion goes against the load.
            for row in flipped[flipped["test"] == test].to_dict("records"):
                x = cohort.joint_names[::-1].index(row["joint"]) - 0.5
                y = cohort.specimen_names.index(row["specimen"]) - 0.5
                axis.add_patch(Rectangle((x, y), 1.0, 1.0, **_FRAME, fill=False, zorder=4))
            _label(axis, cohort, line == len(found) - 1, column == 0)
            words = _over(test, loaded, len(axes[0])) if line == 0 else ""
            axis.set_title(
                f" \n{words}" if words else " ", fontweight="normal", fontsize=6.5, linespacing=1.7
            )
        head_line(axes[line][0], line, stage.title, 12.5 if line == 0 else 3.5)
    assert image is not None
    _explain(figure, axes, image, scale, found, bool(len(flipped)))
    return figure


def _line_mm(cohort: Cohort, lines: int) -> float:
    """Height of a specimen's row so that all lines of panels fit on a page."""
    left = TALLEST_MM - _KEY_MM - _NAMES_MM - lines * _HEAD_MM
    return min(_ROW_MM, max(_LEAST_ROW_MM, left / (lines * len(cohort.specimen_names))))


def _cell_mm(cohort: Cohort, across: int) -> float:
    names = max(len(short(name, _NAME)) for name in cohort.specimen_names)
    return (WIDTH_MM - 6.0 - 1.3 * names - 5.0 * across) / (across * len(cohort.joint_names))


def _scale(found: Sequence[PanelLine]) -> Normalize:
    """Symmetric around zero; an end that few errors reach is drawn in."""
    sizes = [np.abs(finite(stage.rows["peak_error"])) for stage in found]
    known = [values for values in sizes if len(values)]
    end = max(float(values.max()) for values in known)
    most = max(float(np.percentile(values, 95.0)) for values in known)
    end = most if end > _FAR * most > 0.0 else end
    return Normalize(-end, end) if end > 0.0 else Normalize(-1.0, 1.0)


def _draw(axis: Axes, grid: Array, scale: Normalize, numbers: bool) -> AxesImage:
    axis.set_facecolor(EMPTY)
    axis.add_patch(
        Rectangle((-0.5, -0.5), *grid.shape[::-1], **_MISSING, facecolor="none", zorder=0)
    )
    shown = np.ma.masked_invalid(grid)
    image = axis.imshow(shown, cmap=COLORS, norm=scale, aspect="auto", zorder=1)
    for row, column in np.argwhere(np.isfinite(grid)) if numbers else ():
        value = grid[row, column]
        dark = abs(scale(value) - 0.5) > 0.31
        axis.text(
            column,
            row,
            fixed(value, 1),
            ha="center",
            va="center",
            fontsize=5.0,
            color=WHITE if dark else BLACK,
            zorder=3,
            in_layout=False,
        )
    for side in axis.spines.values():
        side.set_visible(False)
    return image


def _label(axis: Axes, cohort: Cohort, lowest: bool, leftmost: bool) -> None:
    levels, names = cohort.joint_names[::-1], cohort.specimen_names
    height = axis.get_figure().get_figheight() * 25.4  # type: ignore[union-attr]
    grid = axis.get_gridspec()
    assert grid is not None
    row_mm = (height - _KEY_MM - _NAMES_MM - grid.nrows * _HEAD_MM) / (grid.nrows * len(names))
    # Of many specimens only every so many have a name.
    every = max(1, int(np.ceil(_LABEL_MM / row_mm)))
    axis.set_yticks(range(0, len(names), every), [short(name, _NAME) for name in names[::every]])
    turned = max(len(name) for name in levels) * 1.25 + 1.0 > _cell_mm(cohort, grid.ncols)
    axis.set_xticks(
        range(len(levels)), [short(name, _NAME) for name in levels], rotation=90 if turned else 0
    )
    axis.tick_params(length=0.0, labelleft=leftmost, labelbottom=lowest, pad=2.0, labelsize=6.0)


def _over(test: str, loaded: pd.DataFrame, across: int) -> str:
    """Load case, and what a positive motion in it is where there is room."""
    driven = loaded.loc[loaded["test"] == test, "coordinate"].unique()
    direction = f" (+ is {POSITIVE[driven[0]]})" if len(driven) == 1 else ""
    room = _LETTERS // across
    words = short(case(test), room)
    return words + direction if len(words) + len(direction) <= room else words


def _explain(
    figure: Figure,
    axes: Sequence[Sequence[Axes]],
    image: AxesImage,
    scale: Normalize,
    found: Sequence[PanelLine],
    flipped: bool,
) -> None:
    sizes = np.abs(np.concatenate([finite(stage.rows["peak_error"]) for stage in found]))
    unit = unit_of(found[0].rows)
    beyond = float(sizes.max()) > float(scale.vmax or 0.0) * (1.0 + 1e-9)
    bar = figure.colorbar(
        image,
        ax=[panel for line in axes for panel in line],
        pad=0.012,
        location="bottom",
        aspect=60,
        shrink=0.6,
        extend="both" if beyond else "neither",
    )
    told = "predicted less measured motion at the largest load, loaded direction"
    bar.set_label(f"{told} ({SIGNS[unit]})")
    bar.outline.set_linewidth(0.4)
    handles = [Patch(facecolor=EMPTY, **_MISSING, label="not measured, or no result")]
    if flipped:
        label = "measured motion goes against the load: sign flipped?"
        handles.append(Patch(facecolor=WHITE, **_FRAME, label=label))
    cases = found[0].rows["test"].nunique()
    largest = f"{fixed(float(sizes.max()), 1)}{after_number(unit)}"
    words = [
        "Predicted less measured, + and − of the coordinate as above the panels",
        f"largest error {largest}" + ", beyond the scale" * beyond,
        f"the first {MOST_CASES} of {cases} load cases" if cases > MOST_CASES else "",
    ]
    explain_marks(figure, handles, "; ".join(word for word in words if word) + ".", len(handles))
