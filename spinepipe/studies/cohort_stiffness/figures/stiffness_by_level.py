"""Figure: fitted stiffness of every specimen, level by level, beside the published values."""

from collections.abc import Mapping, Sequence

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from spinepipe.cohort import Cohort
from spinepipe.report.cohort.chosen import doubted, own
from spinepipe.report.cohort.levels import label_levels, places, shade
from spinepipe.report.cohort.mark import Mark, draw_marks, handle
from spinepipe.report.cohort.named import NAME, listed
from spinepipe.report.cohort.reach import reach
from spinepipe.report.layout import explain_marks, head
from spinepipe.report.log_axis import log_ticks
from spinepipe.report.spread import draw_upright, finite
from spinepipe.report.stage_errors import joint_label_of
from spinepipe.report.style import BEST, BLACK, GREY, OURS, THEIRS, blank, saying
from spinepipe.report.words import AXIS, count, number, stiffness_unit
from spinepipe.studies import CohortStiffness
from spinepipe.units import COORDINATES

MOST_INTERVALS = 170
"""More intervals than this cannot be told apart side by side."""

_PANEL_MM, _KEY_MM = 56.0, 22.0
_MOST_NAMES = 12
_FROM_BEST = ("per_joint", "partially_pooled", "per_specimen", "level_ratio")
_MARKS = (Mark(OURS, "o", 3.4), Mark(BEST, "D", 2.9))
_DASHES: tuple[int, tuple[int, int]] = (0, (4, 2))


def stiffness_by_level_figure(
    study: CohortStiffness, cohort: Cohort, tables: Mapping[str, pd.DataFrame]
) -> Figure:
    """A panel per free coordinate: levels side by side, and in each level the specimens."""
    stiffness = tables["stiffness"]
    shown = _representations(stiffness, cohort)
    rows = own(stiffness, shown)
    if not len(finite(rows["stiffness"])):
        tried = own(stiffness, _FROM_BEST)["message"]
        why = "; ".join(list(dict.fromkeys(tried[tried != ""]))[:2])
        return saying("No stiffness was found for any specimen" + (f": {why}." if why else "."))
    names = [name for name in COORDINATES if name in set(rows["coordinate"])]
    figure = blank(_PANEL_MM * len(names) + _KEY_MM)
    axes = figure.subplots(len(names), 1, squeeze=False).ravel()
    for index, (name, axis) in enumerate(zip(names, axes, strict=True)):
        head(axis, index, AXIS[name])
        published = stiffness[
            (stiffness["source"] == "literature") & (stiffness["coordinate"] == name)
        ]
        _draw(axis, name, rows[rows["coordinate"] == name], published, shown, cohort)
    _explain(figure, stiffness, rows, shown, cohort)
    return figure


def _representations(stiffness: pd.DataFrame, cohort: Cohort) -> list[str]:
    """At most two: those with a value for each joint first; one where two would crowd."""
    known = own(stiffness, _FROM_BEST).dropna(subset=["stiffness"])
    found = [name for name in _FROM_BEST if name in set(known["representation"])]
    free = [name for name in found if name in _FROM_BEST[:2]] or found[:1]
    one = len(cohort.joint_names) * len(cohort.specimen_names)
    return free[:2] if one * len(free[:2]) <= MOST_INTERVALS else free[:1]


def _crowded(cohort: Cohort) -> bool:
    return len(cohort.joint_names) * len(cohort.specimen_names) > MOST_INTERVALS


def _draw(
    axis: Axes,
    name: str,
    rows: pd.DataFrame,
    published: pd.DataFrame,
    shown: Sequence[str],
    cohort: Cohort,
) -> None:
    levels = cohort.joint_names[::-1]
    shade(axis, len(levels))
    _draw_published(axis, published, levels)
    axis.set_yscale("log")
    axis.set_ylabel(f"stiffness ({stiffness_unit(name)})")
    label_levels(axis, levels)
    if not len(finite(rows["stiffness"])):
        axis.text(0.5, 0.5, "no stiffness was found", transform=axis.transAxes, ha="center")
        return
    low, high = reach(rows, published["stiffness"])
    axis.set_ylim(low, high)
    log_ticks(axis.yaxis, low, high, 6)
    axis.tick_params(axis="y", which="major", length=2.5)
    for level, joint in enumerate(levels):
        here = rows[rows["joint"] == joint]
        if _crowded(cohort):
            values = finite(here.loc[~doubted(here), "stiffness"])
            if len(values):
                draw_upright(axis, values, level, OURS, 0.5)
            continue
        at = places(level, cohort.specimen_names, shown)
        x = [at[key] for key in zip(here["specimen"], here["representation"], strict=True)]
        for number_of, representation in enumerate(shown):
            chosen = (here["representation"] == representation).to_numpy(bool)
            draw_marks(axis, here[chosen], pd.Series(x)[chosen], _MARKS[number_of])


def _draw_published(axis: Axes, published: pd.DataFrame, levels: Sequence[str]) -> None:
    """The same value for all joints as a dashed line, values of levels as short bars."""
    one = finite(published.loc[published["representation"] == "literature", "stiffness"])
    if len(one):
        axis.axhline(one[0], color=GREY, lw=0.8, ls=_DASHES, zorder=1.5)
    each = published[published["representation"] == "literature_levels"]
    for joint, value in each.groupby("joint")["stiffness"].first().dropna().items():
        x = list(levels).index(str(joint))
        axis.plot([x - 0.46, x + 0.46], [value, value], color=THEIRS, lw=1.4,
                  solid_capstyle="butt", zorder=1.6)  # fmt: skip


def _explain(
    figure: Figure,
    stiffness: pd.DataFrame,
    rows: pd.DataFrame,
    shown: Sequence[str],
    cohort: Cohort,
) -> None:
    handles: list[Line2D] = []
    if _crowded(cohort):
        handles.append(Line2D([], [], color=OURS, marker="o", ms=2.2, mew=0, ls="",
                              label=f"{NAME[shown[0]]}, a specimen"))  # fmt: skip
    else:
        handles += [handle(mark, NAME[name]) for mark, name in zip(_MARKS, shown, strict=False)]
    published = set(stiffness.loc[stiffness["source"] == "literature", "representation"])
    if "literature" in published:
        handles.append(Line2D([], [], color=GREY, lw=0.8, ls=_DASHES, label=NAME["literature"]))
    if "literature_levels" in published:
        handles.append(Line2D([], [], color=THEIRS, lw=1.4, label=NAME["literature_levels"]))
    doubt = bool(doubted(rows[rows["stiffness"].notna()]).any())
    if doubt and not _crowded(cohort):
        handles.append(handle(_MARKS[0].hollow(), "not identifiable or at a bound"))
    if rows["stiffness"].isna().any() and not _crowded(cohort):
        handles.append(Line2D([], [], color=BLACK, marker="x", ms=3.5, ls="",
                              label="no stiffness"))  # fmt: skip
    explain_marks(
        figure, handles, _words(stiffness, rows, cohort), len(handles) if len(handles) < 5 else 3
    )


def _words(stiffness: pd.DataFrame, rows: pd.DataFrame, cohort: Cohort) -> str:
    label = joint_label_of(stiffness)
    fitted = "all load cases" if label == "all" else label.replace("_", " ")
    words = [f"Fitted to {fitted}"]
    if _crowded(cohort):
        held = rows[~doubted(rows) & rows["high"].notna()]
        half = (held["high"] / held["low"]).pow(0.5)
        if len(half):
            words.append(f"median 95 % interval: times and divided by {number(half.median())}")
        words.append("bar: middle half of the specimens, tick: median")
        lost = int(doubted(rows[rows["stiffness"].notna()]).sum())
        if lost:
            words.append(f"left out: {count(lost, 'value')} not identifiable or at a bound")
    else:
        several = len(cohort.specimen_names) > 1
        if several:
            words.append(
                f"in each level from left to right: {listed(cohort.specimen_names, _MOST_NAMES)}"
            )
        words += ["line: 95 % interval, where longer than the symbol", "▲▼: beyond the axis"]
    return "; ".join(words) + "."
