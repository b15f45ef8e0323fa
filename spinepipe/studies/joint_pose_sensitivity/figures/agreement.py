"""Figure: predicted against measured motion after Bland and Altman."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from spinepipe.cohort import Cohort
from spinepipe.report.glyphs import EXACT, exact, rounded
from spinepipe.report.panels import (
    explain,
    grid,
    head,
    label_rows,
    row_height,
    rows_of,
    side_by_side,
)
from spinepipe.report.style import BLACK, GREY, OURS, VERMILLION, blank, saying
from spinepipe.report.words import AXIS, POSITIVE, count, fixed, unit
from spinepipe.studies.joint_pose_sensitivity.findings import settling
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.units import COORDINATE_COLUMNS, COORDINATES

_NUMBERS = ["lower_limit", "upper_limit", "bias_low", "bias_high", "bias"]
MOST_PANELS = 12
"""With more of them, bias and limits are drawn in rows instead, without the readings."""

_DATASET, _OWN = "reduced", "calibrated"
_ACROSS_AT_MOST, _PANEL_MM, _KEY_MM = 3, 48.0, 16.0
_MOST_OUTLINES = 300
LIMITS = VERMILLION


def agreement_figure(
    study: JointPoseSensitivity, cohort: Cohort, tables: Mapping[str, pd.DataFrame]
) -> Figure:
    """A panel per joint and coordinate, or where there are many a row for each."""
    known = _usable(tables["agreement"], cohort)
    if known.empty:
        total = count(len(tables["agreement"]), "row")
        return saying(f"No agreement can be shown: none of {total} has two different readings.")
    if len(known) > MOST_PANELS:
        return _draw_rows(cohort, known, settling(study))
    panels = [_panel(row, tables, len(cohort.specimen_names)) for _, row in known.iterrows()]
    coordinates = known["coordinate"].nunique()  # a column for each, where there are several
    across = min(len(panels), coordinates if coordinates > 1 else _ACROSS_AT_MOST)
    figure = blank(-(-len(panels) // across) * _PANEL_MM + _KEY_MM)
    axes = side_by_side(figure, len(panels), across)
    for index, (panel, axis) in enumerate(zip(panels, axes, strict=True)):
        head(axis, index, panel.title)
        _draw(axis, panel)
    words = "Reduced poses; bands: 95 % intervals of bias and limits of agreement (bias ± 1.96 SD)."
    bars = {OURS: "a reading with the pose's own stiffness"}
    if all(exact(panel.readings["difference"]) for panel in panels):
        words = "Reduced poses. No difference is larger than rounding, so there are no limits."
    else:
        bars |= {BLACK: "bias", LIMITS: "limits"}
    explain(figure, bars, f"{words} {settling(study)}".strip())
    return figure


def in_rows(table: pd.DataFrame, cohort: Cohort) -> bool:
    """Whether there are too many joints and directions for a panel each."""
    return len(_usable(table, cohort)) > MOST_PANELS


def _usable(table: pd.DataFrame, cohort: Cohort) -> pd.DataFrame:
    """Rows with a result of the reduced dataset, by specimen, coordinate and joint from above."""
    rows = table[(table["status"] == "done") & (table["dataset"] == _DATASET)]
    single = rows[rows["joint"] != "*"]
    orders = {
        "specimen": list(cohort.specimen_names),
        "joint": list(reversed(cohort.joint_names)),
        "coordinate": list(COORDINATES),
    }
    places = [single[name].map(order.index) for name, order in orders.items()]
    found = single.assign(_specimen=places[0], _joint=places[1], _coordinate=places[2])
    return found.sort_values(["_specimen", "_joint", "_coordinate"])


@dataclass(frozen=True)
class _AgreementPanel:
    """One joint and coordinate of a specimen: the row of the table and the readings behind it."""

    row: pd.Series
    readings: pd.DataFrame
    title: str


def _panel(row: pd.Series, tables: Mapping[str, pd.DataFrame], n_specimens: int) -> _AgreementPanel:
    column = COORDINATE_COLUMNS[COORDINATES.index(row["coordinate"])]
    success, runs = tables["success"], tables["simulations"]
    kept = success.loc[success["reduced"] & (success["specimen"] == row["specimen"]), "pose"]
    chosen = runs["stiffness"].eq(_OWN) & runs["specimen"].eq(row["specimen"])
    chosen &= runs["joint"].eq(row["joint"]) & runs["pose"].isin(kept)
    predicted = runs.loc[chosen, f"predicted_{column}"]
    measured = runs.loc[chosen, f"measured_{column}"]
    readings = pd.DataFrame(
        {"mean": (predicted + measured) / 2.0, "difference": predicted - measured}
    ).dropna()
    readings["difference"] = rounded(readings["difference"])
    words = [row["specimen"]] if n_specimens > 1 else []
    title = ", ".join([*words, row["joint"], AXIS[row["coordinate"]].lower()])
    return _AgreementPanel(row, readings, title)


def _draw(axis: Axes, panel: _AgreementPanel) -> None:
    row, readings = panel.row, panel.readings
    axis.plot(
        readings["mean"],
        readings["difference"],
        "o",
        color=OURS,
        ms=2.0,
        mew=0.0,
        alpha=0.35,
        rasterized=len(readings) > _MOST_OUTLINES,
        zorder=3,
    )
    axis.axhline(0.0, color=GREY, lw=0.5, zorder=1)
    axis.xaxis.set_major_locator(MaxNLocator(4))
    name = row["coordinate"]
    axis.set_xlabel(f"mean of both ({unit(name)}), + is {POSITIVE[name]}")
    axis.set_ylabel(f"predicted less measured ({unit(name)})")
    if exact(readings["difference"]):
        axis.set_yticks([0.0])
        axis.set_ylim(-1.0, 1.0)
        words = f"{EXACT}, n = {row['n']}"
    else:
        # each limit in the middle of its interval, of which the outer end is in the table
        _line(axis, row["bias"], (row["bias_low"], row["bias_high"]), BLACK)
        lower, upper, far = row["lower_limit"], row["upper_limit"], row["upper_limit_high"]
        sd_band = lower - row["lower_limit_low"]
        _line(axis, lower, (row["lower_limit_low"], lower + sd_band), LIMITS)
        _line(axis, upper, (2.0 * upper - far, far), LIMITS)
        axis.margins(y=0.18)
        axis.yaxis.set_major_locator(MaxNLocator(5))
        limits = f"({fixed(row['lower_limit'])} to {fixed(row['upper_limit'])})"
        words = f"bias {fixed(row['bias'])} {limits}, n = {row['n']}"
    axis.text(0.02, 0.995, words, transform=axis.transAxes, fontsize=6.0, va="top")


def _line(axis: Axes, y: float, ends: tuple[float, float], color: str) -> None:
    axis.axhspan(*ends, color=color, alpha=0.15, lw=0, zorder=1)
    axis.axhline(y, color=color, lw=0.9, ls="-" if color == BLACK else (0, (5, 2)), zorder=4)


def _draw_rows(cohort: Cohort, known: pd.DataFrame, settled: str = "") -> Figure:
    """A panel per coordinate: bias with its interval on a line from limit to limit.

    ``settled`` is what is to be said where motion was not simulated at rest, or nothing.
    """
    names = [name for name in COORDINATES if name in set(known["coordinate"])]
    rows = rows_of(known, cohort.specimen_names, cohort.joint_names)
    axes, figure = grid(len(names), rows, row_height(rows, 8.0))
    for index, (name, axis) in enumerate(zip(names, axes, strict=True)):
        head(axis, index, AXIS[name])
        axis.axvline(0.0, color=GREY, lw=0.6, zorder=1)
        for y, frame in enumerate(rows.frames):
            here = frame[frame["coordinate"] == name]
            alpha = 1.0 if len(here) == 1 else 0.35
            bar: dict[str, Any] = {"color": OURS, "lw": 2.5, "alpha": alpha}
            for _, row in here.iterrows():
                low, high, bias_low, bias_high, bias = rounded(row[_NUMBERS])
                axis.plot([low, high], [y, y], **bar, solid_capstyle="butt")
                axis.plot([bias_low, bias_high], [y, y], color=BLACK, lw=1.2, zorder=4)
                axis.plot([bias], [y], "|", color=BLACK, ms=5.0, mew=1.0, zorder=5)
        label_rows(axis, rows, below=0.6, above=0.6)
        axis.xaxis.set_major_locator(MaxNLocator(4))
        axis.set_xlabel(f"predicted less measured ({unit(name)})")
    bars = {OURS: "limits of agreement (bias ± 1.96 SD)", BLACK: "bias with 95 % interval"}
    told = ("Reduced poses with their own stiffness.", rows.note and f"{rows.note}.", settled)
    explain(figure, bars, " ".join(words for words in told if words))
    return figure
