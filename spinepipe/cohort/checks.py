"""Are the loads unambiguous, and do they act on something that can move?"""

from collections import defaultdict
from collections.abc import Iterator
from itertools import pairwise
from math import isnan

from spinepipe.cohort.applied_loads import AppliedLoad
from spinepipe.cohort.draft import Draft
from spinepipe.problems import Problem

__all__ = ["check_loads"]

POINT = ("px_mm", "py_mm", "pz_mm")
FORCE = ("fx_n", "fy_n", "fz_n")


def check_loads(draft: Draft, applied: list[AppliedLoad]) -> Iterator[Problem]:
    """Problems of ``loads.csv`` beyond its cells and names."""
    yield from _repeated(draft, applied)
    yield from _on_the_fixed_vertebra(draft)
    yield from _partial_points(draft)
    yield from _without_a_point(draft, applied)
    yield from _times(draft)


def _repeated(draft: Draft, applied: list[AppliedLoad]) -> Iterator[Problem]:
    seen: dict[tuple[object, ...], int] = {}
    reported = set()
    for load in applied:
        if load.step is None:
            continue
        key = (load.specimen, load.test, load.cycle, load.step, load.vertebra)
        first = seen.setdefault(key, load.line)
        if first != load.line and load.line not in reported:
            reported.add(load.line)
            found = f"again {load.specimen}, {load.test}, {load.step}, {load.vertebra}"
            allowed = "one row per specimen x test x cycle x step x vertebra (* and empty mean all)"
            remedy = f"add the loads up in one row (the other is line {first})"
            yield Problem(draft.file("loads"), load.line, None, found, allowed, remedy)


def _on_the_fixed_vertebra(draft: Draft) -> Iterator[Problem]:
    for line, (vertebra,) in draft.rows("loads", "vertebra"):
        if draft.vertebrae and vertebra == draft.vertebrae[0]:
            place = (draft.file("loads"), line, "vertebra")
            found = f"a load on '{vertebra}', which is fixed to ground"
            allowed = "one of " + ", ".join(draft.vertebrae[1:])
            yield Problem(*place, found, allowed, "load a moving vertebra or delete the row")


def _partial_points(draft: Draft) -> Iterator[Problem]:
    for line, point in draft.rows("loads", *POINT):
        missing = [name for name, value in zip(POINT, point, strict=True) if isnan(value)]
        if 0 < len(missing) < len(POINT):
            place = (draft.file("loads"), line, missing[0])
            remedy = "fill the cell; without all three the force would act elsewhere"
            yield Problem(*place, "an incomplete point", "all of px, py, pz or none", remedy)


def _without_a_point(draft: Draft, applied: list[AppliedLoad]) -> Iterator[Problem]:
    """A force without a point acts at the centre of mass, which must then be known."""
    rows = draft.rows("loads", *POINT, *FORCE)
    pointless = {line for line, cells in rows if _pulls_without_a_point(cells)}
    if not pointless or not ("bodies" in draft.tables or "bodies" in draft.absent):
        return
    known = {cells for _, cells in draft.rows("bodies", "specimen", "vertebra")}
    moving = set(draft.vertebrae[1:])
    for load in applied:
        lacking = (load.specimen, load.vertebra) not in known
        if load.line in pointless and load.vertebra in moving and lacking:
            place = (draft.file("loads"), load.line, "px_mm")
            found = "a force without a point, on a vertebra without a body"
            allowed = f"a point, or a row for {load.specimen}, {load.vertebra} in bodies.csv"
            yield Problem(*place, found, allowed, "fill px_mm, py_mm, pz_mm")


def _pulls_without_a_point(cells: tuple[float, ...]) -> bool:
    point, force = cells[:3], cells[3:]
    return all(map(isnan, point)) and any(f != 0.0 and not isnan(f) for f in force)


def _times(draft: Draft) -> Iterator[Problem]:
    tests: dict[tuple[object, ...], list[tuple[float, float, int]]] = defaultdict(list)
    columns = ("specimen", "test", "cycle", "step", "time_s")
    for line, (specimen, test, cycle, step, time) in draft.rows("loads", *columns):
        if not isnan(step):
            tests[specimen, test, None if isnan(cycle) else cycle].append((step, time, line))
    for rows in tests.values():
        if not all(isnan(time) for _, time, _ in rows):
            yield from _times_of_one_test(draft.file("loads"), sorted(rows))


def _times_of_one_test(file: str, rows: list[tuple[float, float, int]]) -> Iterator[Problem]:
    for _, time, line in rows:
        if isnan(time):
            allowed = "a time in every row of a test, or in none"
            yield Problem(file, line, "time_s", "no time", allowed, "fill the cell")
    timed = [row for row in rows if not isnan(row[1])]
    for (step, time, _), (later_step, later, line) in pairwise(timed):
        found = f"{later:g} s at step {later_step:g} after {time:g} s at step {step:g}"
        if step == later_step and later != time:
            yield Problem(file, line, "time_s", found, "one time per step", "correct the time")
        if step < later_step and later <= time:
            yield Problem(file, line, "time_s", found, "times that increase", "correct the time")
