"""Figure: how precise landmarks must be for errors below a limit."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from spinepipe.cohort import Cohort
from spinepipe.report.panels import explain, head, lines_of
from spinepipe.report.style import BEST, GREY, INK, OURS, THEIRS, blank, saying
from spinepipe.report.words import count, fixed, tick
from spinepipe.studies.joint_pose_sensitivity.gould_2024a import GOULD_2024A
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity

COLORS = {"calibrated": OURS, "nominal": BEST}

WHOSE = {
    "calibrated": "stiffness fitted to each pose",
    "nominal": "stiffness of the cohort's own pose",
}

MOTIONS = {"translation": "mm", "rotation": "°"}

_HEIGHT_MM = 125.0


def landmark_precision_figure(
    study: JointPoseSensitivity, cohort: Cohort, tables: Mapping[str, pd.DataFrame]
) -> Figure:
    """Above: quantiles of the largest error over landmark SD; below: share under the limit."""
    curves, required = tables["landmark_precision"], tables["required_precision"]
    if curves.empty or not curves["median"].notna().any():
        return saying("No error can be shown: no sampled pose has a result at any landmark SD.")
    figure = blank(_HEIGHT_MM)
    measured = [motion for motion in MOTIONS if (curves["motion"] == motion).any()]
    axes = lines_of(figure, 2 * len(measured), len(measured), sharex=True)
    for index, motion in enumerate(measured):
        symbol, here = MOTIONS[motion], curves[curves["motion"] == motion]
        upper, lower = axes[0][index], axes[1][index]
        head(upper, index, f"Largest {motion} error")
        head(lower, index + len(measured), f"Poses below the limit of {motion}")
        _draw_errors(upper, here, symbol)
        _draw_shares(lower, here, required[required["motion"] == motion], study)
        _mark_paper(upper, lower, cohort)
        lower.set_xlabel("SD of each landmark, per axis (mm)")
    axes[1][0].set_ylabel("share of poses (%)")
    bars = {
        COLORS[name]: words for name, words in WHOSE.items() if name in set(curves["stiffness"])
    }
    explain(figure, bars, _words(study, cohort, curves, required))
    return figure


def required_words(row: pd.Series, sampled: Sequence[float]) -> str:
    """``1.20 mm (1.05–1.40)``, or why there is no such SD.

    An end of the interval that lies outside the sampled SDs, mm, is told as such:
    ``0.95 mm (0.65 to above 4 mm)``.
    """
    if not np.isfinite(row["sd_mm"]):
        return str(row["message"]) or "none"
    low, high = row["sd_low_mm"], row["sd_high_mm"]
    if np.isfinite(low) and np.isfinite(high):
        return f"{fixed(row['sd_mm'])} mm ({fixed(low)}–{fixed(high)})"
    start = fixed(low) if np.isfinite(low) else f"below {tick(min(sampled))}"
    end = f"{fixed(high)} mm" if np.isfinite(high) else f"above {tick(max(sampled))} mm"
    return f"{fixed(row['sd_mm'])} mm ({start} to {end})"


def _draw_curves(
    axis: Axes, here: pd.DataFrame, column: str, band: tuple[str, str], dashed: bool, factor: float
) -> None:
    """A line per specimen and stiffness; of one specimen with a band, of several their median."""
    alone = here["specimen"].nunique() == 1
    for (_, whose), rows in here.groupby(["specimen", "stiffness"]):
        rows = rows.sort_values("sd_mm")
        color, x = COLORS[str(whose)], rows["sd_mm"]
        thin: dict[str, Any] = {"lw": 1.2 if alone else 0.5, "alpha": 1.0 if alone else 0.4}
        axis.plot(x, factor * rows[column], color=color, marker="o", ms=2.5, **thin)
        if alone:
            low, high = (factor * rows[end] for end in band)
            axis.fill_between(x, low, high, color=color, alpha=0.15, lw=0)
        if alone and dashed:
            axis.plot(x, factor * rows[band[1]], color=color, lw=0.8, ls=(0, (4, 2)))
    for whose, rows in here.groupby("stiffness") if not alone else ():
        middle = factor * rows.groupby("sd_mm")[column].median()
        axis.plot(middle.index, middle, color=COLORS[str(whose)], lw=1.8)


def _draw_errors(axis: Axes, here: pd.DataFrame, symbol: str) -> None:
    _draw_curves(axis, here, "median", ("median", "p95"), dashed=True, factor=1.0)
    limit = float(here["limit"].iloc[0])
    axis.axhline(limit, color=GREY, lw=0.8, ls=":")
    axis.annotate(
        f"limit {tick(limit)} {symbol}",
        (1.0, limit),
        (0, 2),
        xycoords=("axes fraction", "data"),
        textcoords="offset points",
        ha="right",
        fontsize=6.0,
        color=INK[GREY],
    )
    axis.set_ylim(0.0, None)
    axis.set_ylabel(f"error ({symbol})")


def _draw_shares(
    axis: Axes, here: pd.DataFrame, required: pd.DataFrame, study: JointPoseSensitivity
) -> None:
    _draw_curves(axis, here, "below", ("below_low", "below_high"), dashed=False, factor=100.0)
    asked = 100.0 * study.landmark_precision.share
    axis.axhline(asked, color=GREY, lw=0.8, ls=":")
    axis.annotate(
        f"{tick(asked)} % asked for",
        (0.0, asked),
        (3, -2),
        xycoords=("axes fraction", "data"),
        textcoords="offset points",
        ha="left",
        va="top",
        fontsize=6.0,
        color=INK[GREY],
    )
    sampled = study.landmark_precision.sd_mm
    for place, (whose, rows) in enumerate(required.groupby("stiffness")):
        _mark_required(axis, rows, COLORS[str(whose)], 6.0 + 8.0 * place, sampled)
    axis.set_ylim(-2.0, 106.0)
    axis.set_xlim(0.0, None)


def _mark_required(
    axis: Axes, rows: pd.DataFrame, color: str, y: float, sampled: Sequence[float]
) -> None:
    """Required SD with its interval near the foot of the panel, and its number.

    An open end of the interval goes as far as SDs were sampled, mm. Several specimens are drawn
    fainter and a little apart, so that each keeps its interval.
    """
    found = rows.dropna(subset=["sd_mm"])
    for index, (_, row) in enumerate(found.iterrows()):
        lift = y + 4.0 * (index / len(found))
        ends = row[["sd_low_mm", "sd_high_mm"]].to_numpy(float)
        ends = np.where(np.isfinite(ends), ends, (min(sampled), max(sampled)))
        axis.plot(
            ends,
            [lift, lift],
            color=color,
            lw=1.2 if len(found) == 1 else 0.7,
            solid_capstyle="butt",
        )
        axis.plot([row["sd_mm"]], [lift], "^", color=color, ms=4.5, mec="white", mew=0.4, zorder=5)
    if len(rows) == 1:
        row = rows.iloc[0]
        known = np.isfinite(row["sd_mm"])
        axis.annotate(
            required_words(row, sampled),
            (0.0, y + 2.0 if known else y),
            (4, 3.5),
            textcoords="offset points",
            va="bottom" if known else "center",
            fontsize=6.0,
            color=INK[color],
        )


def _mark_paper(upper: Axes, lower: Axes, cohort: Cohort) -> None:
    """The SD that the paper reports for its landmarks, per axis as this axis is.

    The paper's is that of the resultant; the axes are taken to share it alike.
    """
    paper = GOULD_2024A.beside(cohort.name)
    if paper is None:
        return
    resultant = float(paper[1]["landmarks"]["largest_resultant_sd_mm"])
    sd = resultant / np.sqrt(3.0)
    for axis in (upper, lower):
        axis.axvline(sd, color=THEIRS, lw=0.9, zorder=1)
    upper.annotate(
        f"{paper[0]}: {fixed(sd)} mm per axis\n({tick(resultant)} mm resultant)",
        (sd, 1.0),
        (2, -1),
        xycoords=("data", "axes fraction"),
        textcoords="offset points",
        va="top",
        fontsize=6.0,
        color=INK[THEIRS],
    )


def _words(
    study: JointPoseSensitivity, cohort: Cohort, curves: pd.DataFrame, required: pd.DataFrame
) -> str:
    specimens = curves["specimen"].nunique()
    poses = f"{count(int(curves['n'].max()), 'pose')} per SD"
    lines = "line: median, dashed: 95th percentile"
    if specimens > 1:
        lines = f"thin: each of {specimens} specimens, thick: their median"
    shown = "triangle: largest SD that will do, with 95 % interval"
    if specimens == 1:
        shown += "; band below: 95 % interval (Wilson)"
    both = required[required["motion"] == "both"]
    sampled = study.landmark_precision.sd_mm
    told = [
        f"below both limits with {WHOSE[row['stiffness']]}: {required_words(row, sampled)}"
        for _, row in both.iterrows()
        if specimens == 1
    ]
    paper = GOULD_2024A.beside(cohort.name)
    resultant = (
        "the paper's SD is that of its worst landmark, the resultant over the root of three"
        if paper
        else ""
    )
    return "; ".join(part for part in (poses, lines, shown, *told, resultant) if part) + "."
