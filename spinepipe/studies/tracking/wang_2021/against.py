"""Job: the numbers of Wang et al. 2021 beside those of a run.

doi 10.1007/s10439-021-02774-3.
"""

from typing import Any

from spinepipe.comparison.claim import Run, judged
from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.studies.tracking.settings import Tracking
from spinepipe.studies.tracking.tables_of_studies import AGAINST_WANG_2021
from spinepipe.studies.tracking.wang_2021.errors_by_approach import claims_of_errors
from spinepipe.studies.tracking.wang_2021.found import COHORT
from spinepipe.studies.tracking.wang_2021.motions import claims_of_motions
from spinepipe.studies.tracking.wang_2021.own_numbers import claims_of_own_numbers
from spinepipe.studies.tracking.wang_2021.set_up import claims_of_set_up
from spinepipe.studies.tracking.wang_2021.stiffness import claims_of_stiffness, generic_rows
from spinepipe.tables import from_rows, read_frames, write

CLAIMS = (
    *claims_of_errors(),
    *claims_of_motions(),
    *claims_of_stiffness(),
    *claims_of_set_up(),
    *claims_of_own_numbers(),
)
"""All claims of the paper: what a run found first, what it says of itself last."""


def run(root: str, study: str, tables: list[str], output: str) -> None:
    """Write ``against_wang_2021.parquet``; what needs an absent table is not computed."""
    settings, cohort = study_of_kind(Tracking, root, study)
    facts = {name: cohort.further[name] for name in COHORT if name in cohort.further}
    facts["generic"] = generic_rows(cohort)
    rows = judged(CLAIMS, Run({**read_frames(tables), **facts}, asked_of(settings)))
    origin = provenance("against_wang_2021", settings, cohort)
    write(from_rows(AGAINST_WANG_2021, rows), output, origin)


def asked_of(settings: Tracking) -> dict[str, Any]:
    """Settings that the paper has numbers for."""
    percent = settings.bounds.increased_by_percent
    added = settings.bounds.means == "added"
    return {
        "rom_bound_increase": percent,
        "times_the_range": percent / 100.0 + (1.0 if added else 0.0),
        "max_marker_deviation": settings.largest_deviation_mm,
        "intervals": settings.intervals,
    }
