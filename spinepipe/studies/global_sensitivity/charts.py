"""Figures of global sensitivity: indices, their convergence, and runs over the leading factors."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from spinepipe.cohort import Cohort
from spinepipe.report.forms.chart import Chart, Key, Panel, saying
from spinepipe.report.forms.curves import Curves
from spinepipe.report.forms.look import BASE, MODEL, SEVERAL, SOFT, THIRD, Look
from spinepipe.report.forms.rows import Rows
from spinepipe.report.words import capital, level, plain
from spinepipe.sensitivity_analysis.global_indices.design import DUMMY
from spinepipe.studies.global_sensitivity.outputs import (
    DONE,
    NAME,
    Output,
    factor_name,
    measures_of,
    outputs,
    quantity,
    with_results,
)
from spinepipe.studies.global_sensitivity.runs import TOP, JointRuns, runs_of
from spinepipe.studies.global_sensitivity.settings import GlobalSensitivity

Tables = Mapping[str, pd.DataFrame]
Array = NDArray[np.float64]

MOST_PANELS = 6
_LOOKS: Mapping[str, Look] = {
    **{"ST": MODEL, "S1": BASE, "mu_star": MODEL, "sigma": BASE},
    **{"PAWN": MODEL, "delta": BASE, "S1_RBD": THIRD},
}


def indices(study: GlobalSensitivity, cohort: Cohort, tables: Tables) -> Chart:
    """Indices of each output, factor by factor, a panel for each joint where there is room."""
    title = "What each output depends on"
    rows = tables["indices"]
    measures = measures_of(rows)
    found = outputs(cohort, rows, measures) if measures else []
    if not measures or not found:
        return _nothing(title, rows)
    panels: list[Panel] = []
    shown = _panels(found, cohort.joint_names)
    scale, unit = (100.0, "share of the variance (%)") if measures.of_variance else (1.0, "")
    for output in shown:
        order = [row["factor"] for row in output.ordered(measures.main)]
        parts = []
        for name in measures.shown:
            own = pd.DataFrame(output.ordered(name))
            if len(own):
                parts.append(own.assign(series=name))
        frame = pd.concat(parts)
        frame = frame.assign(
            row=frame["factor"].map(factor_name),
            value=scale * frame["estimate"],
            low=scale * frame["low"],
            high=scale * frame["high"],
            rank=frame["factor"].map(order.index),
        ).sort_values("rank", kind="stable")
        effect = f"effect ({output.unit})" if measures.in_units else "index (0 to 1)"
        label = unit or effect
        limits = (0.0, 105.0) if measures.of_variance else None
        panels.append(
            Rows(
                title=capital(_short(output)),
                x_label=label,
                frame=frame,
                looks={name: _LOOKS[name] for name in measures.shown},
                x_limits=limits,
                width=310.0,
            )
        )
    named = {index for output in shown for index in output.rows["index"]}
    keys = [Key(_LOOKS[name], NAME[name]) for name in measures.shown if name in named]
    runs = rows.loc[rows["status"] == DONE, "runs"]
    ends = "lines: intervals by bootstrap" if rows["ci_low"].notna().any() else "no intervals"
    caption = f"Symbols: indices at the largest load over {int(runs.min()):,} runs or more; {ends}."
    return Chart(title, panels, caption.replace(",", "\u2009", 1), keys)


def convergence(study: GlobalSensitivity, cohort: Cohort, tables: Tables) -> Chart:
    """The main index of the leading factors of each output against the number of runs."""
    title = "Indices against the number of runs"
    measures = measures_of(tables["indices"])
    found = outputs(cohort, tables["indices"], measures) if measures else []
    if not measures or not found:
        return _nothing(title, tables["indices"])
    grown = with_results(tables["convergence"], measures)
    grown = grown[grown["index"] == measures.main]
    if grown["runs"].nunique() < 2:
        return saying(title, "This design has no smaller part of its own.")
    panels = []
    for output in found[:MOST_PANELS]:
        order = [row["factor"] for row in output.ordered(measures.main)][:TOP]
        rows = output.of(grown).rows
        rows = rows[rows["factor"].isin([*order, DUMMY])]
        means = rows.groupby(["factor", "runs"], sort=False).agg(
            y=("estimate", "mean"), y_low=("ci_low", "mean"), y_high=("ci_high", "mean")
        )
        frame = means.reset_index().rename(columns={"runs": "x", "factor": "series"})
        looks = dict(zip([*order, DUMMY], (MODEL, BASE, THIRD, SOFT), strict=False))
        last = frame.sort_values("x").groupby("series").tail(1)
        apart = 0.09 * float(frame["y"].max() - frame["y"].min() or 1.0)
        labels, taken = {}, list[float]()
        for series, y in zip(last["series"], last["y"], strict=True):
            if all(abs(y - other) > apart for other in taken):  # else names stand over each other
                labels[series] = factor_name(series)
                taken.append(y)
        room = 1.0 + 0.03 * max((len(words) for words in labels.values()), default=0)
        panels.append(
            Curves(
                title=capital(_short(output)),
                x_label="runs",
                y_label=NAME[measures.main],
                frame=frame.sort_values("x"),
                looks=looks,
                labels=labels,
                x_limits=(0.0, room * float(frame["x"].max())),
                width=420.0,
                zeros=False,
            )
        )
    caption = "Lines: the leading inputs and the one without effect; bands: intervals by bootstrap."
    return Chart(title, panels, caption)


def runs(study: GlobalSensitivity, cohort: Cohort, tables: Tables) -> Chart:
    """Each output over the values of its leading factors: median and middle 90 % of all runs."""
    title = "Outputs over the leading inputs"
    measures = measures_of(tables["indices"])
    found = outputs(cohort, tables["indices"], measures) if measures else []
    found = [one for one in found if one.kind != "stiffness"]
    if not measures or not found:
        return _nothing(title, tables["indices"])
    every = [runs_of(one, tables["responses"], tables["design"], measures) for one in found[:2]]
    known = [one for one in every if one is not None and one.factors]
    if not known:
        return saying(title, "No run has an equilibrium.")
    panels = [_over(one, name, number) for one in known for number, name in enumerate(one.factors)]
    caption = (
        "Line: running median; band: middle 90 % of the runs with about that value, all other "
        "inputs varying too."
    )
    return Chart(title, panels, caption)


def _over(one: JointRuns, factor: str, number: int) -> Panel:
    """One output over one factor."""
    x = one.drawn(factor).to_numpy(float)
    at, (low, middle, high) = running(x, one.values.to_numpy(float))
    frame = pd.DataFrame({"x": at, "y": middle, "y_low": low, "y_high": high, "series": factor})
    unit = one.units[factor]
    joint = level(one.joint)
    return Curves(
        title=f"{capital(factor_name(factor))}",
        x_label={"1": "times the own value", "deg": "offset (°)"}.get(unit, f"offset ({unit})"),
        y_label=f"{joint}, {quantity(one.output.kind, one.output.coordinate)} ({one.output.unit})",
        frame=frame,
        looks={factor: SEVERAL[0]},
        x_log=unit == "1" and bool(x.min() > 0.0),
        zeros=False,
        high=200.0,
    )


def running(x: Array, y: Array, few: int = 12) -> tuple[Array, Array]:
    """(P,) middles and (3, P) 5th percentile, median and 95th of y along x.

    Parts hold equal numbers of runs, of about 100 different values of x: designs repeat values, and
    runs that share one are much alike. Of a design of few levels each level is one part.
    """
    levels = np.unique(x)
    if len(levels) <= few:
        groups = [x == one for one in levels]
    else:
        # a hundred different values a part, from four parts to twenty
        parts = min(20, max(4, len(levels) // 100))
        part = np.searchsorted(np.quantile(levels, np.arange(1, parts) / parts), x)
        groups = [part == number for number in range(parts)]
    middles = np.array([np.median(x[group]) for group in groups])
    found = np.array([np.percentile(y[group], [5.0, 50.0, 95.0]) for group in groups])
    return middles, found.T


def _panels(found: Sequence[Output], joints: Sequence[str]) -> list[Output]:
    """Of a single specimen a panel for each joint, where there is room."""
    apart = [one for output in found for one in output.by_joint(joints)]
    several = any(output.rows["specimen"].nunique() > 1 for output in found)
    return list(found[:MOST_PANELS]) if several or len(apart) > MOST_PANELS else apart


def _short(output: Output) -> str:
    """``flexion: L4–L5, motion``."""
    parts = (level(output.joint), quantity(output.kind, output.coordinate))
    test = f"{plain(output.test)}: " if output.test else ""
    return test + ", ".join(part for part in parts if part)


def _nothing(title: str, rows: pd.DataFrame) -> Chart:
    lost = rows[rows["status"] != DONE]
    reasons = [text for text in lost["message"].unique() if text]
    return saying(title, f"There is no index: {plain(reasons[0]) if reasons else 'no result'}.")
