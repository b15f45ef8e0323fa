"""Digests of parts of a cohort, so that a job hangs on the specimens that it reads."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import pandas as pd

EVERYONE = "*"
"""In the table of loads: the row is for every specimen."""


class PartDigests:
    """Digest of each specimen's rows in the tables of a cohort, taken when first asked for."""

    def __init__(self, shared: Any, tables: Mapping[str, pd.DataFrame | None]) -> None:
        """``shared`` : what counts for every specimen, plain values."""
        self._shared = json.dumps(shared, sort_keys=True)
        self._tables = {name: table for name, table in tables.items() if table is not None}

    def of(self, specimens: Sequence[str]) -> str:
        """sha256 over what all specimens share and the rows of these."""
        digest = hashlib.sha256(self._shared.encode())
        for specimen in specimens:
            digest.update(f"\n{specimen}".encode())
            for name in self._tables:
                digest.update(f"\n{name}".encode())
                for group in (specimen, EVERYONE):
                    digest.update(self._rows[name].get(group, b""))
        return digest.hexdigest()

    @cached_property
    def _rows(self) -> dict[str, dict[str, bytes]]:
        """Digest of the rows of each specimen in each table, in the order of the file."""
        return {name: _by_specimen(table) for name, table in self._tables.items()}


def _by_specimen(table: pd.DataFrame) -> dict[str, bytes]:
    columns = json.dumps(list(map(str, table.columns))).encode()
    return {
        str(specimen): hashlib.sha256(columns + rows.to_csv(index=False).encode()).digest()
        for specimen, rows in table.groupby("specimen", sort=False)
    }
