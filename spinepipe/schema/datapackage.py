"""Data Packages: names, types, units and keys of a folder's tables, as other programs read them.

The descriptor ``datapackage.json`` follows Data Package 2.0 (https://datapackage.org), once called
frictionless. Readers of the first version are served too, by ``profile``. The standard leaves room
for further properties: ``unit`` is one.
"""

import json
from collections.abc import Iterable
from math import isfinite
from pathlib import PurePath
from typing import Any

from spinepipe.schema.table import Column, Table

FILE = "datapackage.json"

_PROFILES = "https://datapackage.org/profiles/2.0"
_TYPES = {"text": "string", "integer": "integer", "number": "number", "flag": "boolean"}
_FORMATS: dict[str, dict[str, Any]] = {
    ".parquet": {"format": "parquet", "mediatype": "application/vnd.apache.parquet"},
    ".csv": {"format": "csv", "mediatype": "text/csv", "encoding": "utf-8"},
}
_MISSING: dict[str, list[str]] = {".parquet": [], ".csv": [""]}
"""Texts that stand for an empty cell: of Parquet none, whose texts may have no letters."""


def descriptor(name: str, title: str, tables: Iterable[tuple[Table, str]]) -> str:
    """The text of a descriptor of tables and their files, as paths from the folder it is in."""
    package = {
        "$schema": f"{_PROFILES}/datapackage.json",
        "name": name,
        "title": title,
        "resources": [_resource(table, path) for table, path in tables],
    }
    return json.dumps(package, indent=1, ensure_ascii=False) + "\n"


def _resource(table: Table, path: str) -> dict[str, Any]:
    suffix = PurePath(path).suffix
    # An empty cell of a key would be no key of this standard.
    known = not any(table.column(name).nullable for name in table.key)
    key = {"primaryKey": list(table.key)} if known else {"uniqueKeys": [list(table.key)]}
    return {
        "$schema": f"{_PROFILES}/dataresource.json",
        "name": table.name,
        "path": path,
        "type": "table",
        "profile": "tabular-data-resource",
        "description": table.about,
        **_FORMATS[suffix],
        "schema": {
            "$schema": f"{_PROFILES}/tableschema.json",
            "fields": [_field(column) for column in table.columns],
            **(key if table.key else {}),
            "missingValues": _MISSING[suffix],
        },
    }


def _field(column: Column) -> dict[str, Any]:
    field: dict[str, Any] = {"name": column.name, "type": _TYPES[column.type]}
    if column.unit:
        field["unit"] = column.unit
    empty = f"; empty: {column.empty}" if column.empty else ""
    field["description"] = column.meaning + empty
    limits: dict[str, Any] = {} if column.nullable else {"required": True}
    limits |= {"minimum": column.low} if isfinite(column.low) else {}
    limits |= {"maximum": column.high} if isfinite(column.high) else {}
    limits |= {"enum": list(column.allowed)} if column.allowed else {}
    return field | ({"constraints": limits} if limits else {})
