"""Values and keys of YAML files spoilt: cohort.yaml, config.yaml, studies of every kind, models."""

import copy
import json
import random
import re
from collections.abc import Iterator
from typing import Any

import yaml

from tests.generators.spoilt.case import Case, Expected
from tests.generators.spoilt.documented import Entry, keys
from tests.generators.spoilt.projects import MODEL, Project, as_yaml
from tests.generators.spoilt.words import bad_names

REFUSED, TOLD, FINE, OPEN = Expected.REFUSED, Expected.TOLD, Expected.FINE, Expected.OPEN

HERE = "PLACE_OF_THE_VALUE"

NOT_NUMBERS = {
    "nan": ".nan",
    "inf": ".inf",
    "1e999": "1e999",
    "hex": "0x1F",
    "octal": "017",
    "time": "1:30",
    "underscore": "1_000",
    "binary": "0b11",
    "decimal comma": "12,5",
    "thousands": "'1,234.5'",
    "words": "five",
    "in quotes": "'5'",
    "unit": "5 mm",
    "true": "true",
    "yes": "yes",
    "date": "2024-01-01",
    "190 digits": "9" * 190,
    "1e300": "1e300",
}
"""None of these is a plain number in range, of any key."""

ANYWHERE = {
    "alias": "*a",
    "anchor": "&a 1",
    "Python object": "!!python/object/apply:os.system ['id']",
    "Python name": "!!python/name:os.system",
    "own tag": "!include other.yaml",
    "binary tag": "!!binary aGVsbG8=",
    "merge": "{<<: {a: 1}}",
    "100 000 digits": "1" * 100_000,
    "100 000 brackets": "[" * 100_000,
    "30 brackets": "[" * 30 + "]" * 30,
    "30 braces": "{a: " * 30 + "1" + "}" * 30,
    "100 000 items": "[" + "1," * 100_000 + "1]",
    "bell": '"a\\ab"',
    "bare bell": "a\x07",
    "NUL": '"a\\0b"',
    "escape": '"\\e[31m"',
    "turned": '"\\u202eabc"',
    "lone surrogate": '"\\ud800"',
    "quote not closed": '"abc',
    "bracket not closed": "[1, 2",
    "colon": "a: b: c",
    "list of lists": "[[1], [2]]",
    "bytes": "\x80",
}
"""Wrong in the place of every value."""


def yaml_files(project: Project) -> Iterator[tuple[str, str]]:
    """Path and documented name of every YAML file of a project."""
    if project.mapping:
        yield project.mapping, "import"
        return
    yield project.study, project.kind
    yield f"{project.folder}/cohort.yaml", "cohort.yaml"
    yield "config/config.yaml", "config.yaml"
    if MODEL in project.files:
        yield MODEL, "model"


def key_cases(project: Project, file: str, form: str, rng: random.Random) -> Iterator[Case]:
    """All cases of the keys of one file."""
    data = yaml.safe_load(project.files[file])
    spoils = list(ANYWHERE)
    rng.shuffle(spoils)
    entries = [entry for entry in keys(form) if _path(data, entry.name) is not None]
    for number, entry in enumerate(entries):
        path = _path(data, entry.name)
        assert path is not None
        make = _Maker(project, file, data, path, entry)
        yield from make.typed()
        for what in sorted({*spoils[number :: len(entries)], "Python object", "100 000 digits"}):
            yield make.case(what, ANYWHERE[what], REFUSED)
        yield from make.keys(required=entry.required)


Path = tuple[str | int, ...]


def _path(data: Any, name: str) -> Path | None:
    """Where a documented key is or would be; None where the file has no such list or form."""
    path: list[str | int] = []
    here: Any = data
    for part in name.split("."):
        key, form = re.fullmatch(r"([^\[]*)(?:\[(.*)\])?", part).groups()  # type: ignore[union-attr]
        path.append(key)
        here = here.get(key) if isinstance(here, dict) else None
        if form is not None:
            fits = [
                n
                for n, item in enumerate(here if isinstance(here, list) else ())
                if not form or form in item.values()
            ]
            if not fits:
                return None
            path.append(fits[0])
            here = here[fits[0]]
    return tuple(path)


MANY_NAMES = f"[{', '.join(f'q{k}' for k in range(10_000))}]"


UNREAD = ("effects[].values[].specimen",)
"""Of bushings in a model file that the study replaces by its own: nobody asks what they say."""


OF_RECORDINGS = ("column", "driving")
"""Keys that name a column: one that is not there is told at the recordings that lack it."""


class _Maker:
    """Cases of one key."""

    def __init__(self, project: Project, file: str, data: Any, path: Path, entry: Entry) -> None:
        self.project, self.file, self.data, self.path, self.entry = project, file, data, path, entry
        self.old = _get(data, path)

    def case(self, what: str, raw: str, expected: Expected) -> Case:
        """The value written as ``raw``, whatever YAML makes of it."""

        def changes() -> dict[str, bytes]:
            return {self.file: self._text(raw)}

        name = self.entry.name
        told_in = ("*",) if name.rpartition(".")[2] in OF_RECORDINGS else ()
        return Case(self.project, "value", what, self.file, name, expected, changes, told_in)

    def _text(self, raw: str) -> bytes:
        text = as_yaml(_put(self.data, self.path, HERE)).decode()
        assert text.count(HERE) == 1, (self.entry, text)
        data = raw.replace("\x80", "\ue000").encode()
        return text.encode().replace(HERE.encode(), data).replace("\ue000".encode(), b"\x80")

    def typed(self) -> Iterator[Case]:
        """What is of another type than documented."""
        words, entry = self.entry.words, self.entry
        yield self.case("null", "null", _null(entry))
        yield self.case("nothing", "", _null(entry))
        if not entry.is_list and "list" not in words:
            yield self.case("a list", "[1, 2]", REFUSED)
            yield self.case("an empty list", "[]", REFUSED)
        if words != "mapping":
            yield self.case("keys", "{a: 1, b: 2}", REFUSED)
        else:
            yield self.case("unknown keys", "{q7: 1}", REFUSED if self._closed() else OPEN)
            yield self.case("a text", "abc", REFUSED)
            yield self.case("a number", "5", REFUSED)
        if entry.is_number:
            yield from self._numbers()
        elif words.startswith("true or false"):
            for what, raw in (
                ("words", "maybe"),
                ("number", "1"),
                ("text", "'true'"),
                ("0.0", "0.0"),
            ):
                yield self.case(what, raw, REFUSED)
            yield self.case("yes", "yes", OPEN)
        elif words.startswith("text"):
            yield from self._texts()
        elif entry.is_list:
            yield from self._lists()

    def _closed(self) -> bool:
        """Whether the keys of a mapping are documented, so that others are wrong."""
        return self.entry.name not in ("level_stiffness", "effects[].options", "uncertain.factors")

    def _numbers(self) -> Iterator[Case]:
        entry = self.entry
        for what, raw in NOT_NUMBERS.items():
            is_large = what in ("1e300", "190 digits") and entry.high is None
            yield self.case(what, raw, OPEN if is_large else REFUSED)
        if entry.low is not None:
            yield self.case("too small", f"{entry.low - 1.0:.17g}", REFUSED)
            if entry.open_low:
                yield self.case("at its low end", f"{entry.low:.17g}", REFUSED)
        if entry.high is not None:
            yield self.case("too large", f"{entry.high + 1.0:.17g}", REFUSED)
            if entry.open_high:
                yield self.case("at its high end", f"{entry.high:.17g}", REFUSED)
        if entry.words.startswith("integer"):
            yield self.case("half a step", f"{(entry.low or 1.0) + 0.5}", REFUSED)
        if isinstance(self.old, int | float) and not isinstance(self.old, bool):
            yield self.case("with its sign", f"{self.old:+}", FINE)
            if isinstance(self.old, float) or entry.words.startswith("number"):
                yield self.case("with an exponent", f"{self.old / 10!r}e1", FINE)

    def _texts(self) -> Iterator[Case]:
        is_prose = self.entry.name in ("title", "source")
        for what, raw in (
            ("number", "5"),
            ("true", "true"),
            ("date", "2024-01-01"),
            ("inf", ".inf"),
        ):
            lawful = what == "number" and "integer" in self.entry.words  # the number of a column
            yield self.case(what, raw, OPEN if lawful else REFUSED)
        if is_prose:
            return
        for what in ("unknown", "path", "dollars", "tag", "100 000 characters", "look-alike"):
            raw = json.dumps(bad_names(str(self.old or "x1"))[what], ensure_ascii=False)
            yield self.case(what, raw, self._of_name(what))
        yield self.case("empty", "''", REFUSED)
        if isinstance(self.old, str) and not self.entry.choices:
            yield self.case("blanks around", f"'  {self.old} '", OPEN)

    def _of_name(self, what: str) -> Expected:
        """A name that nothing else must know may be any sound one."""
        own = ("name", "group", "model", "source")
        is_own = self.entry.name.rpartition(".")[2] in own and what == "unknown"
        return OPEN if is_own or self.entry.name in UNREAD else REFUSED

    def _lists(self) -> Iterator[Case]:
        item = self.entry.words.removeprefix("list of ").removesuffix(" or null")
        yield self.case("a number", "5", REFUSED)
        yield self.case("items without a value", "[null]", REFUSED)
        yield self.case("items of keys", "[{q7: 1}]", REFUSED)
        if item.startswith("text"):
            yield self.case("numbers", "[1, 2]", REFUSED)
            yield self.case("unknown", "[q7x]", REFUSED)
            yield self.case("dollars", "['a $\\frac$']", REFUSED)
            yield self.case("500 unknown", f"[{', '.join(f'q{k}' for k in range(500))}]", REFUSED)
            yield self.case("10 000 unknown", MANY_NAMES, REFUSED)
        if item == "number":
            yield self.case("words", "[five]", REFUSED)
            yield self.case("nan", "[.nan]", REFUSED)
            yield self.case("true", "[true]", REFUSED)
            yield self.case("500 numbers", f"[{', '.join(str(k) for k in range(500))}]", OPEN)
        if isinstance(self.old, list) and self.old:
            twice = yaml.safe_dump([*self.old, self.old[-1]], default_flow_style=True, width=10**9)
            expected = OPEN if item == "mappings" else REFUSED
            yield self.case("an item twice", twice.strip(), expected)

    def keys(self, *, required: bool) -> Iterator[Case]:
        """The key itself left out, written twice, misspelt, in capitals."""
        if self.old is None:
            return
        key = str(self.path[-1])

        def case(what: str, new: dict[str, Any] | None, expected: Expected, place: str) -> Case:
            def changes() -> dict[str, bytes]:
                return {self.file: as_yaml(self._renamed(key, new))}

            return Case(self.project, "key", what, self.file, place, expected, changes)

        name = self.entry.name
        yield case("left out", None, REFUSED if required else OPEN, name)
        swapped = key[:-2] + key[-1] + key[-2] if key[-1] != key[-2] else key + "x"
        for what, new in (
            ("misspelt", swapped),
            ("in capitals", key.upper()),
            ("look-alike", key.replace("e", "е").replace("o", "о").replace("a", "а")),
        ):
            open_key = self.entry.name.startswith("effects[].options.")
            if new != key:
                place = f"{name.rpartition('.')[0]}.{new}".strip(".")
                yield case(what, {new: self.old}, OPEN if open_key else REFUSED, place)
        yield self._twice(key)

    def _renamed(self, key: str, new: dict[str, Any] | None) -> Any:
        """The data with other keys in the place of one."""
        inner = _get(self.data, self.path[:-1])
        outer: dict[str, Any] = {}
        for name, value in inner.items():
            outer |= (new or {}) if name == key else {name: value}
        return _put(self.data, self.path[:-1], outer) if len(self.path) > 1 else outer

    def _twice(self, key: str) -> Case:
        def changes() -> dict[str, bytes]:
            lines = as_yaml(_put(self.data, self.path, HERE)).decode().splitlines()
            at = next(n for n, line in enumerate(lines) if HERE in line)
            start = lines[at].partition(f"{key}:")[0].replace("-", " ")
            value = yaml.safe_dump(self.old, default_flow_style=True, width=10**9).strip()
            value = value.removesuffix("...").strip()
            lines[at] = lines[at].replace(HERE, value)
            lines.insert(at + 1, f"{start}{key}: {value}")
            return {self.file: ("\n".join(lines) + "\n").encode()}

        return Case(self.project, "key", "twice", self.file, self.entry.name, REFUSED, changes)


def _null(entry: Entry) -> Expected:
    """Nothing may stand where the documentation says so."""
    return OPEN if entry.nullable else REFUSED


def _get(data: Any, path: Path) -> Any:
    for part in path:
        if isinstance(data, list):
            data = data[int(part)]
        elif isinstance(data, dict):
            data = data.get(part)
        else:
            return None
    return data


def _put(data: Any, path: Path, value: Any) -> Any:
    """A copy of the data with a value at a path, keys on the way made where there are none."""
    new = copy.deepcopy(data)
    here = new
    for part in path[:-1]:
        if isinstance(here, dict) and not isinstance(here.get(part), dict | list):
            here[part] = {}
        here = here[part]
    here[path[-1]] = value
    return new
