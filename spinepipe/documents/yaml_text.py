"""A YAML file as plain data, the line of every key known; whatever is wrong comes back located.

What the parser meets is looked at piece by piece before anything is built of it: aliases, tags,
depth, number and length. Python and YAML would follow all of them without an end.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from spinepipe.documents.text import LONGEST_CELL, MOST_YAML_BYTES, longest_word, read_text
from spinepipe.problems import InputProblem

DEEPEST = 20
"""Levels of lists and keys within each other."""

MOST_VALUES = 100_000
"""Keys, values and list items of one file."""

LONGEST_VALUE = 10_000
"""Characters of one text, such as the source of a cohort."""


@dataclass(frozen=True)
class YamlDocument:
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

    def place_of(self, key: str) -> tuple[str, int | None, str]:
        """File, line and key, as problems tell them."""
        return self.file, self.line_of(key), key


def read_yaml(path: Path, file: str) -> tuple[YamlDocument | None, list[InputProblem]]:
    """Read a YAML file of keys and values, None when it is none.

    Parameters
    ----------
    path : the file.
    file : its name in messages.
    """
    text, problems = read_text(path, file, MOST_YAML_BYTES)
    return (None, problems) if problems else yaml_of_text(text, file)


def yaml_of_text(text: str, file: str) -> tuple[YamlDocument | None, list[InputProblem]]:
    """As `read_yaml`, of a text that may be in no file yet."""
    try:
        problems = list(_beyond_bounds(text, file))
        return (None, problems) if problems else _document(text, file)
    except (yaml.YAMLError, ValueError) as error:
        return None, [_no_yaml(file, error)]


_PARSER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


class _Loader(_PARSER):  # type: ignore[misc]
    """YAML's safe loader, in which numbers are what everybody writes: decimal, 1e5 too.

    017 (15), 1:30 (90), 0x1F, 0b11 and 1_000 are texts, so that a number that is not what it looks
    like is refused where one is asked for.
    """


_INTEGER, _FLOAT = "tag:yaml.org,2002:int", "tag:yaml.org,2002:float"

_Loader.yaml_implicit_resolvers = {
    first: [(tag, pattern) for tag, pattern in found if tag not in (_INTEGER, _FLOAT)]
    for first, found in _PARSER.yaml_implicit_resolvers.items()
}
_Loader.add_implicit_resolver(_INTEGER, re.compile(r"^[-+]?(0|[1-9][0-9]*)$"), list("-+0123456789"))
_Loader.add_implicit_resolver(
    _FLOAT,
    re.compile(
        r"^[-+]?((0|[1-9][0-9]*)\.[0-9]*|\.[0-9]+|(0|[1-9][0-9]*)(?=[eE]))([eE][-+]?[0-9]+)?$"
        r"|^[-+]?\.(inf|Inf|INF)$|^\.(nan|NaN|NAN)$"
    ),
    list("-+.0123456789"),
)


def packaged_yaml(path: Path) -> dict[str, Any]:
    """Keys and values of a file of this package, which is trusted."""
    found: dict[str, Any] = _PARSER(path.read_text(encoding="utf-8")).get_single_data()
    return found


def _document(text: str, file: str) -> tuple[YamlDocument | None, list[InputProblem]]:
    """Keys and values of a text within bounds."""
    loader = _Loader(text)
    try:
        node = loader.get_single_node()
        if not isinstance(node, yaml.MappingNode):
            allowed, remedy = "lines of the form `key: value`", "see the format's documentation"
            return None, [InputProblem(file, None, None, "no keys", allowed, remedy)]
        problems = list(_no_names(node, file))
        if problems:
            return None, problems
        lines: dict[str, int] = {}
        problems = list(_walk(node, "", file, lines))
        return YamlDocument(file, loader.construct_document(node), lines), problems
    finally:
        loader.dispose()


def _beyond_bounds(text: str, file: str) -> Iterator[InputProblem]:
    """The first thing in a file that is beyond what is read."""
    depth, values = 0, 0
    for event in yaml.parse(text, Loader=_PARSER):
        fault = _fault(event)
        if isinstance(event, yaml.CollectionStartEvent):
            depth += 1
        elif isinstance(event, yaml.CollectionEndEvent):
            depth -= 1
        values += isinstance(event, yaml.NodeEvent)
        if fault is None and depth > DEEPEST:
            fault = (
                f"more than {DEEPEST} levels within each other",
                f"at most {DEEPEST}",
                "look for brackets or dashes too many",
            )
        if fault is None and values > MOST_VALUES:
            found, allowed = "more keys and values than are read", f"at most {MOST_VALUES}"
            fault = found, allowed, "take out what does not belong, or split it"
        if fault is not None:
            yield InputProblem(file, _line(event), None, *fault)
            return


def _line(event: yaml.Event) -> int | None:
    return None if event.start_mark is None else event.start_mark.line + 1


def _fault(event: yaml.Event) -> tuple[str, str, str] | None:
    """What was found, what is allowed and what to do, where one piece by itself is refused."""
    if isinstance(event, yaml.AliasEvent):
        return f"the alias '*{event.anchor}'", "values written out", "write the value again"
    if not isinstance(event, yaml.NodeEvent):
        return None
    if event.anchor is not None:
        return f"the anchor '&{event.anchor}'", "values without anchors", "delete it, or quote text"
    tag = getattr(event, "tag", None)
    if tag is not None:
        return f"the tag '{tag}'", "values without tags", "delete it, or put text in quotes"
    if not isinstance(event, yaml.ScalarEvent):
        return None
    if len(event.value) > LONGEST_VALUE:
        found = f"a text of {len(event.value)} characters"
        return found, f"at most {LONGEST_VALUE}", "shorten it"
    longest = longest_word(event.value)
    if longest > LONGEST_CELL:
        found = f"a word or number of {longest} characters"
        return found, f"at most {LONGEST_CELL}", "shorten it, or look for a missing blank"
    return None


def _no_names(node: yaml.Node, file: str) -> Iterator[InputProblem]:
    """Keys below a node that are no names."""
    if isinstance(node, yaml.SequenceNode):
        for item in node.value:
            yield from _no_names(item, file)
    if isinstance(node, yaml.MappingNode):
        for key, value in node.value:
            fault = _key_fault(key)
            if fault is not None:
                yield InputProblem(file, key.start_mark.line + 1, None, *fault)
            yield from _no_names(value, file)


def _walk(node: yaml.Node, path: str, file: str, lines: dict[str, int]) -> Iterator[InputProblem]:
    """Note the line of every key below a node, and report repeated keys."""
    prefix = f"{path}." if path else ""
    if isinstance(node, yaml.SequenceNode):
        for index, item in enumerate(node.value):
            lines[f"{prefix}{index}"] = item.start_mark.line + 1
            yield from _walk(item, f"{prefix}{index}", file, lines)
    if isinstance(node, yaml.MappingNode):
        seen: set[str] = set()
        for key_node, value in node.value:
            key, line = f"{prefix}{key_node.value}", key_node.start_mark.line + 1
            if key in seen:
                remedy = f"delete one (the other is in line {lines[key]})"
                yield InputProblem(file, line, key, "the same key twice", "each key once", remedy)
            seen.add(key)
            lines.setdefault(key, line)
            yield from _walk(value, key, file, lines)


def _key_fault(node: yaml.Node) -> tuple[str, str, str] | None:
    """What was found, what is allowed and what to do, where a key is no name."""
    if not isinstance(node, yaml.ScalarNode) or node.tag != "tag:yaml.org,2002:str":
        shown = repr(node.value) if isinstance(node, yaml.ScalarNode) else "a list or mapping"
        return f"the key {shown}", "names as keys", "write a name; in quotes if it is like a number"
    if len(node.value) > LONGEST_CELL:
        found = f"a key of {len(node.value)} characters"
        return found, f"at most {LONGEST_CELL}", "shorten it"
    return None


def _no_yaml(file: str, error: Exception) -> InputProblem:
    mark = getattr(error, "problem_mark", None)
    reason = getattr(error, "problem", None) or str(error)
    about = getattr(error, "context", None) or ""
    if about.startswith(("while parsing a flow", "while scanning a quoted")):
        mark = getattr(error, "context_mark", None) or mark  # what is not closed: where it opens
    line = mark.line + 1 if mark is not None else None
    remedy = "check indentation, colons, brackets and quotes there"
    return InputProblem(file, line, None, f"no YAML ({reason})", "YAML", remedy)
