"""The report of a study of scoliotic spines: its answer, figures and tables."""

from spinepipe.cohort import Cohort
from spinepipe.comparison import papers
from spinepipe.report.page.document import Document, Headline, ResultTables
from spinepipe.report.page.tables import Sortable, page_tables
from spinepipe.studies.scoliosis.films import HELD_OUT
from spinepipe.studies.scoliosis.findings import findings
from spinepipe.studies.scoliosis.headline import headline
from spinepipe.studies.scoliosis.settings import MODELS, Scoliosis
from spinepipe.studies.scoliosis.tables import (
    ACCURACY,
    AGAINST_JALALIAN_2017,
    BY_RANGE,
    CURVES,
    DISPLACEMENTS,
    JALALIAN_2017_COHORTS,
    LAWS,
    POPULATION,
    POSITIONS,
    STATISTICS,
    VARIATION,
)

QUESTION = (
    "Which model of a scoliotic spine, personalised on two bending films, reproduces positions "
    "that it has not seen, by how much, and what do the films not tell?"
)

_TITLES = {
    ACCURACY: "Errors of every model",
    STATISTICS: "Do models differ over patients?",
    BY_RANGE: "Errors by size of the rotation",
    VARIATION: "Enlargement and scale",
    AGAINST_JALALIAN_2017: "Beside Jalalian et al. 2017",
    LAWS: "Stiffness of every segment",
    POPULATION: "What patients have in common",
    POSITIONS: "Every patient on every film",
    CURVES: "Cobb and Ferguson angles",
}
"""Tables of the page in their order, with their titles."""

READ = (*(table.name for table in _TITLES), DISPLACEMENTS.name)
"""Tables whose rows the page needs; of the others it tells where they come from."""


def document(study: Scoliosis, cohort: Cohort, results: ResultTables) -> Document:
    """What the report says and shows."""
    found = headline(results)
    return Document(
        question=QUESTION,
        findings=findings(study, results),
        pictures=list(results.pictures.values()),
        tables=shown_tables(results),
        metadata=results.metadata,
        left_out=(
            *left_out(study, cohort),
            *papers.left_out("Jalalian et al. 2017", cohort.name in JALALIAN_2017_COHORTS),
        ),
        headline=Headline(_joined(found.words), _joined(found.how_sure), found.warnings),
    )


def _joined(words: str) -> str:
    """No line ends between a number and its percent sign."""
    return words.replace(" %", "\u00a0%")


def shown_tables(results: ResultTables) -> list[Sortable]:
    """Tables that the study has; those without rows are left out."""
    return [
        table
        for shape, title in _TITLES.items()
        for table in page_tables(shape, title, results.table(shape.name))
    ]


def left_out(study: Scoliosis, cohort: Cohort) -> tuple[str, ...]:
    """Parts that the settings or the films leave out, each with the reason."""
    films = cohort.further["films"]
    parts = [f"{name} (models)" for name in MODELS if name not in study.models]
    for position in HELD_OUT:
        have = films.loc[films["position"] == position, "specimen"].nunique()
        if have < len(cohort.specimen_names):
            who = "nobody has" if not have else f"{have} of {len(cohort.specimen_names)} have"
            parts.append(f"position {position} ({who} a film of it)")
    return tuple(parts)
