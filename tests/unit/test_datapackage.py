"""Descriptors beside results say what the files are, as the standard wants it said.

Catches a descriptor whose types, keys or empty cells are not those of the files, or one that other
programs cannot read. The rules are those of https://datapackage.org/standard.
"""

import json
import re
from pathlib import Path, PurePosixPath

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
from sweeps import sweep

from spinepipe.schema import Column, Table
from spinepipe.schema.datapackage import descriptor
from spinepipe.studies.registry import every_kind
from spinepipe.tables import to_arrow, write

ARROW = {
    "string": pa.string(),
    "integer": pa.int32(),
    "number": pa.float64(),
    "boolean": pa.bool_(),
}
PANDAS = {
    "string": pd.api.types.is_string_dtype,
    "integer": pd.api.types.is_integer_dtype,
    "number": pd.api.types.is_float_dtype,
    "boolean": pd.api.types.is_bool_dtype,
}
RESOURCE = {
    *("$schema", "name", "path", "type", "profile", "description"),
    *("format", "mediatype", "encoding", "schema"),
}
CONSTRAINTS = {"required", "minimum", "maximum", "enum"}
KINDS = every_kind()


def read(text: str) -> dict:
    """A descriptor that keeps the rules of the standard."""
    package = json.loads(text)
    assert set(package) == {"$schema", "name", "title", "resources"}
    assert re.fullmatch(r"[-a-z0-9._/]+", package["name"])
    names = [resource["name"] for resource in package["resources"]]
    assert len(set(names)) == len(names)
    for resource in package["resources"]:
        assert set(resource) <= RESOURCE
        assert re.fullmatch(r"[-a-z0-9._/]+", resource["name"])
        path = PurePosixPath(resource["path"])
        assert not path.is_absolute()
        assert ".." not in path.parts
        schema = resource["schema"]
        fields = [field["name"] for field in schema["fields"]]
        assert len(set(fields)) == len(fields)
        assert set(schema.get("primaryKey", ())) <= set(fields)
        for field in schema["fields"]:
            assert field["type"] in ARROW
            assert set(field.get("constraints", ())) <= CONSTRAINTS
    return package


@sweep("kind", KINDS)
def test_what_is_told_of_tables_is_what_files_of_them_are(kind: str, tmp_path: Path) -> None:
    tables = KINDS[kind].tables
    package = read(descriptor("a_study", "Title", [(one, f"{one.name}.parquet") for one in tables]))
    for table, told in zip(tables, package["resources"], strict=True):
        write(to_arrow(table, {name: [] for name in table.names}), tmp_path / told["path"], {})
        found = pq.read_schema(tmp_path / told["path"])
        fields = told["schema"]["fields"]
        assert [field["name"] for field in fields] == found.names
        assert [ARROW[field["type"]] for field in fields] == found.types
        assert [not field.get("constraints", {}).get("required", False) for field in fields] == [
            one.nullable for one in found
        ]
        assert tuple(told["schema"]["primaryKey"]) == table.key
        assert [field.get("unit", "") for field in fields] == [one.unit for one in table.columns]


TABLE = Table(
    "small",
    "A table for tests.",
    ("specimen", "step"),
    (
        Column("specimen", "text", "which"),
        Column("step", "integer", "load step", low=0),
        Column("angle_deg", "number", "angle", "deg", nullable=True, high=90, empty="not read"),
        Column("sure", "flag", "whether it is"),
        Column("side", "text", "of the body", allowed=("left", "")),
    ),
)
ROWS = {
    "specimen": ["a", "a", "b"],
    "step": [0, 1, 0],
    "angle_deg": [1.5, None, -3.0],
    "sure": [True, False, True],
    "side": ["left", "", "left"],
}


def test_pandas_finds_the_types_units_and_empty_cells_that_are_told(tmp_path: Path) -> None:
    write(to_arrow(TABLE, ROWS), tmp_path / "small.parquet", {})
    (told,) = read(descriptor("a", "A", [(TABLE, "small.parquet")]))["resources"]
    frame = pd.read_parquet(tmp_path / told["path"])
    for field in told["schema"]["fields"]:
        values = frame[field["name"]]
        limits = field.get("constraints", {})
        assert PANDAS[field["type"]](values)
        assert not (limits.get("required") and values.isna().any())
        assert "minimum" not in limits or (values >= limits["minimum"]).all()
        assert values.dropna().isin(limits.get("enum", values)).all()
    assert not frame.duplicated(told["schema"]["primaryKey"]).any()
    assert told["schema"]["missingValues"] == []  # a side of no letters is no empty cell
    step, angle = told["schema"]["fields"][1:3]
    assert step["constraints"] == {"required": True, "minimum": 0}
    assert angle == {
        "name": "angle_deg",
        "type": "number",
        "unit": "deg",
        "description": "angle; empty: not read",
        "constraints": {"maximum": 90},
    }


def test_a_key_that_may_be_empty_is_no_primary_key() -> None:
    cycle = Column("cycle", "integer", "repeat", nullable=True)
    table = Table("loads", "About.", ("cycle",), (cycle,))
    (told,) = read(descriptor("a", "A", [(table, "loads.csv")]))["resources"]
    assert "primaryKey" not in told["schema"]
    assert told["schema"]["uniqueKeys"] == [["cycle"]]
    assert told["schema"]["missingValues"] == [""]
    assert (told["format"], told["encoding"]) == ("csv", "utf-8")
