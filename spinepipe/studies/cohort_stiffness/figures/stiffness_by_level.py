"""Figure: fitted stiffness of every specimen, level by level, beside the published values."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from spinepipe.cohort import Cohort
from spinepipe.report.glyphs import draw_upright, finite, quartiles
from spinepipe.report.panels import explain_marks, head, log_ticks, side_by_side
from spinepipe.report.style import BEST, BLACK, GREY, OURS, THEIRS, WHITE, blank, saying
from spinepipe.report.words import AXIS, count, listed, number, short, stiffness_unit
from spinepipe.studies.cohort_stiffness.representations import (
    ASKED_FOR,
    IN_WORDS,
    OF_JOINTS,
    PUBLISHED,
    SHARED,
    named,
)
from spinepipe.studies.cohort_stiffness.settings import CohortStiffness
from spinepipe.studies.cohort_stiffness.stages import joint_label_of, own_fits
from spinepipe.units import COORDINATES


@dataclass(frozen=True)
class Mark:
    """Colour, shape and size of a symbol."""

    color: str
    shape: str
    size_pt: float


MOST_INTERVALS = 170
"""More intervals than this cannot be told apart side by side."""

FARTHEST = 10.0
"""What lies farther than this factor from the quartiles is shown at the edge."""

_MARGIN, _LEAST = 0.06, 0.09
"""Room at either end: a share of the axis, and at least so many decades."""

_EDGE = 0.025
"""How far from the end of the axis something beyond it is marked, as a share of the axis."""

_SHARE = 0.82
_SHADE = "#F2F2F2"

_MOST_LETTERS = 140
"""Letters that stand side by side below a panel of the whole width."""

_PANEL_MM, _KEY_MM = 56.0, 22.0
_MOST_NAMES = 12
_FROM_BEST = tuple(sorted((*OF_JOINTS, *SHARED), key=ASKED_FOR.__contains__))
"""Linear ones first: a stiffness at rest is not to be compared with one of the whole motion."""

_MARKS = (Mark(OURS, "o", 3.4), Mark(BEST, "D", 2.9))
_DASHES: tuple[int, tuple[int, int]] = (0, (4, 2))


def stiffness_by_level_figure(
    study: CohortStiffness, cohort: Cohort, tables: Mapping[str, pd.DataFrame]
) -> Figure:
    """A panel per free coordinate: levels side by side, and in each level the specimens."""
    stiffness = tables["stiffness"]
    own = own_fits(stiffness)
    shown = _representations(own, cohort)
    rows = own[own["representation"].isin(shown)]
    if not len(finite(rows["stiffness"])):
        tried = own.loc[own["representation"].isin(_FROM_BEST), "message"]
        why = "; ".join(list(dict.fromkeys(tried[tried != ""]))[:2])
        return saying("No stiffness was found for any specimen" + (f": {why}." if why else "."))
    names = [name for name in COORDINATES if name in set(rows["coordinate"])]
    figure = blank(_PANEL_MM * len(names) + _KEY_MM)
    axes = side_by_side(figure, len(names), 1)
    for index, (name, axis) in enumerate(zip(names, axes, strict=True)):
        head(axis, index, AXIS[name])
        published = stiffness[
            (stiffness["source"] == "literature") & (stiffness["coordinate"] == name)
        ]
        _draw(axis, name, rows[rows["coordinate"] == name], published, shown, cohort)
    _explain(figure, stiffness, rows, shown, cohort)
    return figure


def _representations(own: pd.DataFrame, cohort: Cohort) -> list[str]:
    """At most two: those with a value for each joint first; one where two would crowd."""
    known = set(own.dropna(subset=["stiffness"])["representation"])
    found = [name for name in _FROM_BEST if name in known]
    found = [name for name in found if name not in ASKED_FOR] or found
    free = [name for name in found if name in OF_JOINTS] or found[:1]
    one = len(cohort.joint_names) * len(cohort.specimen_names)
    return free[:2] if one * len(free[:2]) <= MOST_INTERVALS else free[:1]


def unconstrained(rows: pd.DataFrame) -> pd.Series:
    """Whether each stiffness is not held by the data: not identifiable, or at a bound."""
    known = rows["identifiable"].map(lambda flag: flag is None or bool(flag)).astype(bool)
    return ~known | (rows["at_bound"] != "no")


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
    for level in range(0, len(levels), 2):  # every second level a shade darker
        axis.axvspan(level - 0.5, level + 0.5, color=_SHADE, lw=0, zorder=0)
    axis.set_xlim(-0.5, len(levels) - 0.5)
    _draw_published(axis, published, levels)
    axis.set_yscale("log")
    axis.set_ylabel(f"stiffness ({stiffness_unit(name)})")
    # Names below the axis, slanted where they are long.
    slanted = sum(len(level) + 2 for level in levels) > _MOST_LETTERS
    turned = {"rotation": 30, "ha": "right", "rotation_mode": "anchor"} if slanted else {}
    axis.set_xticks(range(len(levels)), [short(level) for level in levels], **turned)  # type: ignore[arg-type]
    axis.tick_params(axis="x", length=0.0)
    if not len(finite(rows["stiffness"])):
        axis.text(0.5, 0.5, "no stiffness was found", transform=axis.transAxes, ha="center")
        return
    low, high = _reach(rows, published["stiffness"])
    axis.set_ylim(low, high)
    log_ticks(axis.yaxis, low, high, 6)
    axis.tick_params(axis="y", which="major", length=2.5)
    for level, joint in enumerate(levels):
        here = rows[rows["joint"] == joint]
        if _crowded(cohort):
            values = finite(here.loc[~unconstrained(here), "stiffness"])
            if len(values):
                draw_upright(axis, values, level, OURS, 0.5)
            continue
        # Where each specimen and representation stands within a level.
        keys = [(specimen, shown_of) for specimen in cohort.specimen_names for shown_of in shown]
        at = {key: level + _SHARE * ((i + 0.5) / len(keys) - 0.5) for i, key in enumerate(keys)}
        x = [at[key] for key in zip(here["specimen"], here["representation"], strict=True)]
        for number_of, representation in enumerate(shown):
            chosen = (here["representation"] == representation).to_numpy(bool)
            _draw_marks(axis, here[chosen], pd.Series(x)[chosen], _MARKS[number_of])


def _reach(rows: pd.DataFrame, more: object = ()) -> tuple[float, float]:
    """Ends of the axis.

    Parameters
    ----------
    rows : with stiffness and interval; those the data do not hold count only where all are such.
    more : further values that are on the axis if they are near.
    """
    held = rows[~unconstrained(rows)]
    chosen = held if len(held) else rows
    values = finite(chosen["stiffness"])
    middle = quartiles(values)
    near = np.concatenate([finite(chosen[name]) for name in ("stiffness", "low", "high")])
    near = np.concatenate([near, finite(more)])
    near = near[(near > middle.low / FARTHEST) & (near < middle.high * FARTHEST)]
    low, high = float(near.min()), float(near.max())
    margin = 10.0 ** max(_LEAST, _MARGIN * np.log10(high / low))
    return low / margin, high * margin


def _draw_published(axis: Axes, published: pd.DataFrame, levels: Sequence[str]) -> None:
    """The same value for all joints as a dashed line, values of levels as short bars."""
    for name, rows in published.groupby("representation", sort=False):
        look = _look(str(name))
        if not named(str(name)).by_level:
            for value in finite(rows["stiffness"])[:1]:
                axis.axhline(value, **look, zorder=1.5)
            continue
        for joint, value in rows.groupby("joint")["stiffness"].first().dropna().items():
            x = list(levels).index(str(joint))
            ends = [x - 0.46, x + 0.46]
            axis.plot(ends, [value, value], **look, solid_capstyle="butt", zorder=1.6)


def _look(published: str) -> dict[str, Any]:
    """Line of a published set."""
    if named(published).by_level:
        return {"color": THEIRS, "lw": 1.4}
    return {"color": GREY, "lw": 0.8, "ls": _DASHES}


def _draw_marks(axis: Axes, rows: pd.DataFrame, x: pd.Series, mark: Mark) -> None:
    """Stiffness of each row at its place (n,); the axis has its limits already."""
    low, high = axis.get_ylim()
    doubt = unconstrained(rows)
    for at, row, doubtful in zip(x, rows.to_dict("records"), doubt, strict=True):
        value = row["stiffness"]
        if value is None or not np.isfinite(value):
            _at_edge(axis, at, 0.0, "x", BLACK)
        elif value > high or value < low:
            _at_edge(axis, at, float(value > high), "^" if value > high else "v", mark.color)
        else:
            ends = ends_shown(row, low, high)
            if ends:
                axis.plot([at, at], ends, color=mark.color, lw=0.9, solid_capstyle="butt", zorder=3)
            symbol: dict[str, Any] = {"color": mark.color, "ms": mark.size_pt, "mew": 0.7}
            face = WHITE if doubtful else mark.color
            axis.plot([at], [value], mark.shape, **symbol, mfc=face, zorder=4)


def ends_shown(row: Mapping[Any, Any], low: float, high: float) -> list[float]:
    """Ends of a region inside an axis, as far as it goes where one is open; nothing without any."""
    below, above = row["low"], row["high"]
    if pd.isna(below) and pd.isna(above):
        return []
    return [
        low if pd.isna(below) else max(below, low),
        high if pd.isna(above) else min(above, high),
    ]


def _at_edge(axis: Axes, x: float, top: float, shape: str, color: str) -> None:
    y = 1.0 - _EDGE if top else _EDGE
    symbol: dict[str, Any] = {"color": color, "mfc": WHITE, "ms": 3.5, "mew": 0.8, "zorder": 5}
    axis.plot([x], [y], shape, **symbol, transform=axis.get_xaxis_transform())


def _handle(mark: Mark, label: str, filled: bool = True) -> Line2D:
    """The symbol as the key shows it."""
    symbol: dict[str, Any] = {"marker": mark.shape, "ms": mark.size_pt, "mew": 0.7}
    face = mark.color if filled else WHITE
    return Line2D([], [], color=mark.color, lw=0.9, **symbol, mfc=face, label=label)


def _explain(
    figure: Figure,
    stiffness: pd.DataFrame,
    rows: pd.DataFrame,
    shown: Sequence[str],
    cohort: Cohort,
) -> None:
    handles: list[Line2D] = []
    if _crowded(cohort):
        dot = {"color": OURS, "marker": "o", "ms": 2.2, "mew": 0, "ls": ""}
        handles.append(Line2D([], [], **dot, label=f"{IN_WORDS[shown[0]]}, a specimen"))  # type: ignore[arg-type]
    else:
        handles += [
            _handle(mark, IN_WORDS[name]) for mark, name in zip(_MARKS, shown, strict=False)
        ]
    published = set(stiffness.loc[stiffness["source"] == "literature", "representation"])
    for name in (name for name in PUBLISHED if name in published):
        handles.append(Line2D([], [], **_look(name), label=IN_WORDS[name]))
    doubt = bool(unconstrained(rows[rows["stiffness"].notna()]).any())
    if doubt and not _crowded(cohort):
        handles.append(_handle(_MARKS[0], "not identifiable or at a bound", filled=False))
    if rows["stiffness"].isna().any() and not _crowded(cohort):
        handles.append(Line2D([], [], color=BLACK, marker="x", ms=3.5, ls="", label="no stiffness"))
    explain_marks(
        figure, handles, _words(stiffness, rows, cohort), len(handles) if len(handles) < 5 else 3
    )


def _words(stiffness: pd.DataFrame, rows: pd.DataFrame, cohort: Cohort) -> str:
    label = joint_label_of(stiffness)
    fitted = "all load cases" if label == "all" else label.replace("_", " ")
    words = [f"Fitted to {fitted}"]
    if _crowded(cohort):
        held = rows[~unconstrained(rows) & rows["high"].notna()]
        half = (held["high"] / held["low"]).pow(0.5)
        if len(half):
            words.append(f"median 95 % interval: times and divided by {number(half.median())}")
        words.append("bar: middle half of the specimens, tick: median")
        lost = int(unconstrained(rows[rows["stiffness"].notna()]).sum())
        if lost:
            words.append(f"left out: {count(lost, 'value')} not identifiable or at a bound")
    else:
        several = len(cohort.specimen_names) > 1
        if several:
            names = listed(map(short, cohort.specimen_names), _MOST_NAMES, last=None)
            words.append(f"in each level from left to right: {names}")
        words += ["line: 95 % interval, where longer than the symbol", "▲▼: beyond the axis"]
    return "; ".join(words) + "."
