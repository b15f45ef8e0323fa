"""The page of a study of scoliotic spines."""

from spinepipe.cohort import Cohort
from spinepipe.comparison import papers
from spinepipe.report.conclusions import sentences_of
from spinepipe.report.page.study_page import Page, ResultTables
from spinepipe.report.page.tables import Sortable, page_tables
from spinepipe.report.words import plain
from spinepipe.studies.scoliosis.charts import SHORT
from spinepipe.studies.scoliosis.conclusions import PUBLISHED, conclusions
from spinepipe.studies.scoliosis.films import HELD_OUT
from spinepipe.studies.scoliosis.settings import MODELS, Scoliosis
from spinepipe.studies.scoliosis.tables import (
    ABSOLUTE_STIFFNESS,
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
    VARIANTS,
    VARIATION,
)

_SHOWN = {
    ACCURACY: (
        "Errors of every law",
        "films measure model n_patients mean_of_patients sd_of_patients reading_noise unit "
        "free_parameters decided_parameters",
    ),
    STATISTICS: ("Corrected tests of pairs of laws", "family response factor n effect p_holm"),
    BY_RANGE: ("Errors by size of the rotation", "films opposite range model n rmse_deg"),
    VARIATION: (
        "Enlargement and size of stiffness",
        "varied value films n_patients rotation_rmse_deg place_rmse_mm moved_deg",
    ),
    POPULATION: ("What spines have in common", "quantity joint unit mean low high"),
}
"""Tables of the page with their titles and the columns that a reader compares.

None has a row for a person: those of single spines are in files.
"""

_READ = (
    *_SHOWN,
    ABSOLUTE_STIFFNESS,
    LAWS,
    POSITIONS,
    DISPLACEMENTS,
    CURVES,
    VARIANTS,
    AGAINST_JALALIAN_2017,
)
READ = tuple(table.name for table in _READ)
"""Tables whose rows the page needs; of the others it tells where they come from."""

_WORDS = {**SHORT, "held_out": "left-out", "beyond": "beyond the end"}


def page(study: Scoliosis, cohort: Cohort, results: ResultTables) -> Page:
    """What the page says and shows."""
    return Page(
        conclusions=list(conclusions(study, cohort, results)),
        sentences=sentences_of(__package__),
        key_figure="fitted_and_held_out",
        tables=shown_tables(results),
        left_out=(
            *left_out(study, cohort, results),
            *papers.left_out("Jalalian et al. 2017", cohort.name in JALALIAN_2017_COHORTS),
        ),
    )


def shown_tables(results: ResultTables) -> list[Sortable]:
    """Tables that the study has, with names of laws and films in words."""
    found: list[Sortable] = []
    for shape, (title, names) in _SHOWN.items():
        told = results.table(shape.name).apply(lambda cells: cells.map(_in_words))
        found += page_tables(shape, title, told, names)
    return found


def _in_words(cell: object) -> object:
    if not isinstance(cell, str):
        return cell
    return " ".join(plain(_WORDS.get(part, part)) for part in cell.split("/"))


def left_out(study: Scoliosis, cohort: Cohort, results: ResultTables) -> tuple[str, ...]:
    """Parts that the settings or the films leave out, each with the reason."""
    films = cohort.further["films"]
    parts = [f"{SHORT[name]} (models)" for name in MODELS if name not in study.models]
    for position in HELD_OUT:
        have = films.loc[films["position"] == position, "specimen"].nunique()
        if have < len(cohort.specimen_names):
            who = "nobody has" if not have else f"{have} of {len(cohort.specimen_names)} have"
            parts.append(f"position {position} ({who} a film of it)")
    if PUBLISHED in study.models and results.table(VARIANTS.name).empty:
        parts.append("other enlargements and sizes of stiffness (make full)")
    return tuple(parts)
