"""Job: the report of a search for missing effects, one HTML file."""

from spinepipe.jobs.digest import digest_of
from spinepipe.jobs.draw import results_of
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.marks import write_marked
from spinepipe.studies.discrepancy.page import READ, discrepancy_page
from spinepipe.studies.discrepancy.settings import Discrepancy
from spinepipe.studies.discrepancy.verdict import read_verdict


def run(
    root: str,
    study: str,
    tables: list[str],
    figures: list[str],
    captions: list[str],
    verdict: str,
    output: str,
) -> None:
    """Write the page from the files of all tables, pictures (SVG), captions and the verdict."""
    settings, cohort = study_of_kind(Discrepancy, root, study)
    results = results_of(READ, tables, figures, captions)
    page = discrepancy_page(settings, cohort, results, read_verdict(verdict))
    write_marked(page, output, digest_of("discrepancy.report", settings, cohort))
