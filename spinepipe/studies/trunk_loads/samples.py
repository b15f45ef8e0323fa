"""What the samples of a task tell: intervals, samples lost, and shares of the spread by input."""

from collections.abc import Mapping

import numpy as np
import pandas as pd

from spinepipe.report.conclusions import Value
from spinepipe.studies.trunk_loads.sampling import LEAST_SAMPLES
from spinepipe.studies.trunk_loads.selection import AnsweredTask, Row, named, of_task, sound
from spinepipe.studies.trunk_loads.settings import TrunkLoads

Tables = Mapping[str, pd.DataFrame]

MOST_LOST = 0.2
"""Share of samples above which nothing is told of those that are left."""

MOST_SHARE = 1.1
"""Sobol's estimate of a share may exceed 1 by chance; by more than this it is no number."""

INDICES, CORRELATIONS = "Sobol's total indices", "squared correlations, too many samples being lost"
"""Where shares of the spread come from."""

_Z = 1.959963984540054
"""97.5 % quantile of the normal distribution."""


def spread_of(tables: Tables, row: Row, quantity: str) -> Row:
    """Row of table intervals of a body and task; nothing where it was not sampled."""
    rows = of_task(tables.get("intervals", pd.DataFrame()), row)
    chosen = named(rows[rows["quantity"] == quantity]) if len(rows) else []
    return chosen[0] if chosen else {}


def with_interval(tables: Tables, row: Row, quantity: str, unit: str) -> Value:
    """A result of a task with the middle 95 % of its samples where known; an end may be open."""
    number, spread = float(row[quantity]), spread_of(tables, row, quantity)
    if not spread or pd.isna(spread["low"]):
        return Value(number, unit, source=f"tasks: {quantity}")
    ends = (float(spread["low"]), None if pd.isna(spread["high"]) else float(spread["high"]))
    n = int(spread["n_samples"])
    return Value(number, unit, *ends, n, f"tasks and intervals: {quantity}")


def times(tables: Tables, found: AnsweredTask, quantity: str) -> Value | None:
    """A load over that of relaxed standing, with the middle 95 % of samples that hold both."""
    if found.standing is None or not found.standing[quantity] > 0.0:
        return None
    ratio = float(found.task[quantity] / found.standing[quantity])
    rows = tables.get("responses", pd.DataFrame())
    one, other = (_held(of_task(rows, row), quantity) for row in (found.task, found.standing))
    both = (one / other).dropna()
    drawn = rows["sample"].nunique() if len(rows) else 0
    if len(both) < LEAST_SAMPLES or len(both) < (1.0 - MOST_LOST) * drawn:
        return Value(ratio, "times", source=f"tasks: {quantity}")
    low, high = (float(end) for end in np.quantile(both, [0.025, 0.975]))
    return Value(ratio, "times", low, high, len(both), f"tasks and responses: {quantity}")


def _held(rows: pd.DataFrame, quantity: str) -> pd.Series:
    """A result by sample, of samples that hold the task."""
    if rows.empty:
        return pd.Series(dtype=float)
    return rows[sound(rows)].set_index("sample")[quantity].astype(float)


def lost_and_all(rows: pd.DataFrame) -> tuple[int, int]:
    """Samples that do not hold their tasks and samples in all, of rows of table intervals."""
    each = rows.drop_duplicates(["specimen", "task"])
    lost = int(each["n_failed"].sum())
    return lost, lost + int(each["n_samples"].sum())


def shares(study: TrunkLoads, tables: Tables, row: Row, quantity: str) -> tuple[pd.DataFrame, str]:
    """Shares of the spread of a task's result by input, percent, the largest first.

    Columns factor, share, low, high; and where they come from. Sobol's total indices, or, where
    too many samples were lost for these, squared correlations over those that hold: what an input
    explains alone if it acts in a straight line.
    """
    drivers = of_task(tables.get("drivers", pd.DataFrame()), row)
    if len(drivers):
        drivers = drivers[drivers["quantity"] == quantity].dropna(subset=["total", "total_low"])
    columns = {"total": "share", "total_low": "low", "total_high": "high"}
    if len(drivers) and drivers["total"].max() <= MOST_SHARE:
        found = drivers[["factor", *columns]].rename(columns=columns)
        found[["share", "low", "high"]] *= 100.0
        return found.sort_values("share", ascending=False, kind="stable"), INDICES
    return _correlations(study, tables, row, quantity), CORRELATIONS


def _correlations(study: TrunkLoads, tables: Tables, row: Row, quantity: str) -> pd.DataFrame:
    """Ends by Fisher's z of as many pairs as the design has independent rows, two a base sample."""
    drawn = tables.get("design", pd.DataFrame())
    result = _held(of_task(tables.get("responses", pd.DataFrame()), row), quantity).dropna()
    known = len(result) >= LEAST_SAMPLES and float(result.std()) > 0.0
    inputs = drawn.pivot(index="sample", columns="factor", values="value") if known else drawn
    pairs = 2.0 * study.uncertain.samples * len(result) / study.uncertain.runs
    found = []
    for factor in study.uncertain.factors if known and pairs > 3.0 else ():
        own = inputs.loc[result.index, factor].astype(float)
        r = abs(float(np.corrcoef(own, result)[0, 1])) if own.std() > 0.0 else 0.0
        z, reach = np.arctanh(min(r, 1.0 - 1e-9)), _Z / np.sqrt(pairs - 3.0)
        low, high = np.tanh(max(z - reach, 0.0)), np.tanh(z + reach)
        squares = 100.0 * np.array([r, low, high]) ** 2
        found.append(
            {"factor": factor, **dict(zip(("share", "low", "high"), squares, strict=True))}
        )
    table = pd.DataFrame(found, columns=["factor", "share", "low", "high"])
    return table.sort_values("share", ascending=False, kind="stable")
