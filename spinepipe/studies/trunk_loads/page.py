"""The report of a study of trunk loads: its answer, figures, the trunk in 3-D, and tables."""

from spinepipe.cohort import Cohort
from spinepipe.comparison import papers
from spinepipe.report.page.document import Document, Headline, ResultTables
from spinepipe.report.page.tables import Sortable, page_tables
from spinepipe.studies.trunk_loads.findings import findings
from spinepipe.studies.trunk_loads.headline import headline
from spinepipe.studies.trunk_loads.in_space import trunk_in_space
from spinepipe.studies.trunk_loads.settings import TrunkLoads, reproduces
from spinepipe.studies.trunk_loads.tables import (
    AGAINST_GHEZELBASH_2016,
    AGREEMENT,
    DRIVERS,
    INTERVALS,
    LEVELS_TABLE,
    MASSES,
    MUSCLES,
    PATHS,
    PRESSURES,
    REMARKS,
    SCALING,
    SIMPLIFIED,
    TASKS,
    TUNING,
    UPRIGHT,
)
from spinepipe.studies.trunk_loads.words import unbroken

QUESTION = (
    "What do tasks ask of a person's trunk: which forces of muscles, which compression and shear "
    "from T11T12 to L5S1, which pressure in the disc L4L5, how sure is that, and what does it hang "
    "on?"
)

_TITLES = {
    TASKS: "Every task of every person",
    AGREEMENT: "Agreement with measured pressures",
    PRESSURES: "Computed and measured pressures",
    TUNING: "What was fitted to measured pressures",
    INTERVALS: "How far answers can be trusted",
    DRIVERS: "What answers hang on",
    LEVELS_TABLE: "Load on every joint",
    SIMPLIFIED: "What simplifications cost",
    AGAINST_GHEZELBASH_2016: "Beside Ghezelbash et al. 2016",
    UPRIGHT: "Upright posture",
    MASSES: "Where every kilogram goes",
    SCALING: "What makes persons differ",
    MUSCLES: "Force of every fascicle",
    REMARKS: "What was put right, added or assumed in the geometry",
}
"""Tables of the page in their order, with their titles."""

READ = (*(table.name for table in _TITLES), PATHS.name)
"""Tables whose rows the page needs; of the others it tells where they come from."""


def document(study: TrunkLoads, cohort: Cohort, results: ResultTables) -> Document:
    """What the report says and shows."""
    found = headline(study, cohort, results)
    return Document(
        question=QUESTION,
        findings=findings(study, cohort, results),
        pictures=list(results.pictures.values()),
        tables=shown_tables(results),
        metadata=results.metadata,
        left_out=(
            *left_out(study),
            *papers.left_out("Ghezelbash et al. 2016", reproduces(cohort.name)),
        ),
        headline=Headline(unbroken(found.words), unbroken(found.how_sure), found.warnings),
        space=trunk_in_space(cohort, results.table(PATHS.name), results.table("levels")),
    )


def shown_tables(results: ResultTables) -> list[Sortable]:
    """Tables that the study has; those without rows are left out."""
    return [
        table
        for shape, title in _TITLES.items()
        for table in page_tables(shape, title, results.table(shape.name))
    ]


def left_out(study: TrunkLoads) -> tuple[str, ...]:
    """Parts that the settings leave out, each with the reason."""
    parts = []
    if not study.uncertain.tasks:
        parts.append("intervals and what answers hang on (no task is to be sampled)")
    if study.volunteer is None:
        parts.append("agreement with measured pressures (nobody stands for the volunteer)")
    if not study.solving.strength:
        parts.append("strength left at every level (not asked for)")
    return tuple(parts)
