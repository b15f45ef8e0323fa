"""A document as settings: what a pydantic model finds wrong with it, told at its line and key."""

import re
from collections.abc import Iterator
from datetime import date
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, Tag, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from spinepipe.documents.yaml_text import YamlDocument
from spinepipe.problems import InputProblem, did_you_mean, one_of

MOST_TOLD = 100
"""Faults of one file that are told one by one."""

_UNION = re.compile(r"constrained-\w+|function-.+\]|tuple\[.+\]|list\[.+\]")
"""Pydantic's names of forms that a value may have, which are no keys."""

Model = TypeVar("Model", bound=BaseModel)


def validate(model: type[Model], document: YamlDocument) -> tuple[Model | None, list[InputProblem]]:
    """The document as an instance of the model, None when it does not fit; and the problems."""
    try:
        return model.model_validate(document.data), []
    except ValidationError as error:
        details = list(_distinct(error.errors(include_url=False)))
        problems = [_problem(model, document, detail) for detail in details[:MOST_TOLD]]
        if len(details) > MOST_TOLD:
            found = f"{len(details) - MOST_TOLD} faults more"
            problems.append(
                InputProblem(document.file, None, None, found, "none", "mend these first")
            )
        return None, problems


def _distinct(details: list[ErrorDetails]) -> Iterator[ErrorDetails]:
    """One error per place: pydantic reports one for each member of a union, named at its end.

    A list is not too short for an item that is wrong.
    """
    seen: set[tuple[int | str, ...]] = set()
    for detail in details:
        loc = detail["loc"]
        if _UNION.fullmatch(str(loc[-1] if loc else "")):
            loc = loc[:-1]
        within = any(other["loc"][: len(loc)] == loc != other["loc"] for other in details)
        if loc not in seen and not (detail["type"] == "too_short" and within):
            seen.add(loc)
            yield {**detail, "loc": loc}


def _problem(model: type[BaseModel], document: YamlDocument, detail: ErrorDetails) -> InputProblem:
    owner, field, loc = _field_at(model, detail["loc"])
    key = ".".join(map(str, loc))
    place = (document.file, document.line_of(key), key or None)
    if detail["type"].startswith("union_tag"):
        return _no_such_form(document, key, detail)
    if detail["type"] == "extra_forbidden":
        names = list(owner.model_fields)
        remedy = did_you_mean(str(loc[-1]), names, "delete it or correct its name")
        return InputProblem(*place, "an unknown key", one_of(names), remedy)
    meaning = field.description if field is not None and field.description else ""
    if detail["type"] == "missing":
        return InputProblem(*place, "nothing: the key is missing", meaning, f"add `{loc[-1]}:`")
    allowed = _allowed(detail)
    for kind, size in (("too_short", "min_length"), ("too_long", "max_length")):
        if detail["type"] == kind:
            end = "at least" if kind == "too_short" else "at most"
            allowed = f"{end} {detail['ctx'][size]} of them"
    expected = detail.get("ctx", {}).get("expected", "")
    remedy = f"correct it ({meaning})" if meaning else "correct it"
    if detail["type"] in ("tuple_type", "list_type"):
        allowed, remedy = "a list", f"begin each item with `- ` ({meaning})"
    if detail["type"] in ("model_type", "dict_type", "model_attributes_type"):
        allowed, remedy = "keys", f"write keys below it, each with its value ({meaning})"
    if detail["type"] == "string_pattern_mismatch":
        allowed = _signs(str(detail["ctx"]["pattern"]))
    if detail["type"] == "literal_error":
        remedy = did_you_mean(str(detail["input"]), _quoted(expected), remedy)
    if detail["type"] == "string_type" and isinstance(detail["input"], int | float | date):
        remedy = "put it in quotes, so that it is a text"  # 12 and 1e3 may be names
    return InputProblem(*place, _shown(detail["input"]), allowed, remedy)


def _no_such_form(document: YamlDocument, key: str, detail: ErrorDetails) -> InputProblem:
    """An item that does not say which of several forms it has, or one that there is not."""
    context = detail.get("ctx", {})
    (name,) = _quoted(context["discriminator"])
    key = f"{key}.{name}"
    place = document.place_of(key)
    if detail["type"] == "union_tag_not_found":
        found, allowed = "nothing: the key is missing", "a form, which decides on the other keys"
        return InputProblem(*place, found, allowed, f"add `{name}:`")
    tags = _quoted(context["expected_tags"])
    remedy = did_you_mean(context["tag"], tags, "it decides which other keys are allowed")
    return InputProblem(*place, repr(context["tag"]), one_of(tags), remedy)


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
        if field is not None:
            candidates: list[Any] = [field.annotation, *get_args(field.annotation)]
            inner = next(filter(None, map(_model, candidates)), None)
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


def _allowed(detail: ErrorDetails) -> str:
    message = detail["msg"]
    for start in ("Input should be ", "Value error, ", "Input should "):
        message = message.removeprefix(start)
    return message


def _signs(pattern: str) -> str:
    """What a name may be made of, in words."""
    found = re.fullmatch(r"\^(?:\[([\w-]+)\])?\[([\w-]+)\][+*]\$", pattern)
    if found is None:
        return f"a text of the form {pattern}"
    ranges = [", ".join(re.findall(r"\w-\w|\w", part or "")) for part in found.groups()]
    return f"a name of {ranges[1]}" + (f" that begins with one of {ranges[0]}" if found[1] else "")


def _quoted(expected: str) -> list[str]:
    return expected.split("'")[1::2]


def _shown(value: object) -> str:
    if isinstance(value, date):
        return str(value)
    return "nothing" if value is None else repr(value)
