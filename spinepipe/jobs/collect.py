"""Job: the rows of many files as one table, block by block and then as a whole."""

from pathlib import Path

import pyarrow as pa

from spinepipe.tables import TABLES, join, read


def run(table: str, inputs: list[str], output: str) -> None:
    """Join files of a table; what their folders say of them becomes columns again."""
    join(TABLES[table], [_with_folders(table, path) for path in inputs], output)


def _with_folders(table: str, path: str) -> pa.Table:
    """Rows of one file with the ``name=value`` parts of its folders as columns."""
    rows = read(path)
    schema = TABLES[table].schema
    for part in Path(path).parts[:-1]:
        name, found, value = part.partition("=")
        if found and name in schema.names and name not in rows.column_names:
            kind = schema.field(name).type
            column = pa.repeat(pa.scalar(value).cast(kind), rows.num_rows)
            rows = rows.append_column(schema.field(name), column)
    return rows
