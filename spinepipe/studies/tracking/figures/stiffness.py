"""Figures of stiffness: what it costs to hold that of a region, and what calibration makes of it.

Profiles show the cost at so many times the generic stiffness; calibrated stiffness is shown over
generic, level by level, hollow where markers do not tell it.
"""

from collections.abc import Mapping
from itertools import product
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from spinepipe.cohort import Cohort
from spinepipe.motion.skeleton import JOINTS
from spinepipe.report.panels import explain_marks, head, log_ticks, side_by_side
from spinepipe.report.style import (
    BLACK,
    BLUE,
    GREY,
    SMALL_PT,
    VERMILLION,
    WHITE,
    LineStyle,
    blank,
    saying,
)
from spinepipe.report.words import AXIS, capital, plain, short, tick
from spinepipe.studies.tracking.figures.line_styles import persons_words, show_ticks, styles_of
from spinepipe.studies.tracking.profile import PROFILED, REGIONS
from spinepipe.studies.tracking.settings import LEARNT, Tracking
from spinepipe.studies.tracking.tables import LIMIT
from spinepipe.studies.tracking.words import VERDICTS, short_of
from spinepipe.units import ROTATIONS

MOST_PERSONS = 4
MOST_PANELS = 9
_PROFILES_MM, _LEVELS_MM, _KEY_MM, _ACROSS = 50.0, 92.0, 17.0, 3
_TOP = 4.0
"""Top of a panel, times the limit; what costs more leaves it."""

_ROOM = 1.22
"""Top of the axis over that, for words."""

_BAR = -0.35
"""Where the first bar of what is not excluded lies, times the limit; the others below it."""

_STEP = 0.28

SIDES = {"positive": LineStyle(BLUE, "o", "-"), "negative": LineStyle(VERMILLION, "s", "-")}
WORDS = {
    "extension": ("extension", "flexion"),
    "right_bending": ("right bending", "left bending"),
    "left_rotation": ("left rotation", "right rotation"),
}
"""What both sides of a rotation are."""

PREFERRED = ("optk_from_both", *LEARNT)
_APART = 0.17
_BAND = "#d9d9d9"


def stiffness_profiles_figure(
    study: Tracking, cohort: Cohort, tables: Mapping[str, pd.DataFrame]
) -> Figure:
    """A panel for each coordinate and region, a line for each person."""
    points, ends = tables["profile_points"], tables["profiles"]
    if points.empty:
        return saying("Nothing can be shown: nobody's markers were asked for stiffness.")
    persons = [str(name) for name in dict.fromkeys(points["specimen"])]
    looks = styles_of(persons[:MOST_PERSONS])
    named = places_of(points)
    across = min(_ACROSS, len(named))
    figure = blank(-(-len(named) // across) * _PROFILES_MM + _KEY_MM)
    axes = side_by_side(figure, len(named), across, sharey=True)
    for index, (axis, (coordinate, region)) in enumerate(zip(axes, named, strict=True)):
        head(axis, index, capital(plain(region)))
        axis.set_xlabel(f"{AXIS[coordinate].lower()}: stiffness over generic (–)")
        _profile(axis, _of(points, coordinate, region), _of(ends, coordinate, region), looks)
    for axis in axes[::across]:
        axis.set_ylabel("cost over the least (–)")
    _explain_profiles(figure, looks, len(persons), bool(points["cost_over_best"].isna().any()))
    return figure


def places_of(points: pd.DataFrame) -> list[tuple[str, str]]:
    """(coordinate, region) in the order of the profiles, regions from below."""
    there = set(zip(points["coordinate"].astype(str), points["region"].astype(str), strict=True))
    ordered = [place for place in product(PROFILED, REGIONS) if place in there]
    return [*ordered, *sorted(there - set(ordered))][:MOST_PANELS]


def _of(rows: pd.DataFrame, coordinate: str, region: str) -> pd.DataFrame:
    if rows.empty:
        return rows
    return rows[(rows["coordinate"] == coordinate) & (rows["region"] == region)]


def _profile(
    axis: Axes, points: pd.DataFrame, ends: pd.DataFrame, looks: Mapping[str, LineStyle]
) -> None:
    reach = (0.75 * float(points["ratio"].min()), 1.33 * float(points["ratio"].max()))
    axis.set_xscale("log")
    axis.set_xlim(*reach)
    log_ticks(axis.xaxis, *reach, most=6)
    axis.axhline(LIMIT, color=GREY, lw=0.7, ls=(0, (4, 2)), zorder=1)
    axis.axvline(1.0, color=GREY, lw=0.5, zorder=0)
    axis.set_ylim((_BAR - _STEP * len(looks)) * LIMIT, _ROOM * _TOP * LIMIT)
    axis.set_yticks(range(0, int(_TOP * LIMIT) + 1, 5))
    show_ticks(axis)
    for k, (name, look) in enumerate(looks.items()):
        _course(axis, points[points["specimen"] == name], look)
        told = ends[ends["specimen"] == name] if len(ends) else ends
        if len(told):
            _interval(axis, told.iloc[0], (_BAR - _STEP * k) * LIMIT, look, reach)
    if len(looks) == 1 and len(ends):
        words = _verdict(points, ends.iloc[0])
        how: dict[str, Any] = {"ha": "right", "va": "top", "fontsize": SMALL_PT}
        how["bbox"] = {"facecolor": WHITE, "edgecolor": "none", "alpha": 0.8, "pad": 0.4}
        axis.text(0.97, 0.97, words, transform=axis.transAxes, **how)


def _verdict(points: pd.DataFrame, row: "pd.Series[Any]") -> str:
    """What a profile say_empty, and whether its least cost lies at the end of what was tried."""
    best = row["best_ratio"]
    if pd.isna(best):
        return "not known: no fit settled"
    settled = points.dropna(subset=["cost_over_best"])["ratio"]
    at_end = best in (settled.min(), settled.max())
    said = VERDICTS[str(row["verdict"])]
    return f"{said}\nleast cost at {tick(float(best))}" + (", an end" if at_end else "")


def _course(axis: Axes, points: pd.DataFrame, look: LineStyle) -> None:
    """The curve; arrows where it leaves the panel, crosses where no fit settled."""
    # cost over ratio: marks inside the panel, triangles at its top, crosses at the limit
    points = points.sort_values("ratio")
    cost = points["cost_over_best"].to_numpy(float)
    ratio = points["ratio"].to_numpy(float)
    top = _TOP * LIMIT
    inside = np.isfinite(cost) & (cost <= top)
    axis.plot(ratio, cost, **look.line(marker="", zorder=3))
    axis.plot(ratio[inside], cost[inside], **look.line(ls="", zorder=4))
    over = np.isfinite(cost) & (cost > top)
    edge = np.full(int(over.sum()), 0.97 * top)
    axis.plot(ratio[over], edge, "^", color=look.color, ms=3.4, zorder=4)
    lost = ~np.isfinite(cost)
    axis.plot(ratio[lost], np.full(int(lost.sum()), LIMIT), "x", color=look.color, ms=4.0)


def _interval(
    axis: Axes, row: "pd.Series[float]", y: float, look: LineStyle, reach: tuple[float, float]
) -> None:
    """What is not excluded, as a bar; an open end has an arrow out of the panel."""
    if pd.isna(row["best_ratio"]):
        return
    low = reach[0] if pd.isna(row["low"]) else float(row["low"])
    high = reach[1] if pd.isna(row["high"]) else float(row["high"])
    axis.plot([low, high], [y, y], color=look.color, lw=2.2, solid_capstyle="butt", zorder=3)
    # an arrow's tip stands at the end of the panel, a closed end at its own place
    for at, is_open, marker in ((low, row["open_below"], "<"), (high, row["open_above"], ">")):
        mark = marker if is_open else "|"
        shift = {"<": 1.06, ">": 1.0 / 1.06}.get(mark, 1.0)
        axis.plot([at * shift], [y], mark, color=look.color, ms=5.0, mew=1.0, zorder=4)


def _explain_profiles(
    figure: Figure, looks: Mapping[str, LineStyle], persons: int, lost: bool
) -> None:
    handles = [Line2D([], [], **look.line(), label=short(name)) for name, look in looks.items()]
    grey: dict[str, Any] = {"color": GREY, "lw": 0.7, "ls": (0, (4, 2))}
    handles.append(Line2D([], [], **grey, label=f"limit of 95 %, {LIMIT}"))
    bar: dict[str, Any] = {"color": looks[next(iter(looks))].color, "lw": 2.2}
    handles.append(Line2D([], [], **bar, label="not excluded; arrow: open end"))
    if lost:
        cross: dict[str, Any] = {"color": BLACK, "marker": "x", "ls": "", "ms": 4.0}
        handles.append(Line2D([], [], **cross, label="did not settle"))
    words = "Triangles at the top: the cost is beyond the panel."
    if persons > len(looks):
        words += f" The first {len(looks)} of {persons} persons."
    explain_marks(figure, handles, words, 5)


def stiffness_by_level_figure(
    study: Tracking, cohort: Cohort, tables: Mapping[str, pd.DataFrame]
) -> Figure:
    """A panel for each rotation; levels as they lie in a standing spine."""
    every = tables["stiffness"]
    rows = every.dropna(subset=["ratio_to_generic"]) if len(every) else every
    rows = rows[(rows["ratio_to_generic"] > 0.0)] if len(rows) else rows
    if rows.empty:
        return saying("Nothing can be shown: no calibration loaded any joint.")
    # of both motions together if there is such a calibration
    laws = [str(name) for name in dict.fromkeys(rows["law"])]
    law = next((name for name in PREFERRED if name in laws), laws[0])
    rows = rows[rows["law"] == law]
    known = closed_elements(tables.get("profiles", pd.DataFrame()))
    figure = blank(_LEVELS_MM + _KEY_MM)
    axes = side_by_side(figure, len(ROTATIONS), len(ROTATIONS), sharey=True)
    # one axis for all: marks, generic bands, and half to twice generic at least
    band = rows[["generic_low", "generic_high"]].to_numpy(float) / _generic(rows)[:, None]
    values = np.concatenate([rows["ratio_to_generic"].to_numpy(float), band.ravel(), [0.5, 2.0]])
    values = values[np.isfinite(values) & (values > 0.0)]
    ends = 0.85 * float(values.min()), 1.18 * float(values.max())
    for index, (axis, coordinate) in enumerate(zip(axes, ROTATIONS, strict=True)):
        head(axis, index, AXIS[coordinate])
        _levels(axis, rows[rows["coordinate"] == coordinate], coordinate, known, ends)
    axes[0].set_yticks(range(len(JOINTS)), JOINTS)
    axes[0].set_ylim(-0.6, len(JOINTS) - 0.4)
    _explain_levels(figure, rows, law)
    return figure


def closed_elements(profiles: pd.DataFrame) -> set[tuple[str, str, str]]:
    """(person, joint, coordinate) whose stiffness markers tell, both ends closed."""
    if profiles.empty:
        return set()
    sure = profiles[profiles["verdict"] == "told"]
    return {
        (str(row["specimen"]), joint, str(row["coordinate"]))
        for row in sure.to_dict("records")
        for joint in JOINTS[REGIONS.get(str(row["region"]), slice(0))]
    }


def _generic(rows: pd.DataFrame) -> "np.ndarray[tuple[int], np.dtype[np.float64]]":
    found = rows["at_high_moment"] / rows["ratio_to_generic"]
    return np.asarray(found, dtype=float)


def _levels(
    axis: Axes,
    rows: pd.DataFrame,
    coordinate: str,
    known: set[tuple[str, str, str]],
    ends: tuple[float, float],
) -> None:
    axis.set_xscale("log")
    axis.set_xlim(*ends)
    log_ticks(axis.xaxis, *ends, most=5)
    axis.set_xlabel("stiffness over generic (–)")
    axis.axvline(1.0, color=GREY, lw=0.7, zorder=1)
    for level, joint in enumerate(JOINTS):
        own = rows[rows["joint"] == joint]
        if len(own):
            low, high = (
                float(np.median(own[f"generic_{end}"].to_numpy(float) / _generic(own)))
                for end in ("low", "high")
            )
            axis.fill_betweenx([level - 0.42, level + 0.42], low, high, color=_BAND, lw=0, zorder=0)
        for k, (side, look) in enumerate(SIDES.items()):
            for row in own[own["side"] == side].to_dict("records"):
                sure = (str(row["specimen"]), joint, coordinate) in known
                y = level + _APART * (1 - 2 * k)
                axis.plot([row["ratio_to_generic"]], [y], **look.line(not sure, ls="", ms=3.0))
    if rows.empty:
        axis.text(0.5, 0.5, "not loaded", ha="center", color=GREY, transform=axis.transAxes)


def _explain_levels(figure: Figure, rows: pd.DataFrame, law: str) -> None:
    handles: list[Line2D | Patch] = [
        Line2D([], [], **look.line(ls=""), label=", ".join(words))
        for look, words in zip(SIDES.values(), zip(*WORDS.values(), strict=True), strict=True)
    ]
    hollow = Line2D([], [], marker="o", ls="", ms=3.4, mec=BLACK, mfc=WHITE, label="not told")
    handles += [hollow, Patch(color=_BAND, label="generic range")]
    words = (
        f"{persons_words(int(rows['specimen'].nunique()))} Calibration: {short_of(law)}. Each mark "
        "is a person's joint and side. Hollow: the markers do not tell this stiffness, or were not "
        "asked; then it is a number of the fit and no property of the spine."
    )
    explain_marks(figure, handles, words, 4)
