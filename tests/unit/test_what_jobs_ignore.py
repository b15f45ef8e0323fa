"""No job looks at a setting that its declaration says it ignores: else results would be stale.

Read from the code: what the functions that a job reaches by name ask of ``settings`` or ``study``.

Catches a setting that a job reads though it says it ignores it.
"""

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from sweeps import sweep

from spinepipe.studies.registry import every_kind, place_of

ROOT = Path(__file__).resolve().parents[2]
ASKED = ("settings", "study")
"""What functions call the study they are handed."""

OF_OTHERS = {
    ("cohort_stiffness", "pool"): {"level_stiffness", "nuisance"},  # no pooled fit has them
    # what ranks its sets: the first two decide of the fits, whose marks it holds, the last is named
    # in the marks of simulations with a ranked set
    ("joint_pose_sensitivity", "simulate"): {"calibration", "stiffness", "success"},
    ("tracking", "profile"): {"intervals"},  # has its own, put in their place
}
"""Asked for by functions that the job shares with others, and only for them."""

Function = tuple[str, str]
"""Module and name of a function or class."""

_Defined = ast.FunctionDef | ast.ClassDef


@cache
def names_in(module: str) -> tuple[dict[str, _Defined], dict[str, Function]]:
    """What a module defines, and what it imports by name from this package."""
    path = ROOT.joinpath(*module.split(".")).with_suffix(".py")
    path = path if path.exists() else path.with_suffix("") / "__init__.py"
    if not path.exists():
        return {}, {}
    tree = ast.parse(path.read_bytes())
    defined = {node.name: node for node in tree.body if isinstance(node, _Defined)}
    imported = {
        alias.asname or alias.name: (node.module, alias.name)
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("spinepipe")
        for alias in node.names
    }
    return defined, imported


@cache
def named_and_asked(module: str, name: str) -> tuple[frozenset[str], frozenset[str]]:
    """Names in a function or class, and attributes of the study that it asks for."""
    nodes = list(ast.walk(names_in(module)[0][name]))
    attributes = [
        node.attr
        for node in nodes
        if isinstance(node, ast.Attribute)
        and isinstance(node.value, ast.Name)
        and node.value.id in ASKED
    ]
    names = {node.id for node in nodes if isinstance(node, ast.Name)}
    return frozenset(names), frozenset(attributes)


def asked_of(module: str, name: str) -> set[str]:
    """What is asked for by a function, and by all that it names in its own and other files."""
    known: set[Function] = set()
    found: set[str] = set()
    waiting = [(module, name)]
    while waiting:
        place, one = waiting.pop()
        defined, imported = names_in(place)
        if (place, one) in known:
            continue
        known.add((place, one))
        if one in imported and one not in defined:
            waiting.append(imported[one])
        elif one in defined:
            names, asked = named_and_asked(place, one)
            found |= asked
            waiting += [(place, used) for used in names]
    return found


def jobs() -> Iterator[tuple[str, str]]:
    """Kind and name of every job that ignores something."""
    for name, kind in every_kind().items():
        yield from ((name, job.name) for job in kind.jobs if job.ignores)


@sweep("kind, job", jobs)
def test_what_a_job_asks_for_it_does_not_ignore(kind: str, job: str) -> None:
    declared = every_kind()[kind].job(job)
    whole = {name for name, what in declared.ignores.items() if what is True}
    asked = asked_of(*place_of(kind, job).split(":"))
    assert asked & whole == OF_OTHERS.get((kind, job), set())


def test_what_a_job_asks_for_is_seen_through_other_files() -> None:
    """Of the calibration in sampled poses: in its file, and in the file that sets its problem."""
    asked = asked_of(*place_of("joint_pose_sensitivity", "calibrate").split(":"))
    assert {"seed", "calibration", "stiffness", "damping", "tests"} <= asked
