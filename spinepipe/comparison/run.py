"""The tables of one run, as the comparison looks them up."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import pandas as pd


class NotComputed(Exception):
    """A run lacks what a comparison needs; the message says what."""


@dataclass(frozen=True)
class Run:
    """Tables by name, and the rule of the study by which a fit has failed, where it has one.

    Of a paper of one specimen these are the rows of that specimen.
    """

    tables: Mapping[str, pd.DataFrame]
    failed_when: Literal["all", "any"] = "all"

    def rows(self, table: str, **where: Any) -> pd.DataFrame:
        """Rows whose columns have the given values, at least one.

        Raises
        ------
        NotComputed
            Where the run has no such table or no such row.
        """
        if table not in self.tables:
            raise NotComputed(f"this run made no table {table}")
        frame = self.tables[table]
        chosen = np.ones(len(frame), dtype=bool)
        for column, value in where.items():
            chosen &= frame[column].to_numpy() == value
        if not chosen.any():
            sought = ", ".join(f"{column} {value}" for column, value in where.items())
            raise NotComputed(f"this run's table {table} has no row of {sought or 'any kind'}")
        return frame[chosen]

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
