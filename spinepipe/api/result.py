"""What every answer is: a sentence, tables with their units, a figure, and a page of all three."""

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from importlib import import_module
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib.pyplot as plt
import pandas as pd

import spinepipe
from spinepipe.citing.cite import methods
from spinepipe.cohort import Cohort
from spinepipe.files import appearing
from spinepipe.report.conclusions import Told, sentences_of, told
from spinepipe.report.page.study_page import ResultTables
from spinepipe.schema import Table
from spinepipe.studies.registry import PACKAGE
from spinepipe.studies.study import Study
from spinepipe.tables import StudyTables, from_rows
from spinepipe.tidy.tables import quality

MOST_ROWS = 200
"""Of a table on a page of `Result.report`; more are told by their number."""

SHOWN_ROWS = 8
"""Of a table in a notebook."""


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


def concluded(
    study: Study,
    cohort: Cohort,
    frames: Mapping[str, pd.DataFrame],
    files: Mapping[str, str] | None = None,
) -> list[Told]:
    """What the page of a study would conclude of these tables, in its words."""
    package = f"{PACKAGE}.{study.kind}"
    rules = import_module(f"{package}.conclusions").conclusions
    results = ResultTables(StudyTables(frames, files))
    return told(rules(study, cohort, results), sentences_of(package))


class Shown:
    """What an answer shows that has a table and the conclusions of a page.

    Attributes
    ----------
    table : its numbers, one row each; units in ``table.attrs["units"]``.
    conclusions : what the page of such a study says.
    """

    made_by = spinepipe.__version__
    if TYPE_CHECKING:  # a dataclass would take a property for the default of its field

        @property
        def table(self) -> pd.DataFrame: ...

        @property
        def conclusions(self) -> Sequence[Told]: ...

    @property
    def headline(self) -> str:
        """The answer in one sentence."""
        return next(one.text for one in self.conclusions if one.place == "answer")

    @property
    def quality(self) -> pd.DataFrame:
        """How far to trust it: ``light`` (ok, check, stop), ``check``, ``finding``; worst first."""
        return quality(self.conclusions)

    def plot(self, ax: Any = None) -> Any:
        """The key figure, as `matplotlib.axes.Axes`: ``ax``, or new ones."""
        raise NotImplementedError

    def cite(self) -> str:
        """What was done, and by what, to be copied."""
        return methods(self.conclusions, self.made_by)

    def report(self, path: str | Path) -> None:
        """Write headline, figure, numbers and quality as one HTML file."""
        parts = [f"<h1>{escape(self.headline)}</h1>{self._figure()}"]
        for title, rows in (("Numbers", self.table), ("Quality", self.quality)):
            shown = rows.head(MOST_ROWS).to_html(index=False, na_rep="", border=0)
            more = len(rows) - MOST_ROWS
            note = f"<p>and {more} rows more</p>" if more > 0 else ""
            parts.append(f"<h2>{title}</h2>{shown}{note}")
        parts.append(f"<p>{escape(self.cite())}</p>")
        head = '<!doctype html><html lang="en"><meta charset="utf-8"><title>spinepipe</title>'
        with appearing(path) as temporary:
            temporary.write_text(f"{head}<body>{''.join(parts)}</body></html>\n", "utf-8")

    def _figure(self) -> str:
        """The key figure as part of a page."""
        figure, ax = plt.subplots(figsize=(6, 3.5), layout="constrained")
        self.plot(ax)
        file = BytesIO()
        figure.savefig(file, format="png", dpi=80)
        plt.close(figure)
        data = base64.b64encode(file.getvalue()).decode()
        return f'<img alt="{escape(self.headline)}" src="data:image/png;base64,{data}">'

    def __repr__(self) -> str:
        return self.headline

    def _repr_html_(self) -> str:
        counts = self.quality["light"].value_counts(sort=False).items()
        trust = ", ".join(f"{n} {light}" for light, n in counts)
        rows = self.table.head(SHOWN_ROWS).to_html(index=False, na_rep="", border=0)
        return f"<p><b>{escape(self.headline)}</b></p><p>Quality: {trust}</p>{self._figure()}{rows}"


@dataclass(frozen=True, eq=False, repr=False)
class Result(Shown):
    """An answer that was computed here; see `Shown`."""

    table: pd.DataFrame
    conclusions: Sequence[Told]
