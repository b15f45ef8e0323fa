"""What a result table is: columns with type, unit, range and meaning. The docs come from here."""

from dataclasses import dataclass

import pyarrow as pa

TYPES = {
    "text": pa.string(),
    "integer": pa.int32(),
    "number": pa.float64(),
    "flag": pa.bool_(),
}


@dataclass(frozen=True)
class Column:
    """One column.

    Attributes
    ----------
    kind : ``text``, ``integer``, ``number`` or ``flag``.
    null : whether cells may be empty, and if so what an empty cell means; None forbids it.
    low, high : closed range of numbers.
    allowed : the only values a text may take.
    """

    name: str
    kind: str
    meaning: str
    unit: str = ""
    null: str | None = None
    low: float | None = None
    high: float | None = None
    allowed: tuple[str, ...] = ()


@dataclass(frozen=True)
class Table:
    """One result table: its rows are unique by ``key``."""

    name: str
    about: str
    key: tuple[str, ...]
    columns: tuple[Column, ...]

    @property
    def schema(self) -> pa.Schema:
        """Arrow schema; columns that may be empty are nullable."""
        return pa.schema(
            pa.field(column.name, TYPES[column.kind], nullable=column.null is not None)
            for column in self.columns
        )

    def without(self, *names: str) -> "Table":
        """The table with some columns left out (those that a folder name carries)."""
        return Table(
            self.name,
            self.about,
            tuple(name for name in self.key if name not in names),
            tuple(column for column in self.columns if column.name not in names),
        )
