"""Which mutants are tried: places of the code drawn evenly, at each one of the ways to spoil it.

The ways are those of Cosmic Ray. Drawn by place, as an addition can be spoilt in ten ways and a
comparison in seven, and the ten would be nearly one mutant ten times.
"""

import random
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from cosmic_ray.ast import ast_nodes, get_ast_from_path
from cosmic_ray.mutating import mutate_code
from cosmic_ray.plugins import get_operator, operator_names
from parso.tree import NodeOrLeaf

from tests.mutants.lines import ROOT

AREAS = {
    "statics": ("spinepipe/statics",),
    "effects": ("spinepipe/effects",),
    "calibrate": ("spinepipe/calibration",),
    "statistics": ("spinepipe/statistics",),
    "sensitivity": ("spinepipe/sensitivity_analysis",),
    "search": ("spinepipe/studies/discrepancy/search", "spinepipe/studies/discrepancy/proof"),
    "films": ("spinepipe/studies/scoliosis",),
    "trunk": ("spinepipe/muscles",),
    "tracking": ("spinepipe/motion",),
    "cohort": ("spinepipe/cohort", "spinepipe/plausibility"),
    "testing_machine": ("spinepipe/testing_machine",),
    "documents": ("spinepipe/documents",),
    "jobs": ("spinepipe/jobs",),
    "report": ("spinepipe/report",),
}
"""Folders of each area that must be safe."""

LEFT_OUT = ("figures", "__init__.py", "settings.py", "tables.py", "kind.py", "page.py")
"""Files of an area that compute nothing: words, drawings, declarations."""

ANNOTATIONS = ("tfpdef", "annassign")
"""Parts of the grammar that Python does not compute with."""

DECORATOR = "decorator"
"""Nor with what stands in one: that data are frozen is asked of all files by test_house.py."""

LENGTHS_ASKED = "strict"
"""An argument of `zip` that ends a run in which lengths differ: no result hangs on it."""

_ENDS_AT_ONCE = ("LShift", "RShift", "BitOr", "BitAnd", "BitXor")
"""Of floats these are errors, which any test sees: they would only make the share look good."""

_NO_FAULT = ("core/ExceptionReplacer", "core/RemoveDecorator", "core/AddNot")
"""Ways left out: what is raised is asked by name elsewhere; a decorator lost ends the import; `not`
before a condition is its opposite comparison once more."""


@dataclass(frozen=True)
class Mutant:
    """One fault: ``occurrence`` of an operator's places in a file."""

    area: str
    path: str
    line: int
    operator: str
    occurrence: int

    def code(self) -> str:
        """The spoilt file.

        Raises
        ------
        ValueError
            Where there is nothing to spoil any more.
        """
        text = (ROOT / self.path).read_text()
        spoilt = mutate_code(text, get_operator(self.operator)(), self.occurrence)
        if spoilt is None:
            raise ValueError(f"{self.path}:{self.line}: nothing to spoil by {self.operator}")
        return str(spoilt)

    def change(self) -> tuple[str, str]:
        """The first line that is spoilt, as it is and as it becomes, without indentation.

        Lines whose numbers move as the file grows are known again by it.
        """
        before = (ROOT / self.path).read_text().splitlines()
        for was, becomes in zip(before, self.code().splitlines(), strict=False):
            if was != becomes:
                return was.strip(), becomes.strip()
        raise ValueError(f"{self.path}:{self.line}: {self.operator} changes nothing")


def drawn(area: str, count: int, seed: int) -> list[Mutant]:
    """That many mutants of an area, at different places."""
    rng = random.Random(f"{area}/{seed}")
    places: dict[tuple[str, int, int], list[Mutant]] = defaultdict(list)
    for path in _files(AREAS[area]):
        for place, mutant in _every(area, path):
            places[place].append(mutant)
    chosen = rng.sample(sorted(places), min(count, len(places)))
    return [rng.choice(places[place]) for place in chosen]


def _files(folders: Sequence[str]) -> list[Path]:
    every = (path for folder in folders for path in sorted((ROOT / folder).rglob("*.py")))
    return [path for path in every if not {*path.relative_to(ROOT).parts} & {*LEFT_OUT}]


def _every(area: str, path: Path) -> Iterator[tuple[tuple[str, int, int], Mutant]]:
    """Each mutant of a file with its place: file, line, column."""
    nodes = list(ast_nodes(get_ast_from_path(path)))
    name = path.relative_to(ROOT).as_posix()
    for operator in operator_names():
        made = get_operator(operator)
        if made.arguments() or operator in _NO_FAULT or operator.endswith(_ENDS_AT_ONCE):
            continue
        found = [(node, at) for node in nodes for at in made().mutation_positions(node)]
        for occurrence, (node, ((line, column), _)) in enumerate(found):
            if not (_is_annotation(node) or _asks_lengths(node)):
                yield (name, line, column), Mutant(area, name, line, operator, occurrence)


def _is_annotation(node: NodeOrLeaf | None) -> bool:
    """Whether a node is in a decorator or the type of an argument, a variable, what is returned."""
    while node is not None and node.parent is not None:
        parent = node.parent
        if parent.type in (*ANNOTATIONS, DECORATOR):
            return True
        if parent.type == "funcdef" and getattr(parent, "annotation", None) is node:
            return True
        node = parent
    return False


def _asks_lengths(node: NodeOrLeaf) -> bool:
    """Whether a node is the value of ``strict``."""
    parent = node.parent
    return (
        parent is not None
        and parent.type == "argument"
        and getattr(parent.children[0], "value", "") == LENGTHS_ASKED
    )
