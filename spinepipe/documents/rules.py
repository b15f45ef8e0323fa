"""Do the rows of a table keep what its form declares: names, words, keys, rules?

One engine for every CSV file that people write. It tells all faults at once, each with line,
column, what was found, what is allowed and what to do; cells that the reader refused are left out.
"""

from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, field

import numpy as np
import pandas as pd

from spinepipe.documents.form import InputColumn, Rule, TableForm
from spinepipe.documents.names import (
    ALLOWED,
    ALLOWED_FOLDER,
    EVERYONE,
    folder_fault,
    look_alike,
    name_fault,
)
from spinepipe.problems import MOST_LISTED, InputProblem, Spelling

HEADER = 1
"""Line of the names of columns."""


@dataclass(frozen=True)
class Listed:
    """Names that a column may refer to.

    Attributes
    ----------
    names : in their order. source : where a new one would be added.
    instead : what to do about names that are often written in place of these.
    """

    names: Sequence[str]
    source: str
    instead: Mapping[str, str] = field(default_factory=dict)


Known = Callable[[str], Listed | None]
"""What a reference means; None where that cannot be read, so that nothing is told of it."""


@dataclass(frozen=True)
class TableCheck:
    """A table that was read, to be held against its form.

    Attributes
    ----------
    form : what it should be. file : its name in messages.
    table : indexed by line. refused : line and column of cells that could not be read.
    known : names of other tables.
    tables : other tables by stem.
    """

    form: TableForm
    file: str
    table: pd.DataFrame
    refused: Set[tuple[int | None, str | None]]
    known: Known
    tables: Mapping[str, pd.DataFrame]

    def problem(
        self, line: int | None, column: str | None, found: str, allowed: str, remedy: str
    ) -> InputProblem:
        """A fault of a row, with the words by which rows of this table are told."""
        if self.form.titled and line is not None:
            found = self.form.titled.format(**self.table.loc[line]) + found
        return InputProblem(self.file, line, column, found, allowed, remedy)

    def problems(self) -> Iterator[InputProblem]:
        """All that is wrong."""
        for column in self.form.columns:
            cells = self.table[column.name].dropna()
            if column.references:
                yield from self._unknown(column, cells)
            elif column.allowed:
                yield from self._not_allowed(column, cells)
            if column.names:
                yield from self._unfit(column, cells)
        if self.form.unique:
            yield from self._repeated()
        if not any(line == HEADER for line, _ in self.refused):  # a column may be misnamed
            for rule in self.form.rules:
                yield from self._broken(rule)

    def _unknown(self, column: InputColumn, cells: "pd.Series[str]") -> Iterator[InputProblem]:
        """Names that do not stand where they should."""
        listed = self.known(column.references)
        if listed is None or not (listed.names or column.wildcard):
            return
        if column.per:
            yield from self._unknown_of_each(column, cells)
            return
        names = (*listed.names, *((EVERYONE,) if column.wildcard else ()))
        otherwise = f"correct the name or add it to {listed.source}"
        spelling = Spelling(names, column.otherwise or otherwise)
        called = column.called or column.name
        many = len(names) > MOST_LISTED
        allowed = f"a {called} of {listed.source}" if many else spelling.allowed
        for line, name in cells[~cells.isin(names)].items():
            found = f"unknown {called} {look_alike(name) or _quoted(name)}"
            remedy = listed.instead.get(name) or spelling.remedy(name)
            yield InputProblem(self.file, _line(line), column.name, found, allowed, remedy)

    def _unknown_of_each(
        self, column: InputColumn, cells: "pd.Series[str]"
    ) -> Iterator[InputProblem]:
        """The same where names are those of a specimen, say, and not of another."""
        stem, _, name = column.references.partition(".")
        listed = self.tables[stem]
        pairs = set(zip(listed[column.per], listed[name], strict=True))
        whose = self.table.loc[cells.index, column.per]
        spellings: dict[object, Spelling] = {}
        for line, cell, owner in zip(cells.index, cells, whose, strict=True):
            if (owner, cell) not in pairs:
                if owner not in spellings:
                    names = listed[name][listed[column.per] == owner].dropna()
                    spellings[owner] = Spelling(names, column.otherwise)
                spelling = spellings[owner]
                found = f"no {column.called or column.name} '{cell}' of '{owner}'"
                place = (self.file, _line(line), column.name)
                yield InputProblem(*place, found, spelling.allowed, spelling.remedy(cell))

    def _not_allowed(self, column: InputColumn, cells: "pd.Series[str]") -> Iterator[InputProblem]:
        """Words that are none of those that a column may hold."""
        spelling = Spelling(column.allowed, column.otherwise or "correct it")
        lower = all(word == word.lower() for word in column.allowed)
        for line, word in cells[~cells.isin(column.allowed)].items():
            found = f"unknown {column.called} {_quoted(word)}" if column.called else _quoted(word)
            remedy = spelling.remedy(word.lower() if lower else word)
            yield self.problem(_line(line), column.name, found, spelling.allowed, remedy)

    def _unfit(self, column: InputColumn, cells: "pd.Series[str]") -> Iterator[InputProblem]:
        """Names that nothing can be called by."""
        is_folder = column.names == "folder"
        fault_of, allowed = (folder_fault, ALLOWED_FOLDER) if is_folder else (name_fault, ALLOWED)
        what = f"the {column.name}" if is_folder else "it"
        faults = {name: fault_of(name) for name in cells.unique() if is_folder or name != EVERYONE}
        for line, name in cells[cells.map(faults).notna()].items():
            remedy = f"rename {what} in every file"
            yield InputProblem(
                self.file, _line(line), column.name, faults[name] or "", allowed, remedy
            )

    def _repeated(self) -> Iterator[InputProblem]:
        """Rows with the keys of another; a row that lacks one is told elsewhere, or may be."""
        keys = self.form.keys
        standing = {one.name: one.empty_is for one in self.form.columns if one.empty_is is not None}
        cells = self.table[list(keys)].fillna(standing).dropna()
        first: dict[Hashable, int] = {}
        for line in cells.index[cells.duplicated(keep=False)]:
            row = tuple(cells.loc[line])
            if first.setdefault(row, line) != line:
                found = "again " + ", ".join(map(_shown, row))
                allowed = f"one row per {' x '.join(keys)}"
                remedy = f"delete one (the other is line {first[row]})"
                yield InputProblem(self.file, _line(line), None, found, allowed, remedy)

    def _broken(self, rule: Rule) -> Iterator[InputProblem]:
        if rule.at_least or rule.at_most:
            yield from self._miscounted(rule)
            return
        for line, lacking in self._breaking(rule):
            column = rule.at or (lacking[0] if lacking else None)
            told = {**self.table.loc[line], "lacking": " and ".join(lacking)}
            yield self.problem(line, column, rule.found.format(**told), rule.allowed, rule.remedy)

    def _breaking(self, rule: Rule) -> Iterator[tuple[int, list[str]]]:
        """Lines of rows that break a rule, and which of its columns they leave empty."""
        if rule.ascending:
            low, high = rule.ascending
            for line in self.table.index[self.table[low] >= self.table[high]]:
                yield _line(line), []
            return
        groups = [group.split("+") for group in rule.any_of or ("+".join(rule.together),)]
        columns = [name for group in groups for name in group]
        filled = self.table[columns].notna()
        whole = np.any([filled[group].all(axis=1) for group in groups], axis=0)
        broken = ~whole if rule.any_of else ~whole & filled.any(axis=1)
        for line in filled.index[broken]:
            if not any((line, name) in self.refused for name in columns):
                yield _line(line), [name for name in columns if not filled.loc[line, name]]

    def _miscounted(self, rule: Rule) -> Iterator[InputProblem]:
        """Groups of too few or too many rows that count; an unknown word may be the one meant."""
        counts = pd.Series(True, index=self.table.index)
        for name, words in (rule.where or {}).items():
            cells, declared = self.table[name], self.form.column(name).allowed
            unknown = cells.notna() & ~cells.isin(declared) & bool(declared)
            counts &= cells.isin(words) | unknown
        groups = self.table[rule.per][counts].dropna()
        lines_of = groups.groupby(groups, sort=False).groups
        listed = self.known(rule.among) if rule.among else None
        if rule.among and (listed is None or not self.table[rule.per].isin(listed.names).all()):
            return  # rows of names that are told as unknown may be those that lack
        for group in lines_of if listed is None else listed.names:
            lines = list(map(_line, lines_of.get(group, ())))
            count = len(lines)
            if rule.at_most and count > rule.at_most:
                faulty: list[int | None] = [*lines[rule.at_most :]]
            elif count < rule.at_least:
                faulty = [None if listed else lines[0]]
            else:
                continue
            found = rule.found.format(**{rule.per: group, "count": count})
            for line in faulty:
                column = rule.at or rule.per
                yield InputProblem(self.file, line, column, found, rule.allowed, rule.remedy)


def _line(index: object) -> int:
    return int(str(index))


def _quoted(name: str) -> str:
    return f"'{name}'"


def _shown(cell: object) -> str:
    return f"{cell:g}" if isinstance(cell, float) else str(cell)
