"""What section 3 says of fitted stiffness level by level, the two models side by side."""

from collections.abc import Callable, Iterator
from itertools import product
from typing import Any

import pandas as pd

from spinepipe.comparison.claim import Claim, Ours
from spinepipe.comparison.gould_2024b.forms import yes_or_no
from spinepipe.comparison.gould_2024b.paper import (
    JOINTS,
    LOAD,
    LOADED,
    MODELS,
    PAPER,
    PHANTOM,
    TESTS,
)
from spinepipe.comparison.gould_2024b.rows_of import stiffness
from spinepipe.comparison.ranges import Range
from spinepipe.comparison.run import NotComputed, Run

_POOLED = "B23: the text has the range larger over all levels, and smaller at most of them"
_OUTSIDE = (
    PHANTOM + "; level_ratio spreads as its one factor does times the ratio of the level, and the "
    "factor follows from levels that are not those of Table 2"
)
_SPREADS = {"range": (0.0, 1.0), "IQR": (0.25, 0.75)}


def claims() -> Iterator[Claim]:
    """Ranges and IQRs, over all levels and at each; then the size of stiffness."""
    for test in TESTS:
        yield _over_all(test)
    larger_range = PAPER["level_ratio_range_larger"]
    larger_iqr = PAPER["per_specimen_iqr_larger"]
    for test, joint in product(TESTS, JOINTS):
        levels = joint in larger_range.get(test, ())
        yield _at_level(test, joint, "range", "level_ratio", levels, "section 3.3.2, Fig 5")
    for test, joint in product(TESTS, JOINTS):
        levels = joint in larger_iqr.get(test, ())
        yield _at_level(test, joint, "IQR", "per_specimen", levels, "section 3.4, Fig 5")
    yield _stiffer()


def _fitted(run: Run, model: str, test: str) -> pd.DataFrame:
    return stiffness(run, model, test, LOADED[test])


def _spread(values: "pd.Series[Any]", what: str) -> float:
    low, high = (float(values.quantile(end)) for end in _SPREADS[what])
    return high - low


def _over_all(test: str) -> Claim:
    def ours(run: Run) -> Ours:
        uniform, levels = (_spread(_fitted(run, m, test)["stiffness"], "range") for m in MODELS)
        told = f"ours: {levels:.3g} and {uniform:.3g} N m/rad"
        return Ours(float(levels > uniform), note=told)

    return yes_or_no(
        f"level_range.all.{test}", "section 3.2.2, Fig 5",
        f"over all levels, the stiffness fitted to {LOAD[test]} has a larger range in level_ratio "
        "than in per_specimen", True, ours, note=_POOLED,
    )  # fmt: skip


def _at_level(test: str, joint: str, what: str, larger: str, paper: bool, where: str) -> Claim:
    (other,) = [model for model in MODELS if model != larger]
    return yes_or_no(
        f"level_{what.lower()}.{joint}.{test}", where,
        f"at {joint}, the stiffness fitted to {LOAD[test]} has a larger {what} in {larger} than in "
        f"{other}", paper, _larger(test, joint, what, larger, other), _OUTSIDE,
        _POOLED if what == "range" else "",
    )  # fmt: skip


def _larger(test: str, joint: str, what: str, larger: str, other: str) -> Callable[[Run], Ours]:
    def ours(run: Run) -> Ours:
        spreads = []
        for model in (larger, other):
            rows = _fitted(run, model, test)
            values = rows.loc[rows["joint"] == joint, "stiffness"]
            if values.empty:
                raise NotComputed(f"no stiffness of {joint} was fitted")
            spreads.append(_spread(values, what))
        told = f"ours: {spreads[0]:.3g} and {spreads[1]:.3g} N m/rad"
        return Ours(float(spreads[0] > spreads[1]), note=told)

    return ours


def _stiffer() -> Claim:
    def ours(run: Run) -> Ours:
        higher = []
        for test in TESTS:
            uniform, levels = (
                _fitted(run, model, test).groupby("joint")["stiffness"].median() for model in MODELS
            )
            higher += (levels > uniform).tolist()
        return Ours(100.0 * sum(higher) / len(higher), note=f"ours: of {len(higher)}")

    return Claim(
        "level_stiffness.level_ratio_above_per_specimen", "section 3.4, Fig 5",
        "loads and levels whose median fitted stiffness is larger of level_ratio than of "
        "per_specimen", "%", None, Range(50.0, 100.0, "most: more than half"), ours, PHANTOM,
        "in the loaded coordinate",
    )  # fmt: skip
