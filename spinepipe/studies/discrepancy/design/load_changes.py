"""Changes of a test's loads and times, as a laboratory could make them."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from spinepipe.effects import Wrench
from spinepipe.effects.contract import Array
from spinepipe.model import LoadCase, LoadStep

STEP_S = 10.0
"""Assumed between load steps where no times are recorded."""

HELD_S = (30.0, 60.0, 120.0, 240.0, 420.0, 600.0)
"""When a held load is read."""


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


def comes_back(case: LoadCase) -> bool:
    """Whether a load comes again after a larger one in the same direction."""
    loads = summed_loads(case)
    for now, load in enumerate(loads):
        same = [before for before in range(now) if np.allclose(loads[before], load)]
        if same and any(between @ between > load @ load for between in loads[same[-1] : now]):
            return True
    return False


def back_down(case: LoadCase) -> LoadCase:
    timed = has_times(case)
    last = times(case)[-1]
    extra = [
        LoadStep(
            case.steps[-1].step + number,
            step.wrenches,
            2.0 * last - step.time if timed and step.time is not None else None,
        )
        for number, step in enumerate(reversed(case.steps[:-1]), start=1)
    ]
    return replace(case, steps=(*case.steps, *extra))


def scaled(case: LoadCase, factor: float) -> LoadCase:
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


def largest_held(case: LoadCase) -> LoadCase:
    """Steps after the one with the largest load, all others later."""
    timed, at = at_times(case, times(case)).steps, farthest(case)
    start = timed[at].time or 0.0
    held = [replace(timed[at], time=start + seconds) for seconds in HELD_S]
    after = [replace(step, time=(step.time or 0.0) + HELD_S[-1]) for step in timed[at + 1 :]]
    steps = [*timed[: at + 1], *held, *after]
    return replace(case, steps=tuple(replace(s, step=n) for n, s in enumerate(steps)))
