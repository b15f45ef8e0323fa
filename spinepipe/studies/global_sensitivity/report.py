"""Job: the report of a global sensitivity study, one HTML file."""

from spinepipe.jobs.digest import digest_of
from spinepipe.jobs.draw import results_of
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.marks import write_marked
from spinepipe.studies.global_sensitivity.page import READ, sensitivity_page
from spinepipe.studies.global_sensitivity.settings import GlobalSensitivity


def run(
    root: str, study: str, tables: list[str], figures: list[str], captions: list[str], output: str
) -> None:
    """Write the page from the files of all tables, pictures (SVG) and captions."""
    settings, cohort = study_of_kind(GlobalSensitivity, root, study)
    results = results_of(READ, tables, figures, captions)
    page = sensitivity_page(settings, cohort, results)
    write_marked(page, output, digest_of("global_sensitivity.report", settings, cohort))
