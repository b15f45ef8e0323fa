"""Hold a YAML document against a pydantic model; faults come back as problems.

A text file as a string, or the reason why it is none.

Rows of a CSV file as text, each with the line where an editor shows it.

A CSV file as a typed table, every bad cell located.

A YAML file as plain data, with the line of every key and every repeated key reported.
"""

import csv
import io
import re
from collections.abc import Iterator
from dataclasses import dataclass
from math import isfinite, nan
from pathlib import Path
from typing import Any, TypeVar, get_args

import pandas as pd
import yaml
from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from spinepipe.cohort.columns import Column, TableForm
from spinepipe.problems import Problem, did_you_mean, one_of


def read_text(path: Path, file: str) -> tuple[str, list[Problem]]:
    """Text of a UTF-8 file; a byte-order mark is allowed.

    Parameters
    ----------
    path : the file, which exists.
    file : its name in messages.

    Returns
    -------
    The text (empty when there is a problem) and the problems.
    """
    data = path.read_bytes()
    if not data.strip():
        return "", [Problem(file, None, None, "an empty file", "a file with content", "fill it")]
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        return "", [_not_utf8(file, data[: error.start].count(b"\n") + 1)]
    if "\0" in text:
        return "", [_not_utf8(file, text[: text.index("\0")].count("\n") + 1)]
    return text, []


def _not_utf8(file: str, line: int) -> Problem:
    found = "bytes that are not UTF-8 text"
    return Problem(file, line, None, found, "UTF-8", "save the file again with encoding UTF-8")


@dataclass(frozen=True)
class Rows:
    """Cells of one CSV file, not yet understood.

    Attributes
    ----------
    file : name in messages.
    header : column names.
    lines : line of each row.
    cells : rows of cells, blanks around a cell removed, as many as the header has names.
    ragged : lines whose rows had too many or too few cells (reported; cut or filled up here).
    """

    file: str
    header: list[str]
    lines: list[int]
    cells: list[list[str]]
    ragged: frozenset[int]


def read_rows(path: Path, file: str) -> tuple[Rows | None, list[Problem]]:
    """Rows of a comma-separated UTF-8 file, None when it is no such table.

    Wholly blank lines are skipped: they carry nothing.
    """
    text, problems = read_text(path, file)
    if problems:
        return None, problems
    try:
        records = _records(text)
    except csv.Error as error:
        return None, [_not_csv(file, str(error))]
    header = records[0][1]
    problems = _header_problems(file, header)
    if problems:
        return None, problems
    rows, problems = _squared(file, header, records[1:])
    if not rows.lines:
        problems.append(
            Problem(file, 1, None, "a header and no rows", "at least one row", "fill or delete it")
        )
    return rows, problems


def _records(text: str) -> list[tuple[int, list[str]]]:
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    records: list[tuple[int, list[str]]] = []
    line = 1
    for cells in reader:
        if cells:
            records.append((line, [cell.strip() for cell in cells]))
        line = reader.line_num + 1  # a quoted cell may span lines
    return records


def _not_csv(file: str, reason: str) -> Problem:
    allowed = "comma-separated cells, double quotes only in pairs around a cell"
    return Problem(file, None, None, f"no CSV ({reason})", allowed, "look for a stray quote mark")


def _header_problems(file: str, header: list[str]) -> list[Problem]:
    separators = [mark for mark in (";", "\t") if len(header) == 1 and mark in header[0]]
    if separators:
        found = f"cells separated by {'semicolons' if separators[0] == ';' else 'tabs'}"
        remedy = "save the file as CSV with commas, and decimal points in numbers"
        return [Problem(file, 1, None, found, "cells separated by commas", remedy)]
    repeated = sorted({name for name in header if header.count(name) > 1 and name})
    problems = [
        Problem(file, 1, name, "the same column name twice", "each name once", "delete one")
        for name in repeated
    ]
    if "" in header:
        allowed = "a name over every column"
        remedy = "name the column or delete it"
        problems.append(Problem(file, 1, None, "a column without a name", allowed, remedy))
    return problems


def _squared(
    file: str, header: list[str], records: list[tuple[int, list[str]]]
) -> tuple[Rows, list[Problem]]:
    width = len(header)
    problems, ragged, cells = [], set(), []
    for line, row in records:
        if len(row) != width:
            problems.append(_ragged(file, line, len(row), width))
            ragged.add(line)
        cells.append((row + [""] * width)[:width])
    return Rows(file, header, [line for line, _ in records], cells, frozenset(ragged)), problems


def _ragged(file: str, line: int, found: int, width: int) -> Problem:
    cause = "a decimal comma splits a number into two cells" if found > width else "fill the row up"
    remedy = f"count the commas ({cause})"
    return Problem(file, line, None, f"{found} cells", f"{width} cells, as in the header", remedy)


NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")


def read_table(path: Path, form: TableForm, file: str) -> tuple[pd.DataFrame | None, list[Problem]]:
    """Read and convert one CSV file.

    Parameters
    ----------
    path : the file, which exists.
    form : its declared columns.
    file : its name in messages.

    Returns
    -------
    The table, indexed by line number, with all declared columns (numbers as float64, NaN where
    empty or bad; text as str, NaN where an optional cell is empty) and then the carried ones;
    None when the file is no table or lacks a required column. And the problems.
    """
    rows, problems = read_rows(path, file)
    if rows is None:
        return None, problems
    problems += _column_problems(rows, form)
    lacking = any(column.required and column.name not in rows.header for column in form.columns)
    if lacking or not rows.cells:
        return None, problems
    texts = dict(zip(rows.header, map(list, zip(*rows.cells, strict=True)), strict=True))
    data: dict[str, pd.Series] = {}
    for column in form.columns:
        cells = texts.pop(column.name, [""] * len(rows.lines))
        data[column.name] = _converted(cells, column, rows, problems)
    if form.carries:
        data |= {name: _text_series(cells, rows.lines) for name, cells in texts.items()}
    return pd.DataFrame(data), problems


def _column_problems(rows: Rows, form: TableForm) -> Iterator[Problem]:
    for name in rows.header:
        if name not in form.names and not form.carries:
            remedy = did_you_mean(name, form.names, "delete the column or correct its name")
            yield Problem(rows.file, 1, name, "an unknown column", one_of(form.names), remedy)
    for column in form.columns:
        if column.required and column.name not in rows.header:
            yield Problem(
                rows.file, 1, column.name, "no such column", column.meaning, "add the column"
            )


def _converted(
    cells: list[str], column: Column, rows: Rows, problems: list[Problem]
) -> "pd.Series":
    if column.required:
        problems += [
            Problem(rows.file, line, column.name, "an empty cell", column.meaning, "fill it")
            for line, cell in zip(rows.lines, cells, strict=True)
            if not cell and line not in rows.ragged
        ]
    if column.kind == "text":
        return _text_series(cells, rows.lines)
    numbers = [float(cell) if NUMBER.fullmatch(cell) else nan for cell in cells]
    for index, (number, cell) in enumerate(zip(numbers, cells, strict=True)):
        if cell and (fault := _number_fault(cell, number, column)):
            allowed, remedy = fault
            place = (rows.file, rows.lines[index], column.name)
            problems.append(Problem(*place, f"'{cell}'", allowed, remedy))
            numbers[index] = nan
    return pd.Series(numbers, index=rows.lines, dtype="float64")


def _text_series(cells: list[str], lines: list[int]) -> "pd.Series":
    return pd.Series([cell or None for cell in cells], index=lines, dtype="str")


def _number_fault(cell: str, number: float, column: Column) -> tuple[str, str] | None:
    """What is allowed and what to do, when a number is wrong."""
    if not isfinite(number):
        remedy = "correct it" if column.required else "leave the cell empty if not measured"
        remedy = "write a decimal point" if "," in cell else remedy
        return "a finite number with a decimal point", remedy
    if column.kind == "integer" and number != int(number):
        return "a whole number", "correct it"
    low_bad = number <= column.low if column.open_low else number < column.low
    high_bad = number >= column.high if column.open_high else number > column.high
    if low_bad or high_bad:
        return f"{column.meaning}: {column.range_text}", "correct it; check its unit and its sign"
    return None


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


Model = TypeVar("Model", bound=BaseModel)


def validate(model: type[Model], document: Document) -> tuple[Model | None, list[Problem]]:
    """The document as an instance of the model, None when it does not fit; and the problems."""
    try:
        return model.model_validate(document.data), []
    except ValidationError as error:
        details = error.errors(include_url=False)
        return None, [_problem(model, document, detail) for detail in _distinct(details)]


def _distinct(details: list[ErrorDetails]) -> Iterator[ErrorDetails]:
    """One error per place: pydantic reports one for each member of a union."""
    seen = set()
    for detail in details:
        if detail["loc"] not in seen:
            seen.add(detail["loc"])
            yield detail


def _problem(model: type[BaseModel], document: Document, detail: ErrorDetails) -> Problem:
    owner, field, loc = _field_at(model, detail["loc"])
    key = ".".join(map(str, loc))
    place = (document.file, document.line_of(key), key or None)
    if detail["type"].startswith("union_tag"):
        return _no_such_form(document, key, detail)
    if detail["type"] == "extra_forbidden":
        names = list(owner.model_fields)
        remedy = did_you_mean(str(loc[-1]), names, "delete it or correct its name")
        return Problem(*place, "an unknown key", one_of(names), remedy)
    meaning = field.description if field is not None and field.description else ""
    if detail["type"] == "missing":
        return Problem(*place, "nothing: the key is missing", meaning, f"add `{loc[-1]}:`")
    allowed = _allowed(detail)
    expected = detail.get("ctx", {}).get("expected", "")
    remedy = f"correct it ({meaning})" if meaning else "correct it"
    if detail["type"] == "literal_error":
        remedy = did_you_mean(str(detail["input"]), _quoted(expected), remedy)
    return Problem(*place, _shown(detail["input"]), allowed, remedy)


def _no_such_form(document: Document, key: str, detail: ErrorDetails) -> Problem:
    """An item that does not say which of several forms it has, or one that there is not."""
    context = detail.get("ctx", {})
    (name,) = _quoted(context["discriminator"])
    key = f"{key}.{name}"
    place = (document.file, document.line_of(key), key)
    if detail["type"] == "union_tag_not_found":
        found, allowed = "nothing: the key is missing", "a form, which decides on the other keys"
        return Problem(*place, found, allowed, f"add `{name}:`")
    tags = _quoted(context["expected_tags"])
    remedy = did_you_mean(context["tag"], tags, "it decides which other keys are allowed")
    return Problem(*place, repr(context["tag"]), one_of(tags), remedy)


def _field_at(
    model: type[BaseModel], loc: tuple[int | str, ...]
) -> tuple[type[BaseModel], FieldInfo | None, tuple[int | str, ...]]:
    """The innermost model on the way to a place, the field of it that was last named, the place.

    Where an item may have several forms, pydantic's place names the form, which is no key.
    """
    owner, field = model, None
    keys: list[int | str] = []
    for name in loc:
        forms = _forms(field)
        if name in forms:
            owner, field = forms[str(name)], None
            continue
        keys.append(name)
        inner = _inner_model(field)
        if inner is not None:
            owner, field = inner, None
        if isinstance(name, str) and name in owner.model_fields:
            field = owner.model_fields[name]
    return owner, field, tuple(keys)


def _forms(field: FieldInfo | None) -> dict[str, type[BaseModel]]:
    """Models of a list of items with one of several forms, by what says which; else none."""
    for item in get_args(field.annotation) if field is not None else ():
        for told in getattr(item, "__metadata__", ()):
            tag = getattr(told, "discriminator", None)
            if isinstance(tag, str):
                models = get_args(item.__origin__)
                return {
                    n: one for one in models for n in get_args(one.model_fields[tag].annotation)
                }
    return {}


def _inner_model(field: FieldInfo | None) -> type[BaseModel] | None:
    if field is None:
        return None
    candidates: list[Any] = [field.annotation, *get_args(field.annotation)]
    for candidate in candidates:
        if isinstance(candidate, type) and issubclass(candidate, BaseModel):
            return candidate
    return None


def _allowed(detail: ErrorDetails) -> str:
    message = detail["msg"]
    for start in ("Input should be ", "Value error, ", "Input should "):
        message = message.removeprefix(start)
    return message


def _quoted(expected: str) -> list[str]:
    return expected.split("'")[1::2]


def _shown(value: object) -> str:
    return "nothing" if value is None else repr(value)
