"""Tables from rows of data: a file ``tables.csv`` beside the code that writes or reads them.

A row is a column of a table. Its cells are those of `Column`; a cell ``key`` says that it belongs
to what makes rows unique, ``allowed`` lists values with bars between them, and a column of which
``empty`` says nothing is never empty. Besides there are rows of type ``table``, which say what a
row of the table stands for, and rows of type ``note``, which say more of how to read it.

Columns that come again are a group, a table whose name begins with ``@``. A row whose type is the
name of a group stands for its rows: what these leave blank is as that row has it, and their ``{}``
is its cell of the same column. Groups of several kinds of studies are in the file beside this one.
"""

import csv
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from math import inf
from pathlib import Path

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


FILE = "tables.csv"
GROUP = "@"

_SHARED = Path(__file__).with_name(FILE)

Row = Mapping[str, str]


@cache
def _declared(path: Path) -> dict[str, Table]:
    return read_tables(path)


def declared(module: str, name: str) -> Table:
    """The table of that name in the file beside a module, which hands over its ``__file__``."""
    return _declared(Path(module).with_name(FILE))[name]


def all_declared(module: str) -> tuple[Table, ...]:
    """All tables in the file beside a module, in their order."""
    return tuple(_declared(Path(module).with_name(FILE)).values())


def read_tables(path: Path) -> dict[str, Table]:
    """The tables of a file by name.

    Raises
    ------
    ValueError
        For a type or a group that there is not, with file, table and column.
    """
    rows = _rows(path)
    groups = {**_rows(_SHARED), **rows}
    return {
        name: _table(name, [leaf for row in of for leaf in _leaves(row, groups, path)])
        for name, of in rows.items()
        if not name.startswith(GROUP)
    }


def _rows(path: Path) -> dict[str, list[Row]]:
    """Rows of a file by the table or group that they are of."""
    found: dict[str, list[Row]] = {}
    with path.open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            found.setdefault(row["table"], []).append(row)
    return found


def _leaves(row: Row, groups: Mapping[str, list[Row]], path: Path) -> Iterator[Row]:
    """The row itself; of a group its rows, filled in."""
    name = row["type"]
    if name in (*TYPES, "table", "note"):
        yield row
    elif name.startswith(GROUP) and name in groups:
        for one in groups[name]:
            filled = {
                head: cell.replace("{}", row[head]) if "{}" in cell else cell or row[head]
                for head, cell in one.items()
            }
            yield from _leaves(filled, groups, path)
    else:
        raise ValueError(f"{path}: {row['table']}, {row['column']}: no type or group {name!r}")


def _table(name: str, rows: list[Row]) -> Table:
    words = {row["type"]: row["meaning"] for row in rows if row["type"] in ("table", "note")}
    columns = [row for row in rows if row["type"] not in ("table", "note")]
    return Table(
        name,
        words["table"],
        tuple(row["column"] for row in columns if row["key"]),
        tuple(_column(row) for row in columns),
        words.get("note", ""),
    )


def _column(row: Row) -> Column:
    return Column(
        row["column"],
        row["type"],
        row["meaning"],
        row["unit"],
        nullable=bool(row["empty"]),
        low=float(row["low"] or -inf),
        high=float(row["high"] or inf),
        allowed=tuple(row["allowed"].split("|")) if row["allowed"] else (),
        empty=row["empty"],
    )
