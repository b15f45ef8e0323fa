"""Figure: predicted less measured motion, with each pose's own stiffness and with the best sets."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from spinepipe.cohort import Cohort
from spinepipe.report.glyphs import (
    BAR_PT,
    EXACT,
    KEY,
    THIN_BAR_PT,
    draw_bar,
    exact,
    finite,
    rounded,
)
from spinepipe.report.panels import PanelRows, explain, grid, head, label_rows, row_height, rows_of
from spinepipe.report.style import BEST, GREY, INK, OURS, note, saying
from spinepipe.report.words import AXIS, POSITIVE, count, fixed, percent, unit
from spinepipe.status import USABLE
from spinepipe.studies.joint_pose_sensitivity.findings import settling
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.studies.joint_pose_sensitivity.variables import readings
from spinepipe.units import COORDINATE_COLUMNS, COORDINATES

OWN = "calibrated"
_COLUMN = dict(zip(COORDINATES, COORDINATE_COLUMNS, strict=True))
_RUN = ["specimen", "pose", "stiffness", "test", "cycle"]


@dataclass(frozen=True)
class _RunGroup:
    """A group of simulations: what it is called, its colour and where in a row it is drawn."""

    name: str
    color: str
    offset: float
    rows: pd.DataFrame


def errors_figure(
    study: JointPoseSensitivity, cohort: Cohort, tables: Mapping[str, pd.DataFrame]
) -> Figure:
    """Errors per measured coordinate and joint, and the share of runs without equilibrium.

    Where motion is zeroed at step 0, the zeros of that step are no readings. The study tells
    whether motion was simulated at rest.
    """
    simulations = tables["simulations"]
    measured = [
        name for name, column in _COLUMN.items() if simulations[f"error_{column}"].notna().any()
    ]
    # one row per run (a test of a pose with a stiffness): did a step end without equilibrium?
    failed = simulations.assign(failed=~simulations["status"].isin(USABLE))
    runs = failed.groupby(_RUN)["failed"].any().reset_index()
    simulations = readings(simulations, cohort.zeroed_at_step_0)
    if not measured:
        total = count(len(runs), "simulation")
        return saying(f"No error can be shown: none of {total} reached a measured equilibrium.")
    columns = [f"error_{_COLUMN[name]}" for name in measured]
    known = simulations[simulations[columns].notna().any(axis=1)]
    rows = rows_of(known, cohort.specimen_names, cohort.joint_names)
    own = known["stiffness"] == OWN
    sets = [_RunGroup("own", OURS, 0.17, known[own]), _RunGroup("best", BEST, -0.23, known[~own])]
    axes, figure = grid(len(measured) + 1, rows, row_height(rows, 15.0), 4)
    for index, (name, axis) in enumerate(zip(measured, axes, strict=False)):
        head(axis, index, AXIS[name])
        _draw(name, axis, rows, sets)
    head(axes[-1], len(measured), "No equilibrium")
    _draw_failures(axes[-1], runs)
    explain(figure, _bars(sets, runs, rows), _words(runs, rows, study))
    return figure


def _draw(name: str, axis: Axes, rows: PanelRows, sets: Sequence[_RunGroup]) -> None:
    """One coordinate: two bars per row, the second below the first."""
    column = f"error_{_COLUMN[name]}"
    axis.axvline(0.0, color=GREY, lw=0.6, zorder=1)
    axis.xaxis.set_major_locator(MaxNLocator(5))
    thick = BAR_PT if rows.with_numbers else THIN_BAR_PT
    for y, frame in enumerate(rows.frames):
        for group in sets:
            values = rounded(finite(frame.loc[frame.index.isin(group.rows.index), column]))
            if len(values):
                found = draw_bar(axis, values, y + group.offset, group.color, thick)
                if rows.with_numbers:
                    ends = f"{fixed(found.low)} to {fixed(found.high)}"
                    words = EXACT if exact(values) else f"{fixed(found.median)} ({ends})"
                    note(axis, 0.02, y + group.offset + 0.19, words, group.color)
    axis.set_xlabel(f"error ({unit(name)}), + is {POSITIVE[name]}")
    label_rows(axis, rows, below=0.45, above=0.55)


def _draw_failures(axis: Axes, runs: pd.DataFrame) -> None:
    """Share of runs without equilibrium, one line per stiffness set, the own on top."""
    names = sorted(runs["stiffness"].unique(), key=lambda name: (name == OWN, name))
    best = sorted((name for name in names if name != OWN), reverse=True)
    order = [*best, *(name for name in names if name == OWN)]
    few = len(order) <= 15
    for y, name in enumerate(order):
        failed = runs.loc[runs["stiffness"] == name, "failed"]
        color = OURS if name == OWN else BEST
        share = 100.0 * float(failed.mean())
        axis.plot([0.0, share], [y, y], color=color, lw=1.0, solid_capstyle="butt")
        axis.plot([share], [y], "o", color=color, ms=3.0, clip_on=False, zorder=5)
        if few:
            words = percent(int(failed.sum()), len(failed))
            axis.annotate(
                words,
                (share, y),
                (5, 0),
                textcoords="offset points",
                fontsize=6.0,
                va="center",
                color=INK[color],
            )
    axis.set_xlim(0.0, max(5.0, 1.25 * axis.get_xlim()[1]))
    axis.set_xlabel("share of runs (%)")
    axis.set_ylim(-0.7, len(order) - 0.3)
    shown = [y for y in range(len(order)) if few or y == len(order) - 1 or y % 10 == 0]
    axis.set_yticks(shown, ["own" if order[y] == OWN else order[y] for y in shown])
    axis.spines["left"].set_visible(False)


def _bars(sets: Sequence[_RunGroup], runs: pd.DataFrame, rows: PanelRows) -> dict[str, str]:
    """Meaning of each colour."""
    best = f"all poses with the {count(len(set(runs['stiffness']) - {OWN}), 'best set')}"
    return {
        OURS: f"each pose with its own calibration ({_readings(rows, sets[0])})",
        BEST: f"{best} of the specimen ({_readings(rows, sets[1])})",
    }


def _words(runs: pd.DataFrame, rows: PanelRows, study: JointPoseSensitivity) -> str:
    own = runs["stiffness"] == OWN
    total = f"{count(int(own.sum()), 'run')} with the own calibration, {int((~own).sum())} with"
    meaning = "Error: predicted less measured, all measured load steps together, median (IQR)"
    parts = (meaning, KEY, rows.note, f"{total} best sets")
    settled = settling(study)
    return " ".join(["; ".join(part for part in parts if part) + ".", settled]).strip()


def _readings(rows: PanelRows, group: _RunGroup) -> str:
    """How many errors a bar stands for, over all rows."""
    numbers = [int(frame.index.isin(group.rows.index).sum()) for frame in rows.frames]
    low, high = int(np.min(numbers)), int(np.max(numbers))
    least = "" if low == high else f"{low:,}–"
    return f"n = {least}{high:,} per row".replace(",", "\u2009")
