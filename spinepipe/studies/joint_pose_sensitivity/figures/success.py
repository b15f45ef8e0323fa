"""Figure: how many fits each way of fitting brings to an end, and the derivatives it goes by."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator
from statsmodels.stats.proportion import proportion_confint

from spinepipe.cohort import Cohort
from spinepipe.report.glyphs import STRIP_KEY, draw_interval, draw_strip, finite
from spinepipe.report.panels import explain, head, log_ticks, side_by_side
from spinepipe.report.style import BLACK, INK, OURS, THEIRS, blank, note, saying
from spinepipe.report.words import count, number, percent, tick
from spinepipe.status import Status
from spinepipe.studies.joint_pose_sensitivity.gould_2024a import GOULD_2024A
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity

_ROW_MM, _AROUND_MM = 12.0, 36.0
_LEAST = 1e-16
"""Derivative errors below what numbers can resolve are drawn there."""

_COUNTS = ["fits", "successful", "arrived"]


def success_figure(
    study: JointPoseSensitivity, cohort: Cohort, tables: Mapping[str, pd.DataFrame]
) -> Figure:
    """Share of successful fits, error of the derivative, and runs of the model, by method."""
    shares, fits = tables["success_by_method"], tables["method_fits"]
    if not len(shares) or not shares["fits"].sum():
        return saying("No fit was done in several ways (methods: poses is 0).")
    why = refused(fits)
    methods = [name for name in dict.fromkeys(shares["method"]) if name not in why][::-1]
    if not methods:
        return saying("Not compared: " + "; ".join(dict.fromkeys(why.values())) + ".")
    found = GOULD_2024A.beside(cohort.name)
    counts = found and found[1]["counts"]
    paper = counts and (counts["pose_samples_successful"], counts["pose_samples"])
    figure = blank(_AROUND_MM + _ROW_MM * (len(methods) + bool(paper)))
    axes = side_by_side(figure, 3, 3, sharey=True)
    for index, axis in enumerate(axes):
        words = ("Successful fits", "Error of the derivative", "Runs of the model per fit")
        head(axis, index, words[index])
        axis.set_yticks(range(len(methods)), [method_name(name) for name in methods])
        axis.set_ylim(-0.5 - bool(paper), len(methods) - 0.4)
        axis.spines["left"].set_visible(False)
    _draw_shares(axes[0], shares, methods, paper)
    _draw_fits(axes[1], fits, "derivative_error", methods)
    axes[1].set_xlabel("at the start, relative to its size")
    _draw_fits(axes[2], fits, "evaluations", methods)
    axes[2].set_xlabel("runs")
    bars = {OURS: "the same poses, fitted in each way"}
    if found and paper:
        bars[THEIRS] = f"{found[0]}, {paper[1]} poses"
    explain(figure, bars, _words(study, len(set(shares["specimen"])), why))
    return figure


def refused(fits: pd.DataFrame) -> dict[str, str]:
    """Message of each method of which every fit was refused, in the order of the table."""
    if fits.empty:
        return {}
    return {
        str(method): "; ".join(dict.fromkeys(rows["message"]))
        for method, rows in fits.groupby("method", sort=False)
        if (rows["status"] == Status.REFUSED.value).all()
    }


def method_name(name: str) -> str:
    """Name of a way of fitting, in two lines where it is long."""
    return name.replace("forward_run_", "forward run,\n").replace("_", " ")


def _draw_shares(
    axis: Axes, shares: pd.DataFrame, methods: Sequence[str], paper: tuple[int, int] | None
) -> None:
    pooled = shares.groupby("method")[_COUNTS].sum()
    for y, method in enumerate(methods):
        fits, successful, arrived = (int(pooled[name][method]) for name in _COUNTS)
        _draw_share(axis, y, successful, fits, OURS)
        axis.plot([100.0 * arrived / fits], [y - 0.2], "D", mfc="none", mec=BLACK, ms=3.5, mew=0.8)
        words = f"least cost: {arrived} of {fits}"
        note(axis, 0.02, y - 0.36, words, BLACK)
    if paper:
        _draw_share(axis, -1, *paper, THEIRS)
    axis.set_xlim(-2.0, 102.0)
    axis.set_xlabel("share of fits (%)")


def _draw_share(axis: Axes, y: float, part: int, whole: int, color: str) -> None:
    low, high = proportion_confint(part, whole, method="wilson")
    draw_interval(axis, 100.0 * part / whole, (100.0 * low, 100.0 * high), y, color)
    note(axis, 0.02, y + 0.26, f"{part} of {whole} ({percent(part, whole)})", color)


def _draw_fits(axis: Axes, fits: pd.DataFrame, column: str, methods: Sequence[str]) -> None:
    """Every fit as a dot on a logarithmic axis, median and largest in words."""
    axis.set_xscale("log")
    for y, method in enumerate(methods):
        values = finite(fits.loc[fits["method"] == method, column])
        if not len(values):
            note(axis, 0.02, y, "could not be compared", BLACK)
            continue
        draw_strip(axis, np.maximum(values, _LEAST), y, OURS)
        most = number(float(values.max()), 2)
        words = f"median {number(float(np.median(values)), 2)}, largest {most}, n = {len(values)}"
        note(axis, 0.02, y + 0.3, words, INK[OURS])
    low, high = axis.get_xlim()
    if not (fits[column] > 0.0).any():
        axis.set_xticks([])
    elif high / low < 1e4:
        log_ticks(axis.xaxis, low, high)
    else:
        axis.xaxis.set_major_locator(LogLocator(numticks=5))
        axis.xaxis.set_minor_locator(NullLocator())
        axis.xaxis.set_major_formatter(lambda x, _: tick(x))


def _words(study: JointPoseSensitivity, specimens: int, why: Mapping[str, str]) -> str:
    success = study.success
    which = "all free stiffnesses" if success.failed_when == "all" else "a free stiffness"
    near = f"{which} within {tick(success.near_start_percent)} % of the start"
    words = (
        f"Successful: ended, without {near}; line: 95 % interval (Wilson)",
        "diamond: cost within 1 % of the least that any method found",
        f"{count(specimens, 'specimen')} pooled" if specimens > 1 else "",
        STRIP_KEY,
        *(f"{method_name(name)} not compared: {message}" for name, message in why.items()),
    )
    return "; ".join(part for part in words if part) + "."
