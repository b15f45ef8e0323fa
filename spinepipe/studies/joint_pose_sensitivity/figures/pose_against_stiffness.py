"""Figure: what errors hang on, joint pose or stiffness, by variance shares and by a tree."""

import textwrap
from collections.abc import Mapping

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from spinepipe.cohort import Cohort
from spinepipe.report.glyphs import draw_interval
from spinepipe.report.panels import PanelRows, explain, head, label_rows, rows_of, sections
from spinepipe.report.style import BEST, GREY, OURS, note, saying
from spinepipe.report.words import AXIS, count, fixed, percent
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.units import COORDINATES

COLORS = {"pose": OURS, "stiffness": BEST, "interaction": GREY}
_OFFSETS = {"pose": 0.24, "stiffness": 0.0, "interaction": -0.24}
_ROW_MM, _NARROW_MM, _AROUND_MM, _KEY_MM = 13.0, 4.6, 14.0, 16.0
_ENDS = (-2.0, 118.0)
"""Ends of the axis, %: beyond 100 stand the numbers."""

_RESULT = {"signed": "signed_share", "absolute": "share", "tree": "importance"}
_TITLES = {"signed": "error", "absolute": "|error|", "tree": "tree of |error|"}
_LINE_LENGTH = 46
TREE = ["specimen", "joint", "coordinate"]
"""What one tree is known by."""


def pose_against_stiffness_figure(
    study: JointPoseSensitivity, cohort: Cohort, tables: Mapping[str, pd.DataFrame]
) -> Figure:
    """Per coordinate shares in the variance of error and |error|, and the tree's importance."""
    shares, grown = tables["variance_shares"], tables["importance"]
    if _done(shares).empty and _done(grown).empty:
        return saying("Pose and stiffness cannot be compared: no error varies over the grid.")
    trees = pd.concat([importance_by_factor(grown), _without(grown)], ignore_index=True)
    names = [name for name in COORDINATES if name in {*shares["coordinate"], *trees["coordinate"]}]
    upper, lower = (
        rows_of(frame, cohort.specimen_names, cohort.joint_names) for frame in (shares, trees)
    )
    every = ((upper, "signed"), (upper, "absolute"), (lower, "tree"))
    parts = [(rows, what) for rows, what in every if len(rows)]
    heights = [
        len(rows) * (_ROW_MM if rows.with_numbers else _NARROW_MM) + _AROUND_MM for rows, _ in parts
    ]
    panels, figure = sections([(len(names), height) for height in heights], _KEY_MM)
    for part, ((rows, what), axes) in enumerate(zip(parts, panels, strict=True)):
        for index, (name, axis) in enumerate(zip(names, axes, strict=True)):
            head(axis, part * len(names) + index, f"{AXIS[name]}: {_TITLES[what]}")
            _draw(axis, rows, name, what)
    bars = {COLORS["pose"]: "joint pose", COLORS["stiffness"]: "stiffness set"}
    explain(figure, bars | {COLORS["interaction"]: "interaction"}, _words(tables, upper))
    return figure


def importance_by_factor(importance: pd.DataFrame) -> pd.DataFrame:
    """Importance of a tree summed over the predictors of each factor; r2, leaves and n with it."""
    done = _done(importance)
    keys = [*TREE, "factor"]
    return done.groupby(keys, sort=False, as_index=False).agg(
        importance=("importance", "sum"),
        predictors=("predictor", "count"),
        r2=("r2", "first"),
        leaves=("leaves", "first"),
        n=("n", "first"),
    )


def _done(table: pd.DataFrame) -> pd.DataFrame:
    return table[table["status"] == "done"]


def _without(table: pd.DataFrame) -> pd.DataFrame:
    """One row for each joint and coordinate that has no result."""
    return table[table["status"] != "done"].drop_duplicates(TREE)


def _draw(axis: Axes, rows: PanelRows, name: str, what: str) -> None:
    for y, frame in enumerate(rows.frames):
        here = frame[frame["coordinate"] == name]
        found = here[here[_RESULT[what]].notna()]
        if what == "tree":
            _draw_tree(axis, y, found, rows)
        else:
            _draw_shares(axis, y, found, rows, _RESULT[what])
        if found.empty and len(here) and rows.with_numbers:
            why = textwrap.fill(str(here["message"].iloc[0]), _LINE_LENGTH)
            note(axis, 0.02, y, why, GREY)
    label_rows(axis, rows, below=0.5, above=0.6)
    axis.set_xlim(*_ENDS)
    axis.set_xticks(range(0, 101, 20))
    axis.spines["bottom"].set_bounds(0.0, 100.0)
    label = "share of importance (%)" if what == "tree" else "share of the variance (%)"
    axis.set_xlabel(label)


def _draw_shares(axis: Axes, y: int, here: pd.DataFrame, rows: PanelRows, column: str) -> None:
    crowded = here["factor"].duplicated().any()
    for _, row in here.iterrows():
        color, at = COLORS[row["factor"]], y + _OFFSETS[row["factor"]]
        ends = (100.0 * row[f"{column}_low"], 100.0 * row[f"{column}_high"])
        draw_interval(axis, 100.0 * row[column], ends, at, color, crowded=bool(crowded))
        if rows.with_numbers and not crowded:
            words = f"{fixed(100.0 * row[column], 0)} %"
            note(axis, 1.0, at, words, color, ha="right")


def _draw_tree(axis: Axes, y: int, here: pd.DataFrame, rows: PanelRows) -> None:
    """A bar from 0 to 100 %: what splits on the pose take, then stiffness; one per specimen."""
    trees = list(here.groupby("specimen", sort=False))
    height = 0.5 / max(1, len(trees))
    for index, (_, tree) in enumerate(trees):
        left, base = 0.0, y + 0.25 - (index + 1) * height
        shares = tree.set_index("factor")["importance"].reindex(["pose", "stiffness"]).dropna()
        for factor, share in shares.items():
            width = 100.0 * share
            color = COLORS[str(factor)]
            axis.add_patch(Rectangle((left, base), width, height, fc=color, ec="none", alpha=0.75))
            left += width
        if not rows.with_numbers or len(trees) > 1:
            continue
        pose = float(tree.loc[tree["factor"] == "pose", "importance"].sum())
        first = tree.iloc[0]
        if first["leaves"] <= 1:
            note(axis, 0.02, y + 0.38, "nothing is explained: one leaf", GREY)
        else:
            leaves = f"{int(first['leaves'])} leaves, r² {fixed(first['r2'])}"
            words = f"pose {percent(round(1000 * pose), 1000)}; {leaves}"
            note(axis, 0.02, y + 0.4, words, GREY)


def _reasons(table: pd.DataFrame, what: str) -> str:
    """Why there are no results, where there is none or rows have no room to say it."""
    without = _without(table)
    if without.empty:
        return ""
    told = "; ".join(sorted(set(without["message"])))
    cells = len(table.drop_duplicates(TREE))
    return f"no {what} for {len(without)} of {count(cells, 'error')}: {told}"


def _words(tables: Mapping[str, pd.DataFrame], rows: PanelRows) -> str:
    grid = tables["variance_shares"]
    ends = [(grid[name].min(), grid[name].max()) for name in ("n_poses", "n_stiffness")]
    poses, sets = (f"{low}" if low == high else f"{low}–{high}" for low, high in ends)
    told = f"Grid of {poses} joint poses times {sets} stiffness sets" if len(grid) else ""
    lines = "line: 95 % interval; tree: share of the squared error that splits remove, r² from "
    parts = [told, rows.note, f"{lines}cross-validation"]
    parts += [_reasons(grid, "shares"), _reasons(tables["importance"], "tree")]
    return "; ".join(part for part in parts if part) + "."
