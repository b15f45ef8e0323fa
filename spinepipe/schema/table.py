"""A table and its columns: name, type, unit, range and meaning. Docs and descriptors tell them."""

from dataclasses import dataclass, replace
from math import inf

TYPES = ("text", "integer", "number", "flag")


@dataclass(frozen=True)
class Column:
    """One column.

    Attributes
    ----------
    type : ``text``, ``integer``, ``number`` or ``flag``.
    nullable : whether cells may be empty.
    low, high : closed range of numbers.
    allowed : the only values a text may take.
    empty : what an empty cell means, where one may be.
    """

    name: str
    type: str
    meaning: str
    unit: str = ""
    nullable: bool = False
    low: float = -inf
    high: float = inf
    allowed: tuple[str, ...] = ()
    empty: str = ""


@dataclass(frozen=True)
class Table:
    """One table: its rows are unique by ``key``.

    Attributes
    ----------
    about : what a row stands for.
    note : how to read it, for the docs alone.
    """

    name: str
    about: str
    key: tuple[str, ...]
    columns: tuple[Column, ...]
    note: str = ""

    def column(self, name: str) -> Column:
        """The column of that name."""
        return next(column for column in self.columns if column.name == name)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns, in order."""
        return tuple(column.name for column in self.columns)

    @property
    def layout(self) -> list[object]:
        """All that decides what a file of it may hold, and no word of what it means."""
        return [
            *(self.name, list(self.key)),
            *(
                [one.name, one.type, one.unit, one.nullable, one.low, one.high, *one.allowed]
                for one in self.columns
            ),
        ]

    def without(self, *names: str) -> "Table":
        """The table with some columns left out (those that a folder name carries)."""
        return replace(
            self,
            key=tuple(name for name in self.key if name not in names),
            columns=tuple(column for column in self.columns if column.name not in names),
        )
