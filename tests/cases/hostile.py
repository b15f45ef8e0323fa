"""Names and texts as somebody would write them who wants a page to do what it should not."""

import copy
import dataclasses
import json
import re
from collections.abc import Callable, Iterator, Mapping
from html.parser import HTMLParser
from itertools import pairwise
from pathlib import Path
from typing import Any, TypeVar

import pandas as pd
from made_results import Made
from pydantic import BaseModel

from spinepipe.tables import StudyTables
from spinepipe.units import COORDINATES

PAYLOAD = (
    "</script></style></title></textarea>\"'><script>alert(1)</script><img src=x onerror=alert(2)>"
    '<a href="javascript:alert(3)" onclick=alert(4)>&lt;b&gt;</a><!-- {{ 7*7 }} ]]> \\u003c/script>'
)
"""What ends elements, attributes and comments, and what would then run."""

HARMLESS = re.sub("[^A-Za-z0-9]", "x", PAYLOAD)
"""As long, and nothing but letters."""

FREE = (
    *("specimen", "person", "test", "task", "trial", "muscle", "group", "message", "remark"),
    *("film", "why", "where", "what", "evidence", "test_that_would_tell"),
)
"""Columns whose texts people write, or that say what people wrote."""

Thing = TypeVar("Thing")


def mapped(thing: Thing, change: Callable[[str], str]) -> Thing:
    """A copy in which every text is changed, keys and cells of tables too."""
    found: Any = thing
    if isinstance(found, str):
        return change(found)  # type: ignore[return-value]
    if isinstance(found, pd.DataFrame):
        return found.map(lambda cell: mapped(cell, change))
    if isinstance(found, Mapping):
        return {mapped(k, change): mapped(v, change) for k, v in found.items()}  # type: ignore[return-value]
    if isinstance(found, list | tuple):
        return type(found)(mapped(one, change) for one in found)
    if isinstance(found, BaseModel):
        fields = {name: mapped(getattr(found, name), change) for name in type(found).model_fields}
        return found.model_copy(update=fields)
    if dataclasses.is_dataclass(found):
        other = copy.copy(found)
        for name, value in vars(found).items():
            object.__setattr__(other, name, mapped(value, change))
        return other
    return thing


def renamed(made: Made, payload: str, folder: Path) -> Made:
    """Results whose every name and free text ends with the payload."""
    names = _renamed_names(made, payload)

    def change(text: str) -> str:
        return names.get(text, text)

    rows = {name: mapped(made.tables[name], change) for name in made.tables}
    files = {name: _renamed_file(path, change, folder) for name, path in made.tables.files.items()}
    tables = StudyTables(rows, files)
    study, cohort = mapped(made.study, change), mapped(made.cohort, change)
    return Made(study, cohort, tables, made.own_vertebrae)


def _renamed_file(path: str, change: Callable[[str], str], folder: Path) -> str:
    """A JSON file with its texts changed."""
    other = folder / Path(path).name
    other.write_text(json.dumps(mapped(json.loads(Path(path).read_text()), change)))
    return str(other)


def _renamed_names(made: Made, payload: str) -> dict[str, str]:
    """Names and texts that people may have written, and what they become; joints by vertebrae."""
    cohort = made.cohort
    found = {cohort.title, cohort.source, *cohort.specimen_names, *cohort.tests}
    for table in made.tables.values():
        for column in set(FREE) & set(table.columns):
            found |= {cell for cell in table[column] if isinstance(cell, str)}
    for path in made.tables.files.values():
        found |= set(_free_texts(json.loads(Path(path).read_text())))
    joints = dict(zip(cohort.joint_names, pairwise(cohort.vertebrae), strict=True))
    own = {name: name + payload for name in found - {"", "*", "all", *COORDINATES} - set(joints)}
    if not made.own_vertebrae:
        return {name: own[name] for name in own if name not in cohort.vertebrae}
    own |= {name: name + payload for name in cohort.vertebrae}
    return own | {joint: own[upper] + own[lower] for joint, (lower, upper) in joints.items()}


def _free_texts(data: Any) -> Iterator[str]:
    """Texts of a JSON file under keys that tell something in words."""
    for key, value in data.items() if isinstance(data, dict) else ():
        if key in FREE and isinstance(value, str):
            yield value
        yield from _free_texts(value)
    for one in data if isinstance(data, list) else ():
        yield from _free_texts(one)


class Structure(HTMLParser):
    """Elements of a page and names of their attributes, in order; and what could run in it."""

    def __init__(self, page: str) -> None:
        """Read a whole page."""
        super().__init__()
        self.elements: list[str] = []
        self.scripts: list[str] = []
        self.addresses: list[str] = []
        self._inside = ""
        self.feed(page)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note an element."""
        self.elements.append(" ".join([tag, *(name for name, _ in attrs)]))
        self.addresses += [told or "" for name, told in attrs if name in ("src", "href")]
        self._inside = tag

    def handle_endtag(self, tag: str) -> None:
        """Note where elements end."""
        self.elements.append(f"/{tag}")
        self._inside = ""

    def handle_comment(self, data: str) -> None:
        """Note a comment."""
        self.elements.append("comment")

    def handle_data(self, data: str) -> None:
        """Note what scripts are."""
        if self._inside == "script":
            self.scripts.append(data)
