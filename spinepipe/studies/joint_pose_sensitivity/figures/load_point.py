"""Figure: what the fitted stiffness and the cost make of another load point."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from spinepipe.cohort import Cohort
from spinepipe.report.panels import across_of, explain, head, side_by_side
from spinepipe.report.style import GREY, INK, OURS, THEIRS, blank, saying
from spinepipe.report.words import AXIS, count, fixed, stiffness_unit, tick
from spinepipe.status import USABLE
from spinepipe.studies.joint_pose_sensitivity.gould_2024a import GOULD_2024A, stiffness_quartiles
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.units import COORDINATES, STIFFNESS_COLUMNS

WAYS = {"superior": "superior_shift_mm", "anterior": "anterior_shift_mm"}

_PANEL_MM, _KEY_MM = 56.0, 16.0
_HIGHEST = 3.0
"""Times the largest stiffness to which an axis goes: regions may end far above it."""

_APART = 0.06
"""Share of the axis' height below which labels would lie on each other."""

_DASHES: tuple[Any, ...] = ((0, (5, 1.5)), (0, (3, 1.5)), (0, (1.5, 1.2)), (0, (4, 1, 1, 1)))


def load_point_figure(
    study: JointPoseSensitivity, cohort: Cohort, tables: Mapping[str, pd.DataFrame]
) -> Figure:
    """A panel for each fitted coordinate, and one for the cost."""
    tried = tables["stiffness_over_load_point"]
    solved = tried[tried["status"].isin(USABLE)]
    if solved.empty:
        points = count(len(tried), "load point")
        return saying(f"No stiffness was found with the load at any of {points}.")
    fitted = set(tables["load_point_effect"]["coordinate"])
    names = [name for name in COORDINATES if name in fitted]
    along = max(WAYS, key=lambda way: tried[WAYS[way]].nunique())
    across = next(way for way in WAYS if way != along)
    alone = len(solved[["specimen", "joint"]].drop_duplicates()) == 1
    n = len(names) + 1
    wide = across_of(n)
    figure = blank(-(-n // wide) * _PANEL_MM + _KEY_MM)
    axes = side_by_side(figure, n, wide)
    for index, (name, axis) in enumerate(zip(names, axes, strict=False)):
        head(axis, index, AXIS[name])
        column = STIFFNESS_COLUMNS[COORDINATES.index(name)]
        if alone:
            _region(axis, solved, name, column, (along, across))
        _lines(axis, solved, column, (along, across), alone)
        axis.set_ylabel(f"stiffness ({stiffness_unit(name)})")
        published = stiffness_quartiles(cohort.name, column)
        if published:
            low, middle, high = published
            axis.axhspan(low, high, color=THEIRS, alpha=0.18, lw=0, zorder=1)
            axis.axhline(middle, color=THEIRS, lw=1.0, zorder=2)
    head(axes[-1], n - 1, "Cost")
    relative = _relative_cost(solved)
    _lines(axes[-1], relative, "relative", (along, across), alone)
    axes[-1].set_ylabel("cost over that of the study's point")
    for axis in axes:
        axis.set_xlabel(f"load point moved {along} (mm)")
        axis.axvline(0.0, color=GREY, lw=0.6, ls=":", zorder=1)
    bars = {OURS: f"not moved {across}"}
    paper = GOULD_2024A.beside(cohort.name)
    if paper:
        bars[THEIRS] = f"{paper[0]}: median and IQR"
    explain(figure, bars, _words(tables["load_point_effect"], across, alone))
    return figure


def _lines(axis: Axes, rows: pd.DataFrame, column: str, ways: tuple[str, str], alone: bool) -> None:
    """Lines over one shift: of every other shift, or of every specimen and joint."""
    along, across = (WAYS[way] for way in ways)
    if not alone:
        here = rows[rows[across] == 0.0]
        for _, part in here.groupby(["specimen", "joint"], sort=False):
            part = part.sort_values(along)
            axis.plot(part[along], part[column], color=OURS, lw=0.7, alpha=0.6)
        return
    shifts = sorted(rows[across].unique())
    others = [shift for shift in shifts if shift != 0.0]
    for shift in shifts:
        part = rows[rows[across] == shift].sort_values(along)
        stated = shift == 0.0
        axis.plot(
            part[along],
            part[column],
            color=OURS if stated else GREY,
            lw=1.4 if stated else 0.8,
            ls="-" if stated else _DASHES[others.index(shift) % len(_DASHES)],
            marker="o" if stated else "",
            ms=2.5,
            zorder=4 if stated else 3,
        )
    _labels(axis, rows, column, (along, across))


def _labels(axis: Axes, rows: pd.DataFrame, column: str, ways: tuple[str, str]) -> None:
    """The outermost shifts and 0 at the ends of their lines; one word where all lines are one."""
    along, across = ways
    ends = rows.sort_values(along).groupby(across).tail(1).sort_values(across)
    low, high = axis.get_ylim()
    if float(np.ptp(ends[column])) < _APART * (high - low):
        _label(axis, ends.iloc[-1], column, along, "all")
        return
    for _, row in ends.iterrows():
        if row[across] in (0.0, ends[across].min(), ends[across].max()):
            sign = "+" if row[across] > 0.0 else ""
            _label(axis, row, column, along, f"{sign}{tick(row[across])}")


def _label(axis: Axes, last: pd.Series, column: str, along: str, words: str) -> None:
    axis.annotate(
        words,
        (last[along], last[column]),
        (3, 0),
        textcoords="offset points",
        va="center",
        fontsize=6.0,
        color=INK[OURS] if words in ("0", "all") else INK[GREY],
        annotation_clip=False,
    )


def _region(axis: Axes, rows: pd.DataFrame, name: str, column: str, ways: tuple[str, str]) -> None:
    """Band of the fits' 95 % regions where the other shift is 0; to the axis' end where open."""
    along, across = (WAYS[way] for way in ways)
    part = rows[rows[across] == 0.0].sort_values(along)
    unit = column.removeprefix(f"{name}_")
    top = _HIGHEST * float(rows[column].max())
    low = part[f"{name}_low_{unit}"].fillna(0.0)
    high = part[f"{name}_high_{unit}"].fillna(np.inf)
    axis.fill_between(part[along], low, np.minimum(high, top), color=OURS, alpha=0.13, lw=0)
    axis.set_ylim(0.0, min(top, 1.05 * max(float(high.max()), float(rows[column].max()))))


def _relative_cost(solved: pd.DataFrame) -> pd.DataFrame:
    """Rows with the cost over that of the same specimen at the study's own point."""
    own = solved[(solved[list(WAYS.values())] == 0.0).all(axis=1)]
    stated = own.drop_duplicates("specimen").set_index("specimen")["cost"]
    relative = solved["cost"] / solved["specimen"].map(stated)
    found = solved.assign(relative=relative).drop_duplicates(["specimen", *WAYS.values()])
    return found.assign(joint="*")


def _words(effect: pd.DataFrame, across: str, alone: bool) -> str:
    points = count(int(effect["points"].max()), "load point")
    lines = f"beside the lines: mm moved {across}" if alone else "a line per specimen and joint"
    band = "band: 95 % region of the fit, to the top where open" if alone else ""
    told = effect.dropna(subset=["allowed"])
    all_of = bool((told["allowed"] == told["fitted"]).all()) and len(told) > 0
    told_apart = "no point is excluded by the readings" if all_of else ""
    costs = (
        f"cost {fixed(effect['cost_lowest'].min())} to {fixed(effect['cost_highest'].max())} "
        "times that of the study's point"
        if effect["cost_lowest"].notna().any()
        else ""
    )
    return "; ".join(one for one in (points, lines, band, costs, told_apart) if one) + "."
