"""A YAML file as plain data and as settings; whatever is wrong comes back located.

The line of every key is known, repeated keys are reported, and what a pydantic model finds is told
as problems of the file. Text files of any kind are read here too.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar, get_args

import yaml
from pydantic import BaseModel, Tag, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from spinepipe.problems import Problem, did_you_mean, one_of


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


class _Loader(yaml.SafeLoader):
    """YAML's safe loader which also takes 1e5 for a number, as everybody means it."""


_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float",
    re.compile(r"^[-+]?(\d+\.?\d*|\.\d+)[eE][-+]?\d+$"),
    list("-+.0123456789"),
)


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
        tagged = _tagged(field)
        if name in tagged:
            owner = tagged[str(name)] or owner
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


def _tagged(field: FieldInfo | None) -> dict[str, type[BaseModel] | None]:
    """Models, and None for words, of a value with one of several forms, by what says which."""
    return {
        told.tag: _model(item.__origin__)
        for item in (get_args(field.annotation) if field is not None else ())
        for told in getattr(item, "__metadata__", ())
        if isinstance(told, Tag)
    }


def _model(candidate: Any) -> type[BaseModel] | None:
    is_model = isinstance(candidate, type) and issubclass(candidate, BaseModel)
    return candidate if is_model else None


def _inner_model(field: FieldInfo | None) -> type[BaseModel] | None:
    if field is None:
        return None
    candidates: list[Any] = [field.annotation, *get_args(field.annotation)]
    return next((model for one in candidates if (model := _model(one)) is not None), None)


def _allowed(detail: ErrorDetails) -> str:
    message = detail["msg"]
    for start in ("Input should be ", "Value error, ", "Input should "):
        message = message.removeprefix(start)
    return message


def _quoted(expected: str) -> list[str]:
    return expected.split("'")[1::2]


def _shown(value: object) -> str:
    return "nothing" if value is None else repr(value)


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
