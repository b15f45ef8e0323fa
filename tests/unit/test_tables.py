"""Tables keep their schema, appear whole or not at all, and carry their provenance.

Catches a table without schema or provenance, and half a table on disk.
"""

import errno
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.dataset
import pytest
from sweeps import sweep

from spinepipe.schema import Column, Table
from spinepipe.status import Status
from spinepipe.studies.registry import every_kind
from spinepipe.tables import (
    BadTable,
    arrow_schema,
    from_rows,
    join,
    read,
    read_frame,
    to_arrow,
    write,
)

TABLE = Table(
    "small",
    "A table for tests.",
    ("specimen", "pose"),
    (
        Column("specimen", "text", "name of the specimen"),
        Column("pose", "integer", "number", low=0, high=99),
        Column("width_mm", "number", "width", "mm", low=0.0, high=10.0),
        Column("depth_mm", "number", "depth", "mm", nullable=True, empty="not measured"),
        Column("sure", "flag", "whether it is", nullable=True, empty="held fixed"),
        Column("status", "text", "how the test ended", allowed=tuple(Status)),
        Column("message", "text", "why"),
    ),
)
TABLES = {f"{name}.{t.name}": t for name, kind in every_kind().items() for t in kind.tables}
ROWS = {
    "specimen": ["a", "a", "b"],
    "pose": [0, 1, 0],
    "width_mm": [0.0, 5.5, 10.0],
    "depth_mm": [1.0, np.nan, None],
    "sure": [True, None, False],
    "status": ["converged", "refused", Status.UNSTABLE.value],
    "message": ["", "why", ""],
}


def spoiled(column: str, value: object) -> dict[str, list]:
    """The rows with one cell changed."""
    return {**ROWS, column: [*ROWS[column][:-1], value]}


def test_good_rows_become_a_table_with_empty_cells_as_null() -> None:
    rows = to_arrow(TABLE, ROWS)
    assert rows.schema == arrow_schema(TABLE)
    assert rows["depth_mm"].to_pylist() == [1.0, None, None]
    assert rows["sure"].to_pylist() == [True, None, False]
    assert not arrow_schema(TABLE).field("width_mm").nullable


@sweep(
    "column, value, said",
    [
        ("specimen", None, "empty"),
        ("pose", None, "empty"),
        ("pose", -1, "below 0"),
        ("pose", 100, "above 99"),
        ("width_mm", None, "empty"),
        ("width_mm", np.nan, "empty"),
        ("width_mm", np.inf, "infinite"),
        ("width_mm", -np.inf, "infinite"),
        ("width_mm", -1e-9, "below 0"),
        ("width_mm", 10.001, "above 10"),
        ("depth_mm", np.inf, "infinite"),
        ("depth_mm", -np.inf, "infinite"),
        ("status", "fine", "'fine' is not one of"),
        ("status", None, "empty"),
        ("message", None, "empty"),
    ],
)
def test_bad_cells_are_refused_with_their_column(column, value, said) -> None:
    with pytest.raises(BadTable, match=rf"small\.{column}: .*{said}"):
        to_arrow(TABLE, spoiled(column, value))


@sweep(
    "column, value",
    [("pose", np.nan), ("pose", 2**40), ("specimen", 3), ("specimen", np.nan), ("sure", "yes")],
)
def test_cells_of_the_wrong_kind_are_refused_with_their_column(column, value) -> None:
    with pytest.raises(BadTable, match=rf"small\.{column}"):
        to_arrow(TABLE, spoiled(column, value))


def test_a_double_key_is_refused() -> None:
    with pytest.raises(BadTable, match="key"):
        to_arrow(TABLE, {**ROWS, "specimen": ["a", "a", "a"]})


def test_missing_and_extra_columns_are_refused() -> None:
    with pytest.raises(BadTable, match="sure"):
        to_arrow(TABLE, {name: cells for name, cells in ROWS.items() if name != "sure"})
    with pytest.raises(BadTable, match="other"):
        to_arrow(TABLE, {**ROWS, "other": [1, 2, 3]})


def test_no_rows_are_a_table_too() -> None:
    assert to_arrow(TABLE, {name: [] for name in ROWS}).num_rows == 0


def test_a_written_table_reads_back_with_its_metadata(tmp_path: Path) -> None:
    rows, path = to_arrow(TABLE, ROWS), tmp_path / "deep" / "specimen-a" / "rows.parquet"
    write(rows, path, {"seed": "7", "code": "abc"})
    again = read(path)
    assert again.replace_schema_metadata(None) == rows
    assert again.schema.metadata == {b"code": b"abc", b"seed": b"7"}
    assert again.column_names == rows.column_names
    frame = read_frame(path)
    assert np.isnan(frame["depth_mm"][1])
    assert frame["pose"].tolist() == [0, 1, 0]


def test_the_same_rows_are_the_same_bytes(tmp_path: Path) -> None:
    for name, order in (("one", ("a", "b")), ("two", ("b", "a"))):
        write(to_arrow(TABLE, ROWS), tmp_path / name, dict.fromkeys(order, "1"))
    assert (tmp_path / "one").read_bytes() == (tmp_path / "two").read_bytes()


def test_a_write_that_fails_leaves_the_old_file_and_no_other(tmp_path, monkeypatch) -> None:
    path = tmp_path / "rows.parquet"
    write(to_arrow(TABLE, ROWS), path, {})
    before = path.read_bytes()

    def half(where: Path, content: bytes) -> None:
        with where.open("wb") as file:
            file.write(content[: len(content) // 2])
        raise OSError(errno.ENOSPC, "No space left on device", str(where))

    monkeypatch.setattr(Path, "write_bytes", half)
    with pytest.raises(OSError, match="No space"):
        write(to_arrow(TABLE, spoiled("pose", 9)), path, {})
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def part(specimen: str, **metadata: str) -> pa.Table:
    rows = to_arrow(TABLE, {**ROWS, "specimen": [specimen] * 3, "pose": [0, 1, 2]})
    return rows.replace_schema_metadata(metadata)


def test_joined_tables_keep_order_and_have_metadata_of_their_own(tmp_path: Path) -> None:
    parts = [part("b", of="b"), part("a", of="a")]
    join(TABLE, parts, tmp_path / "all.parquet", {"seed": "1", "code": "x"})
    rows = read(tmp_path / "all.parquet")
    assert rows["specimen"].to_pylist() == ["b"] * 3 + ["a"] * 3
    assert rows.schema.metadata == {b"seed": b"1", b"code": b"x"}


def test_joining_finds_rows_that_repeat_a_key(tmp_path: Path) -> None:
    with pytest.raises(BadTable, match="3 rows repeat the key"):
        join(TABLE, [part("a"), part("b"), part("a")], tmp_path / "all.parquet", {})
    assert not list(tmp_path.iterdir())


@sweep("table", TABLES.values(), TABLES)
def test_every_result_table_is_complete(table: Table) -> None:
    names = [column.name for column in table.columns]
    assert len(set(names)) == len(names)
    assert set(table.key) <= set(names)
    assert arrow_schema(table).names == names
    for column in table.columns:
        assert column.meaning
        assert not column.nullable or (column.empty and column.name not in table.key)
        for unit in ("mm", "deg"):
            told = column.name.endswith(f"_{unit}") and not column.name.endswith(f"_per_{unit}")
            assert not told or column.unit == unit


def test_what_all_rows_have_is_told_once() -> None:
    given = {name: cells for name, cells in ROWS.items() if name not in ("specimen", "pose")}
    given = {name: cells[:1] for name, cells in given.items()}
    rows = to_arrow(TABLE, given, specimen="001", pose=7)
    assert rows.schema == arrow_schema(TABLE)
    assert rows["specimen"].to_pylist() == ["001"]
    assert rows["pose"].to_pylist() == [7]
    (row,) = rows.drop_columns(["specimen", "pose"]).to_pylist()
    assert from_rows(TABLE, [row], specimen="001", pose=7) == rows
    with pytest.raises(BadTable, match="columns differ"):
        to_arrow(TABLE, given, pose=7)


def test_a_folder_of_job_files_opens_as_one_data_set(tmp_path: Path) -> None:
    """As readers open it that make a column of each ``name=value`` in a path."""
    for name in ("001", "010"):
        path = tmp_path / f"specimen-{name}" / "rows.parquet"
        path.parent.mkdir()
        write(to_arrow(TABLE, {**ROWS, "specimen": [name] * 3, "pose": [0, 1, 2]}), path, {})
    for rows in (
        pd.read_parquet(tmp_path),
        pyarrow.dataset.dataset(tmp_path, partitioning="hive").to_table().to_pandas(),
    ):
        assert set(rows["specimen"]) == {"001", "010"}
        assert len(rows) == 6
