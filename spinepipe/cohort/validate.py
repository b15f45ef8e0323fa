"""Hold a YAML document against a pydantic model; faults come back as problems."""

from collections.abc import Iterator
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from spinepipe.cohort.read_yaml import Document
from spinepipe.problems import Problem, did_you_mean, one_of

__all__ = ["validate"]

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
    loc = detail["loc"]
    key = ".".join(map(str, loc))
    owner, field = _field_at(model, loc)
    place = (document.file, document.line_of(key), key or None)
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


def _field_at(
    model: type[BaseModel], loc: tuple[int | str, ...]
) -> tuple[type[BaseModel], FieldInfo | None]:
    """The innermost model on the way to a place, and the field of it that was last named."""
    owner, field = model, None
    for name in loc:
        inner = _inner_model(field)
        if inner is not None:
            owner, field = inner, None
        if isinstance(name, str) and name in owner.model_fields:
            field = owner.model_fields[name]
    return owner, field


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
