"""Result tables as Parquet files, checked against what is declared of their columns."""

from spinepipe.tables.parquet import (
    BadTable,
    StudyTables,
    arrow_schema,
    from_rows,
    join,
    metadata_of,
    opened,
    read,
    read_frame,
    read_frames,
    read_metadata,
    to_arrow,
    write,
)

__all__ = [
    "BadTable",
    "StudyTables",
    "arrow_schema",
    "from_rows",
    "join",
    "metadata_of",
    "opened",
    "read",
    "read_frame",
    "read_frames",
    "read_metadata",
    "to_arrow",
    "write",
]
