"""Writing the table ``against_<paper>`` of a study."""

from collections.abc import Mapping
from typing import Any

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.comparison.papers import compare, digest
from spinepipe.jobs.digest import provenance
from spinepipe.studies.study import Study
from spinepipe.tables import from_rows, write
from spinepipe.tables.shared import against_paper


def write_against(
    paper: str,
    tables: Mapping[str, pd.DataFrame],
    asked: Mapping[str, Any],
    study: Study,
    cohort: Cohort,
    output: str,
) -> None:
    """Write it; what needs an absent table is told as not computed."""
    name = f"against_{paper}"
    rows = compare(paper, tables, asked)
    origin = provenance(name, study, cohort, others=[digest(paper)])
    write(from_rows(against_paper(name), rows), output, origin)
