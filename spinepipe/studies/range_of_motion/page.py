"""The page of a study of range of motion."""

from spinepipe.cohort import Cohort
from spinepipe.report.conclusions import sentences_of
from spinepipe.report.page.study_page import Page, ResultTables
from spinepipe.report.page.tables import page_tables
from spinepipe.report.viewer.specimens import specimen_scenes
from spinepipe.studies.range_of_motion.conclusions import conclusions, whole
from spinepipe.studies.range_of_motion.settings import RangeOfMotion
from spinepipe.studies.range_of_motion.tables import ROM_SUMMARY, ROM_VARIANCE, STIFFNESS_SETS

READ = ("rom_summary", "rom_variance", "stiffness_sets")
"""Tables whose rows the page needs; of the others it tells where they come from."""


def page(study: RangeOfMotion, cohort: Cohort, results: ResultTables) -> Page:
    """What the page says and shows; rows of the cohort, those of each specimen are in the file."""
    summary, variance = (whole(cohort, results.table(name)) for name in READ[:2])
    return Page(
        conclusions=list(conclusions(study, cohort, results)),
        sentences=sentences_of(__package__),
        key_figure="range_of_motion",
        tables=[
            *page_tables(ROM_SUMMARY, "Range of motion", summary),
            *page_tables(ROM_VARIANCE, "Shares of variance", variance),
            *page_tables(STIFFNESS_SETS, "Stiffness sets", results.table("stiffness_sets")),
        ],
        scenes=specimen_scenes(cohort, with_loads=study.virtual_tests is None),
    )
