"""Runs that a laboratory could add to its tests, one cycle each: a menu that knows what is there.

An added run keeps the name of the test it varies while the specimen stays in its set-up, so that it
shares the errors of that set-up; another direction and a new set-up have a name of their own.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from spinepipe.effects import Wrench
from spinepipe.effects.contract import Array
from spinepipe.model import LoadCase, LoadStep
from spinepipe.studies.discrepancy.design.plans import (
    HELD_S,
    LARGER,
    PRELOAD_N,
    SLOWER,
    STEP_S,
    PlannedTest,
    at_times,
    has_times,
    peak,
    scale_loads,
    summed_loads,
    times,
    unloads,
    with_hold,
    with_unloading,
)

ALONG = 0.9
"""Cosine from which two loads have the same direction."""

HALF = 0.5
"""Share of the largest load from which a direction counts as tested."""

DIRECTIONS = {
    (3, 2): ("extension", "flexion"),
    (3, 0): ("right lateral bending", "left lateral bending"),
    (3, 1): ("left axial rotation", "right axial rotation"),
    (0, 0): ("anterior force", "posterior force"),
    (0, 1): ("superior force", "inferior force"),
    (0, 2): ("force to the right", "force to the left"),
}
"""Moments and forces along the ground axes x (anterior), y (superior) and z (right): + and -."""

AGAIN = ("once more", "set up anew, once more")


def runs(tests: Sequence[PlannedTest]) -> list[PlannedTest]:
    """The menu for a specimen that has had these tests; nothing that is there already but repeats.

    A run is offered once, however many ways lead to it.
    """
    found: dict[tuple[object, ...], PlannedTest] = {}
    for one in (*_variations(tests), *_directions(tests)):
        if one.words.endswith(AGAIN) or not any(_has(test, one) for test in tests):
            case, read = one.case, one.count.astype(bool).tobytes()
            loads = tuple(np.round(load, 9).tobytes() for load in summed_loads(case))
            seconds = tuple(step.time for step in case.steps)
            way = (case.test, loads, seconds, read, one.preload, one.zeroed)
            found.setdefault(way, one)
    return list(found.values())


def _has(test: PlannedTest, one: PlannedTest) -> bool:
    """Whether a test that was done is the added run already, about as slow where it has times."""
    loads, added = summed_loads(test.case), summed_loads(one.case)
    same = len(loads) == len(added) and np.allclose(loads, added)
    timed = not has_times(one.case) or (
        has_times(test.case) and _lasts(test.case) >= 0.5 * _lasts(one.case)
    )
    read = bool((test.count >= one.count).all())
    return same and timed and read and (test.preload, test.zeroed) == (one.preload, one.zeroed)


def _lasts(case: LoadCase) -> float:
    every = times(case)
    return every[-1] - every[0]


def _variations(tests: Sequence[PlannedTest]) -> Iterator[PlannedTest]:
    for one in tests:
        case, name = one.case, one.case.test
        once = replace(one, count=np.minimum(one.count, 1))

        def run(words: str, changed: LoadCase, once: PlannedTest = once) -> PlannedTest:
            return replace(once, case=changed, words=words)

        yield run(f"{name}: once more", case)
        anew = once.renamed(replace(case, test=f"{name}, set up anew"))
        yield replace(anew, words=f"{name}: specimen taken out, set up anew, once more")
        for part, what in ((slice(0, 3), "translations"), (slice(3, 6), "rotations")):
            if not one.count[:, part].any():
                count = once.count.copy()
                count[:, part] = 1
                yield replace(once, count=count, words=f"{name}: {what} read as well")
        # a step half-way between each two
        halved = [step for two in pairwise(case.steps) for step in (two[0], _between(*two))]
        every = enumerate([*halved, case.steps[-1]])
        finer = replace(case, steps=tuple(replace(step, step=number) for number, step in every))
        yield run(f"{name}: in twice as many load steps", finer)
        if not unloads(case):
            yield run(f"{name}: unloading too, the same loads back down", with_unloading(case))
        yield run(f"{name}: loads {LARGER:g} times as large", scale_loads(case, LARGER))
        words = f"{name}: under a follower load of {PRELOAD_N:g} N more"
        yield replace(once, preload=PRELOAD_N, words=words)
        if not has_times(case):
            timed = at_times(case, times(case))
            yield run(f"{name}: time recorded, {STEP_S:g} s from load step to load step", timed)
        slow = at_times(case, [SLOWER * time for time in times(case)])
        yield run(f"{name}: {SLOWER:g} times as slow, time recorded", slow)
        held = f"{name}: largest load held for {HELD_S[-1] / 60:g} min, read along the way"
        yield run(held, with_hold(case))
        if one.zeroed:
            words = f"{name}: readings kept as they are, not zeroed"
            yield replace(once, zeroed=False, words=words)


def _between(before: LoadStep, after: LoadStep) -> LoadStep:
    if len(before.wrenches) != len(after.wrenches):
        return before
    wrenches = tuple(
        Wrench(
            b.body,
            0.5 * (a.point + b.point),
            0.5 * (a.force + b.force),
            0.5 * (a.moment + b.moment),
        )
        for a, b in zip(before.wrenches, after.wrenches, strict=True)
    )
    timed = before.time is not None and after.time is not None
    time = 0.5 * (before.time + after.time) if timed else None  # type: ignore[operator]
    return replace(before, wrenches=wrenches, time=time)


def _directions(tests: Sequence[PlannedTest]) -> Iterator[PlannedTest]:
    """The largest moment, and the largest force, of any test along axes that no test has."""
    loads = [load for one in tests for load in _large(one.case)]
    for start in (3, 0):
        sizes = [float(np.linalg.norm(peak(one.case)[start : start + 3])) for one in tests]
        if not sizes:
            continue
        template = tests[int(np.argmax(sizes))]
        largest = peak(template.case)
        # a test whose load (6,) is mostly of the other sort is no template
        if not np.linalg.norm(largest[start : start + 3]) > HALF * np.linalg.norm(largest) > 0.0:
            continue
        once = replace(template, count=np.minimum(template.count, 1))
        for axis in range(3):
            for sign, name in zip((1.0, -1.0), DIRECTIONS[start, axis], strict=True):
                direction = np.zeros(6)
                direction[start + axis] = sign
                if any(load @ direction >= ALONG * np.linalg.norm(load) for load in loads):
                    continue
                case = replace(_turned(template.case, start, axis, sign), test=f"added {name}")
                loads += _large(case)  # a test to both sides needs no other
                what = "moment about" if start else "force along"
                where = f"{what} {'+' if sign > 0.0 else '-'}{'xyz'[axis]} of ground"
                yield replace(once.renamed(case), words=f"new test: {name} ({where})")


def _large(case: LoadCase) -> list[Array]:
    loads = summed_loads(case)
    size = float(np.linalg.norm(peak(case)))
    return [load for load in loads if np.linalg.norm(load) >= HALF * size > 0.0]


def _turned(case: LoadCase, start: int, axis: int, sign: float) -> LoadCase:
    """The moments, or forces, of a case with their size along one axis; the others as they are.

    The side of each step is that of its load along the largest one.
    """
    largest = peak(case)
    steps = []
    for step, load in zip(case.steps, summed_loads(case), strict=True):
        side = sign * float(np.sign(load @ largest))
        along = side * np.eye(3)[axis]
        changed = "moment" if start else "force"
        wrenches = tuple(
            replace(w, **{changed: float(np.linalg.norm(getattr(w, changed))) * along})
            for w in step.wrenches
        )
        steps.append(replace(step, wrenches=wrenches))
    return replace(case, steps=tuple(steps))
