"""Figure: what errors hang on, joint pose or stiffness, by variance shares and by a tree."""

from collections.abc import Mapping

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from spinepipe.cohort import Cohort
from spinepipe.report.intervals import draw_interval
from spinepipe.report.layout import explain, head, label_rows
from spinepipe.report.rows import Rows, rows_of
from spinepipe.report.sections import sections
from spinepipe.report.style import BEST, GREY, OURS, note, saying
from spinepipe.report.words import AXIS, fixed, percent
from spinepipe.studies import JointPoseSensitivity
from spinepipe.units import COORDINATES

COLORS = {"pose": OURS, "stiffness": BEST, "interaction": GREY}
_OFFSETS = {"pose": 0.24, "stiffness": 0.0, "interaction": -0.24}
_ROW_MM, _NARROW_MM, _AROUND_MM, _KEY_MM = 13.0, 4.6, 14.0, 16.0
_ENDS = (-2.0, 102.0)
"""Ends of the axis, %."""

_TREE = ["specimen", "joint", "coordinate"]


def pose_against_stiffness_figure(
    study: JointPoseSensitivity, cohort: Cohort, tables: Mapping[str, pd.DataFrame]
) -> Figure:
    """Per coordinate a panel of variance shares and, below it, one of the tree's importance."""
    shares = _done(tables["variance_shares"])
    trees = importance_by_factor(tables["importance"])
    if shares.empty and trees.empty:
        return saying("Pose and stiffness cannot be compared: no error varies over the grid.")
    known = pd.concat([shares, trees], ignore_index=True)
    names = [name for name in COORDINATES if name in set(known["coordinate"])]
    upper, lower = (
        rows_of(frame, cohort.specimen_names, cohort.joint_names) for frame in (shares, trees)
    )
    parts = [(rows, what) for rows, what in ((upper, "variance"), (lower, "tree")) if len(rows)]
    panels, figure = sections([(len(names), _height(rows)) for rows, _ in parts], _KEY_MM)
    for (rows, what), axes in zip(parts, panels, strict=True):
        for name, axis in zip(names, axes, strict=True):
            head(axis, figure.axes.index(axis), f"{AXIS[name]} error: {what}")
            _draw(axis, rows, name, what)
    bars = {COLORS["pose"]: "joint pose", COLORS["stiffness"]: "stiffness set"}
    explain(figure, bars | {COLORS["interaction"]: "interaction"}, _words(tables, upper))
    return figure


def importance_by_factor(importance: pd.DataFrame) -> pd.DataFrame:
    """Importance of a tree summed over the predictors of each factor; r2, leaves and n with it."""
    done = _done(importance)
    keys = [*_TREE, "factor"]
    return done.groupby(keys, sort=False, as_index=False).agg(
        importance=("importance", "sum"),
        predictors=("predictor", "count"),
        r2=("r2", "first"),
        leaves=("leaves", "first"),
        n=("n", "first"),
    )


def _done(table: pd.DataFrame) -> pd.DataFrame:
    return table[table["status"] == "done"]


def _height(rows: Rows) -> float:
    return len(rows) * (_ROW_MM if rows.with_numbers else _NARROW_MM) + _AROUND_MM


def _draw(axis: Axes, rows: Rows, name: str, what: str) -> None:
    for y, frame in enumerate(rows.frames):
        here = frame[frame["coordinate"] == name]
        if what == "variance":
            _draw_shares(axis, y, here, rows)
        else:
            _draw_tree(axis, y, here, rows)
    label_rows(axis, rows, below=0.5, above=0.6)
    axis.set_xlim(*_ENDS)
    label = "share of the variance (%)" if what == "variance" else "share of importance (%)"
    axis.set_xlabel(label)


def _draw_shares(axis: Axes, y: int, here: pd.DataFrame, rows: Rows) -> None:
    crowded = here["factor"].duplicated().any()
    for _, row in here.iterrows():
        color, at = COLORS[row["factor"]], y + _OFFSETS[row["factor"]]
        ends = (100.0 * row["share_low"], 100.0 * row["share_high"])
        draw_interval(axis, 100.0 * row["share"], ends, at, color, crowded=bool(crowded))
        if rows.with_numbers and not crowded:
            _tell_share(axis, at, row, color)


def _tell_share(axis: Axes, at: float, row: pd.Series, color: str) -> None:
    """The share as a number, on the side of its interval that has more room."""
    if row["share_high"] < 0.85:
        x, side, lift = row["share_high"] + 0.03, "left", 0.0
    elif row["share_low"] > 0.15:
        x, side, lift = row["share_low"] - 0.03, "right", 0.0
    else:
        x, side, lift = row["share"], "center", 0.11
    across = (100.0 * x - _ENDS[0]) / (_ENDS[1] - _ENDS[0])
    note(axis, across, at + lift, f"{fixed(100.0 * row['share'], 0)} %", color, ha=side)


def _draw_tree(axis: Axes, y: int, here: pd.DataFrame, rows: Rows) -> None:
    """A bar from 0 to 100 %: what splits on the pose take, then stiffness; one per specimen."""
    trees = list(here.groupby("specimen", sort=False))
    height = 0.5 / max(1, len(trees))
    for index, (_, tree) in enumerate(trees):
        left, base = 0.0, y + 0.25 - (index + 1) * height
        for _, row in tree.set_index("factor").reindex(["pose", "stiffness"]).dropna().iterrows():
            width = 100.0 * row["importance"]
            color = COLORS[str(row.name)]
            axis.add_patch(Rectangle((left, base), width, height, fc=color, ec="none", alpha=0.75))
            left += width
        if rows.with_numbers and len(trees) == 1:
            _tell_tree(axis, y, tree)


def _tell_tree(axis: Axes, y: int, tree: pd.DataFrame) -> None:
    pose = float(tree.loc[tree["factor"] == "pose", "importance"].sum())
    first = tree.iloc[0]
    if first["leaves"] <= 1:
        note(axis, 0.02, y + 0.38, "nothing is explained: one leaf", GREY)
        return
    leaves = f"{int(first['leaves'])} leaves, r² {fixed(first['r2'])}"
    note(axis, 0.02, y + 0.4, f"pose {percent(round(1000 * pose), 1000)}; {leaves}", GREY)


def _span(numbers: pd.Series) -> str:
    low, high = numbers.min(), numbers.max()
    return f"{low}" if low == high else f"{low}–{high}"


def _words(tables: Mapping[str, pd.DataFrame], rows: Rows) -> str:
    grid = tables["variance_shares"]
    poses, sets = (_span(grid[name]) for name in ("n_poses", "n_stiffness"))
    told = f"Grid of {poses} joint poses times {sets} stiffness sets" if len(grid) else ""
    lines = "line: 95 % interval; tree: share of the squared error that splits remove, r² from "
    parts = (told, rows.note, f"{lines}cross-validation")
    return "; ".join(part for part in parts if part) + "."
