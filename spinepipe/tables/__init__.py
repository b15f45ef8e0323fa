"""Result tables: one schema each, from which files are checked and the docs are generated."""

from spinepipe.tables.parquet import (
    BadTable,
    Tables,
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
from spinepipe.tables.schema import Column, Table

__all__ = [
    "BadTable",
    "Column",
    "Table",
    "Tables",
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
