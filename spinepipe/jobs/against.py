"""Writing the table ``against_<paper>`` of a study."""

from collections.abc import Mapping
from typing import Any

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.comparison.papers import compare, digest
from spinepipe.jobs.digest import provenance
from spinepipe.schema import Table
from spinepipe.studies.study import Study
from spinepipe.tables import from_rows, write


def write_against(
    table: Table,
    tables: Mapping[str, pd.DataFrame],
    asked: Mapping[str, Any],
    study: Study,
    cohort: Cohort,
    output: str,
) -> None:
    """Write it; what needs an absent table is told as not computed."""
    paper = table.name.removeprefix("against_")
    rows = compare(paper, tables, asked)
    origin = provenance(table.name, study, cohort, others=[digest(paper)])
    write(from_rows(table, rows), output, origin)
