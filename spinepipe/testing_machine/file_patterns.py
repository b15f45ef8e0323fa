"""Patterns of file names in the YAML, `glob:`, as the files that they match."""

import re
from collections.abc import Iterator
from dataclasses import replace
from difflib import get_close_matches
from glob import glob
from itertools import islice
from pathlib import Path, PurePath
from typing import Any

from spinepipe.documents.yaml_text import YamlDocument
from spinepipe.problems import InputProblem, one_of

FIELDS = ("specimen", "test")
MOST_LOOKED_AT = 5_000
"""Files among which the nearest names are sought."""

_PARTS = re.compile(r"(\{\w*\}|\*\*/|\*|\?)")


def with_files(
    folder: Path, document: YamlDocument
) -> tuple[YamlDocument, tuple[int, ...], list[InputProblem]]:
    """The document with an item of `files` for each file that a pattern matches.

    Also the number of the item in the YAML for each of them, and problems: a pattern without a
    match, one that can be read in two ways, a file that two items name.
    """
    items: list[Any] = []
    numbers: list[int] = []
    problems: list[InputProblem] = []
    of_file: dict[str, int] = {}
    entries = document.data.get("files")
    lines = {key: at for key, at in document.lines.items() if not key.startswith("files.")}
    if not isinstance(entries, list):
        return document, (), []
    for number, entry in enumerate(entries):
        key = f"files.{number}"
        found: list[dict[str, str] | tuple[str, str, str]] = [{}]
        if isinstance(entry, dict) and isinstance(pattern := entry.get("glob"), str):
            told = [name for name in ("file", *FIELDS) if name in entry]
            found = list(_matches(folder, pattern, told))
        own = [one for one in document.lines if one == key or one.startswith(f"{key}.")]
        for one in found:
            if isinstance(one, tuple):
                place = (document.file, document.line_of(f"{key}.glob"), f"{key}.glob")
                problems.append(InputProblem(*place, *one))
                continue
            if (file := one.get("file") or _file(entry)) in of_file and (
                one or "glob" in entries[of_file[file]]
            ):
                place = (document.file, document.line_of(key), key)
                what = f"{file}, which files.{of_file[file]} names too"
                remedy = "narrow a pattern, or delete one of them"
                problems.append(InputProblem(*place, what, "each file once", remedy))
            of_file.setdefault(file, number)
            lines |= {f"files.{len(items)}{o[len(key) :]}": document.lines[o] for o in own}
            items.append({**entry, **one} if one else entry)
            numbers.append(number)
    data = {**document.data, "files": items}
    return replace(document, data=data, lines=lines), tuple(numbers), problems


def _file(entry: object) -> str:
    return str(entry.get("file", "")) if isinstance(entry, dict) else ""


def _matches(
    folder: Path, pattern: str, told: list[str]
) -> Iterator[dict[str, str] | tuple[str, str, str]]:
    """`file` and what its name says, for each match in natural order; else found, allowed, remedy.

    ``told`` : keys that stand beside the pattern.
    """
    fields = re.findall(r"\{(\w*)\}", pattern)
    for name in dict.fromkeys(fields):
        if name not in FIELDS:
            yield f"'{{{name}}}'", one_of(f"{{{one}}}" for one in FIELDS), "correct the pattern"
    for name in told:
        if name in ("file", *fields):
            yield f"`{name}` beside a pattern that tells it", "one of them", "delete one of them"
    star = re.sub(r"\{\w*\}", "*", pattern.replace("[", "[[]"))
    there = [PurePath(one).as_posix() for one in glob(star, root_dir=folder, recursive=True)]
    # each part as short, and as long as it can be: a name that gives both the same has one reading
    shortest, longest = (_expression(pattern, lazy) for lazy in ("?", ""))
    names = [one for one in there if (folder / one).is_file() and shortest.fullmatch(one)]
    for name in sorted(names, key=natural):
        ways = [one.fullmatch(name) for one in (shortest, longest)]
        read, other = (way.groupdict() if way else {} for way in ways)
        if read != other:
            words = " or ".join(
                ", ".join(f"{k} '{v}'" for k, v in one.items()) for one in (read, other)
            )
            remedy = "write the test into the pattern instead, `test:` beside it; one for each test"
            yield f"{name}: {words}", "names that are read in one way", remedy
        yield {"file": name, **read}
    if not names:
        base = star.partition("*")[0].rpartition("/")[0]
        nearby = islice((folder / base).rglob("*"), MOST_LOOKED_AT)
        files = [one.relative_to(folder).as_posix() for one in nearby if one.is_file()]
        near = get_close_matches(star, files, 3, 0.0)
        allowed = f"the name of a file; nearest {one_of(near)}" if near else "the name of a file"
        what = (
            "correct the pattern" if near else f"no file is in '{base or folder.name}': look there"
        )
        yield "no file of this pattern", allowed, what


def natural(name: str) -> list[tuple[int, str]]:
    """A key by which file2 comes before file10."""
    parts = re.findall(r"\d+|\D+", name)
    return [(int(one), "") if one.isdecimal() else (-1, one) for one in parts]


def _expression(pattern: str, lazy: str) -> re.Pattern[str]:
    text, met = "", set()
    for part in _PARTS.split(pattern):
        if part.startswith("{") and part.endswith("}"):
            name = part[1:-1] or "_"
            text += f"(?P={name})" if name in met else f"(?P<{name}>[^/]+{lazy})"
            met.add(name)
        elif part == "**/":
            text += f"(?:.*/)?{lazy}"
        else:
            text += {"*": f"[^/]*{lazy}", "?": "[^/]"}.get(part, re.escape(part))
    return re.compile(text)
