"""A YAML file as plain data, with the line of every key and every repeated key reported."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from spinepipe.cohort.read_text import read_text
from spinepipe.problems import Problem

__all__ = ["Document", "read_yaml"]


class _Loader(yaml.SafeLoader):
    """YAML's safe loader which also takes 1e5 for a number, as everybody means it."""


_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float",
    re.compile(r"^[-+]?(\d+\.?\d*|\.\d+)[eE][-+]?\d+$"),
    list("-+.0123456789"),
)


@dataclass(frozen=True)
class Document:
    """One YAML file whose top level is a list of keys.

    Attributes
    ----------
    file : name in messages.
    data : its content.
    lines : line of every dotted key, list items by their number from 0.
    """

    file: str
    data: dict[str, Any]
    lines: dict[str, int]

    def line_of(self, key: str) -> int | None:
        """Line of a dotted key, or of the closest key above it that is there."""
        while key and key not in self.lines:
            key = key.rpartition(".")[0]
        return self.lines.get(key)


def read_yaml(path: Path, file: str) -> tuple[Document | None, list[Problem]]:
    """Read a YAML file of keys and values, None when it is none.

    Parameters
    ----------
    path : the file, which exists.
    file : its name in messages.
    """
    text, problems = read_text(path, file)
    if problems:
        return None, problems
    loader = _Loader(text)
    try:
        node = loader.get_single_node()
        if not isinstance(node, yaml.MappingNode):
            return None, [_no_keys(file)]
        lines: dict[str, int] = {}
        problems = list(_walk(node, "", file, lines, set()))
        data = loader.construct_document(node)
    except (yaml.YAMLError, ValueError) as error:
        return None, [_no_yaml(file, error)]
    finally:
        loader.dispose()
    return Document(file, data, lines), problems


def _walk(
    node: yaml.Node, path: str, file: str, lines: dict[str, int], walked: set[int]
) -> Iterator[Problem]:
    """Note the line of every key below a node, and report repeated keys."""
    if id(node) in walked:  # an alias, perhaps of a node that holds itself
        return
    walked.add(id(node))
    prefix = f"{path}." if path else ""
    if isinstance(node, yaml.SequenceNode):
        for index, item in enumerate(node.value):
            lines[f"{prefix}{index}"] = item.start_mark.line + 1
            yield from _walk(item, f"{prefix}{index}", file, lines, walked)
    if isinstance(node, yaml.MappingNode):
        seen: set[str] = set()
        for key_node, value in node.value:
            key, line = f"{prefix}{key_node.value}", key_node.start_mark.line + 1
            if key in seen:
                remedy = f"delete one (the other is in line {lines[key]})"
                yield Problem(file, line, key, "the same key twice", "each key once", remedy)
            seen.add(key)
            lines.setdefault(key, line)
            yield from _walk(value, key, file, lines, walked)


def _no_keys(file: str) -> Problem:
    allowed = "lines of the form `key: value`"
    return Problem(file, None, None, "no keys", allowed, "see the format's documentation")


def _no_yaml(file: str, error: Exception) -> Problem:
    mark = getattr(error, "problem_mark", None)
    reason = getattr(error, "problem", None) or str(error)
    line = mark.line + 1 if mark is not None else None
    remedy = "check indentation, colons, brackets and quotes there"
    return Problem(file, line, None, f"no YAML ({reason})", "YAML", remedy)
