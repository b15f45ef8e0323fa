"""Job: the report of a study, one HTML file."""

from spinepipe.jobs.digest import digest_of
from spinepipe.jobs.draw import results_of
from spinepipe.jobs.inputs import study_and_cohort
from spinepipe.marks import write_marked
from spinepipe.studies.joint_pose_sensitivity.page import READ, study_page


def run(
    root: str, study: str, tables: list[str], figures: list[str], captions: list[str], output: str
) -> None:
    """Write the page from the files of all tables, pictures (SVG) and captions."""
    settings, cohort = study_and_cohort(root, study)
    page = study_page(settings, cohort, results_of(READ, tables, figures, captions))
    write_marked(page, output, digest_of("report", settings, cohort))
