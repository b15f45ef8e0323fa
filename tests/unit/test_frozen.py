"""Data types do not change under those who hold them."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

FILLED_STEP_BY_STEP = {
    "spinepipe/motion/banded.py": {"Band"},
    "spinepipe/progress.py": {"Progress"},
    "spinepipe/studies/trunk_loads/tune.py": {"Volunteer"},
}
"""Sums and counters, which are there to be changed."""


def thawed(text: str) -> Iterator[str]:
    """Dataclasses of a module that are not declared frozen."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.ClassDef):
            for one in node.decorator_list:
                called = one.func if isinstance(one, ast.Call) else one
                if isinstance(called, ast.Name) and called.id == "dataclass":
                    words = one.keywords if isinstance(one, ast.Call) else []
                    said = {word.arg: ast.unparse(word.value) for word in words}
                    if said.get("frozen") != "True":
                        yield node.name


def test_dataclasses_are_frozen_but_for_those_that_are_filled() -> None:
    found = {}
    for path in sorted((ROOT / "spinepipe").rglob("*.py")):
        if names := set(thawed(path.read_text())):
            found[path.relative_to(ROOT).as_posix()] = names
    assert found == FILLED_STEP_BY_STEP


@pytest.mark.parametrize(
    ("declared", "names"),
    [
        ("@dataclass\nclass A: ...", ["A"]),
        ("@dataclass()\nclass A: ...", ["A"]),
        ("@dataclass(frozen=False)\nclass A: ...", ["A"]),
        ("@dataclass(eq=False)\nclass A: ...", ["A"]),
        ("@dataclass(frozen=True, eq=False)\nclass A: ...", []),
        ("class A: ...", []),
    ],
)
def test_what_is_not_frozen_is_seen(declared: str, names: list[str]) -> None:
    assert list(thawed(declared)) == names
