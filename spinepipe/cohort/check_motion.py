"""Was every measured motion caused by a load that is given?"""

from collections.abc import Iterator
from math import isnan

from spinepipe.cohort.applied_loads import AppliedLoad
from spinepipe.cohort.draft import Draft
from spinepipe.problems import Problem, did_you_mean

__all__ = ["check_motion"]


def check_motion(draft: Draft, applied: list[AppliedLoad]) -> Iterator[Problem]:
    """Motion without loads; said once per test, cycle or step of a specimen."""
    if "motion" in draft.absent or not ("loads" in draft.tables or "loads" in draft.absent):
        return
    file = draft.file("motion")
    if "loads" in draft.absent:
        remedy = "add loads.csv, or take motion.csv out"
        yield Problem(file, None, None, "motion without loads", "motion with loads.csv", remedy)
        return
    known = _prefixes(applied)
    tests = sorted({load.test for load in applied})
    reported = set()
    rows = draft.rows("motion", "specimen", "test", "cycle", "step")
    specimens = set(draft.specimens)  # rows of an unknown one are reported as such
    for line, (specimen, test, cycle, step) in rows:
        if specimen not in specimens or not isinstance(test, str) or isnan(step):
            continue
        key = (specimen, test, 1 if isnan(cycle) else int(cycle), int(step))
        missing = next((key[:n] for n in (2, 3, 4) if key[:n] not in known), None)
        unclear = (*key[:3], None) in known  # a bad step cell may be the one looked for
        if missing is not None and missing not in reported and not unclear:
            reported.add(missing)
            yield _problem(file, line, missing, tests)


def _prefixes(applied: list[AppliedLoad]) -> set[tuple[object, ...]]:
    """(specimen, test), with cycle, and with cycle and step, of every load."""
    known: set[tuple[object, ...]] = set()
    for load in applied:
        key = (load.specimen, load.test, load.cycle, load.step)
        known |= {key[:2], key[:3], key}
    return known


def _problem(file: str, line: int, key: tuple[object, ...], tests: list[str]) -> Problem:
    column = ("test", "cycle", "step")[len(key) - 2]
    found = f"{column} '{key[-1]}' of specimen '{key[0]}', which has no load"
    allowed = "a specimen, test, cycle and step of loads.csv"
    remedy = "add the load or delete the motion"
    if column == "test" and key[1] not in tests:
        remedy = did_you_mean(str(key[1]), tests, remedy)
    return Problem(file, line, column, found, allowed, remedy)
