"""Figure: outputs of all runs over the values of the factors that lead."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from spinepipe.cohort import Cohort
from spinepipe.report.glyphs import Array
from spinepipe.report.panels import explain_marks, head, lines_of, log_ticks
from spinepipe.report.style import BLUE, GREY, VERMILLION, blank, saying
from spinepipe.report.words import capital, count, fixed, number
from spinepipe.sensitivity_analysis.global_indices.design import DUMMY
from spinepipe.status import Status
from spinepipe.studies.global_sensitivity.figures.panels import (
    NAME,
    Measures,
    Panel,
    factor_name,
    first_of,
    no_index,
    shown_outputs,
    unit_of,
    what,
    where,
)
from spinepipe.studies.global_sensitivity.settings import GlobalSensitivity
from spinepipe.units import COORDINATE_COLUMNS, COORDINATES, TRANSLATIONS

TOP = 3
Values = Mapping[str, pd.Series]
"""Value of each factor of the design by sample."""


@dataclass(frozen=True, eq=False)
class JointOutput:
    """One output of one joint.

    Attributes
    ----------
    values : output by sample, in the unit of the tables.
    factors : its leading factors, of a group one member.
    index : rows of the main index of this output, by factor or group.
    failed : samples without an equilibrium.
    """

    panel: Panel
    specimen: str
    joint: str
    values: pd.Series
    factors: tuple[str, ...]
    index: pd.DataFrame
    failed: pd.Index


def output_of(
    panel: Panel,
    responses: pd.DataFrame,
    measures: Measures,
    drawn: Values,
    groups: Mapping[str, str],
) -> JointOutput | None:
    """The output at the joint where it varies most, of the first specimen; None without runs.

    Parameters
    ----------
    groups : group of each factor.
    """
    specimen = str(panel.rows["specimen"].iloc[0])
    every = responses[
        (responses["specimen"] == specimen)
        & (responses["test"] == panel.test)
        & (responses["step"] == panel.step)
    ]
    stands = every["status"] == Status.CONVERGED.value
    rows = every[stands]
    if rows.empty:
        return None
    column = column_of(panel.output, panel.coordinate, responses)
    joint = str(rows.groupby("joint", sort=False)[column].std().fillna(0.0).idxmax())
    values = rows[rows["joint"] == joint].set_index("sample")[column]
    index = panel.rows[
        (panel.rows["index"] == measures.main)
        & (panel.rows["specimen"] == specimen)
        & (panel.rows["joint"] == joint)
    ].set_index("factor")
    order = index["estimate"].drop(DUMMY, errors="ignore").sort_values(ascending=False)
    leading = _drawn(list(order.index), values, drawn, groups)
    failed = pd.Index(every.loc[~stands, "sample"].unique())
    return JointOutput(panel, specimen, joint, values, leading, index, failed)


def _drawn(
    order: Sequence[str], values: pd.Series, drawn: Values, groups: Mapping[str, str]
) -> tuple[str, ...]:
    """The leading factors; of a group the member whose ranks follow the output's most."""
    ranks = values.rank()

    def follows(name: str) -> float:
        return abs(float(ranks.corr(drawn[name].reindex(values.index).rank())))

    members = [[name for name in drawn if groups[name] == leader] for leader in order[:TOP]]
    return tuple(max(of_group, key=follows) for of_group in members if of_group)


def column_of(output: str, coordinate: str, responses: pd.DataFrame) -> str:
    """Column of an output in ``responses``: motion ends with mm or deg, loads with n or nm."""
    if output == "motion":
        return f"predicted_{COORDINATE_COLUMNS[COORDINATES.index(coordinate)]}"
    ending = f"{coordinate}_{'n' if coordinate in TRANSLATIONS else 'nm'}"
    return next(str(name) for name in responses.columns if str(name).endswith(ending))


def running(x: Array, y: Array, few: int = 12) -> tuple[Array, Array]:
    """(P,) middles and (3, P) 5th percentile, median and 95th of y along x.

    Parts hold equal numbers of runs, of about 100 different values of x: designs repeat values, and
    runs that share one are much alike. Of a design of few levels each level is one part.
    """
    levels = np.unique(x)
    if len(levels) <= few:
        groups = [x == level for level in levels]
    else:
        # a hundred different values a part, from four parts to twenty
        parts = min(20, max(4, len(levels) // 100))
        part = np.searchsorted(np.quantile(levels, np.arange(1, parts) / parts), x)
        groups = [part == number for number in range(parts)]
    middles = np.array([np.median(x[group]) for group in groups])
    found = np.array([np.percentile(y[group], [5.0, 50.0, 95.0]) for group in groups])
    return middles, found.T


MOST_OUTPUTS, MOST_DOTS = 3, 1000
_PANEL_MM, _KEY_MM = 56.0, 17.0
_CROSS: Mapping[str, Any] = {"color": VERMILLION, "marker": "x", "ms": 3.5, "mew": 0.8, "lw": 0}
_BOTTOM = 0.02
"""Where failed runs are marked, as a part of the panel's height."""

_UNITS = {"deg": "°", "1": "times"}


def scatter_figure(
    study: GlobalSensitivity, cohort: Cohort, tables: Mapping[str, pd.DataFrame]
) -> Figure:
    """A line of panels for each output: all runs over the values of its three leading factors."""
    responses, design, indices = tables["responses"], tables["design"], tables["indices"]
    found, measures = shown_outputs(cohort, indices)
    if not found or measures is None:
        return no_index(indices)
    # values by sample, and unit, of each factor
    parts = {str(name): part for name, part in design.groupby("factor", sort=False)}
    values = {name: part.set_index("sample")["value"] for name, part in parts.items()}
    units = {name: str(part["unit"].iloc[0]) for name, part in parts.items()}
    run = [panel for panel in found if panel.output != "stiffness"]
    first = first_of(run, MOST_OUTPUTS)
    groups = dict(zip(design["factor"], design["group"], strict=True))
    every = [output_of(panel, responses, measures, values, groups) for panel in first]
    lines = [one for one in every if one is not None and one.factors]
    if not lines:
        return saying("No runs can be shown: none has an equilibrium.")
    figure = blank(len(lines) * _PANEL_MM + _KEY_MM)
    axes = lines_of(figure, len(lines) * TOP, TOP, sharey="row")
    for number_, (line, one) in enumerate(zip(axes, lines, strict=True)):
        _line(line, one, values, units, measures, number_ * TOP)
    handles = _handles(any(len(one.failed) for one in lines))
    explain_marks(figure, handles, _words(lines, cohort), len(handles))
    return figure


def _line(
    axes: Sequence[Axes],
    one: JointOutput,
    values: Values,
    units: Mapping[str, str],
    measures: Measures,
    letter: int,
) -> None:
    for place, axis in enumerate(axes):
        if place >= len(one.factors):
            axis.set_visible(False)
            continue
        name = one.factors[place]
        unit = units[name]
        x = np.asarray(values[name].reindex(one.values.index), dtype=np.float64)
        lost = np.asarray(values[name].reindex(one.failed), dtype=np.float64)
        _cloud(axis, x, np.asarray(one.values, dtype=np.float64), unit, lost)
        axis.set_xlabel(f"{factor_name(name, 40)} ({_UNITS.get(unit, unit)})")
        head(axis, letter + place, _index(one, name, measures))
        axis.tick_params(axis="y", length=2.5)
    panel = one.panel
    unit = unit_of(panel.output, panel.coordinate)
    words = f"{where(panel.test, one.joint)}\n{what(panel.output, panel.coordinate)} ({unit})"
    axes[0].set_ylabel(words)


def _cloud(axis: Axes, x: Array, y: Array, unit: str, lost: Array) -> None:
    """Runs as dots, at most so many of them; the middle 90 % and the median of all.

    Parameters
    ----------
    lost : values of the factor at runs that failed and have no output: crosses at the bottom.
    """
    # the same dots each time a figure is drawn
    kept = np.random.default_rng(0).permutation(len(x))[:MOST_DOTS]
    axis.plot(
        x[kept], y[kept], "o", color=GREY, ms=1.6, mew=0.0, alpha=0.45, zorder=2, rasterized=True
    )
    at, (low, middle, high) = running(x, y)
    axis.fill_between(at, low, high, color=BLUE, alpha=0.15, lw=0, zorder=1)
    axis.plot(at, middle, color=BLUE, lw=1.6, zorder=4)
    if len(lost):
        bottom = np.full(len(lost), _BOTTOM)
        axis.plot(lost, bottom, transform=axis.get_xaxis_transform(), zorder=5, **_CROSS)
    if unit == "1" and x.min() > 0.0:
        axis.set_xscale("log")
        ends = np.concatenate([x, lost])
        log_ticks(axis.xaxis, float(ends.min()), float(ends.max()))


def _index(one: JointOutput, factor: str, measures: Measures) -> str:
    """``ST 0.71 (0.66 to 0.75)``; a factor of a group has no index."""
    if factor not in one.index.index:
        return "in a group"
    say = number if measures.in_units else fixed
    columns = ("estimate", "ci_low", "ci_high")
    size, low, high = (float(one.index[column][factor]) for column in columns)
    told = f"{NAME[measures.main].split()[-1]} {say(size)}"
    return f"{told} ({say(low)} to {say(high)})" if np.isfinite([low, high]).all() else told


def _handles(failed: bool) -> list[Line2D | Patch]:
    return [
        Line2D([], [], color=GREY, marker="o", ms=3.0, mew=0.0, lw=0, label="run"),
        Line2D([], [], color=BLUE, lw=1.6, label="running median"),
        Patch(facecolor=BLUE, alpha=0.15, lw=0, label="middle 90 % of the runs there"),
        *([Line2D([], [], label="failed run, at its value", **_CROSS)] if failed else []),
    ]


def _words(lines: Sequence[JointOutput], cohort: Cohort) -> str:
    runs = max(len(one.values) for one in lines)
    parts = ["Each output at the joint where it varies most"]
    if len(cohort.specimen_names) > 1:
        parts.append(f"specimen {lines[0].specimen}")
    dots = f", {MOST_DOTS} of them drawn" if runs > MOST_DOTS else ""
    parts.append(f"{count(runs, 'run')} with an equilibrium{dots}")
    lost = max(len(one.failed) for one in lines)
    if lost:
        parts.append(f"{count(lost, 'run')} without")
    if any(name not in one.index.index for one in lines for name in one.factors):
        parts.append("of a group the factor that the output follows most")
    return capital("; ".join(parts)) + "."
