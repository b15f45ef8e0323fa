"""Cells of a run's summary table."""

from collections.abc import Callable, Iterable
from typing import Any

import pandas as pd

from spinepipe.comparison.claim import Ours
from spinepipe.comparison.run import NotComputed, Run


def median(**where: Any) -> Callable[[Run], Ours]:
    """Median of one row with its quartiles."""

    def ours(run: Run) -> Ours:
        low, high = (_end(run, name, where) for name in ("low_quartile", "high_quartile"))
        return Ours(value(run, "median", **where), low, high)

    return ours


def statistic(column: str, **where: Any) -> Callable[[Run], Ours]:
    """Another column of one row."""
    return lambda run: Ours(value(run, column, **where))


def largest(column: str, joints: Iterable[str], **where: Any) -> Callable[[Run], Ours]:
    """Largest value of a column over joints."""
    names = tuple(joints)
    return lambda run: Ours(max(value(run, column, joint=joint, **where) for joint in names))


def ratio_percent(column: str, **where: Any) -> Callable[[Run], Ours]:
    """A spread as a percentage of its median."""

    def ours(run: Run) -> Ours:
        middle = value(run, "median", **where)
        if middle == 0.0:
            raise NotComputed("the median is 0")
        return Ours(100.0 * value(run, column, **where) / middle)

    return ours


def value(run: Run, column: str, **where: Any) -> float:
    """One cell of the summary."""
    return run.number("summary", column, **where)


def _end(run: Run, column: str, where: dict[str, Any]) -> float | None:
    found = run.row("summary", **where)[column]
    return None if pd.isna(found) else float(found)
