"""The published bootstrap beside ours: medians and ranges by loading, joint and direction."""

from collections.abc import Mapping
from typing import Any

import pandas as pd
from matplotlib.axes import Axes

from spinepipe.report.published import OF_JOINT_POSE, paper_of
from spinepipe.report.style import BLACK, THEIRS, note
from spinepipe.report.words import number
from spinepipe.units import COORDINATE_COLUMNS, COORDINATES, STIFFNESS_COLUMNS

_RANGE_OF = "quasi_static"
"""The loading whose ranges of stiffness are published."""


def draw_errors(axis: Axes, cohort: str, name: str, row: pd.DataFrame, y: float) -> None:
    """Median of an error with its range around it (no ends are printed), where it is published."""
    sampled, loading, joint = (row[key].iloc[0] for key in ("bootstrap", "loading", "joint"))
    column = COORDINATE_COLUMNS[COORDINATES.index(name)]
    table = _paper(cohort).get(f"{sampled}_bootstrap_error", {})
    found = table.get(loading, {}).get(joint, {})
    median, width = (found.get(what, {}).get(column) for what in ("median", "range"))
    if median is None or width is None:
        return
    low = max(0.0, median - width / 2.0)  # an error is not negative
    axis.plot([low, low + width], [y, y], color=THEIRS, lw=0.8, zorder=4)
    axis.plot([median], [y], "|", color=BLACK, ms=5.0, mew=1.0, zorder=5)
    axis.plot([median], [y], "D", color=THEIRS, ms=2.6, mew=0.0, zorder=4)


def write_range(axis: Axes, cohort: str, name: str, row: pd.DataFrame, y: float) -> None:
    """Width of the range of a stiffness, where it is published (its place is not)."""
    column = STIFFNESS_COLUMNS[COORDINATES.index(name)]
    table = _paper(cohort).get("bootstrap_stiffness_range", {})
    width = table.get(row["bootstrap"].iloc[0], {}).get(column)
    if width is not None and row["loading"].iloc[0] == _RANGE_OF:
        note(axis, 0.02, y, f"range {number(width, 2)}", THEIRS)


def _paper(cohort: str) -> Mapping[str, Any]:
    """Numbers of the paper that the cohort was rebuilt from, empty where there is none."""
    found = paper_of(cohort, OF_JOINT_POSE)
    return {} if found is None else found[1]
