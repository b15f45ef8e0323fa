"""Figure: predicted less measured motion, with each pose's own stiffness and with the best sets."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from spinepipe.cohort import Cohort
from spinepipe.report.layout import grid, label_rows, row_height
from spinepipe.report.rows import Rows, rows_of
from spinepipe.report.spread import KEY, draw_bar, finite
from spinepipe.report.style import BLUE, GREY, ORANGE, note, saying
from spinepipe.report.words import AXIS, POSITIVE, count, fixed, percent, unit
from spinepipe.statics.status import Status
from spinepipe.units import COORDINATE_COLUMNS, COORDINATES

OWN = "calibrated"
_RUN = ["specimen", "pose", "stiffness", "test", "cycle"]


@dataclass(frozen=True)
class _Set:
    """A group of simulations: what it is called, its colour and where in a row it is drawn."""

    name: str
    color: str
    offset: float
    rows: pd.DataFrame


def errors_figure(cohort: Cohort, simulations: pd.DataFrame) -> Figure:
    """Errors per measured coordinate and joint, and the share of runs without equilibrium."""
    measured = [
        name
        for name, column in zip(COORDINATES, COORDINATE_COLUMNS, strict=True)
        if simulations[f"error_{column}"].notna().any()
    ]
    runs = _failed_runs(simulations)
    if not measured:
        total = count(len(runs), "simulation")
        return saying(f"No error can be shown: none of {total} reached a measured equilibrium.")
    columns = [f"error_{_column(name)}" for name in measured]
    known = simulations[simulations[columns].notna().any(axis=1)]
    rows = rows_of(known, cohort.specimen_names, cohort.joint_names)
    own = known["stiffness"] == OWN
    sets = [_Set("own", BLUE, 0.17, known[own]), _Set("best", ORANGE, -0.23, known[~own])]
    axes, figure = grid(len(measured) + 1, rows, row_height(rows, 15.0))
    for name, axis in zip(measured, axes, strict=False):
        _draw(name, axis, rows, sets)
    _draw_failures(axes[-1], runs)
    figure.supxlabel(_key(sets, runs, rows), fontsize=6.5, color=GREY)
    return figure
