"""Job: the report of a cohort study, one HTML file."""

from dataclasses import replace

from spinepipe.jobs.digest import digest_of
from spinepipe.jobs.draw import results_of
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.marks import write_marked
from spinepipe.report.page.document import Results
from spinepipe.studies.cohort_stiffness.page import READ, cohort_page
from spinepipe.studies.cohort_stiffness.problem import NOT_HELD_OUT
from spinepipe.studies.cohort_stiffness.settings import CohortStiffness

HELD_OUT = "held_out_error"


def run(
    root: str, study: str, tables: list[str], figures: list[str], captions: list[str], output: str
) -> None:
    """Write the page from the files of all tables, pictures (SVG) and captions."""
    settings, cohort = study_of_kind(CohortStiffness, root, study)
    results = results_of(READ, tables, figures, captions)
    page = cohort_page(settings, cohort, _with_base(settings, results))
    write_marked(page, output, digest_of("cohort_stiffness.report", settings, cohort))


def _with_base(study: CohortStiffness, results: Results) -> Results:
    """Beneath held-out errors, what of a base model was not held out."""
    caption = results.captions.get(HELD_OUT)
    if study.base is None or caption is None:
        return results
    told = f"{caption} {NOT_HELD_OUT.format(file=study.base.model)}"
    return replace(results, captions={**results.captions, HELD_OUT: told})
