"""What every answer is: a sentence, tables with their units, and a page of both."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any

import pandas as pd

import spinepipe
from spinepipe.files import appearing
from spinepipe.schema import Table
from spinepipe.tables import from_rows

MOST_ROWS = 200
"""Of a table on a page of `Result.report`; more are told by their number."""


def frame(table: Table, rows: Sequence[Mapping[str, Any]]) -> pd.DataFrame:
    """Rows as the declared table, checked as a run checks its files; units in ``attrs``.

    Raises
    ------
    BadTable
        As `spinepipe.tables.from_rows` does.
    """
    return with_units(table, from_rows(table, rows).to_pandas())


def with_units(table: Table, found: pd.DataFrame) -> pd.DataFrame:
    """The frame with the unit of each column that has one, as ``attrs["units"]``."""
    found.attrs["units"] = {one.name: one.unit for one in table.columns if one.unit}
    return found


@dataclass(frozen=True, eq=False)
class Result:
    """An answer.

    Attributes
    ----------
    headline : the answer in one sentence.
    table : its numbers, one row each; units in ``table.attrs["units"]``.
    quality : how far they can be trusted: what ended how.
    """

    headline: str
    table: pd.DataFrame
    quality: pd.DataFrame

    def report(self, path: str | Path) -> None:
        """Write headline, numbers and quality as one HTML file."""
        parts = [f"<h1>{escape(self.headline)}</h1>"]
        for title, rows in (("Numbers", self.table), ("Quality", self.quality)):
            shown = rows.head(MOST_ROWS).to_html(index=False, na_rep="", border=0)
            more = len(rows) - MOST_ROWS
            note = f"<p>and {more} rows more</p>" if more > 0 else ""
            parts.append(f"<h2>{title}</h2>{shown}{note}")
        parts.append(f"<p>{escape(self.cite())}</p>")
        head = '<!doctype html><html lang="en"><meta charset="utf-8"><title>spinepipe</title>'
        with appearing(path) as temporary:
            temporary.write_text(f"{head}<body>{''.join(parts)}</body></html>\n", "utf-8")

    def cite(self) -> str:
        """What to cite for this answer."""
        return f"Computed with spinepipe {spinepipe.__version__}."

    def _repr_html_(self) -> str:
        return f"<p><b>{escape(self.headline)}</b></p>{self.table.head(10).to_html(index=False)}"
