"""Job: what the study says to the findings of Gould et al. 2024b, each with its number."""

from collections.abc import Iterator, Mapping

import pandas as pd

from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.studies.cohort_stiffness.claims import Row
from spinepipe.studies.cohort_stiffness.claims_of_errors import error_findings, error_spreads
from spinepipe.studies.cohort_stiffness.claims_of_stiffness import (
    load_case_findings,
    stiffness_spreads,
)
from spinepipe.studies.cohort_stiffness.claims_together import together
from spinepipe.studies.cohort_stiffness.settings import CohortStiffness
from spinepipe.studies.cohort_stiffness.tables import FINDINGS
from spinepipe.tables import from_rows, read_frames, write


def run(root: str, study: str, tables: list[str], output: str) -> None:
    """Write ``findings.parquet``."""
    settings, cohort = study_of_kind(CohortStiffness, root, study)
    rows = list(finding_rows(read_frames(tables), settings.significance))
    origin = provenance("findings", settings, cohort)
    write(from_rows(FINDINGS, rows), output, origin)


def finding_rows(frames: Mapping[str, pd.DataFrame], significance: float) -> Iterator[Row]:
    """Rows of the table ``findings``.

    Parameters
    ----------
    frames : tables ``stiffness``, ``errors``, ``statistics``, and ``pooling`` where there is one.
    significance : p below which a test decides.
    """
    stiffness, errors, statistics = (frames[n] for n in ("stiffness", "errors", "statistics"))
    by_themselves = (
        *error_findings(errors, significance),
        *load_case_findings(stiffness, errors, statistics, significance),
        *stiffness_spreads(stiffness, frames.get("pooling"), significance),
        *error_spreads(statistics, significance),
    )
    yield from together(by_themselves, stiffness["specimen"].nunique(), significance)
