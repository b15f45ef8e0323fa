"""Reading and writing result tables as Parquet: checked against their schema, atomically.

A file is only believed as it was written: each has checksums of its pages, which any reader can
verify, and a digest of all its bytes, so of the names, types and values of all columns.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from spinepipe.files import appearing
from spinepipe.marks import BLANK, CONTENT, DamagedFile, check_whole, sealed
from spinepipe.schema import Column, Table

TYPES = {
    "text": pa.string(),
    "integer": pa.int32(),
    "number": pa.float64(),
    "flag": pa.bool_(),
}

SMALL_ROWS = 1000
"""Files of fewer rows are mostly footer: packing them costs time and gains nothing."""

_SMALL = {"compression": "none", "use_dictionary": False, "write_statistics": False}
_LARGE = {"compression": "zstd"}


class BadTable(ValueError):
    """A result that does not keep its table's promise: a fault of the library, not of the user."""


def arrow_schema(table: Table) -> pa.Schema:
    """Names and types of a table's columns; those that may be empty are nullable."""
    return pa.schema(
        pa.field(column.name, TYPES[column.type], nullable=column.nullable)
        for column in table.columns
    )


def to_arrow(table: Table, columns: Mapping[str, Sequence[Any]], **same: Any) -> pa.Table:
    """Columns (NaN or None for empty cells) as a table that keeps the schema.

    Parameters
    ----------
    same : what stands in all rows of other columns, such as the specimen of a job file.

    Raises
    ------
    BadTable
        For a missing or extra column, an empty, infinite or out-of-range cell, or a double key.
    """
    n = max((len(columns[name]) for name in columns), default=0)
    columns = {**columns, **{name: pa.repeat(value, n) for name, value in same.items()}}
    if set(columns) != set(table.names):
        raise BadTable(f"{table.name}: columns differ: {sorted(set(columns) ^ set(table.names))}")
    arrays = [_array(table.name, column, columns[column.name]) for column in table.columns]
    rows = pa.Table.from_arrays(arrays, schema=arrow_schema(table))
    _check_keys(table, rows)
    return rows


def _check_keys(table: Table, rows: pa.Table) -> None:
    keys = list(table.key)
    if rows.num_rows < SMALL_ROWS:
        distinct = len(set(zip(*(rows[key].to_pylist() for key in keys), strict=True)))
    else:
        distinct = rows.group_by(keys).aggregate([]).num_rows
    repeated = rows.num_rows - distinct
    if repeated:
        raise BadTable(f"{table.name}: {repeated} rows repeat the key of another")


def _typed(values: Sequence[Any], kind: pa.DataType) -> pa.Array:
    """Whole arrays are taken as they are: a list of them would be many times their size."""
    if isinstance(values, pa.Array):
        return values.cast(kind)
    return pa.array(values if isinstance(values, np.ndarray) else list(values), type=kind)


def _array(table: str, column: Column, values: Sequence[Any]) -> pa.Array:
    kind = TYPES[column.type]
    try:
        if column.type == "number":
            array = pa.array(np.asarray(values, dtype=float), type=kind, from_pandas=True)
        else:
            array = _typed(values, kind)
    except (pa.ArrowException, TypeError, ValueError) as error:
        raise BadTable(f"{table}.{column.name}: {error}") from None
    problem = _problem(column, array)
    if problem:
        raise BadTable(f"{table}.{column.name}: {problem}")
    return array


def _problem(column: Column, array: pa.Array) -> str | None:
    if not column.nullable and array.null_count:
        return f"{array.null_count} empty cells"
    if len(array) == array.null_count:
        return None
    if column.type in ("number", "integer"):
        numbers = array.to_numpy(zero_copy_only=False)  # of few rows, ten times as fast as Arrow
        low, high = np.fmin.reduce(numbers), np.fmax.reduce(numbers)
        if not (np.isfinite(low) and np.isfinite(high)):
            return "an infinite cell"
        if low < column.low:
            return f"{low} is below {column.low}"
        if high > column.high:
            return f"{high} is above {column.high}"
    if column.allowed:
        strangers = set(array.drop_null().unique().to_pylist()) - set(column.allowed)
        if strangers:
            return f"{sorted(strangers)[0]!r} is not one of {column.allowed}"
    return None


def write(rows: pa.Table, path: str | Path, metadata: Mapping[str, str]) -> None:
    """Write rows with provenance in the file's metadata; the file appears whole or not at all."""
    rows = rows.replace_schema_metadata(dict(sorted(metadata.items())))
    how = _SMALL if rows.num_rows < SMALL_ROWS else _LARGE
    file = pa.BufferOutputStream()
    with pq.ParquetWriter(file, rows.schema, write_page_checksum=True, **how) as writer:
        writer.write_table(rows)
        writer.add_key_value_metadata({CONTENT: BLANK})  # not in Arrow's own copy of the metadata
    raw = sealed(file.getvalue(), ".parquet")
    with appearing(path) as temporary:
        temporary.write_bytes(raw)


def metadata_of(rows: pa.Table) -> dict[str, str]:
    """Metadata of a table that was read."""
    return _told(rows.schema)


def read_metadata(path: str | Path) -> dict[str, str]:
    """Metadata of a file, its rows left alone.

    Raises
    ------
    DamagedFile
        As `read` does.
    """
    with opened(path) as file:
        return _told(file.schema_arrow)


def _told(schema: pa.Schema) -> dict[str, str]:
    found = {key.decode(): value.decode() for key, value in (schema.metadata or {}).items()}
    return {key: value for key, value in found.items() if key != CONTENT}


def join(
    table: Table, parts: Sequence[pa.Table], path: str | Path, metadata: Mapping[str, str]
) -> None:
    """Write tables one after the other as one, with metadata of its own."""
    rows = pa.concat_tables(
        [part.select(table.names).replace_schema_metadata(None) for part in parts]
    )
    rows = rows.cast(arrow_schema(table))
    _check_keys(table, rows)
    write(rows, path, metadata)


@contextmanager
def opened(path: str | Path) -> Iterator[pq.ParquetFile]:
    """A file whose bytes are those that were written, to be read whole or some rows at a time.

    Raises
    ------
    DamagedFile
        For a file that is broken, cut off, empty or changed, here or while it is read.
    OSError
        With the file's name, where there is none or it may not be read.
    """
    with open(path, "rb") as file:
        try:
            check_whole(path, file)
            yield pq.ParquetFile(file, page_checksum_verification=True)
        except (pa.ArrowException, OSError) as trouble:
            raise DamagedFile(path, " ".join(str(trouble).split())) from None


def read(path: str | Path, columns: Sequence[str] | None = None) -> pa.Table:
    """The rows of one file, metadata included; folder names are not read as columns.

    The digest of the file's bytes is no metadata of its rows, and is left out.

    Raises
    ------
    DamagedFile, OSError
        As `opened` does.
    """
    with opened(path) as file:
        rows = file.read(columns=None if columns is None else list(columns))
    return rows.replace_schema_metadata(_told(rows.schema))


def read_frame(path: str | Path) -> pd.DataFrame:
    """The rows of one file as a data frame, empty cells as NaN or None. Raises what `read` does."""
    frame: pd.DataFrame = read(path).to_pandas()
    return frame


class StudyTables(dict[str, pd.DataFrame]):
    """Tables of a study by name, and its other result files."""

    def __init__(
        self, frames: Mapping[str, pd.DataFrame], files: Mapping[str, str] | None = None
    ) -> None:
        super().__init__(frames)
        self.files = dict(files or {})

    @classmethod
    def read(
        cls, paths: Sequence[str | Path], files: Mapping[str, str] | None = None
    ) -> "StudyTables":
        """Tables by the name of their file; other files are not opened."""
        return cls({Path(path).stem: read_frame(path) for path in paths}, files)


def read_frames(paths: Sequence[str | Path]) -> dict[str, pd.DataFrame]:
    """Tables by name, which is that of their file."""
    return StudyTables.read(paths)


def from_rows(table: Table, rows: Sequence[Mapping[Any, Any]], **same: Any) -> pa.Table:
    """Rows as a table that keeps the schema; ``same`` as `to_arrow` takes it.

    Raises
    ------
    BadTable
        As `to_arrow` does.
    """
    names = [name for name in table.names if name not in same]
    return to_arrow(table, {name: [row[name] for row in rows] for name in names}, **same)
