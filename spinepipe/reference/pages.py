"""The generated parts of the documentation, each between two markers in a page.

A page says where a part goes:

    <!-- generated: cohort motion -->
    <!-- end of generated -->

What stands between the markers is written by `spinepipe docs` and compared in the tests: the list
of effects, tables of configuration keys from the pydantic models, columns of a cohort. The pages
of result tables are written as a whole, and nobody keeps them.
"""

import inspect
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import Field, fields
from functools import cache, partial
from math import inf, isfinite
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from spinepipe.cohort.cohort import CohortHeader
from spinepipe.documents.form import TableForm
from spinepipe.effects import Effect, Parameter, TriedValues, create, registered
from spinepipe.imports.imported import all_forms
from spinepipe.imports.landmarks import LandmarkSettings
from spinepipe.imports.motion_capture import MotionCaptureSettings
from spinepipe.imports.opensim_model.spine import OsimSettings
from spinepipe.model.file import ModelFile
from spinepipe.problems import InputError, InputProblem, did_you_mean, one_of
from spinepipe.reference.licences import licences
from spinepipe.schema import Column, Table
from spinepipe.studies.read import Selection
from spinepipe.studies.registry import every_kind
from spinepipe.testing_machine.settings import MachineMapping

_HEAD = ("parameter", "unit", "bounds", "off", "default", "prior SD", "meaning")

Schema = Mapping[str, Any]
_WORDS: dict[str, str] = {
    "string": "text",
    "number": "number",
    "integer": "integer",
    "boolean": "true or false",
    "object": "mapping",
    "null": "null",
}

_LIMITS = (
    ("minimum", "at least {}"),
    ("exclusiveMinimum", "above {}"),
    ("maximum", "at most {}"),
    ("exclusiveMaximum", "below {}"),
    ("minItems", "at least {} of them"),
)

DOCS = "docs"
END = "<!-- end of generated -->"
_PART = re.compile(rf"<!-- generated: (.+?) -->\n.*?{re.escape(END)}", re.DOTALL)


def outdated_pages(root: Path) -> list[Path]:
    """Pages whose generated parts differ from what the code says."""
    texts = ((path, path.read_text(encoding="utf-8")) for path in pages(root))
    return [path for path, text in texts if refresh(text, path.name) != text]


def pages(root: Path) -> list[Path]:
    """All pages of the documentation."""
    return sorted((root / DOCS).rglob("*.md"))


def refresh(text: str, page: str) -> str:
    """A page with all its generated parts as they should be.

    Raises
    ------
    InputError
        For a marker that names nothing known, or one without an end.
    """
    if text.count("<!-- generated: ") != len(_PART.findall(text)):
        problem = InputProblem(page, None, None, "a marker without an end", END, "add it")
        raise InputError([problem])
    return _PART.sub(lambda found: _part(found[1], page), text)


def _part(name: str, page: str) -> str:
    known = generators()
    if name not in known:
        remedy = did_you_mean(name, known, "correct the marker")
        raise InputError([InputProblem(page, None, None, f"'{name}'", one_of(known), remedy)])
    return f"<!-- generated: {name} -->\n\n{known[name]()}\n\n{END}"


@cache
def generators() -> dict[str, Callable[[], str]]:
    """Every part that can be generated, by the name that pages use."""
    parts: dict[str, Callable[[], str]] = {"effects": effects, "licences": licence_table}
    kinds = every_kind()
    parts |= {f"cohort {name}": partial(cohort_table, form) for name, form in all_forms().items()}
    parts["keys cohort.yaml"] = partial(key_table, CohortHeader)
    parts["keys config.yaml"] = partial(key_table, Selection)
    parts["keys import"] = partial(key_table, MachineMapping)
    parts["keys import landmarks"] = partial(key_table, LandmarkSettings)
    parts["keys import motion_capture"] = partial(key_table, MotionCaptureSettings)
    parts["keys import opensim_model"] = partial(key_table, OsimSettings)
    parts["keys model"] = partial(key_table, ModelFile)
    parts |= {f"keys {name}": partial(key_table, kind.settings) for name, kind in kinds.items()}
    return parts


def licence_table() -> str:
    """Packages that the product runs on, and their licences."""
    rows = [(code(one.package), one.version, one.licence, one.remark) for one in licences()]
    return table(("package", "version", "licence", "remark"), rows)


def cohort_table(form: TableForm) -> str:
    """Columns of a CSV file of a cohort."""
    rows = [
        (
            code(c.name) if c.nullable else f"**{code(c.name)}**",
            c.type,
            ", ".join(map(code, c.allowed)) or c.range_text,
            c.meaning,
            "allowed" if c.nullable else "not allowed",
        )
        for c in form.columns
    ]
    keys = ", ".join(code(name) for name in form.keys)
    more = " Further columns are carried through as text." if form.carries else ""
    head = ("column", "type", "range", "meaning", "an empty cell")
    return f"One row per {form.row}; unique by {keys}.{more}\n\n{table(head, rows)}"


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
            words = [choice for choice in _choices(given) if "const" in choice]
            yield (
                code(key),
                " or ".join(["mapping", *(_type(whole, word) for word in words)]),
                _default(given, name in required),
                "; ".join(["the keys below", *(_allowed(whole, word) for word in words)]),
                field["told"],
            )
            yield from _rows(whole, field, f"{key}.")
        elif "properties" in inner:
            yield (
                code(key),
                "list of mappings",
                _default(given, name in required),
                "the keys below, for each",
                field["told"],
            )
            yield from _rows(whole, inner, f"{key}[].")
        elif "discriminator" in inner:
            forms = inner["discriminator"]
            one_of = f"the keys of one form, by `{forms['propertyName']}`"
            yield (
                code(key),
                "list of mappings",
                _default(given, name in required),
                one_of,
                field["told"],
            )
            for form, reference in forms["mapping"].items():
                yield from _rows(whole, _resolved(whole, {"$ref": reference}), f"{key}[{form}].")
        else:
            default = _default(given, name in required)
            yield code(key), _type(whole, field), default, _allowed(whole, field), field["told"]


def _resolved(whole: Schema, given: Schema) -> dict[str, Any]:
    """A schema with its reference followed; ``told`` is what is said where it is used."""
    told = given.get("description", "")
    reference = given.get("$ref")
    for choice in _choices(given):
        reference = reference or choice.get("$ref")
    if reference is None:
        return {**given, "told": told}
    definition = whole["$defs"][reference.rsplit("/", 1)[1]]
    return {**definition, "told": told}


def _choices(field: Schema) -> list[Schema]:
    forms = () if "discriminator" in field else field.get("oneOf", ())
    return list(field.get("anyOf", forms) or [field])


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


def effects() -> str:
    """All registered effects with options, parameters, and how a search tries them."""
    every = sorted(registered().items())
    rows = [(f"[{code(name)}](#{name})", create(name).kind, _about(cls)) for name, cls in every]
    return "\n\n".join(
        [
            table(("effect", "kind", "what it is"), rows),
            *(_effect(name, cls) for name, cls in every),
        ]
    )


def _about(cls: type) -> str:
    """The first line of the effect's file, without its name."""
    first = (sys.modules[cls.__module__].__doc__ or "").strip().split("\n")[0]
    return first.partition(": ")[2].rstrip(".") or first


def _effect(name: str, cls: type) -> str:
    effect = create(name)
    scope = "for each joint" if effect.per_joint else "once for the whole model"
    trial: TriedValues | None = getattr(cls, "trial", None)
    parts = [
        f"### {code(name)}",
        f"Kind: {effect.kind}; parameters {scope}.",
        _law(cls),
        _options(cls, trial),
        _parameters(name, effect, trial),
        _search(trial),
    ]
    return "\n\n".join(part for part in parts if part)


def _law(cls: type) -> str:
    """The law as its class says it; options are listed apart."""
    words = inspect.cleandoc(cls.__doc__ or "").split("\n\n")
    return "\n\n".join(part for part in words if not part.startswith("Options:"))


def _options(cls: type, trial: TriedValues | None) -> str:
    """Each option with its default and what a search tries."""
    told = []
    for field in fields(cls):
        tried = _tried(trial, field)
        others = f" (a search tries {', '.join(map(_typed, tried))})" if len(tried) > 1 else ""
        told.append(f"{code(field.name)}, by default {_typed(field.default)}{others}")
    return f"Options: {'; '.join(told)}." if told else ""


def _tried(trial: TriedValues | None, option: Field[Any]) -> list[Any]:
    """The values of an option among the variants, each once; its default where none is named."""
    variants = trial.variants if trial else ()
    if not any(option.name in one for one in variants):
        return []
    return list(dict.fromkeys(one.get(option.name, option.default) for one in variants))


def _typed(value: Any) -> str:
    """A value as a model file has it."""
    return code(f"[{', '.join(value)}]" if isinstance(value, tuple) else str(value))


def _parameters(name: str, effect: Effect, trial: TriedValues | None) -> str:
    """Parameters with the default options, then those that other options have instead."""
    own = effect.parameters
    if not own:
        return "No parameters."
    rows, differing = [_row(one, "") for one in own], []
    for options, parameters in _other_options(name, trial):
        known = {one.name: one for one in own}
        rows += [_row(one, options) for one in parameters if one.name not in known]
        if any(_size(one) != _size(known.get(one.name, one)) for one in parameters):
            differing.append(options.partition(":")[0])
    listed = table(_HEAD, rows)
    if differing:
        keys = " and ".join(map(code, dict.fromkeys(differing)))
        listed += f"\n\nSizes are those of the default options; with another {keys} they differ."
    return listed


def _other_options(
    name: str, trial: TriedValues | None
) -> Iterator[tuple[str, tuple[Parameter, ...]]]:
    """Parameters with one option at a time away from its default, among those that are tried."""
    effect_class = registered()[name]
    for field in fields(effect_class):
        for value in _tried(trial, field):
            if value != field.default:
                options: Mapping[str, Any] = {field.name: value}
                yield f"{field.name}: {value}", create(name, options).parameters


def _size(one: Parameter) -> tuple[float, ...]:
    return one.low, one.high, one.default, one.prior_scale


def _row(one: Parameter, options: str) -> tuple[str, ...]:
    bounds = f"{_number(one.low)} to {_number(one.high)}"
    prior = f"{one.prior_scale:g}" + (" (of the logarithm)" if one.logarithmic else "")
    off = "" if one.off is None else f"{one.off:g}"
    name = f"{code(one.name)}, with {code(options)}" if options else code(one.name)
    default = f"{one.default:.6g}"
    if one.unsaid is not None:
        default += f" (in a file that does not name it {one.unsaid:g})"
    return name, one.unit, bounds, off, default, prior, one.meaning


def _number(value: float) -> str:
    return "no limit" if abs(value) == inf else f"{value:.6g}"


def _search(trial: TriedValues | None) -> str:
    """How its values may differ in a search, and what test shows it."""
    if trial is None:
        return "A search for missing effects does not try it."
    spreads = ", ".join(trial.spreads)
    return f"In a search its values may be: {spreads}. What shows it: {trial.told_by}."


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table; a bar inside a cell is escaped."""
    lines = [_line(head), _line(["---"] * len(head))]
    return "\n".join([*lines, *(_line(row) for row in rows)])


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def code(text: str) -> str:
    """Text as it is typed."""
    return f"`{text}`"


# --- columns of result tables ---------------------------------------------------------------------

_COLUMN_HEAD = ("column", "meaning", "unit", "type", "range", "an empty cell means")


def table_pages() -> dict[str, str]:
    """One page per table, one per kind that lists them; by their place below `docs`, not kept."""
    found = {}
    for name, kind in every_kind().items():
        tables = sorted(kind.tables, key=lambda one: one.name)
        rows = [(f"[{shape.name}]({name}/{shape.name}.md)", shape.about) for shape in tables]
        head = f"# Tables of {name}\n\nWhat the study asks: [{name}](../studies/{name}.md)"
        found[f"table/{name}.md"] = f"{head}\n\n{table(('table', 'what'), rows)}\n"
        found |= {f"table/{name}/{shape.name}.md": _shape(name, shape) for shape in tables}
    return found


def _shape(kind: str, shape: Table) -> str:
    rows = [
        (code(c.name), c.meaning, c.unit, c.type, _range(c), c.empty or "never empty")
        for c in shape.columns
    ]
    key = f"Unique by {', '.join(map(code, shape.key))}."
    of = f"A table of studies of kind [{kind}](../../studies/{kind}.md)."
    columns = table(_COLUMN_HEAD, rows)
    words = [f"# {shape.name}.parquet", of, shape.note, shape.about, key, columns]
    return "\n\n".join(word for word in words if word) + "\n"


def _range(column: Column) -> str:
    if column.allowed:
        return ", ".join(map(code, column.allowed))
    ends = (("at least {:g}", column.low), ("at most {:g}", column.high))
    return " and ".join(words.format(end) for words, end in ends if isfinite(end))
