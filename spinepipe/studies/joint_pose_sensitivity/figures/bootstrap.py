"""Figure: how much fitted stiffness and errors hang on start values, damping and loading."""

from collections.abc import Mapping, Sequence
from itertools import compress, product
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from spinepipe.cohort import Cohort
from spinepipe.report.glyphs import STRIP_KEY, draw_strip, finite, rounded
from spinepipe.report.panels import (
    EVERY_JOINT,
    MOST_ACROSS,
    MOST_ROWS,
    PanelRows,
    explain,
    head,
    label_rows,
    log_ticks,
    mark_start,
    sections,
)
from spinepipe.report.style import BLACK, GREY, OURS, TALLEST_MM, THEIRS, note, saying
from spinepipe.report.words import AXIS, count, number, stiffness_unit, unit
from spinepipe.status import USABLE
from spinepipe.studies.joint_pose_sensitivity.gould_2024a import GOULD_2024A
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.studies.joint_pose_sensitivity.tables import LOADINGS
from spinepipe.units import COORDINATE_COLUMNS, COORDINATES, STIFFNESS_COLUMNS, TRANSLATIONS

_RANGE_OF = "quasi_static"
"""The loading whose ranges of stiffness are published."""

STIFFNESS = dict(zip(COORDINATES, STIFFNESS_COLUMNS, strict=True))
ERROR = {name: f"{name}_error_{'mm' if name in TRANSLATIONS else 'deg'}" for name in COORDINATES}
"""Columns of each coordinate."""

SAMPLED = {"start": "start", "damping": "damping"}
"""What is sampled, as printed; the first stands on top."""

LOADING_NAMES = {
    "equilibrium": "at rest",
    "quasi_static": "quasi-static",
    "dynamic": "dynamic",
}

FIT = ["specimen", "bootstrap", "loading", "set"]
"""What one fit is known by."""

MOST_ROWS_WITH_WORDS = 14
_ROW_MM, _NARROW_MM, _AROUND_MM, _KEY_MM = 9.0, 3.2, 15.0, 16.0
_MOST_ACROSS, _FEW_TICKS, _TICK_PT = 4, 3, 5.5
_LEAST_SPREAD = 1.05
"""An axis shows at least 5 % to either side: smaller spreads are to look small."""

_LEAST_DIFFERENCE = 0.05
"""So do differences of errors, mm or degrees."""


def bootstrap_figure(
    study: JointPoseSensitivity, cohort: Cohort, tables: Mapping[str, pd.DataFrame]
) -> Figure:
    """Upper panels: fitted stiffness; lower panels: errors; every fit a dot."""
    fits = tables["bootstrap"]
    solved = fits[fits["status"].isin(USABLE)]
    tried, found = (len(frame[FIT].drop_duplicates()) for frame in (fits, solved))
    if not found:
        return saying(f"No stiffness was found in any of {count(tried, 'bootstrap fit')}.")
    free: list[str] = [name for name in COORDINATES if name in study.calibration.free]
    measured = [name for name in COORDINATES if solved[ERROR[name]].notna().any()]
    columns = [STIFFNESS[name] for name in free] + [ERROR[name] for name in measured]
    shared = study.calibration.grouping == "per_specimen"
    joints = (EVERY_JOINT,) if shared else cohort.joint_names
    # how many narrow rows a panel may have for all lines of panels to fit on the page
    lines = sum(-(-n // _MOST_ACROSS) for n in (len(free), len(measured)))
    most = int(((TALLEST_MM - _KEY_MM) / lines - _AROUND_MM) / _NARROW_MM)
    upper, pooled = bootstrap_rows(solved, columns, cohort.specimen_names, joints, most)
    errors = solved[[ERROR[name] for name in measured]].notna().any(axis=1)
    moving = [name for name in cohort.joint_names if (errors & solved["joint"].eq(name)).any()]
    lower, relative = bootstrap_rows(solved, columns, cohort.specimen_names, moving, most)
    # words stand beside rows only where the page does not become too tall by them
    tall = sum(
        -(-n // MOST_ACROSS) * _height(rows, MOST_ROWS_WITH_WORDS)
        for n, rows in ((len(free), upper), (len(measured), lower))
    )
    room = MOST_ROWS_WITH_WORDS if tall + _KEY_MM <= TALLEST_MM else 0
    parts = [(len(free), _height(upper, room)), (len(measured), _height(lower, room))]
    across = MOST_ACROSS if room else _MOST_ACROSS
    (above, *others), figure = sections([part for part in parts if part[0]], _KEY_MM, across)
    below = others[0] if others else []
    for index, (name, axis) in enumerate(zip(free, above, strict=True)):
        head(axis, index, AXIS[name])
        _draw_stiffness(name, axis, upper, study, pooled)
        if len(upper) <= room:
            _tell(axis, upper, STIFFNESS[name], pooled)
            for y, frame in enumerate(upper.frames):
                _write_range(axis, cohort.name, name, frame, y - 0.36)
    for index, (name, axis) in enumerate(zip(measured, below, strict=True)):
        head(axis, len(free) + index, AXIS[name])
        _draw_errors(name, axis, lower, relative, cohort.name)
        if len(lower) <= room:
            _tell(axis, lower, ERROR[name], relative)
    bars = {OURS: "fits in the cohort's own joint poses"}
    paper = GOULD_2024A.beside(cohort.name)
    if paper:
        bars[THEIRS] = f"{paper[0]}, median and range"
    explain(
        figure,
        bars,
        _words(tried, found, upper),
        dashed="" if pooled else "start of the other fits",
    )
    return figure


def _height(rows: PanelRows, room: int) -> float:
    return len(rows) * (_ROW_MM if len(rows) <= room else _NARROW_MM) + _AROUND_MM


def bootstrap_rows(
    solved: pd.DataFrame,
    columns: Sequence[str],
    specimens: Sequence[str],
    joints: Sequence[str],
    most: int = MOST_ROWS,
) -> tuple[PanelRows, bool]:
    """Rows from the bottom up, and whether more than ``most`` of them were pooled.

    Where they were, each specimen and joint is taken relative to its own median: ``columns`` are
    then shares of it for stiffness, and differences from it for errors.
    """
    keys = list(product(SAMPLED, LOADINGS, specimens, reversed(joints)))
    parts = [(key, part) for key in keys if len(part := _part(solved, *key))]
    if len(parts) <= most:
        told = (True, True, len(specimens) > 1, len(joints) > 1)  # what tells rows apart
        labels = [
            ", ".join(compress((SAMPLED[sampled], LOADING_NAMES[loading], *place), told))
            for (sampled, loading, *place), _ in reversed(parts)
        ]
        return PanelRows(tuple(labels), tuple(part for _, part in reversed(parts)), ""), False
    shares = []  # of the own median; errors, which may be zero, less it
    for _, part in parts:
        moved = part.copy()
        for name in columns:
            middle = part[name].median()
            moved[name] = part[name] - middle if "_error_" in name else part[name] / middle
        shares.append(moved)
    relative = pd.concat(shares)
    groups = [
        ((sampled, loading), part)
        for sampled, loading in reversed(list(product(SAMPLED, LOADINGS)))
        if len(part := relative.query("bootstrap == @sampled and loading == @loading"))
    ]
    labels = [f"{SAMPLED[sampled]}, {LOADING_NAMES[loading]}" for (sampled, loading), _ in groups]
    return PanelRows(
        tuple(labels), tuple(part for _, part in groups), "specimens and joints pooled"
    ), True


def _part(
    solved: pd.DataFrame, sampled: str, loading: str, specimen: str, joint: str
) -> pd.DataFrame:
    chosen = solved["bootstrap"].eq(sampled) & solved["loading"].eq(loading)
    chosen &= solved["specimen"].eq(specimen)
    if joint == EVERY_JOINT:  # the stiffness is the same in the rows of all joints
        return solved[chosen].drop_duplicates(FIT)
    return solved[chosen & solved["joint"].eq(joint)]


def _draw_stiffness(
    name: str, axis: Axes, rows: PanelRows, study: JointPoseSensitivity, relative: bool
) -> None:
    index = COORDINATES.index(name)
    box = study.start_bootstrap
    ends = (box.lowest.in_order()[index], box.highest.in_order()[index])
    axis.set_xscale("log")
    if not relative:
        mark_start(axis, study.stiffness.in_order()[index])
    samples = [finite(frame[STIFFNESS[name]]) for frame in rows.frames]
    for y, (frame, values) in enumerate(zip(rows.frames, samples, strict=True)):
        start = frame["bootstrap"].iloc[0] == "start"
        if start and not relative:
            axis.plot(ends, [y, y], color=GREY, lw=7.0, alpha=0.2, solid_capstyle="butt", zorder=1)
        draw_strip(axis, values, y, OURS)
    found = np.concatenate([*samples, *([] if relative else [np.array(ends)])])
    low, high = found.min() / _LEAST_SPREAD, found.max() * _LEAST_SPREAD
    axis.set_xlim(low, high)
    log_ticks(axis.xaxis, low, high, _FEW_TICKS)
    axis.tick_params(axis="x", labelsize=_TICK_PT)
    label_rows(axis, rows, below=0.5, above=0.75)
    axis.set_xlabel("share of own median" if relative else f"stiffness ({stiffness_unit(name)})")


def _draw_errors(name: str, axis: Axes, rows: PanelRows, relative: bool, cohort: str) -> None:
    axis.xaxis.set_major_locator(MaxNLocator(_FEW_TICKS))
    for y, frame in enumerate(rows.frames):
        values = rounded(finite(frame[ERROR[name]]))
        if not len(values):
            continue
        draw_strip(axis, values, y, OURS)
        if not relative:
            draw_paper(axis, cohort, name, frame, y - 0.32)
    if not relative:
        axis.set_xlim(0.0, max(1.05 * axis.get_xlim()[1], 0.1))
    else:
        low, high = axis.get_xlim()
        axis.set_xlim(min(low, -_LEAST_DIFFERENCE), max(high, _LEAST_DIFFERENCE))
    label_rows(axis, rows, below=0.6, above=0.75)
    what = "error less own median" if relative else "absolute error"
    axis.set_xlabel(f"{what} ({unit(name)})")


def draw_paper(axis: Axes, cohort: str, name: str, row: pd.DataFrame, y: float) -> None:
    """Median of an error with its range around it (no ends are printed), where it is published."""
    sampled, loading, joint = (row[key].iloc[0] for key in ("bootstrap", "loading", "joint"))
    column = COORDINATE_COLUMNS[COORDINATES.index(name)]
    table = _paper(cohort).get(f"{sampled}_bootstrap_error", {})
    found = table.get(loading, {}).get(joint, {})
    median, width = (found.get(what, {}).get(column) for what in ("median", "range"))
    if median is None or width is None:
        return
    low = max(0.0, median - width / 2.0)  # an error is not negative
    axis.plot([low, low + width], [y, y], color=THEIRS, lw=0.8, zorder=4)
    axis.plot([median], [y], "|", color=BLACK, ms=5.0, mew=1.0, zorder=5)
    axis.plot([median], [y], "D", color=THEIRS, ms=2.6, mew=0.0, zorder=4)


def _write_range(axis: Axes, cohort: str, name: str, row: pd.DataFrame, y: float) -> None:
    """Width of the range of a stiffness, where it is published (its place is not)."""
    column = STIFFNESS_COLUMNS[COORDINATES.index(name)]
    table = _paper(cohort).get("bootstrap_stiffness_range", {})
    width = table.get(row["bootstrap"].iloc[0], {}).get(column)
    if width is not None and row["loading"].iloc[0] == _RANGE_OF:
        note(axis, 0.02, y, f"range {number(width, 2)}", THEIRS)


def _tell(axis: Axes, rows: PanelRows, column: str, relative: bool) -> None:
    """Median, width of the range and n of each row; a relative median says nothing."""
    for y, frame in enumerate(rows.frames):
        values = rounded(finite(frame[column]))
        if len(values):
            width = f"range {number(float(values.max() - values.min()), 2)}, n = {len(values)}"
            words = width if relative else f"{number(float(np.median(values)))}, {width}"
            note(axis, 0.02, y + 0.4, words, OURS)


def _paper(cohort: str) -> Mapping[str, Any]:
    """Numbers of the paper that the cohort was rebuilt from, empty where there is none."""
    found = GOULD_2024A.beside(cohort)
    return {} if found is None else found[1]


def _words(tried: int, found: int, rows: PanelRows) -> str:
    solved = f"{count(found, 'fit')} of {tried} with a stiffness"
    grey = "" if rows.note else "grey: where start values were drawn"
    return "; ".join(part for part in (solved, rows.note, STRIP_KEY, grey) if part) + "."
