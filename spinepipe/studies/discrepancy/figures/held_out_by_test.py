"""Figure: the gap on motion left out of the fits, by left-out test and specimen."""

from collections.abc import Mapping
from textwrap import fill
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from spinepipe.cohort import Cohort
from spinepipe.report.glyphs import finite
from spinepipe.report.panels import explain_marks, head, side_by_side
from spinepipe.report.style import BLACK, GREY, OURS, THEIRS, blank, note, saying
from spinepipe.report.words import fixed, plain, short
from spinepipe.studies.discrepancy.settings import Discrepancy
from spinepipe.studies.discrepancy.verdict import share_of_gap
from spinepipe.tables import StudyTables

KINDS = {
    "test": "One test left out",
    "specimen": "One specimen left out",
    "steps": "Load steps left out",
}
MODELS = {
    "base": (THEIRS, "s", 4.6, 0.2, "base model"),
    "surrogate": (GREY, "D", 3.4, 0.0, "generic surrogate without physics"),
    "with_effects": (OURS, "o", 4.6, -0.2, "with the effects"),
}
"""Colour, shape, size (pt), place in its row and words of each model."""

_ROW_MM, _AROUND_MM, _KEY_MM = 7.0, 20.0, 15.0
_ROOM_FOR_WORDS = 1.28
_LEAST_SCALE = 1.0
"""The axis reaches at least so many noise SD: noise must not look like physics."""


def held_out_by_test_figure(study: Discrepancy, cohort: Cohort, tables: StudyTables) -> Figure:
    """A panel for left-out tests and one for left-out specimens; a row for each fold."""
    rows = tables["held_out"]
    kinds = [kind for kind in KINDS if (rows["kind"] == kind).any()]
    added = not rows["gap_base"].fillna(0.0).equals(rows["gap_with_effects"].fillna(0.0))
    shown = [name for name in MODELS if added or name != "with_effects"]
    ends = finite(rows[[f"gap_{name}_high" for name in shown]].to_numpy(float))
    if not kinds or not len(ends):
        return saying("No held-out motion can be shown: nothing was left out, or no fit ended.")
    longest = max(int((rows["kind"] == kind).sum()) for kind in kinds)
    figure = blank(longest * _ROW_MM + _AROUND_MM + _KEY_MM)
    axes = side_by_side(figure, len(kinds), len(kinds))
    most = max(_LEAST_SCALE, float(ends.max()))
    for index, (axis, kind) in enumerate(zip(axes, kinds, strict=True)):
        head(axis, index, KINDS[kind])
        folds = rows[rows["kind"] == kind].iloc[::-1]
        _draw(axis, folds, shown, added)
        axis.set_ylim(len(folds) - longest - 0.7, len(folds) - 0.3)
        axis.set_xlim(-0.03 * most, (_ROOM_FOR_WORDS if added else 1.06) * most)
        axis.xaxis.set_major_locator(MaxNLocator(5))
        axis.set_xlabel("held-out gap (noise SD), with 95 % interval")
    handles = [
        Line2D([], [], color=color, marker=shape, ms=size, mew=0.0, lw=1.1, label=words)
        for color, shape, size, _, words in (MODELS[name] for name in shown)
    ]
    handles.append(Line2D([], [], color=BLACK, lw=0.8, ls="--", label="only noise"))
    told = "No effect was added: there is one model."
    if added:
        told = "Worse: the effects predict it worse than the base, by more than noise makes."
    left_off = "Left out and then predicted; what noise and training leave open is taken off."
    explain_marks(figure, handles, f"{left_off} {told}", len(handles))
    return figure


def _draw(axis: Axes, rows: pd.DataFrame, shown: list[str], added: bool) -> None:
    for y, row in enumerate(rows.to_dict("records")):
        if not np.isfinite(row["gap_base"]):
            note(axis, 0.02, y, fill(f"no result: {row['message'] or row['status']}", 44))
            continue
        for name in shown:
            _point(axis, row, name, y)
        if added:
            words, how = _change(row)
            note(axis, 1.0, y, words, ha="right", **how)
    axis.axvline(0.0, color=BLACK, lw=0.8, ls="--", zorder=1)
    names = (
        fold.removeprefix(f"{kind} ").removeprefix(f"{kind}=")
        for fold, kind in zip(rows["fold"], rows["kind"], strict=True)
    )
    axis.set_yticks(range(len(rows)), [short(plain(name), 24) for name in names])
    axis.spines["left"].set_visible(False)


def _point(axis: Axes, row: Mapping[Any, Any], name: str, y: float) -> None:
    color, shape, size, above, _ = MODELS[name]
    gap, low, high = (row[f"gap_{name}{end}"] for end in ("", "_low", "_high"))
    if not np.isfinite(gap):
        return
    axis.plot([low, high], [y + above] * 2, color=color, lw=1.1, solid_capstyle="butt", zorder=3)
    axis.plot([gap], [y + above], shape, color=color, ms=size, mew=0.0, zorder=4, clip_on=False)


def _change(row: Mapping[Any, Any]) -> tuple[str, dict[str, Any]]:
    """What the effects make of a fold, in words and how they are written."""
    if row["worse"]:
        return "worse", {"color": THEIRS, "fontweight": "bold"}
    closed = row["closed"]
    if not np.isfinite(closed) or row["gap_base_low"] <= 0.0:
        return "noise may be all", {"color": GREY}
    if closed <= 0.0:
        return "no better", {}
    return f"{fixed(100.0 * share_of_gap(closed), 0)} % of gap", {}
