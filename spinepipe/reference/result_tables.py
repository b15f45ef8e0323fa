"""The page of all columns of all result tables, made from what the kinds of studies declare."""

from math import isfinite

from spinepipe.reference.pages import code, table
from spinepipe.schema import Column, Table
from spinepipe.studies.registry import every_kind

PAGE = "docs/tables.md"
"""Where it is written; nobody keeps it, as it follows from the tables alone."""

_HEAD = ("column", "type", "unit", "range", "meaning", "an empty cell means")


def columns_page() -> str:
    """All columns, kind by kind. How tables are read is told beside it."""
    parts = [
        "# Columns of result tables",
        "Made by `spinepipe docs`. [How to read results](results.md)",
    ]
    for name, kind in every_kind().items():
        parts.append(f"## Studies of kind [{name}](studies/{name}.md)")
        parts += [_told(shape) for shape in kind.tables]
    return "\n\n".join(parts) + "\n"


def _told(shape: Table) -> str:
    rows = [
        (code(c.name), c.type, c.unit, _range(c), c.meaning, c.empty or "never empty")
        for c in shape.columns
    ]
    key = f"Unique by {', '.join(map(code, shape.key))}."
    words = [f"### {shape.name}.parquet", shape.note, shape.about, key, table(_HEAD, rows)]
    return "\n\n".join(word for word in words if word)


def _range(column: Column) -> str:
    if column.allowed:
        return ", ".join(map(code, column.allowed))
    ends = (("at least {:g}", column.low), ("at most {:g}", column.high))
    return " and ".join(words.format(end) for words, end in ends if isfinite(end))
