"""A cohort while it is being checked: whatever could be read of it."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import pandas as pd

from spinepipe.cohort.cohort import joint_names
from spinepipe.cohort.columns import TABLES

__all__ = ["Draft"]


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
    """

    name: str
    vertebrae: tuple[str, ...]
    gravity: bool | None
    tables: dict[str, pd.DataFrame]
    absent: frozenset[str]

    @property
    def specimens(self) -> tuple[str, ...]:
        """Specimens of ``specimens.csv`` in its order; empty when it cannot be read."""
        table = self.tables.get("specimens")
        return () if table is None else tuple(dict.fromkeys(table["specimen"].dropna()))

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Joints, caudal to cranial."""
        return joint_names(self.vertebrae)

    def file(self, stem: str) -> str:
        """Name of a table's file in messages."""
        return f"{self.name}/{TABLES[stem].file}"

    def rows(self, stem: str, *columns: str) -> Iterator[tuple[int, tuple[Any, ...]]]:
        """Line number and cells of the named columns, row by row; nothing for an absent table."""
        table = self.tables.get(stem)
        if table is not None:
            cells = (table[column].tolist() for column in columns)
            yield from zip(table.index.tolist(), zip(*cells, strict=True), strict=True)
