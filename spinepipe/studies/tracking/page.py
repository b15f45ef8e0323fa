"""The page of a study of tracked motions."""

from spinepipe.cohort import Cohort
from spinepipe.comparison import papers
from spinepipe.report.conclusions import sentences_of
from spinepipe.report.page.study_page import Page, ResultTables
from spinepipe.report.page.tables import Sortable, page_tables
from spinepipe.studies.tracking import tables as shapes
from spinepipe.studies.tracking.conclusions import conclusions, window_rows
from spinepipe.studies.tracking.conclusions_of_moments import conclusions_of_moments
from spinepipe.studies.tracking.scenes import tracking_scenes
from spinepipe.studies.tracking.settings import Tracking

READ = (
    *("accuracy", "against_wang_2021", "clusters", "drawn", "errors", "fits", "profile_points"),
    *("joint_moments", "moment_agreement"),
    *("profiles", "ranges", "remarks", "sharing", "similarity", "sizes", "stiffness", "weights"),
)
"""Tables whose rows the page needs; of the others it tells where they come from."""

_SHOWN = (
    (shapes.ACCURACY, "Errors over all subjects"),
    (shapes.FITS, "How every fit ended"),
    (shapes.PROFILES, "Whether markers tell stiffness"),
    (shapes.SIMILARITY, "How alike subjects share a motion"),
    (shapes.WEIGHTS, "What the weight of loads does"),
    (shapes.SIZES, "How large subjects are"),
    (shapes.CLUSTERS, "How rigid clusters of markers are"),
    (shapes.REMARKS, "What to know of recordings"),
)

_IN_THE_FILE = {
    *("iterations", "unknowns", "markers_cost", "loads_cost", "cpu_s", "frames", "frames_used"),
    *("open_below", "open_above", "window", "largest_mm", "first_marker", "second_marker"),
    *("variability_percent",),
}
"""Columns that nobody compares on a page."""


def page(study: Tracking, cohort: Cohort, results: ResultTables) -> Page:
    """What the page says and shows."""
    if study.marker_set != "own":
        beside = results.table("moment_agreement")
        title = "How moments agree with measured ones"
        return Page(
            conclusions=list(conclusions_of_moments(study, results.tables)),
            sentences=sentences_of(__package__),
            key_figure="moments",
            tables=page_tables(shapes.MOMENT_AGREEMENT, title, beside) if len(beside) else [],
            left_out=() if len(beside) else ("agreement (no moment was measured)",),
        )
    parts = []
    if results.table("errors").empty:
        parts.append("errors (where vertebrae truly were is not known)")
    if results.table("stiffness").empty:
        parts.append("calibrated stiffness (no approach asks for it)")
    return Page(
        conclusions=list(conclusions(study, cohort, results)),
        sentences=sentences_of(__package__),
        key_figure="approach_errors",
        tables=shown_tables(results),
        left_out=(*parts, *papers.left_out("Wang et al. 2021")),
        scenes=tracking_scenes(results.table("drawn")),
        chooser="Motion",
    )


def shown_tables(results: ResultTables) -> list[Sortable]:
    """Tables that the study has, with the columns that a reader compares."""
    found: list[Sortable] = []
    for shape, title in _SHOWN:
        rows = results.table(shape.name)
        rows = window_rows(rows) if "window" in rows else rows
        rows = rows.drop(columns=list(_IN_THE_FILE & set(rows)))
        if shape is shapes.ACCURACY and len(rows):
            rows = rows.sort_values(["measure", "trial", "mean"], kind="stable")
        found += page_tables(shape, title, rows)
    return found
