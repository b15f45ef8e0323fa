"""What the CSV files that people write hold: columns, and rules that their rows keep.

A room that reads such files has a ``forms.yaml`` beside it, which declares each of them. The
reader, the rules (`spinepipe.documents.rules`) and the documentation take it from there.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import Any, Literal

from spinepipe.documents.yaml_text import packaged_yaml
from spinepipe.schema import Column

__all__ = ["FILE", "WORDS", "InputColumn", "Rule", "TableForm", "read_forms"]

FILE = "forms.yaml"

WORDS = frozenset({"row", "titled", "meaning", "called", "otherwise", "found", "allowed", "remedy"})
"""Fields whose texts are for people alone; a list that is ``allowed`` decides."""


@dataclass(frozen=True)
class InputColumn(Column):
    """A column of a file that people write; its name says unit and positive direction.

    Attributes
    ----------
    key : whether it is one of those that together may occur only once.
    nullable : whether cells may be empty, and the column absent.
    open_low, open_high : whether the limit itself is outside the range.
    references : where each of its names must stand: ``table.column``, or a list that the reader
        knows by name (vertebrae, joints).
    per : the column by which names referred to are told apart: trials of the same specimen.
    wildcard : whether * may stand for all names.
    names : which names texts may be, where nothing lists them: ``name``, of anything that is told
        and drawn; ``folder``, of files too.
    empty_is : what an empty cell of a key stands for; None: it is no key then.
    called : what one of its words or names is, in messages; empty: the name of the column.
    otherwise : what to do with a word or name that is like none of the known ones, or a number out
        of range.
    """

    key: bool = False
    open_low: bool = False
    open_high: bool = False
    references: str = ""
    per: str = ""
    wildcard: bool = False
    names: Literal["", "name", "folder"] = ""
    empty_is: float | None = None
    called: str = ""
    otherwise: str = ""

    @property
    def range_text(self) -> str:
        """The range in words."""
        parts = []
        if self.low > -inf:
            parts.append(f"{'above' if self.open_low else 'at least'} {self.low:g}")
        if self.high < inf:
            parts.append(f"{'below' if self.open_high else 'at most'} {self.high:g}")
        return " and ".join(parts)


@dataclass(frozen=True)
class Rule:
    """What the rows of a table keep, beyond what each cell may be by itself.

    Exactly one of the first five says what.

    Attributes
    ----------
    together : columns that are all filled in a row, or all empty.
    any_of : columns (or ``a+b``, columns together) of which each row fills one at least.
    ascending : two columns whose numbers ascend in each row, where both are there.
    at_least, at_most : numbers of rows for each value of the column ``per``.
    per : column that groups rows.
    among : the list that tells the groups, as `Column.references`; empty: those in the table.
    where : by column, the words that a row must have to be counted.
    at : column at which a fault is told; empty: the first that lacks something.
    found, allowed, remedy : of the message; cells of the row stand in braces, as do ``{lacking}``,
        the names of empty columns, and ``{count}``, the number of rows.
    """

    together: tuple[str, ...] = ()
    any_of: tuple[str, ...] = ()
    ascending: tuple[str, ...] = ()
    at_least: int = 0
    at_most: int = 0
    per: str = ""
    among: str = ""
    where: Mapping[str, Sequence[str]] | None = None
    at: str = ""
    found: str = ""
    allowed: str = ""
    remedy: str = ""

    @property
    def of_each_specimen(self) -> bool:
        """Whether it asks for rows that a specimen may lack where no study needs them."""
        return self.at_least > 0 and self.among == "specimens.specimen"


@dataclass(frozen=True, eq=False)
class TableForm:
    """One CSV file.

    Attributes
    ----------
    stem : file name without ``.csv``.
    row : what one row stands for.
    columns : declared columns in output order.
    rules : what its rows keep.
    unique : whether the engine looks for repeated keys; not where names may stand for all.
    carries : whether undeclared columns are allowed and carried through as text.
    places : whether it tells where vertebrae are, so that neither landmarks nor joints are needed.
    titled : how a finding about a row begins, cells in braces.
    """

    stem: str
    row: str
    columns: tuple[InputColumn, ...]
    rules: tuple[Rule, ...] = ()
    unique: bool = True
    carries: bool = False
    places: bool = False
    titled: str = ""

    @property
    def file(self) -> str:
        """File name."""
        return f"{self.stem}.csv"

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the declared columns."""
        return tuple(column.name for column in self.columns)

    @property
    def keys(self) -> tuple[str, ...]:
        """Columns that together may occur only once."""
        return tuple(column.name for column in self.columns if column.key)

    def column(self, name: str) -> InputColumn:
        """A declared column."""
        return next(column for column in self.columns if column.name == name)


def read_forms(path: Path) -> dict[str, TableForm]:
    """The forms that a file of the package declares, by stem.

    Columns are of numbers unless their ``type`` says otherwise. A key is never empty unless it says
    ``nullable: true``; other columns may be empty unless they say ``nullable: false``.
    """
    return {stem: _form(stem, told) for stem, told in packaged_yaml(path).items()}


def _form(stem: str, told: Mapping[str, Any]) -> TableForm:
    columns = (_column(name, _as_tuples(one)) for name, one in told["columns"].items())
    rules = (Rule(**_as_tuples(rule)) for rule in told.get("rules", ()))
    rest = {key: value for key, value in told.items() if key not in ("columns", "rules")}
    return TableForm(stem, columns=tuple(columns), rules=tuple(rules), **rest)


def _column(name: str, told: Mapping[str, Any]) -> InputColumn:
    unsaid: dict[str, Any] = {"type": "number", "nullable": not told.get("key", False)}
    return InputColumn(name, **(unsaid | dict(told)))


def _as_tuples(told: Mapping[str, Any]) -> dict[str, Any]:
    return {key: tuple(one) if isinstance(one, list) else one for key, one in told.items()}
