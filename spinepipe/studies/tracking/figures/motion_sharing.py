"""Figure: how lumbar joints share a motion between 20 and 80 % of its cycle."""

from collections.abc import Mapping

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from spinepipe.cohort import Cohort
from spinepipe.effects.contract import Array
from spinepipe.motion.skeleton import LUMBAR_JOINTS
from spinepipe.report.panels import across_of, explain_marks, head, side_by_side
from spinepipe.report.style import GREY, LineStyle, blank, saying
from spinepipe.report.words import capital, plain
from spinepipe.studies.tracking.figures.line_styles import (
    choose_approaches,
    key_of,
    persons_words,
    say_empty,
    show_ticks,
    styles_of_approaches,
    trials_of,
    zero_line,
)
from spinepipe.studies.tracking.settings import Tracking
from spinepipe.studies.tracking.tables import WINDOW

MOST_TRIALS = 4
_HEIGHT_MM, _KEY_MM = 62.0, 17.0
_WIDE, _MARGIN = 0.62, 8.0
_FARTHEST = (-80.0, 130.0)
"""Percent; shares beyond are drawn at the edge."""


def motion_sharing_figure(
    study: Tracking, cohort: Cohort, tables: Mapping[str, pd.DataFrame]
) -> Figure:
    """A panel for each trial: joints from below, a mark for each approach."""
    every = tables["sharing"]
    rows = every[every["window"] == WINDOW] if len(every) else every
    if rows.empty:
        return saying("Nothing can be shown: no trial turns the lumbar spine.")
    names = choose_approaches(study, rows["approach"].unique(), 4)
    rows = rows[rows["approach"].isin(names)]
    trials = trials_of(rows)
    looks = styles_of_approaches(names)
    shown = trials[:MOST_TRIALS]
    across = across_of(len(shown), 2)
    figure = blank(-(-len(shown) // across) * _HEIGHT_MM + _KEY_MM)
    axes = side_by_side(figure, len(shown), across)
    for index, (axis, trial) in enumerate(zip(axes, shown, strict=True)):
        head(axis, index, capital(plain(trial)))
        _trial(axis, rows[rows["trial"] == trial], looks)
    _explain(figure, looks, rows, len(trials) - len(shown))
    return figure


def _trial(axis: Axes, rows: pd.DataFrame, looks: Mapping[str, LineStyle]) -> None:
    known = rows.dropna(subset=["share"])
    if known.empty:
        say_empty(axis, "the lumbar spine turns too little to be shared out")
        return
    step = _WIDE / len(looks)
    for number, (name, look) in enumerate(looks.items()):
        own = known[known["approach"] == name]
        shift = (number - 0.5 * (len(looks) - 1)) * step
        for place, joint in enumerate(LUMBAR_JOINTS):
            shares = 100.0 * own.loc[own["joint"] == joint, "share"].to_numpy(float)
            if len(shares):
                _mark(axis, place + shift, shares, look)
    even = 100.0 / len(LUMBAR_JOINTS)
    axis.axhline(even, color=GREY, lw=0.7, ls=(0, (4, 2)), zorder=1)
    zero_line(axis)
    show_ticks(axis)
    axis.set_xticks(range(len(LUMBAR_JOINTS)), LUMBAR_JOINTS)
    axis.set_xlim(-0.5, len(LUMBAR_JOINTS) - 0.5)
    axis.set_ylabel("share of the lumbar rotation (%)")
    # all shares that are not beyond the edges, zero, and up to 40 % at least
    all_of_them = 100.0 * known["share"].to_numpy(float)
    low, high = max(_FARTHEST[0], all_of_them.min()), min(_FARTHEST[1], all_of_them.max())
    bottom = max(min(low - _MARGIN, -_MARGIN), _FARTHEST[0])
    axis.set_ylim(bottom, min(max(high + _MARGIN, 40.0), _FARTHEST[1]))


def _mark(axis: Axes, x: float, shares: Array, look: LineStyle) -> None:
    """Mean and one SD over persons, each person a small dot."""
    low, high = _FARTHEST
    inside = shares[(shares > low) & (shares < high)]
    axis.plot([x] * len(inside), inside, ".", color=look.color, ms=2.2, alpha=0.6, zorder=2)
    mean = float(shares.mean())
    if len(shares) > 1:
        sd = float(shares.std(ddof=1))
        axis.plot([x, x], [mean - sd, mean + sd], color=look.color, lw=1.0, zorder=3)
    if low < mean < high:
        axis.plot([x], [mean], **look.line(ls="", ms=4.0, zorder=4))
    else:
        edge, marker = (low, "v") if mean <= low else (high, "^")
        axis.plot([x], [edge], marker=marker, color=look.color, ms=4.0, clip_on=False, zorder=4)


def _explain(figure: Figure, looks: dict[str, LineStyle], rows: pd.DataFrame, more: int) -> None:
    handles = key_of(looks)
    handles.append(Line2D([], [], color=GREY, lw=0.7, ls=(0, (4, 2)), label="evenly shared"))
    persons = int(rows["specimen"].nunique())
    words = persons_words(persons)
    if persons > 1:
        words += " Large mark: mean, line: one SD to either side, small dot: a person."
    lost = rows[rows["share"].isna()].drop_duplicates(["specimen", "trial", "approach"])
    if len(lost):
        words += f" {len(lost)} motions turn too little to be shared out."
    if more > 0:
        words += f" {more} more trials are not shown."
    explain_marks(figure, handles, words, 5)
