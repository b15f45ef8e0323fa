"""Do the files of a cohort fit each other beyond what their forms declare?

The vertebrae are a chain, steps count 0, 1, 2 without a gap, loads are unambiguous and act on
something that can move, every measured motion was caused by a load that is given, and
``supports.csv`` says of a rig what can be done.
"""

import re
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Sequence
from functools import cache
from itertools import pairwise
from math import isnan

from spinepipe.cohort.draft import Draft, LoadRow
from spinepipe.cohort.supports import MEASURED, PRESCRIBED, Rig
from spinepipe.documents.names import COHORT_NAME
from spinepipe.documents.yaml_text import YamlDocument
from spinepipe.model import MOST_JOINTS
from spinepipe.problems import InputProblem, Spelling, first_of
from spinepipe.units import COORDINATE_COLUMNS, TRANSLATIONS

REGIONS = "SLTC"
"""Sacral, lumbar, thoracic, cervical: caudal to cranial."""


def check_header(document: YamlDocument, folder: str) -> Iterator[InputProblem]:
    """Problems of ``cohort.yaml`` which its schema cannot see."""
    name = document.data.get("cohort")
    if isinstance(name, str) and name != folder:
        place = document.place_of("cohort")
        remedy = "rename the folder or change the key"
        if not COHORT_NAME.fullmatch(folder):
            remedy = "rename the folder: names of cohorts are of a-z, 0-9 and _"
        yield InputProblem(*place, f"'{name}'", f"the folder's name, '{folder}'", remedy)
    vertebrae = document.data.get("vertebrae")
    if isinstance(vertebrae, list):
        names = [name for name in vertebrae if isinstance(name, str)]
        yield from _chain_problems(document, names, len(vertebrae))


def usable_vertebrae(document: YamlDocument) -> tuple[str, ...]:
    """The vertebrae when they are a sound chain; none otherwise, so that one fault stays one."""
    names = document.data.get("vertebrae")
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        return ()
    return () if any(_chain_problems(document, names, len(names))) else tuple(names)


def _chain_problems(document: YamlDocument, names: list[str], count: int) -> Iterator[InputProblem]:
    place = document.place_of("vertebrae")
    if count < 2:
        found = f"{count} vertebra{'' if count == 1 else 'e'}"
        yield InputProblem(*place, found, "at least 2", "list every vertebra, caudal to cranial")
    if count - 1 > MOST_JOINTS:
        allowed = f"at most {MOST_JOINTS}"
        yield InputProblem(*place, f"{count - 1} joints", allowed, "leave vertebrae out at an end")
        return
    for name, times in Counter(names).items():
        if times > 1:
            yield InputProblem(*place, f"'{name}' twice", "each vertebra once", "delete one")
    for lower, upper in pairwise(names):
        low, high = height(lower), height(upper)
        if low is not None and high is not None and low > high:
            found = f"'{lower}' before '{upper}'"
            yield InputProblem(
                *place, found, "caudal to cranial, as in [L4, L3]", "turn the list round"
            )


def height(name: str) -> tuple[int, int] | None:
    """Sort key of an anatomical name, growing cranially; None for other names."""
    match = re.fullmatch(r"([SLTC])([0-9]{1,3})", name)
    return (REGIONS.index(match[1]), -int(match[2])) if match else None


POINT = ("px_mm", "py_mm", "pz_mm")
FORCE = ("fx_n", "fy_n", "fz_n")


def check_loads(draft: Draft, applied: Sequence[LoadRow]) -> Iterator[InputProblem]:
    """Problems of ``loads.csv`` beyond its cells and names."""
    yield from _repeated_loads(draft, applied)
    for stem in ("loads", "preload"):
        for line, (vertebra,) in draft.rows(stem, "vertebra"):
            if draft.vertebrae and vertebra == draft.vertebrae[0]:
                place = (draft.file(stem), line, "vertebra")
                found = f"a load on '{vertebra}', which is fixed to ground"
                allowed = "one of " + ", ".join(draft.vertebrae[1:])
                remedy = "load a moving vertebra or delete the row"
                yield InputProblem(*place, found, allowed, remedy)
    yield from _without_a_point(draft, applied)
    yield from _preload(draft)
    yield from _times(draft)
    yield from _followers(draft)


def _repeated_loads(draft: Draft, applied: Sequence[LoadRow]) -> Iterator[InputProblem]:
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
            yield InputProblem(draft.file("loads"), load.line, None, found, allowed, remedy)


def _preload(draft: Draft) -> Iterator[InputProblem]:
    """A preload that is a force belongs to a point of a vertebra."""
    for line, cells in draft.rows("preload", *POINT, *FORCE):
        if _pulls_without_a_point(cells):
            place = (draft.file("preload"), line, "px_mm")
            remedy = "fill px_mm, py_mm, pz_mm"
            yield InputProblem(*place, "a force without a point", "a force with a point", remedy)


def _without_a_point(draft: Draft, applied: Sequence[LoadRow]) -> Iterator[InputProblem]:
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
            yield InputProblem(*place, found, allowed, "fill px_mm, py_mm, pz_mm")


def _pulls_without_a_point(cells: tuple[float, ...]) -> bool:
    point, force = cells[:3], cells[3:]
    return all(map(isnan, point)) and any(f != 0.0 and not isnan(f) for f in force)


def _times(draft: Draft) -> Iterator[InputProblem]:
    tests: dict[tuple[object, ...], list[tuple[float, float, int]]] = defaultdict(list)
    columns = ("specimen", "test", "cycle", "step", "time_s")
    for line, (specimen, test, cycle, step, time) in draft.rows("loads", *columns):
        if not isnan(step):
            tests[specimen, test, None if isnan(cycle) else cycle].append((step, time, line))
    file, remedy = draft.file("loads"), "correct the time"
    for rows in map(sorted, tests.values()):
        timed = [row for row in rows if not isnan(row[1])]
        for _, _, line in (row for row in rows if timed and isnan(row[1])):
            allowed = "a time in every row of a test, or in none"
            yield InputProblem(file, line, "time_s", "no time", allowed, "fill the cell")
        for (step, time, _), (later_step, later, line) in pairwise(timed):
            found = f"{later:g} s at step {later_step:g} after {time:g} s at step {step:g}"
            if step == later_step and later != time:
                yield InputProblem(file, line, "time_s", found, "one time per step", remedy)
            if step < later_step and later <= time:
                yield InputProblem(file, line, "time_s", found, "times that increase", remedy)


def _followers(draft: Draft) -> Iterator[InputProblem]:
    """A test has one follower load, told in each of its rows."""
    file, told = draft.file("loads"), defaultdict[tuple[object, object], dict[str, int]](dict)
    for line, (specimen, test, force) in draft.rows("loads", "specimen", "test", "follower_n"):
        word = "no follower load" if isnan(force) else f"{force:g} N"
        told[specimen, test].setdefault(word, line)
    for specimen, test in tuple(told):
        of_all = told["*", test] if specimen != "*" else {}
        (first, _), *others = ({**of_all, **told[specimen, test]}).items()
        for word, line in others:
            found = f"{word} after {first} in test '{test}'"
            allowed = "one tension in all rows of a test (of a specimen, or of * and it)"
            remedy = "fill it in everywhere; a test under another tension has a name of its own"
            yield InputProblem(file, line, "follower_n", found, allowed, remedy)


def check_motion(draft: Draft, applied: Sequence[LoadRow]) -> Iterator[InputProblem]:
    """Motion without loads; said once per test, cycle or step of a specimen."""
    if "motion" in draft.absent or not ("loads" in draft.tables or "loads" in draft.absent):
        return
    file = draft.file("motion")
    if "loads" in draft.absent:
        remedy = "add loads.csv, or take motion.csv out"
        yield InputProblem(
            file, None, None, "motion without loads", "motion with loads.csv", remedy
        )
        return
    # (specimen, test), with cycle, and with cycle and step, of every load
    keys = ((load.specimen, load.test, load.cycle, load.step) for load in applied)
    known = {key[:length] for key in keys for length in (2, 3, 4)}
    tests = Spelling(sorted({load.test for load in applied}), "add the load or delete the motion")
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


def _problem(file: str, line: int, key: tuple[object, ...], tests: Spelling) -> InputProblem:
    column = ("test", "cycle", "step")[len(key) - 2]
    found = f"{column} '{key[-1]}' of specimen '{key[0]}', which has no load"
    allowed = "a specimen, test, cycle and step of loads.csv"
    remedy = "add the load or delete the motion"
    if column == "test" and key[1] not in tests.known:
        remedy = tests.remedy(str(key[1]))
    return InputProblem(file, line, column, found, allowed, remedy)


def check_steps(draft: Draft, applied: Sequence[LoadRow]) -> Iterator[InputProblem]:
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
) -> Iterator[InputProblem]:
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
                yield InputProblem(file, line, "step", found, allowed, remedy)
            before = step


def check_supports(draft: Draft, document: YamlDocument | None) -> Iterator[InputProblem]:
    """Problems of ``supports.csv`` beyond its cells and keys; ``document`` is ``cohort.yaml``."""
    if "supports" not in draft.tables:
        return
    for found in (_support_places(draft), _without_values(draft), _without_sd(draft, document)):
        yield from first_of(found)


def _support_places(draft: Draft) -> Iterator[InputProblem]:
    """Each row is of a joint and a coordinate; a vertebra by itself cannot be held yet."""
    columns = ("joint", "coordinate", "vertebra", "direction")
    for line, cells in draft.rows("supports", *columns):
        there = {n: isinstance(cell, str) for n, cell in zip(columns, cells, strict=True)}
        place = (draft.file("supports"), line)
        if there["vertebra"] or there["direction"]:
            found = "a vertebra held in a direction of ground, which is not yet supported"
            allowed = "a joint and a coordinate"
            remedy = "say it of the joints, or leave the row out if the rig does not matter"
            yield InputProblem(*place, "vertebra", found, allowed, remedy)
            continue
        for name in ("joint", "coordinate"):
            if not there[name]:
                allowed = "a joint and a coordinate in every row"
                yield InputProblem(*place, name, "an empty cell", allowed, f"name the {name}")


def _without_values(draft: Draft) -> Iterator[InputProblem]:
    """A prescribed coordinate needs a reading at every step; said once per test and coordinate."""
    if "motion" not in draft.tables and "motion" not in draft.absent:
        return
    if not any(state == PRESCRIBED for _, (state,) in draft.rows("supports", "state")):
        return
    fixed = cache(Rig(draft.tables["supports"], draft.joint_names).fixed)
    motion, reported = _measured(draft), set()
    for load in draft.applied:
        if load.step is None:
            continue
        for one in fixed(load.specimen, load.test):
            joint, column = draft.joint_names[one.joint], COORDINATE_COLUMNS[one.coordinate]
            key = (load.specimen, load.test, load.cycle, load.step, joint, column)
            if one.state != PRESCRIBED or key in motion or (*key[:3], *key[4:]) in reported:
                continue
            reported.add((*key[:3], *key[4:]))
            found = (
                f"no {column} of {joint} at step {load.step} of test '{load.test}', specimen "
                f"'{load.specimen}', cycle {load.cycle}, though it is prescribed"
            )
            allowed = "a value at every step of a test in which supports.csv prescribes it"
            remedy = "add the value to motion.csv, or set the state to held or free"
            yield InputProblem(draft.file("supports"), None, "state", found, allowed, remedy)


def _measured(draft: Draft) -> set[tuple[object, ...]]:
    """Specimen, test, cycle, step, joint and column of every value in ``motion.csv``."""
    keys = ("specimen", "test", "cycle", "step", "joint")
    found: set[tuple[object, ...]] = set()
    for _, cells in draft.rows("motion", *keys, *COORDINATE_COLUMNS):
        (specimen, test, cycle, step, joint), values = cells[:5], cells[5:]
        if isnan(step):
            continue
        place = (specimen, test, 1 if isnan(cycle) else int(cycle), int(step), joint)
        named = zip(COORDINATE_COLUMNS, values, strict=True)
        found |= {(*place, column) for column, value in named if not isnan(value)}
    return found


def _without_sd(draft: Draft, document: YamlDocument | None) -> Iterator[InputProblem]:
    """A load that was measured counts by its SD."""
    sd = document.data.get("measurement_sd") if document else None
    known = sd if isinstance(sd, dict) else {}
    reported = set()
    for line, (coordinate, reaction) in draft.rows("supports", "coordinate", "reaction"):
        key = "force_n" if coordinate in TRANSLATIONS else "moment_nm"
        if reaction == MEASURED and key not in known and key not in reported:
            reported.add(key)
            place = (draft.file("supports"), line, "reaction")
            allowed = f"a measured reaction with measurement_sd.{key} in cohort.yaml"
            remedy = f"add `{key}:` there, the SD of the rig's load, or set the reaction to unknown"
            yield InputProblem(*place, f"'{MEASURED}', but no SD of it", allowed, remedy)
