"""The report of a study of trunk loads."""

from spinepipe.cohort import Cohort
from spinepipe.report.page.document import Document, Results
from spinepipe.studies.trunk_loads.settings import TrunkLoads

READ = ("tasks",)


def document(study: TrunkLoads, cohort: Cohort, results: Results) -> Document:
    """What the report says and shows."""
    return Document(
        question="What do tasks ask of the trunk?",
        findings=[],
        pictures=list(results.pictures.values()),
        tables=[],
        metadata=results.metadata,
    )
