"""Figure: predicted against measured motion after Bland and Altman.

Each reading as the difference (predicted less measured) over the mean of the two, mm or deg, with
the mean difference (bias) and the limits of agreement, bias +- 1.96 SD of the differences.
"""

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

# columns of the table `agreement`, in the order in which `_draw_rows` takes them apart
_NUMBERS = ["lower_limit", "upper_limit", "bias_low", "bias_high", "bias"]
MOST_PANELS = 12
"""With more joints and coordinates than this, bias and limits are drawn in rows instead of panels,
without the readings.
"""

_DATASET, _OWN = "reduced", "calibrated"
"""Poses whose fit neither failed nor is an outlier (`filters`), and the stiffness set that was
fitted in the pose itself.
"""
_ACROSS_AT_MOST, _PANEL_MM, _KEY_MM = 3, 48.0, 16.0
_MOST_OUTLINES = 300
"""More dots than this become a picture inside the SVG, which stays small."""
LIMITS = VERMILLION
"""Colour of the limits of agreement."""


def agreement_figure(
    study: JointPoseSensitivity, cohort: Cohort, tables: Mapping[str, pd.DataFrame]
) -> Figure:
    """A panel per specimen, joint and coordinate; with more than `MOST_PANELS`, rows instead.

    Parameters
    ----------
    tables : agreement, and for panels success and simulations.
    """
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
    """Whether there are too many joints and coordinates for a panel each.

    Parameters
    ----------
    table : agreement.
    """
    return len(_usable(table, cohort)) > MOST_PANELS


def _usable(table: pd.DataFrame, cohort: Cohort) -> pd.DataFrame:
    """Rows with a result of single joints in the reduced dataset.

    By specimen, then joint from above, then coordinate. Rows without a result have too few pairs of
    readings, or the same difference in all of them.
    """
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
    """One joint and coordinate of a specimen.

    Attributes
    ----------
    row : of the table ``agreement``. readings : ``mean`` of predicted and measured, and their
        ``difference``, predicted less measured, mm or deg.
    """

    row: pd.Series
    readings: pd.DataFrame
    title: str


def _panel(row: pd.Series, tables: Mapping[str, pd.DataFrame], n_specimens: int) -> _AgreementPanel:
    """The readings behind a row of the table: all poses of the reduced dataset, tests and steps.

    Step 0 is drawn too. Where motion is zeroed there it is a dot at (0, 0), which the table, its
    limits and its n leave out.
    """
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
    """Readings as dots; bias and limits as lines, with bands for their 95 % intervals."""
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
        # of the interval of a limit the table has the end away from the bias alone; towards the
        # bias the band is drawn as wide. The interval itself (noncentral t, see `bland_altman`) is
        # narrower on that side, the more so the fewer pairs there are
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
    """A line at y with a band between ``ends``: full for the bias (black), dashed for limits."""
    axis.axhspan(*ends, color=color, alpha=0.15, lw=0, zorder=1)
    axis.axhline(y, color=color, lw=0.9, ls="-" if color == BLACK else (0, (5, 2)), zorder=4)


def _draw_rows(cohort: Cohort, known: pd.DataFrame, settled: str = "") -> Figure:
    """A panel per coordinate: bias with its interval on a line from limit to limit.

    A row of a panel is a joint of a specimen, or where these are many of all specimens, whose bars
    then lie over each other, half transparent. ``settled`` : a sentence where motion was read
    before it had come to rest, or nothing.
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
