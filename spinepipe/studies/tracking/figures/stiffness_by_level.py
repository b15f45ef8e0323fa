"""Figure: calibrated stiffness over generic, level by level, and what markers tell of it."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from spinepipe.cohort import Cohort
from spinepipe.motion.skeleton import JOINTS
from spinepipe.report.panels import explain_marks, head, log_ticks, side_by_side
from spinepipe.report.style import BLACK, BLUE, GREY, VERMILLION, WHITE, LineStyle, blank, saying
from spinepipe.report.words import AXIS
from spinepipe.studies.tracking.figures.line_styles import persons_words
from spinepipe.studies.tracking.profile import REGIONS
from spinepipe.studies.tracking.settings import LEARNT, Tracking
from spinepipe.studies.tracking.words import short_of
from spinepipe.units import ROTATIONS

SIDES = {"positive": LineStyle(BLUE, "o", "-"), "negative": LineStyle(VERMILLION, "s", "-")}
WORDS = {
    "extension": ("extension", "flexion"),
    "right_bending": ("right bending", "left bending"),
    "left_rotation": ("left rotation", "right rotation"),
}
"""What both sides of a rotation are."""

PREFERRED = ("optk_from_both", *LEARNT)
_HEIGHT_MM, _KEY_MM = 92.0, 17.0
_APART = 0.17
_BAND = "#d9d9d9"


def stiffness_by_level_figure(
    study: Tracking, cohort: Cohort, tables: Mapping[str, pd.DataFrame]
) -> Figure:
    """A panel for each rotation; levels as they lie in a standing spine."""
    every = tables["stiffness"]
    rows = every.dropna(subset=["ratio_to_generic"]) if len(every) else every
    rows = rows[(rows["ratio_to_generic"] > 0.0)] if len(rows) else rows
    if rows.empty:
        return saying("Nothing can be shown: no calibration loaded any joint.")
    law = law_of(rows)
    rows = rows[rows["law"] == law]
    known = told_by(tables.get("profiles", pd.DataFrame()))
    figure = blank(_HEIGHT_MM + _KEY_MM)
    axes = side_by_side(figure, len(ROTATIONS), len(ROTATIONS), sharey=True)
    ends = _ends(rows)
    for index, (axis, coordinate) in enumerate(zip(axes, ROTATIONS, strict=True)):
        head(axis, index, AXIS[coordinate])
        _panel(axis, rows[rows["coordinate"] == coordinate], coordinate, known, ends)
    axes[0].set_yticks(range(len(JOINTS)), JOINTS)
    axes[0].set_ylim(-0.6, len(JOINTS) - 0.4)
    _explain(figure, rows, law)
    return figure


def law_of(rows: pd.DataFrame) -> str:
    """The calibration that is shown: of both motions together if there is one."""
    laws = [str(name) for name in dict.fromkeys(rows["law"])]
    return next((name for name in PREFERRED if name in laws), laws[0])


def told_by(profiles: pd.DataFrame) -> set[tuple[str, str, str]]:
    """(person, joint, coordinate) whose stiffness markers tell, both ends closed."""
    if profiles.empty:
        return set()
    sure = profiles[profiles["verdict"] == "told"]
    return {
        (str(row["specimen"]), joint, str(row["coordinate"]))
        for row in sure.to_dict("records")
        for joint in JOINTS[REGIONS.get(str(row["region"]), slice(0))]
    }


def _ends(rows: pd.DataFrame) -> tuple[float, float]:
    ratios = rows["ratio_to_generic"].to_numpy(float)
    band = rows[["generic_low", "generic_high"]].to_numpy(float) / _generic(rows)[:, None]
    values = np.concatenate([ratios, band.ravel(), [0.5, 2.0]])
    values = values[np.isfinite(values) & (values > 0.0)]
    return 0.85 * float(values.min()), 1.18 * float(values.max())


def _generic(rows: pd.DataFrame) -> "np.ndarray[tuple[int], np.dtype[np.float64]]":
    found = rows["at_high_moment"] / rows["ratio_to_generic"]
    return np.asarray(found, dtype=float)


def _panel(
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


def _explain(figure: Figure, rows: pd.DataFrame, law: str) -> None:
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
