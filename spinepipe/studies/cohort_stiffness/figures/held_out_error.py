"""Figure: error of motion that was fitted and of motion that was held out, by representation."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from spinepipe.cohort import Cohort
from spinepipe.report.glyphs import finite, spread_out
from spinepipe.report.panels import explain_marks, head, log_ticks, side_by_side
from spinepipe.report.style import BLACK, GREY, OURS, THEIRS, blank, note, saying
from spinepipe.report.words import SIGNS, after_number, count, number
from spinepipe.statistics import mean_of
from spinepipe.studies.cohort_stiffness.representations import IN_WORDS, NAMES, PUBLISHED, named
from spinepipe.studies.cohort_stiffness.settings import CohortStiffness
from spinepipe.studies.cohort_stiffness.stages import MOTIONS, of_joint_fits, specimen_rms, unit_of

KEYS = ["stage", "representation", "specimen"]

PANELS = {
    "fitted": "Fitted motion",
    "left_out_case": "Left-out load case",
    "left_out_specimen": "Left-out specimen",
}

LEAST = 1e-3
"""Smaller errors, of exact fits, are drawn there."""

_ROW_MM, _AROUND_MM, _KEY_MM = 13.0, 16.0, 18.0
_DASHES, _DOTS = (0, (4, 2)), (0, (1, 1))
_DOT: dict[str, Any] = {"color": OURS, "ms": 3.0, "mew": 0, "alpha": 0.55}


def held_out_error_figure(
    study: CohortStiffness, cohort: Cohort, tables: Mapping[str, pd.DataFrame]
) -> Figure:
    """A panel for fitted motion and one for each way of holding motion out."""
    errors = tables["errors"]
    found = motion_errors(errors) if len(errors) else errors
    unit = unit_of(errors) if len(errors) else "deg"
    panels = [name for name in PANELS if len(found) and (found["stage"] == name).any()]
    if not panels:
        return saying("No error of a fit can be shown: no fit has a result.")
    fitted = found[found["stage"].isin(panels)]
    rows = [name for name in NAMES[::-1] if name in set(fitted["representation"])]
    # The mean error over specimens of each published set.
    literature = found[found["stage"] == "literature"]
    means = literature.groupby("representation")["error"].mean()
    published = {name: float(means[name]) for name in PUBLISHED if name in means.index}
    figure = blank(max(45.0, _ROW_MM * len(rows) + _AROUND_MM + _KEY_MM))
    axes = side_by_side(figure, len(panels), len(panels), sharey=True, sharex=True)
    sizes = np.maximum([*finite(fitted["error"]), *published.values()], LEAST)
    low, high = float(sizes.min()) / 1.35, float(sizes.max()) * 1.35
    for index, (name, axis) in enumerate(zip(panels, axes, strict=True)):
        head(axis, index, PANELS[name])
        axis.set_xscale("log")
        axis.set_xlim(low, high)
        log_ticks(axis.xaxis, low, high, 5)
        axis.set_xlabel(f"root mean square error of {MOTIONS[unit]} ({SIGNS[unit]})")
        names = [IN_WORDS[row].replace(" of ", "\nof ").replace(", ", ",\n") for row in rows]
        axis.set_yticks(range(len(rows)), names)
        axis.set_ylim(-0.55, len(rows) - 0.35)
        axis.spines["left"].set_visible(False)
        for representation, value in published.items():
            axis.axvline(value, **_look(representation), zorder=1)
        _draw(axis, found[found["stage"] == name], rows, unit)
    _explain(figure, published, len(cohort.specimen_names), unit)
    return figure


def motion_errors(errors: pd.DataFrame) -> pd.DataFrame:
    """Root mean square error over all readings that are compared, column ``error``, by ``KEYS``.

    Of held-out load cases each is predicted by the fit that left it out; all else is of fits to
    all load cases. A specimen without an error for all that was measured of it is left out.
    """
    found = {
        (stage, name): values
        for stage in errors["stage"].unique()
        for name, rows in of_joint_fits(errors, stage).groupby("representation", sort=False)
        if len(values := specimen_rms(rows, errors))
    }
    if not found:
        return pd.DataFrame(columns=[*KEYS, "error"])
    return pd.concat(found, names=KEYS).rename("error").reset_index()


def _look(published: str) -> dict[str, Any]:
    """Line of a published set."""
    if named(published).by_level:
        return {"color": THEIRS, "ls": _DOTS, "lw": 1.0}
    return {"color": GREY, "ls": _DASHES, "lw": 1.0}


def _draw(axis: Axes, rows: pd.DataFrame, names: Sequence[str], unit: str) -> None:
    low, _ = axis.get_xlim()
    for y, name in enumerate(names):
        values = finite(rows.loc[rows["representation"] == name, "error"])
        axis.axhline(y - 0.5, color=GREY, lw=0.2, zorder=0)
        if not len(values):
            note(axis, 0.02, y, "no result", GREY)
            continue
        shown = np.maximum(values, LEAST)
        axis.plot(shown, y - 0.12 + 0.3 * spread_out(len(values)), "o", **_DOT, zorder=3)
        words = f"{number(float(values.mean()))}{after_number(unit)}"
        interval = mean_of(values).interval
        if interval is not None:
            ends = max(0.0, interval[0]), interval[1]
            line = [max(ends[0], low), ends[1]]
            axis.plot(line, [y + 0.16] * 2, color=BLACK, lw=1.1, zorder=4, solid_capstyle="butt")
            words = f"{words} ({number(ends[0])}–{number(ends[1])})"
        middle = max(float(values.mean()), LEAST)
        axis.plot([middle], [y + 0.16], "D", color=BLACK, ms=3.2, mew=0, zorder=5)
        note(axis, 0.02, y + 0.4, words, BLACK)


def _explain(figure: Figure, published: Mapping[str, float], specimens: int, unit: str) -> None:
    handles = [Line2D([], [], **_DOT, marker="o", ls="", label="a specimen")]
    mean = "mean with 95 % interval" if specimens > 1 else "mean"
    handles.append(Line2D([], [], color=BLACK, marker="D", ms=3.2, mew=0, lw=1.1, label=mean))
    for name, value in published.items():
        label = f"{IN_WORDS[name]}: {number(value)}{after_number(unit)}"
        handles.append(Line2D([], [], **_look(name), label=label))
    words = (
        f"All measured {MOTIONS[unit]} of all joints, load steps and used cycles; "
        f"{count(specimens, 'specimen')}. Vertical lines: stiffness that was not fitted at all."
    )
    explain_marks(figure, handles, words, len(handles))
