"""Shares with their 95 % intervals, and whether a goal is reached."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import binomtest, quantile_test


@dataclass(frozen=True)
class Goal:
    """A share or value that is wanted: at least ``low`` and at most ``high``."""

    low: float = -np.inf
    high: float = np.inf

    def __str__(self) -> str:
        if np.isfinite(self.low) and np.isfinite(self.high):
            return f"{self.low:g} to {self.high:g}"
        return f">= {self.low:g}" if np.isfinite(self.low) else f"<= {self.high:g}"

    def met(self, value: float) -> bool:
        """By the value itself."""
        return self.low <= value <= self.high

    def reached(self, low: float, high: float) -> str:
        """By an interval: yes or no where all of it says so, else undecided."""
        if self.low <= low and high <= self.high:
            return "yes"
        return "no" if high < self.low or low > self.high else "undecided"


def share(name: str, counts: Iterable[bool], goal: Goal | None = None) -> dict[str, Any]:
    """How often something holds, with its Clopper-Pearson interval."""
    flags = list(counts)
    if not flags:
        return _row(name, 0, None, None, None, None, goal)
    ends = binomtest(sum(flags), len(flags)).proportion_ci(0.95, "exact")
    found = sum(flags) / len(flags)
    return _row(name, len(flags), sum(flags), found, float(ends.low), float(ends.high), goal)


def ratio(
    name: str, counts: Sequence[bool], expected: Sequence[float], goal: Goal | None = None
) -> dict[str, Any]:
    """How often something holds over how often it is expected to; bootstrap over the cohorts."""
    of, by = np.array(counts, dtype=float), np.array(expected)
    if not by.sum() > 0.0:
        return _row(name, len(of), None, None, None, None, goal)
    drawn = np.random.default_rng(0).integers(len(of), size=(2000, len(of)))
    found = of[drawn].sum(axis=1) / np.maximum(by[drawn].sum(axis=1), np.finfo(float).tiny)
    low, high = np.quantile(found, [0.025, 0.975])
    value = float(of.sum() / by.sum())
    return _row(name, len(of), int(of.sum()), value, float(low), float(high), goal)


def median(name: str, values: Sequence[float], goal: Goal | None = None) -> dict[str, Any]:
    """A median with the interval of its order statistics; ends are None where too few."""
    return percentile(name, values, 0.5, goal)


def percentile(
    name: str, values: Sequence[float], at: float, goal: Goal | None = None
) -> dict[str, Any]:
    """A percentile with the interval of its order statistics; ends are None where too few."""
    if not values:
        return _row(name, 0, None, None, None, None, goal)
    ends: Any = quantile_test(np.array(values), q=0.0, p=at).confidence_interval(0.95)
    low, high = (float(end) if np.isfinite(end) else None for end in (ends.low, ends.high))
    return _row(name, len(values), None, float(np.quantile(values, at)), low, high, goal)


def _row(
    name: str,
    n: int,
    count: int | None,
    value: float | None,
    low: float | None,
    high: float | None,
    goal: Goal | None,
) -> dict[str, Any]:
    reached = "undecided" if goal else ""
    if goal and low is not None and high is not None:
        reached = goal.reached(low, high)
    return {
        "what": name,
        "n": n,
        "count": count,
        "value": value,
        "low": low,
        "high": high,
        "goal": str(goal) if goal else "",
        "met": ("yes" if goal.met(value) else "no") if goal and value is not None else "",
        "reached": reached,
    }
