"""The report of a study of tracked motions: its answer, figures, the spine in 3-D, and tables."""

from spinepipe.cohort import Cohort
from spinepipe.comparison import papers
from spinepipe.report.page.document import (
    Document,
    Headline,
    ResultTables,
    Sortable,
    page_tables,
)
from spinepipe.studies.tracking.findings import findings
from spinepipe.studies.tracking.headline import headline
from spinepipe.studies.tracking.in_space import spine_in_space
from spinepipe.studies.tracking.settings import Tracking
from spinepipe.studies.tracking.tables import (
    ACCURACY,
    AGAINST_WANG_2021,
    CLUSTERS,
    DRAWN,
    ERRORS,
    FITS,
    PROFILE_POINTS,
    PROFILES,
    RANGES,
    REMARKS,
    SHARING,
    SIMILARITY,
    SIZES,
    STIFFNESS,
    WEIGHTS,
)

QUESTION = (
    "How do the vertebrae of a moving person turn under the skin, as markers on it tell: which "
    "approach is nearest the truth, how do lumbar joints share a motion, and do markers tell how "
    "stiff a spine is?"
)

_TITLES = {
    ACCURACY: "Errors over all persons",
    FITS: "How every fit ended",
    PROFILES: "Whether markers tell stiffness",
    AGAINST_WANG_2021: "Beside Wang et al. 2021",
    SHARING: "How lumbar joints share a motion",
    SIMILARITY: "How alike persons share a motion",
    WEIGHTS: "What the weight of loads does",
    STIFFNESS: "Stiffness of every joint",
    PROFILE_POINTS: "What each ratio costs",
    REMARKS: "What to know of recordings",
    CLUSTERS: "How rigid clusters of markers are",
    SIZES: "How large persons are",
    RANGES: "How far every joint moves",
    ERRORS: "Errors of every person",
}
"""Tables of the page in their order, with their titles."""

READ = (*(table.name for table in _TITLES), DRAWN.name)
"""Tables whose rows the page needs; of the others it tells where they come from."""

_SORTED = {
    ACCURACY: (["measure", "trial", "mean"], True),
    FITS: (["status"], False),
    SHARING: (["trial", "approach", "window", "specimen"], True),
    CLUSTERS: (["variability_mm"], False),
}
"""By what rows of a table are sorted, and whether from the least; the others stay as they are.

Fits that did not settle stand first that way, as `converged` is the first of all words.
"""


def document(study: Tracking, cohort: Cohort, results: ResultTables) -> Document:
    """What the report says and shows."""
    found = headline(study, cohort, results)
    return Document(
        question=QUESTION,
        findings=findings(study, cohort, results),
        pictures=list(results.pictures.values()),
        tables=shown_tables(results),
        metadata=results.metadata,
        left_out=left_out(study, results),
        headline=Headline(_joined(found.words), _joined(found.how_sure), found.warnings),
        space=spine_in_space(results.table(DRAWN.name)),
    )


def _joined(words: str) -> str:
    """No line ends between a number and its percent sign."""
    return words.replace(" %", "\u00a0%")


def shown_tables(results: ResultTables) -> list[Sortable]:
    """Tables that the study has; those without rows are left out."""
    found: list[Sortable] = []
    for shape, title in _TITLES.items():
        rows = results.table(shape.name)
        if shape in _SORTED and len(rows):
            columns, rising = _SORTED[shape]
            rows = rows.sort_values(columns, ascending=rising, kind="stable")
        found += page_tables(shape, title, rows)
    return found


def left_out(study: Tracking, results: ResultTables) -> tuple[str, ...]:
    """What there is nothing of, each with the reason."""
    parts = []
    if results.table("errors").empty:
        parts.append("errors (where vertebrae truly were is not known)")
    if results.table("stiffness").empty:
        parts.append("calibrated stiffness (no approach asks for it)")
    return (*parts, *papers.left_out("Wang et al. 2021"))
