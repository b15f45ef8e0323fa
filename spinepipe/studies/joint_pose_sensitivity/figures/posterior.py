"""Figure: the stiffness that the data make likely, the motion it predicts, the weights of poses."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from spinepipe.cohort import Cohort
from spinepipe.report.glyphs import draw_interval
from spinepipe.report.panels import (
    EVERY_JOINT,
    PanelRows,
    explain,
    head,
    label_rows,
    log_ticks,
    mark_start,
    rows_of,
    sections,
)
from spinepipe.report.style import BEST, BLACK, GREY, OURS, note, saying
from spinepipe.report.words import AXIS, number
from spinepipe.status import Status
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.units import COORDINATES, STIFFNESS_COLUMNS, STIFFNESS_UNITS

_ROW_MM, _AROUND_MM, _MOTION_MM, _KEY_MM = 13.0, 18.0, 62.0, 17.0
_LAPLACE_BELOW = 0.2
_MOTIONS = {"mm": "Translations", "deg": "Rotations"}


def posterior_figure(
    study: JointPoseSensitivity, cohort: Cohort, tables: Mapping[str, pd.DataFrame]
) -> Figure:
    """Above: 95 % intervals of each stiffness; below: motion, and how the poses weigh."""
    told = tables["posterior"]
    good = told[told["status"] == Status.CONVERGED.value]
    stiffness = good[(good["quantity"] == "stiffness") & good["median"].notna()]
    if stiffness.empty:
        why = "; ".join(dict.fromkeys(told["message"])) or "it has no rows"
        return saying(f"No posterior can be shown: {why}.")
    names = list(dict.fromkeys(stiffness["unknown"]))
    shared = (stiffness["joint"] == EVERY_JOINT).all()
    joints = (EVERY_JOINT,) if shared else cohort.joint_names
    rows = rows_of(stiffness, cohort.specimen_names, joints)
    motion = tables["posterior_motion"]
    read = motion[motion["inside"].notna() & (motion["status"] == Status.CONVERGED.value)]
    units = [unit for unit in _MOTIONS if (read["unit"] == unit).any()]
    height = _ROW_MM * len(rows) + _AROUND_MM
    parts = [(len(names), height), (len(units) + 1, _MOTION_MM)]
    (upper, lower), figure = sections(parts, _KEY_MM)
    for index, (axis, name) in enumerate(zip(upper, names, strict=True)):
        _draw_stiffness(axis, rows, name, index, study)
    for index, (axis, unit) in enumerate(zip(lower[:-1], units, strict=True)):
        _draw_motion(axis, read[read["unit"] == unit], unit, len(names) + index)
    _draw_weights(lower[-1], tables["pose_weights"], len(names) + len(units))
    bars = {OURS: "sampler, 95 % interval", BEST: "Laplace, 95 % interval"}
    words = (
        "Motion: line, 95 % band of a new reading; thick, of the motion itself. "
        "Open: the prior's bound makes that end. Specimens whose sampler has not converged are "
        "not shown."
    )
    explain(figure, bars, words, dashed="start, the middle of the prior")
    return figure


def _draw_stiffness(
    axis: Axes, rows: PanelRows, name: str, index: int, study: JointPoseSensitivity
) -> None:
    coordinate = COORDINATES[STIFFNESS_COLUMNS.index(name)]
    head(axis, index, AXIS[coordinate])
    axis.set_xscale("log")
    start = study.stiffness.in_order()[COORDINATES.index(coordinate)]
    mark_start(axis, start)
    ends = [start]
    for y, frame in enumerate(rows.frames):
        for _, row in frame[frame["unknown"] == name].iterrows():
            draw_interval(axis, row["median"], (row["low"], row["high"]), y, OURS)
            near = row["laplace_low"], row["laplace_high"]
            middle = float(np.sqrt(near[0] * near[1]))
            draw_interval(axis, middle, near, y - _LAPLACE_BELOW, BEST)
            ends += [row["low"], row["high"], *near]
            if rows.with_numbers:
                told = f"{number(row['median'])} ({number(row['low'])}–{number(row['high'])})"
                sides = [side for side in ("below", "above") if row[f"open_{side}"]]
                told += f", open {' and '.join(sides)}" if sides else ""
                note(axis, 0.02, y + 0.32, told, OURS)
    low, high = 0.8 * min(ends), 1.25 * max(ends)
    axis.set_xlim(low, high)
    log_ticks(axis.xaxis, low, high)
    axis.set_xlabel(f"stiffness ({STIFFNESS_UNITS[coordinate]})")
    label_rows(axis, rows, below=0.5, above=0.6)


def _draw_motion(axis: Axes, read: pd.DataFrame, unit: str, index: int) -> None:
    """Predicted over measured motion, one mark per reading; on the line both are the same."""
    head(axis, index, f"{_MOTIONS[unit]}, predicted")
    x = read["measured"].to_numpy(float)
    for ends, width in ((("reading_low", "reading_high"), 0.8), (("low", "high"), 2.6)):
        low, high = (read[end].to_numpy(float) for end in ends)
        axis.vlines(x, low, high, color=OURS, lw=width, alpha=0.6)
    axis.plot(x, read["median"], "o", color=OURS, ms=2.5)
    reach = 0.1 * float(np.ptp(x)) or 0.1
    span = [float(x.min()) - reach, float(x.max()) + reach]
    axis.plot(span, span, color=GREY, lw=0.7, zorder=1)
    symbol = "mm" if unit == "mm" else "°"
    axis.set_xlabel(f"measured ({symbol})")
    axis.set_ylabel(f"predicted ({symbol})")


def _draw_weights(axis: Axes, weights: pd.DataFrame, index: int) -> None:
    """Share of the weight that the likeliest poses hold, one line per specimen."""
    head(axis, index, "Weight of the likeliest poses")
    axis.plot([0, 100], [0, 100], color=GREY, lw=0.7, zorder=1)
    for _, part in weights.groupby("specimen", sort=False):
        each = part.groupby("pose")["weight"].first().to_numpy(float)
        if not each.sum():
            continue
        held = np.concatenate([[0.0], np.cumsum(np.sort(each)[::-1])])
        axis.plot(np.linspace(0, 100, len(held)), 100.0 * held, color=BLACK, lw=0.9)
    axis.set_xlabel("poses, the likeliest first (%)")
    axis.set_ylabel("share of the weight (%)")
    axis.set_xlim(0, 100)
    axis.set_ylim(0, 102)
