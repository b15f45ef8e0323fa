"""Tables of configuration keys, from the pydantic models that check them."""

from collections.abc import Iterator, Mapping
from typing import Any

from pydantic import BaseModel

from spinepipe.report.markdown import code, table

Schema = Mapping[str, Any]
_WORDS: dict[str, str] = {
    "string": "text",
    "number": "number",
    "integer": "integer",
    "boolean": "true or false",
    "object": "mapping",
    "null": "null",
}


def key_table(model: type[BaseModel]) -> str:
    """One line per key, nested ones dotted: key, type, default, range, meaning."""
    schema = model.model_json_schema()
    rows = list(_rows(schema, schema, ""))
    return table(("key", "type", "default", "allowed", "meaning"), rows)


def _rows(whole: Schema, part: Schema, prefix: str) -> Iterator[tuple[str, ...]]:
    """Rows of a mapping's keys; a nested mapping is told key by key."""
    required = part.get("required", ())
    for name, given in part.get("properties", {}).items():
        field = _resolved(whole, given)
        key = f"{prefix}{name}"
        inner = _resolved(whole, field.get("items", {}))
        if "properties" in field:
            yield (code(key), "mapping", _default(given, name in required), "the keys below",
                   field["told"])  # fmt: skip
            yield from _rows(whole, field, f"{key}.")
        elif "properties" in inner:
            yield (code(key), "list of mappings", _default(given, name in required),
                   "the keys below, for each", field["told"])  # fmt: skip
            yield from _rows(whole, inner, f"{key}[].")
        elif "discriminator" in inner:
            forms = inner["discriminator"]
            one_of = f"the keys of one form, by `{forms['propertyName']}`"
            yield (code(key), "list of mappings", _default(given, name in required), one_of,
                   field["told"])  # fmt: skip
            for form, reference in forms["mapping"].items():
                yield from _rows(whole, _resolved(whole, {"$ref": reference}), f"{key}[{form}].")
        else:
            default = _default(given, name in required)
            yield code(key), _type(whole, field), default, _allowed(whole, field), field["told"]


def _resolved(whole: Schema, given: Schema) -> dict[str, Any]:
    """A schema with its reference followed; ``told`` is what is said where it is used."""
    told = given.get("description", "")
    reference = given.get("$ref")
    for choice in given.get("anyOf", ()):
        reference = reference or choice.get("$ref")
    if reference is None:
        return {**given, "told": told}
    definition = whole["$defs"][reference.rsplit("/", 1)[1]]
    return {**definition, "told": told}


def _choices(field: Schema) -> list[Schema]:
    return list(field.get("anyOf", [field]))


def _type(whole: Schema, field: Schema) -> str:
    words = []
    for choice in _choices(field):
        kind: str = choice.get("type", "string" if "const" in choice or "enum" in choice else "any")
        if kind == "array":
            inner = _type(whole, _resolved(whole, choice.get("items", {})))
            words.append(f"list of {inner}")
        else:
            words.append(_WORDS.get(kind, kind))
    return " or ".join(words)


def _default(given: Schema, required: bool) -> str:
    if required:
        return "**required**"
    if "default" not in given:
        return ""
    return code(_value(given["default"]))


def _value(value: object) -> str:
    """A value as YAML writes it."""
    if value is None:
        return "null"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_value(item) for item in value) + "]"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {_value(item)}" for key, item in value.items()) + "}"
    return f"{value:.10g}" if isinstance(value, float) else str(value)


_LIMITS = (
    ("minimum", "at least {}"),
    ("exclusiveMinimum", "above {}"),
    ("maximum", "at most {}"),
    ("exclusiveMaximum", "below {}"),
    ("minItems", "at least {} of them"),
)


def _allowed(whole: Schema, field: Schema) -> str:
    parts = []
    for choice in _choices(field):
        if "const" in choice:
            parts.append(code(_value(choice["const"])))
        if "enum" in choice:
            parts.append(", ".join(code(_value(value)) for value in choice["enum"]))
        if "pattern" in choice:
            parts.append(code(choice["pattern"]))
        parts += [words.format(_value(choice[key])) for key, words in _LIMITS if key in choice]
        if choice.get("type") == "array":
            parts.append(_allowed(whole, _resolved(whole, choice.get("items", {}))))
    return "; ".join(part for part in parts if part)
