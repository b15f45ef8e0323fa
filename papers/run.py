"""What a run found, as selectors read it, and what they make of it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd


class NotComputed(Exception):
    """A run lacks what a comparison needs; the message says what."""


@dataclass(frozen=True)
class Computed:
    """Our value, the ends of our range where there is one, and what a reader must know."""

    value: float
    low: float | None = None
    high: float | None = None
    note: str = ""


@dataclass(frozen=True)
class StudyRun:
    """What a run found.

    Attributes
    ----------
    tables : by name; of a paper of one specimen the rows of that specimen.
    asked : settings of the study that claims look at, by name.
    """

    tables: Mapping[str, pd.DataFrame]
    asked: Mapping[str, Any] = field(default_factory=dict)
    _chosen: dict[Any, pd.DataFrame] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )

    def rows(self, table: str, **where: Any) -> pd.DataFrame:
        """Rows whose columns have a given value, or one of several; at least one row.

        Raises
        ------
        NotComputed
            Where the run has no such table or no such row.
        """
        if table not in self.tables:
            raise NotComputed(f"this run made no table {table}")
        key = table, *where.items()
        if key in self._chosen:
            return self._chosen[key]
        frame = self.tables[table]
        chosen = np.ones(len(frame), dtype=bool)
        for column, value in where.items():
            several = isinstance(value, tuple)
            chosen &= frame[column].isin(value) if several else frame[column].to_numpy() == value
        if not chosen.any():
            sought = ", ".join(f"{column} {value}" for column, value in where.items())
            raise NotComputed(f"this run's table {table} has no row of {sought or 'any kind'}")
        self._chosen[key] = frame[chosen]
        return self._chosen[key]

    def row(self, table: str, **where: Any) -> "pd.Series[Any]":
        """The first such row."""
        return self.rows(table, **where).iloc[0]

    def number(self, table: str, column: str, **where: Any) -> float:
        """One cell that is not empty."""
        row = self.row(table, **where)
        if pd.isna(row[column]):
            told = str(row.get("message") or "nothing is in this dataset")
            raise NotComputed(f"{column} is empty in {table}: {told}")
        return float(row[column])
