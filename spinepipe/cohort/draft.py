"""A cohort while it is being checked: what could be read of it, wildcards of loads written out."""

from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from math import isnan
from typing import Any

import pandas as pd

from spinepipe.cohort.cohort import joint_names
from spinepipe.cohort.columns import COHORT_YAML, TABLES
from spinepipe.documents.form import TableForm
from spinepipe.documents.rules import Listed


@dataclass(frozen=True)
class Draft:
    """What is known of a cohort before it is known to be sound.

    Attributes
    ----------
    name : the folder's name.
    vertebrae : caudal to cranial; empty when ``cohort.yaml`` does not say.
    gravity : None when ``cohort.yaml`` does not say.
    tables : tables by stem, indexed by line number; cells that are bad are NaN.
    absent : stems of the files that do not exist. A stem neither here nor in ``tables`` belongs to
        a file that could not be read, about which nothing more is said.
    forms : of all files that are read, by stem.
    """

    name: str
    vertebrae: tuple[str, ...]
    gravity: bool | None
    tables: dict[str, pd.DataFrame]
    absent: frozenset[str]
    forms: Mapping[str, TableForm] = field(default_factory=lambda: TABLES)

    @cached_property
    def specimens(self) -> tuple[str, ...]:
        """Specimens of ``specimens.csv`` in its order; empty when it cannot be read."""
        table = self.tables.get("specimens")
        return () if table is None else tuple(dict.fromkeys(table["specimen"].dropna()))

    @cached_property
    def applied(self) -> tuple["LoadRow", ...]:
        """Every load on every specimen in every cycle, as `applied_loads` gives them."""
        return tuple(applied_loads(self))

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Joints, caudal to cranial."""
        return joint_names(self.vertebrae)

    def known(self, reference: str) -> Listed | None:
        """Names that a column refers to, see `spinepipe.documents.rules`."""
        if reference in ("vertebrae", "joints"):
            chain = self.vertebrae if reference == "vertebrae" else self.joint_names
            turned = zip(joint_names(self.vertebrae[::-1]), self.joint_names[::-1], strict=True)
            instead = {a: f"a joint is named upper vertebra first: '{b}'" for a, b in turned}
            return Listed(chain, f"vertebrae in {COHORT_YAML}", instead) if chain else None
        stem, _, column = reference.partition(".")
        if stem not in self.tables and (stem not in self.absent or stem == "specimens"):
            return None  # a file that cannot be read, or that every cohort has
        names = self.tables[stem][column].dropna().unique().tolist() if stem in self.tables else []
        return Listed(names, f"{stem}.csv")

    def file(self, stem: str) -> str:
        """Name of a table's file in messages."""
        return f"{self.name}/{self.forms[stem].file}"

    def rows(self, stem: str, *columns: str) -> Iterator[tuple[int, tuple[Any, ...]]]:
        """Line number and cells of the named columns, row by row; nothing for an absent table."""
        table = self.tables.get(stem)
        if table is not None:
            cells = (table[column].tolist() for column in columns)
            yield from zip(table.index.tolist(), zip(*cells, strict=True), strict=True)


@dataclass(frozen=True)
class LoadRow:
    """One row of ``loads.csv`` as it acts on one specimen in one cycle.

    Attributes
    ----------
    line : its line in ``loads.csv``.
    step : None when the cell is bad.
    """

    line: int
    specimen: str
    test: str
    cycle: int
    step: int | None
    vertebra: str


def applied_loads(draft: Draft) -> Iterator[LoadRow]:
    """Every load on every specimen in every cycle; rows without a name are left out."""
    cycles = _known_cycles(draft)
    everyone = draft.specimens or ("*",)
    keys = ("specimen", "test", "cycle", "step", "vertebra")
    for line, (specimen, test, cycle, step, vertebra) in draft.rows("loads", *keys):
        if not all(isinstance(name, str) for name in (specimen, test, vertebra)):
            continue
        known_step = None if isnan(step) else int(step)
        for name in everyone if specimen == "*" else (specimen,):
            for number in cycles[test] if isnan(cycle) else (int(cycle),):
                yield LoadRow(line, name, test, number, known_step, vertebra)


def number_of_applied_loads(draft: Draft) -> int:
    """How many `applied_loads` gives, at most."""
    cycles = _known_cycles(draft)
    everyone = max(len(draft.specimens), 1)
    return sum(
        (everyone if specimen == "*" else 1) * (len(cycles[test]) if isnan(cycle) else 1)
        for _, (specimen, test, cycle) in draft.rows("loads", "specimen", "test", "cycle")
    )


def _known_cycles(draft: Draft) -> dict[str, tuple[int, ...]]:
    """Cycles of each test that either file numbers; 1 when none does."""
    cycles: dict[str, set[int]] = defaultdict(set)
    for stem in ("loads", "motion"):
        for _, (test, cycle) in draft.rows(stem, "test", "cycle"):
            numbers = cycles[test]
            if not isnan(cycle):
                numbers.add(int(cycle))
    return {test: tuple(sorted(numbers)) or (1,) for test, numbers in cycles.items()}
