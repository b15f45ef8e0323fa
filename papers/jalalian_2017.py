"""Selectors for Jalalian et al. 2017, doi 10.1007/s11517-016-1576-8, beside a phantom.

Its Model-1 has tangent laws, its Model-2 linear ones by the scheme of Petit et al. 2004: `tangent`
and `linear_regions` in tables. The bending films took part in personalising, neutral and traction
did not. Whatever the verdict, errors say nothing of the patients: the phantom's spines are made up.

Tables that are no results: `patients` and `films` of the cohort's folder, and `erect`, the Cobb
angle of each patient's main curve as it is on the erect film.
"""

import numpy as np
import pandas as pd

from papers.run import Computed, NotComputed, StudyRun
from papers.selectors import named

MODELS = ("tangent", "linear_regions")
BELOW = ("below_0.2", "0.2_to_0.8")
"""Ranges of a rotation that end at 0.8 of the published end, or below."""


def least_error_at(run: StudyRun, table: str, column: str, **where: str) -> Computed:
    """The enlargement of the smallest error, mean over patients."""
    rows = run.rows(table, varied="enlargement", **where)
    known = rows.drop_duplicates([name for name in ("specimen", "value") if name in rows])
    by_value = known.groupby("value")[column].mean().astype(float).dropna()
    if by_value.empty:
        raise NotComputed("no enlargement has an error")
    told = ", ".join(f"{value:g} % {error:.3g}" for value, error in by_value.items())
    return Computed(float(by_value.index[int(np.argmin(by_value))]), note=f"ours: {told} deg")


def below_the_end(run: StudyRun) -> Computed:
    """Share of rotations on held-out films below 0.8 of the published end, percent."""
    rows = run.rows("by_range", films="held_out", model="tangent")
    counts = rows.groupby("range")["n"].sum()
    if not counts["all"]:
        raise NotComputed("nothing was held out")
    note = f"ours: {int(counts['beyond'])} of {int(counts['all'])} beyond the end"
    return Computed(100.0 * float(counts.reindex(BELOW).sum()) / float(counts["all"]), note=note)


def error(run: StudyRun, column: str, unit: str, **where: str) -> Computed:
    """An error of table `accuracy`, beside mean less and plus SD of the patients' own errors."""
    value = run.number("accuracy", column, **where)
    row = run.row("accuracy", **where)
    mean, sd, noise = (
        float(row[name]) for name in ("mean_of_patients", "sd_of_patients", "reading_noise")
    )
    told = f"ours: reading the films alone makes {noise:.2g} {unit}" if noise > 0.0 else ""
    low, high = (mean - sd, mean + sd) if np.isfinite(sd) else (None, None)
    return Computed(value, low, high, told)


def _against_the_bend(run: StudyRun, films: str, model: str) -> "pd.Series[float]":
    """Errors without sign of rotations of segments that turn against a bend, deg."""
    rows = run.rows("displacements", model=model, opposite=True)
    rows = rows[rows["fitted"].astype(bool) == (films == "fitted")]
    sizes = (rows["simulated_deg"] - rows["measured_deg"]).astype(float).abs().dropna()
    if sizes.empty:
        raise NotComputed("no film has a segment that turns against a bend")
    return sizes


def error_against_the_bend(run: StudyRun, films: str, model: str, of: str) -> Computed:
    """Mean or SD of those errors."""
    sizes = _against_the_bend(run, films, model)
    mean, sd = float(sizes.mean()), float(sizes.std(ddof=0))
    if of == "sd":
        return Computed(sd)
    return Computed(mean, mean - sd, mean + sd, f"ours: {len(sizes)} rotations")


# --- by how much tangent laws are better, percent -------------------------------------------------


def _less(tangent: float, linear: float) -> float:
    if linear == 0.0:
        raise NotComputed("the linear model has no error")
    return 100.0 * (1.0 - tangent / linear)


def _reduction(run: StudyRun, measure: str, column: str, films: str) -> float:
    where = {"films": films, "measure": measure}
    return _less(*(run.number("accuracy", column, **where, model=model) for model in MODELS))


def reduction(run: StudyRun, measure: str, column: str, films: str) -> Computed:
    """Of an error of table `accuracy`."""
    return Computed(_reduction(run, measure, column, films))


def reduction_of_both(run: StudyRun, measure: str) -> Computed:
    """The mean of the reductions on fitted and on held-out films."""
    both = [_reduction(run, measure, "mean_of_patients", one) for one in ("fitted", "held_out")]
    told = f"ours: {both[0]:.0f} % on fitted, {both[1]:.0f} % on held-out films"
    return Computed(0.5 * sum(both), min(both), max(both), told)


def reduction_in_range(run: StudyRun, films: str, range: str) -> Computed:
    """Of rotations by their share of the published end, with and against the bend together."""
    sizes = []
    for model in MODELS:
        rows = run.rows("by_range", films=films, range=range, model=model)
        known = rows[rows["n"] > 0]
        if known.empty:
            raise NotComputed("there is no such rotation")
        counts = known["n"].to_numpy(float)
        squares = known["rmse_deg"].to_numpy(float) ** 2
        sizes.append(float(np.sqrt((counts * squares).sum() / counts.sum())))
    rows = run.rows("by_range", films=films, range=range, model=MODELS[0])
    return Computed(_less(*sizes), note=f"ours: {int(rows['n'].sum())} rotations")


def reduction_against_the_bend(run: StudyRun, films: str) -> Computed:
    """Of the mean error of segments that turn against a bend."""
    return Computed(_less(*(float(_against_the_bend(run, films, one).mean()) for one in MODELS)))


SELECTORS = named(
    *(least_error_at, below_the_end, error, error_against_the_bend, reduction),
    *(reduction_of_both, reduction_in_range, reduction_against_the_bend),
)
