"""Patterns of file names in the YAML, `glob:`, as the files that they match."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from glob import glob
from pathlib import Path, PurePath
from typing import Any

from spinepipe.documents.yaml_text import YamlDocument
from spinepipe.problems import InputProblem, one_of

Fault = tuple[str, str, str]
"""What was found, what is allowed, and what to do."""


def with_files(
    folder: Path, document: YamlDocument, fields: Sequence[str]
) -> tuple[YamlDocument, tuple[int, ...], list[InputProblem]]:
    """The document with an item of `files` for each file that a pattern matches.

    Also the number of the item in the YAML for each of them, and problems: a pattern without a
    match, one that can be read in two ways, a file that two items name.

    Parameters
    ----------
    fields : what names may tell, in braces.
    """
    entries = document.data.get("files")
    if not isinstance(entries, list):
        return document, (), []
    items: list[Any] = []
    numbers: list[int] = []
    problems: list[InputProblem] = []
    first: dict[str, int] = {}
    lines = {key: at for key, at in document.lines.items() if not key.startswith("files.")}
    for number, entry in enumerate(entries):
        key = f"files.{number}"
        own = [one for one in document.lines if one == key or one.startswith(f"{key}.")]
        made: list[Any] = [entry]
        faults: list[Fault] = []
        if isinstance(entry, dict) and isinstance(entry.get("glob"), str):
            found = list(_matches(folder, entry["glob"], entry, fields))
            made = [{**entry, **one} for one in found if isinstance(one, dict)]
            faults = [one for one in found if isinstance(one, tuple)]
        for item in made:
            file = item.get("file") if isinstance(item, dict) else None
            other = first.setdefault(file, number) if isinstance(file, str) else number
            if other != number and any("glob" in entries[one] for one in (other, number)):
                twice = f"{file}, which files.{other} names too"
                faults.append((twice, "each file once", "narrow a pattern, or delete one of them"))
            lines |= {f"files.{len(items)}{o[len(key) :]}": document.lines[o] for o in own}
            items.append(item)
            numbers.append(number)
        place = (document.file, document.line_of(f"{key}.glob"), key)
        problems += [InputProblem(*place, *fault) for fault in faults]
    data = {**document.data, "files": items}
    return replace(document, data=data, lines=lines), tuple(numbers), problems


def _matches(
    folder: Path, pattern: str, told: dict[str, Any], known: Sequence[str]
) -> Iterator[dict[str, str] | Fault]:
    """`file` and what its name says, for each match in natural order.

    ``told`` : what stands beside the pattern.
    """
    fields = re.findall(r"\{(\w*)\}", pattern)
    for name in dict.fromkeys(fields):
        if name not in known:
            yield f"'{{{name}}}'", one_of(f"{{{one}}}" for one in known), "correct the pattern"
    for name in ("file", *fields):
        if name in told:
            yield f"`{name}` beside a pattern that tells it", "one of them", "delete one of them"
    star = re.sub(r"\{\w*\}", "*", pattern.replace("[", "[[]"))
    there = [PurePath(one).as_posix() for one in glob(star, root_dir=folder, recursive=True)]
    # each part as short, and as long as it can be: a name that gives both the same has one reading
    ways = [_expression(pattern, lazy) for lazy in ("?", "")]
    names = [one for one in there if (folder / one).is_file() and ways[0].fullmatch(one)]
    for name in sorted(names, key=natural):
        read, other = (found.groupdict() for way in ways if (found := way.fullmatch(name)))
        if read != other:
            words = " or ".join(
                ", ".join(f"{k} '{v}'" for k, v in one.items()) for one in (read, other)
            )
            last = known[-1]
            remedy = f"write the {last} into the pattern instead, `{last}:` beside it; one for each"
            yield f"{name}: {words}", "names that are read in one way", remedy
        yield {"file": name, **read}
    if not names:
        yield "no file of this pattern", f"files in {folder.name or '.'}", "correct the pattern"


def natural(name: str) -> list[tuple[int, str]]:
    """A key by which file2 comes before file10."""
    parts = re.findall(r"\d+|\D+", name)
    return [(int(one), "") if one.isdecimal() else (-1, one) for one in parts]


def _expression(pattern: str, lazy: str) -> re.Pattern[str]:
    known = {"*": f"[^/]*{lazy}", "?": "[^/]", "**/": f"(?:.*{lazy}/)?{lazy}"}
    text, met = "", set()
    for part in re.split(r"(\{\w+\}|\*\*/|\*|\?)", pattern):
        if re.fullmatch(r"\{\w+\}", part):
            name = part[1:-1]
            text += f"(?P={name})" if name in met else f"(?P<{name}>[^/]+{lazy})"
            met.add(name)
        else:
            text += known.get(part, re.escape(part))
    return re.compile(text)
