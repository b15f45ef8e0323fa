"""Figure: the most likely size of each small imperfection, and what its kind takes up."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from spinepipe.cohort import Cohort
from spinepipe.report.panels import explain_marks, head, side_by_side
from spinepipe.report.style import BLACK, GREY, OURS, THEIRS, blank, note, saying
from spinepipe.report.words import plain
from spinepipe.studies.discrepancy.settings import Discrepancy
from spinepipe.studies.discrepancy.tables import MODELS
from spinepipe.tables import StudyTables

HEADS = {"base": "Beside the base model", "with_effects": "Beside the model with the effects"}
EVERY = "*"

WORDS = (
    "A point: one imperfection of one specimen. Grey band: one prior SD. Pale: readings hardly "
    "tell it. Shares: of the chi squared that all imperfections take up."
)

_LANE_MM, _ROW_MM, _AROUND_MM, _KEY_MM = 1.5, 3.0, 16.0, 17.0
_LEAST_REACH, _ROOM = 2.4, 1.08
_HARDLY_TOLD = 0.7
"""Posterior SD from which readings hardly tell an imperfection: drawn pale."""

_LEAST_SHARE = 0.01
"""Of chi2, less of which is not written."""

_SHADES = ("#0B3C5D", "#0072B2", "#3FA7D6", "#56B4E9", "#009E73", "#7A9E00")
"""Of joints, caudal to cranial, again from the start where there are more."""


def imperfections_figure(study: Discrepancy, cohort: Cohort, tables: StudyTables) -> Figure:
    """A panel per model: a row for each kind, in it a lane of points for each joint."""
    rows = tables["imperfections"]
    if rows.empty:
        return saying("No imperfection can be shown: none is allowed for, or the base has no fit.")
    # without effects both models are the same, and one panel tells of both
    sizes = {name: rows.loc[rows["model"] == name, "in_prior_sds"].to_numpy() for name in MODELS}
    shown = [n for n in MODELS if n == "base" or not np.array_equal(sizes[n], sizes["base"])]
    kinds = list(dict.fromkeys(rows["kind"]))[::-1]
    lanes = (EVERY, *cohort.joint_names)
    here = [joint for joint in lanes if (rows["joint"] == joint).any()]
    height = len(kinds) * (_ROW_MM + _LANE_MM * len(here)) + _AROUND_MM + _KEY_MM
    figure = blank(height)
    drawn = rows[(rows["places"] == 1) | rows["common"]]
    reach = _ROOM * max(_LEAST_REACH, float(drawn["in_prior_sds"].abs().max()))
    colors = {EVERY: GREY}
    colors |= {joint: _SHADES[n % len(_SHADES)] for n, joint in enumerate(cohort.joint_names)}
    for index, (axis, name) in enumerate(
        zip(side_by_side(figure, len(shown), len(shown)), shown, strict=True)
    ):
        head(axis, index, HEADS[name])
        _draw(axis, rows[rows["model"] == name], kinds, here, colors)
        axis.set_xlim(-reach, reach)
        axis.set_yticks(range(len(kinds)), [plain(kind) for kind in kinds] if not index else [])
        axis.set_xlabel("most likely size (prior SD)")
    names = {EVERY: "loads, and all joints alike"}
    handles = [
        Line2D([], [], color=colors[lane], marker="o", ms=3.5, lw=0, label=names.get(lane, lane))
        for lane in here
    ]
    if rows["common"].any():
        words = "alike in many places, mean and 95 % interval: no random error"
        handles.append(Line2D([], [], color=THEIRS, marker="D", ms=4.5, lw=0, label=words))
    explain_marks(figure, handles, WORDS, min(len(handles), 6))
    return figure


def _draw(
    axis: Axes,
    rows: pd.DataFrame,
    kinds: Sequence[str],
    lanes: Sequence[str],
    colors: Mapping[str, str],
) -> None:
    axis.axvspan(-1.0, 1.0, color="#EEEEEE", lw=0.0, zorder=0)
    axis.axvline(0.0, color=BLACK, lw=0.6, zorder=1)
    single = rows[rows["places"] == 1]
    taken = single.groupby("kind")["taken_chi2"].sum()
    whole = float(taken.clip(lower=0.0).sum())
    step = 0.8 / len(lanes)
    for y, kind in enumerate(kinds):
        own = single[single["kind"] == kind]
        for number, joint in enumerate(lanes):
            height = y + 0.5 * 0.8 - (number + 0.5) * step
            _points(axis, own[own["joint"] == joint], height, colors[joint])
        means = rows[(rows["kind"] == kind) & rows["common"]]
        for mean in means[["in_prior_sds", "posterior_sd"]].to_numpy(dtype=float):
            ends = mean[0] + 1.96 * mean[1] * np.array([-1.0, 1.0])
            axis.plot(ends, [y, y], color=THEIRS, lw=1.0, zorder=5)
            axis.plot([mean[0]], [y], "D", color=THEIRS, ms=4.5, mew=0.0, zorder=6)
        share = float(taken.get(kind, 0.0))
        if share > _LEAST_SHARE * whole:
            words = f"{100.0 * share / whole:.0f} %"
            note(axis, 0.99, y - 0.36, f"takes up {words} of it", OURS, ha="right")
        axis.axhline(y - 0.5, color="#DDDDDD", lw=0.5, zorder=0)
    axis.set_ylim(-0.5, len(kinds) - 0.5)
    axis.spines["left"].set_visible(False)


def _points(axis: Axes, rows: pd.DataFrame, y: float, color: str) -> None:
    told = rows["posterior_sd"] < _HARDLY_TOLD
    for part, alpha in ((rows[told], 0.9), (rows[~told], 0.3)):
        sizes = part["in_prior_sds"]
        axis.plot(sizes, np.full(len(part), y), "o", color=color, ms=2.8, mew=0.0, alpha=alpha)
