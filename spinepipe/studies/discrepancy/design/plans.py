"""Plans of tests for one specimen, and the changes a laboratory could make to them.

A plan says which loads there are, what is read, and which base is fitted to it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from spinepipe.cohort.specimen import FOLLOWER_LOAD, cables
from spinepipe.effects import Wrench
from spinepipe.effects.contract import Array, Indices
from spinepipe.model import LoadCase, LoadStep, SpineModel
from spinepipe.studies.discrepancy.search.readings import Repeats, SpecimenReadings
from spinepipe.units import without_step_0

STEP_S = 10.0
"""Assumed between load steps where no times are recorded."""

HELD_S = (30.0, 60.0, 120.0, 240.0, 420.0, 600.0)
"""When a held load is read."""

SLOWER, LARGER = 10.0, 1.5
"""Times slower, and times larger loads, that a laboratory could test with."""

PRELOAD_N = 400.0

NEAR, FALLEN = 0.05, 0.8
"""Shares of the largest load: how far from the way a load may be, and how far it must fall."""


def has_times(case: LoadCase) -> bool:
    return all(step.time is not None for step in case.steps)


def times(case: LoadCase) -> list[float]:
    """Recorded or assumed times of the steps, s."""
    if has_times(case):
        return [step.time for step in case.steps if step.time is not None]
    return [STEP_S * number for number in range(len(case.steps))]


def at_times(case: LoadCase, times: Sequence[float]) -> LoadCase:
    steps = zip(case.steps, times, strict=True)
    return replace(case, steps=tuple(replace(step, time=time) for step, time in steps))


def summed_loads(case: LoadCase) -> list[Array]:
    """(6,) force in units of 100 N and moment in units of 10 N m of each step, summed."""
    return [
        sum((np.r_[w.force / 100.0, w.moment / 10.0] for w in step.wrenches), np.zeros(6))
        for step in case.steps
    ]


def farthest(case: LoadCase) -> int:
    """The step farthest in load from the first."""
    loads = summed_loads(case)
    return int(np.argmax([np.linalg.norm(load - loads[0]) for load in loads]))


def peak(case: LoadCase) -> Array:
    return summed_loads(case)[farthest(case)]


def unloads(case: LoadCase) -> bool:
    """Whether a load falls again along its own direction, to where it was on the way up.

    A machine never gives the same load twice, and a thinned test has no equal steps left: it is
    enough that the load passes there.
    """
    loads = np.array(summed_loads(case))
    sizes = np.linalg.norm(loads, axis=1)
    near = NEAR * float(sizes.max(initial=0.0))
    for now in np.flatnonzero(sizes > near):
        # each load in turn as the peak: loads along its direction, and away from that line
        direction = loads[now] / sizes[now]
        along = loads @ direction
        aside = np.linalg.norm(loads - along[:, None] * direction, axis=1)
        on_the_way = (aside <= near) & (along >= -near)
        before, after = along[:now][on_the_way[:now]], along[now + 1 :][on_the_way[now + 1 :]]
        fallen = after[after <= FALLEN * sizes[now]]
        if len(before) and len(fallen) and before.min() <= fallen.max() + near:
            return True
    return False


def with_unloading(case: LoadCase) -> LoadCase:
    timed = has_times(case)
    last = times(case)[-1]
    extra = [
        LoadStep(
            case.steps[-1].step + number,
            step.wrenches,
            2.0 * last - step.time if timed and step.time is not None else None,
            step.supports,
        )
        for number, step in enumerate(reversed(case.steps[:-1]), start=1)
    ]
    return replace(case, steps=(*case.steps, *extra))


def scale_loads(case: LoadCase, factor: float) -> LoadCase:
    steps = tuple(
        replace(
            step,
            wrenches=tuple(
                Wrench(w.body, w.point, factor * w.force, factor * w.moment) for w in step.wrenches
            ),
        )
        for step in case.steps
    )
    return replace(case, steps=steps)


def with_hold(case: LoadCase) -> LoadCase:
    """Steps after the one with the largest load, all others later."""
    timed, at = at_times(case, times(case)).steps, farthest(case)
    start = timed[at].time or 0.0
    held = [replace(timed[at], time=start + seconds) for seconds in HELD_S]
    after = [replace(step, time=(step.time or 0.0) + HELD_S[-1]) for step in timed[at + 1 :]]
    steps = [*timed[: at + 1], *held, *after]
    return replace(case, steps=tuple(replace(s, step=n) for n, s in enumerate(steps)))


@dataclass(frozen=True)
class PlannedTest:
    """A test: its loads, and how often each coordinate of each joint is read, ``count`` (J, 6).

    ``preload``: of a follower load through the joints' centres, N, beside that of the rig.
    ``rig``: the test whose rig it is done in, if it is not called so itself.
    ``words``: what it is, where it is offered.
    """

    case: LoadCase
    count: Indices
    zeroed: bool
    preload: float = 0.0
    rig: str = ""
    words: str = ""

    def renamed(self, case: LoadCase) -> "PlannedTest":
        """A test of another name in the same rig."""
        return replace(self, case=case, rig=self.rig or self.case.test)


def repeats_of(one: PlannedTest) -> Repeats:
    """Readings of zero wherever the test reads."""
    cycle = np.arange(one.count.max())[:, None, None, None]
    shape = (len(cycle), len(one.case.steps), *one.count.shape)
    readings = np.where(np.broadcast_to(cycle < one.count, shape), 0.0, np.nan)
    by_step = without_step_0(readings.swapaxes(0, 1), one.zeroed)
    return Repeats(one.case, by_step.swapaxes(0, 1))


def with_preloads(model: SpineModel, tests: Sequence[PlannedTest]) -> SpineModel:
    """The model under the follower load of each test that has one: it is known and not fitted.

    A follower load of the cohort acts in each test that is done in its rig.
    """
    rigs = {one.case.test: one.rig for one in tests if one.rig}
    tension_n = {one.case.test: one.preload for one in tests if one.preload > 0.0}
    effects = []
    for scoped in model.effects:
        if scoped.effect.name == FOLLOWER_LOAD:
            under = [name for name, rig in rigs.items() if rig in scoped.tests]
            more = (name for name in under if name not in scoped.tests)
            scoped = replace(scoped, tests=(*scoped.tests, *more))
        effects.append(scoped)
    return model.with_effects((*effects, *cables(tension_n, model.n_joints)))


def planned_of(one: SpecimenReadings, zeroed: bool, most_steps: int) -> list[PlannedTest]:
    """The tests that a specimen has had; cycles whose loads differ a little are one test.

    Of long tests about ``most_steps`` load steps: the first, the farthest and the last stay.
    """
    planned: dict[str, PlannedTest] = {}
    for test in one.tests:
        name, count = test.case.test, test.count.max(axis=0)
        known = planned.get(name)
        if known is not None:
            planned[name] = replace(known, count=known.count + count)
            continue
        case = test.case
        if len(case.steps) > most_steps:
            even = np.linspace(0, len(case.steps) - 1, most_steps).round().astype(int)
            chosen = sorted({*even.tolist(), farthest(case)})
            case = replace(case, steps=tuple(case.steps[k] for k in chosen))
        planned[name] = PlannedTest(case, count, zeroed)
    return list(planned.values())
