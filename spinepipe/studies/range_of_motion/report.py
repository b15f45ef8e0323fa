"""Job: the report of a range-of-motion study, one HTML file."""

from spinepipe.jobs.digest import digest_of
from spinepipe.jobs.draw import results_of
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.marks import write_marked
from spinepipe.studies.range_of_motion.page import READ, range_of_motion_page
from spinepipe.studies.range_of_motion.settings import RangeOfMotion


def run(
    root: str, study: str, tables: list[str], figures: list[str], captions: list[str], output: str
) -> None:
    """Write the page from the files of all tables, pictures (SVG) and captions."""
    settings, cohort = study_of_kind(RangeOfMotion, root, study)
    results = results_of(READ, tables, figures, captions)
    page = range_of_motion_page(settings, cohort, results)
    write_marked(page, output, digest_of("range_of_motion.report", settings, cohort))
