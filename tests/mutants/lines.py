"""What stands at a line of the library: the statement, the function around it, names it defines."""

import ast
import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
LIBRARY = "spinepipe"

_COMPOUND = (
    *(ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef, ast.If, ast.For, ast.While),
    *(ast.With, ast.Try, ast.Match),
)


@dataclass(frozen=True)
class Statement:
    """The innermost statement at a line; of one with a body only its head.

    Attributes
    ----------
    lines : from its first line to its last.
    inside : whether it stands in a function, so that it runs when that is called.
    names : by which others come to it: the function around it, or what it defines.
    """

    lines: range
    inside: bool
    names: frozenset[str]


@cache
def statement(path: str, line: int) -> Statement:
    """At a line (counted from 1) of a file named from the project's folder.

    Raises
    ------
    ValueError
        Where nothing stands.
    """
    found = None
    for one in _statements(path):
        if line in one.lines:  # those further in come later
            found = one
    if found is None:
        raise ValueError(f"{path}:{line}: nothing stands here")
    return found


@cache
def _statements(path: str) -> tuple[Statement, ...]:
    return tuple(_below(ast.parse((ROOT / path).read_text()), None))


def _below(node: ast.AST, function: str | None) -> list[Statement]:
    found = []
    for child in ast.iter_child_nodes(node):
        inner = function
        if isinstance(child, (ast.stmt, ast.match_case, ast.ExceptHandler)):
            found.append(_made(child, function))
            if isinstance(child, (ast.FunctionDef, ast.AsyncFunctionDef)):
                inner = child.name
        found += _below(child, inner)
    return found


def _made(node: ast.AST, function: str | None) -> Statement:
    places = [one.lineno for one in ast.walk(node) if hasattr(one, "lineno")]
    first, last = min(places), getattr(node, "end_lineno", max(places)) or max(places)
    body = getattr(node, "body", None)
    if isinstance(body, list) and body:
        last = max(first, min(_first_line(one) for one in body) - 1)
    return Statement(range(first, last + 1), function is not None, _names(node, function))


def _first_line(node: ast.stmt) -> int:
    marks = getattr(node, "decorator_list", [])
    return min([node.lineno, *(mark.lineno for mark in marks)])


def _names(node: ast.AST, function: str | None) -> frozenset[str]:
    if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)):
        return frozenset({node.name})
    if function is not None:
        return frozenset({function})
    stored = (one for one in ast.walk(node) if isinstance(one, ast.Name))
    return frozenset(one.id for one in stored if isinstance(one.ctx, ast.Store))


@cache
def mentions(name: str) -> tuple[tuple[str, int], ...]:
    """Places of the library (file, line) where a name stands, but where it is defined."""
    word = re.compile(rf"\b{re.escape(name)}\b")
    defined = re.compile(
        rf"^\s*(?:def|class) {re.escape(name)}\b|^{re.escape(name)}\s*[:=]|^\s*(?:from|import)\b"
    )
    return tuple(
        (path, number)
        for path, lines in _library()
        for number, line in enumerate(lines, start=1)
        if word.search(line) and not defined.match(line)
    )


@cache
def _library() -> tuple[tuple[str, tuple[str, ...]], ...]:
    found = sorted((ROOT / LIBRARY).rglob("*.py"))
    return tuple(
        (path.relative_to(ROOT).as_posix(), tuple(path.read_text().splitlines())) for path in found
    )
