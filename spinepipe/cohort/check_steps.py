"""Do the steps of every test count 0, 1, 2 without a gap?"""

from collections import defaultdict
from collections.abc import Iterable, Iterator
from math import isnan

from spinepipe.cohort.applied_loads import AppliedLoad
from spinepipe.cohort.draft import Draft
from spinepipe.problems import Problem

__all__ = ["check_steps"]


def check_steps(draft: Draft, applied: list[AppliedLoad]) -> Iterator[Problem]:
    """Gaps in ``loads.csv`` and, joint by joint, in ``motion.csv``."""
    loads = (((a.specimen, a.test, a.cycle), a.step, a.line) for a in applied)
    remedy = "add the row, with zeros where nothing acts"
    yield from _gaps(draft.file("loads"), loads, remedy)
    columns = ("specimen", "test", "cycle", "joint", "step")
    motion = (
        (
            (specimen, test, 1 if isnan(cycle) else cycle, joint),
            None if isnan(step) else int(step),
            line,
        )
        for line, (specimen, test, cycle, joint, step) in draft.rows("motion", *columns)
        if all(isinstance(name, str) for name in (specimen, test, joint))
    )
    remedy = "add the row, with empty cells where nothing was measured"
    yield from _gaps(draft.file("motion"), motion, remedy)


def _gaps(
    file: str, rows: Iterable[tuple[tuple[object, ...], int | None, int]], remedy: str
) -> Iterator[Problem]:
    series: dict[tuple[object, ...], list[tuple[int, int]]] = defaultdict(list)
    unclear = set()  # a bad cell hides one step, and is reported there
    for key, step, line in rows:
        if step is None:
            unclear.add(key)
        else:
            series[key].append((step, line))
    for key, steps in series.items():
        before = -1
        for step, line in sorted(steps):
            if step > before + 1 and key not in unclear:
                last = f"after step {before}" if before >= 0 else "first"
                found = f"step {step} {last} in test '{key[1]}'"
                allowed = "steps 0, 1, 2, … without a gap"
                yield Problem(file, line, "step", found, allowed, remedy)
            before = step
