"""Loads row by row for one specimen and one cycle each, wildcards written out."""

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from math import isnan

from spinepipe.cohort.draft import Draft

__all__ = ["AppliedLoad", "applied_loads"]


@dataclass(frozen=True)
class AppliedLoad:
    """One row of ``loads.csv`` as it acts on one specimen in one cycle.

    Attributes
    ----------
    line : its line in ``loads.csv``.
    step : None when the cell is bad.
    """

    line: int
    specimen: str
    test: str
    cycle: int
    step: int | None
    vertebra: str


def applied_loads(draft: Draft) -> Iterator[AppliedLoad]:
    """Every load on every specimen in every cycle; rows without a name are left out."""
    cycles = _known_cycles(draft)
    everyone = draft.specimens or ("*",)
    keys = ("specimen", "test", "cycle", "step", "vertebra")
    for line, (specimen, test, cycle, step, vertebra) in draft.rows("loads", *keys):
        if not all(isinstance(name, str) for name in (specimen, test, vertebra)):
            continue
        known_step = None if isnan(step) else int(step)
        for name in everyone if specimen == "*" else (specimen,):
            for number in cycles[test] if isnan(cycle) else (int(cycle),):
                yield AppliedLoad(line, name, test, number, known_step, vertebra)


def _known_cycles(draft: Draft) -> dict[str, tuple[int, ...]]:
    """Cycles of each test that either file numbers; 1 when none does."""
    cycles: dict[str, set[int]] = defaultdict(set)
    for stem in ("loads", "motion"):
        for _, (test, cycle) in draft.rows(stem, "test", "cycle"):
            cycles[test] |= set() if isnan(cycle) else {int(cycle)}
    return {test: tuple(sorted(numbers)) or (1,) for test, numbers in cycles.items()}
