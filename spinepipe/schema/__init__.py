"""What tables are: their columns are rows of data, and one class says what a column is."""

from spinepipe.schema.rows import all_declared, declared, read_tables
from spinepipe.schema.table import Column, Table

__all__ = ["Column", "Table", "all_declared", "declared", "read_tables"]
