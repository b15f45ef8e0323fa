"""Job: the report of a cohort study, one HTML file."""

from pathlib import Path

from spinepipe.files import appearing
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.jobs.page_inputs import results_of
from spinepipe.report.cohort.page import READ, cohort_page
from spinepipe.studies import CohortStiffness


def run(
    root: str, study: str, tables: list[str], figures: list[str], captions: list[str], output: str
) -> None:
    """Write the page from the files of all tables, pictures (SVG) and captions."""
    settings, cohort = study_of_kind(CohortStiffness, root, study)
    page = cohort_page(settings, cohort, results_of(READ, tables, figures, captions))
    with appearing(Path(output)) as temporary:
        temporary.write_text(page, encoding="utf-8")
