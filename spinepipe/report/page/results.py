"""What a report is made of."""

from collections.abc import Mapping
from dataclasses import dataclass

import pandas as pd


@dataclass(frozen=True, eq=False)
class Results:
    """Results of one study, each by its name.

    Attributes
    ----------
    tables : rows of each table that the study has.
    metadata : what each table's file says of where it comes from.
    pictures : each figure as SVG text, in the order of the report.
    captions : the words below each figure.
    """

    tables: Mapping[str, pd.DataFrame]
    metadata: Mapping[str, Mapping[str, str]]
    pictures: Mapping[str, str]
    captions: Mapping[str, str]

    def table(self, name: str) -> pd.DataFrame:
        """Rows of a table, none where the study does not have it."""
        return self.tables.get(name, pd.DataFrame())
