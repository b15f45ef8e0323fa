"""Figure: outputs of all runs over the values of the factors that lead."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from spinepipe.cohort import Cohort
from spinepipe.report.discrepancy.words import capital
from spinepipe.report.global_sensitivity.measures import NAME, Measures, measures_of, unit_of
from spinepipe.report.global_sensitivity.panels import first_of, outputs
from spinepipe.report.global_sensitivity.responses import TOP, Output, Values, output_of, running
from spinepipe.report.global_sensitivity.titles import no_index
from spinepipe.report.global_sensitivity.words import factor_name, what, where
from spinepipe.report.layout import explain_marks
from spinepipe.report.log_axis import log_ticks
from spinepipe.report.spread import Array
from spinepipe.report.style import BLUE, GREY, blank, saying
from spinepipe.report.words import count, fixed, number

MOST_OUTPUTS, MOST_DOTS = 3, 1000
_PANEL_MM, _KEY_MM = 56.0, 17.0
_UNITS = {"deg": "°", "1": "times"}


def scatter_figure(
    cohort: Cohort, responses: pd.DataFrame, design: pd.DataFrame, indices: pd.DataFrame
) -> Figure:
    """A line of panels for each output: all runs over the values of its three leading factors."""
    measures = measures_of(indices)
    found = outputs(cohort, indices, measures) if measures else []
    if not found or measures is None:
        return no_index(indices)
    values, units = _values(design)
    run = [panel for panel in found if panel.output != "stiffness"]
    first = first_of(run, MOST_OUTPUTS)
    groups = dict(zip(design["factor"], design["group"], strict=True))
    every = [output_of(panel, responses, measures, values, groups) for panel in first]
    lines = [one for one in every if one is not None and one.factors]
    if not lines:
        return saying("No runs can be shown: none has an equilibrium.")
    figure = blank(len(lines) * _PANEL_MM + _KEY_MM)
    axes = figure.subplots(len(lines), TOP, squeeze=False, sharey="row")
    for number_, (line, one) in enumerate(zip(axes, lines, strict=True)):
        _line(line, one, values, units, measures, number_ * TOP)
    explain_marks(figure, _handles(), _words(lines, cohort), 3)
    return figure


def _values(design: pd.DataFrame) -> tuple[Values, Mapping[str, str]]:
    """Values by sample, and unit, of each factor."""
    parts = {str(name): part for name, part in design.groupby("factor", sort=False)}
    values = {name: part.set_index("sample")["value"] for name, part in parts.items()}
    return values, {name: str(part["unit"].iloc[0]) for name, part in parts.items()}


def _line(
    axes: Sequence[Axes],
    one: Output,
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
        _cloud(axis, x, np.asarray(one.values, dtype=np.float64), unit)
        axis.set_xlabel(f"{factor_name(name, 40)} ({_UNITS.get(unit, unit)})")
        axis.set_title(f"{chr(ord('a') + letter + place)}   {_index(one, name, measures)}")
        axis.tick_params(axis="y", length=2.5)
    panel = one.panel
    unit = unit_of(panel.output, panel.coordinate)
    head = f"{where(panel.test, one.joint)}\n{what(panel.output, panel.coordinate)} ({unit})"
    axes[0].set_ylabel(head)


def _cloud(axis: Axes, x: Array, y: Array, unit: str) -> None:
    """Runs as dots, at most so many of them; the middle 90 % and the median of all."""
    kept = np.random.default_rng(0).permutation(len(x))[:MOST_DOTS]
    axis.plot(x[kept], y[kept], "o", color=GREY, ms=1.6, mew=0.0, alpha=0.45, zorder=2,
              rasterized=True)  # fmt: skip
    at, (low, middle, high) = running(x, y)
    axis.fill_between(at, low, high, color=BLUE, alpha=0.15, lw=0, zorder=1)
    axis.plot(at, middle, color=BLUE, lw=1.6, zorder=4)
    if unit == "1" and x.min() > 0.0:
        axis.set_xscale("log")
        log_ticks(axis.xaxis, float(x.min()), float(x.max()))


def _index(one: Output, factor: str, measures: Measures) -> str:
    """``ST 0.71 (0.66 to 0.75)``; a factor of a group has no index."""
    if factor not in one.index.index:
        return "in a group"
    say = number if measures.in_units else fixed
    columns = ("estimate", "ci_low", "ci_high")
    size, low, high = (float(one.index[column][factor]) for column in columns)
    told = f"{NAME[measures.main].split()[-1]} {say(size)}"
    return f"{told} ({say(low)} to {say(high)})" if np.isfinite([low, high]).all() else told


def _handles() -> list[Line2D | Patch]:
    return [
        Line2D([], [], color=GREY, marker="o", ms=3.0, mew=0.0, lw=0, label="run"),
        Line2D([], [], color=BLUE, lw=1.6, label="running median"),
        Patch(facecolor=BLUE, alpha=0.15, lw=0, label="middle 90 % of the runs there"),
    ]


def _words(lines: Sequence[Output], cohort: Cohort) -> str:
    runs = max(len(one.values) for one in lines)
    parts = ["Each output at the joint where it varies most"]
    if len(cohort.specimen_names) > 1:
        parts.append(f"specimen {lines[0].specimen}")
    dots = f", {MOST_DOTS} of them drawn" if runs > MOST_DOTS else ""
    parts.append(f"{count(runs, 'run')} with an equilibrium{dots}")
    if any(name not in one.index.index for one in lines for name in one.factors):
        parts.append("of a group the factor that the output follows most")
    return capital("; ".join(parts)) + "."
