"""What tables are: their columns are rows of data, and one class says what a column is."""

from spinepipe.schema.table import Column, Table, all_declared, declared, read_tables

__all__ = ["Column", "Table", "all_declared", "declared", "read_tables"]
