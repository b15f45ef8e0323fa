"""Plans of tests for one specimen: which loads, what is read, and which base is fitted to it."""

from dataclasses import dataclass, replace

import numpy as np

from spinepipe.discrepancy.design.load_changes import farthest
from spinepipe.discrepancy.readings import Repeats, SpecimenReadings
from spinepipe.effects.contract import Indices
from spinepipe.model import LoadCase

PER_SPECIMEN = "per_specimen"


@dataclass(frozen=True)
class Planned:
    """A test: its loads, and how often each coordinate of each joint is read, ``count`` (J, 6).

    ``preload``: of a follower load through the joints' centres, N.
    """

    case: LoadCase
    count: Indices
    preload: float = 0.0


@dataclass(frozen=True)
class Plan:
    """The tests of a specimen, and the base that is fitted to them: ``grouping``."""

    tests: tuple[Planned, ...]
    zeroed: bool
    grouping: str

    def repeats(self) -> tuple[Repeats, ...]:
        """Readings of zero wherever the plan reads."""
        return tuple(_repeats(one, self.zeroed) for one in self.tests)


def as_made(one: SpecimenReadings, zeroed: bool, grouping: str) -> Plan:
    """The tests that a specimen has had; cycles whose loads differ a little are one test."""
    planned: dict[str, Planned] = {}
    for test in one.tests:
        name, count = test.case.test, test.count.max(axis=0)
        known = planned.get(name)
        planned[name] = Planned(test.case, count) if known is None else _again(known, count)
    return Plan(tuple(planned.values()), zeroed, grouping)


def _again(known: Planned, count: Indices) -> Planned:
    return replace(known, count=known.count + count)


def _repeats(one: Planned, zeroed: bool) -> Repeats:
    number = np.arange(one.count.max())[:, None, None, None]
    read = np.broadcast_to(
        number < one.count, (len(number), len(one.case.steps), *one.count.shape)
    ).copy()
    read[:, 0] &= not zeroed
    return Repeats(one.case, np.where(read, 0.0, np.nan))


def thinned(plan: Plan, steps: int) -> Plan:
    """A plan with about that many load steps per test at most: first, farthest and last stay."""
    return replace(plan, tests=tuple(_thin(one, steps) for one in plan.tests))


def _thin(one: Planned, steps: int) -> Planned:
    count = len(one.case.steps)
    if count <= steps:
        return one
    even = np.linspace(0, count - 1, steps).round().astype(int)
    kept = sorted({*even.tolist(), farthest(one.case)})
    return replace(one, case=replace(one.case, steps=tuple(one.case.steps[k] for k in kept)))
