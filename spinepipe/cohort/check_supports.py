"""Does ``supports.csv`` say of a rig what can be done? Places, values to be prescribed."""

from collections.abc import Iterator
from functools import cache
from math import isnan

from spinepipe.cohort.draft import Draft
from spinepipe.cohort.supports import MEASURED, PRESCRIBED, Rig
from spinepipe.documents.yaml_text import YamlDocument
from spinepipe.problems import InputProblem, first_of
from spinepipe.units import COORDINATE_COLUMNS, TRANSLATIONS


def check_supports(draft: Draft, document: YamlDocument | None) -> Iterator[InputProblem]:
    """Problems of ``supports.csv`` beyond its cells and keys; ``document`` is ``cohort.yaml``."""
    if "supports" not in draft.tables:
        return
    for found in (
        _places(draft),
        _without_values(draft),
        _without_sd(draft, document),
    ):
        yield from first_of(found)


def _places(draft: Draft) -> Iterator[InputProblem]:
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
