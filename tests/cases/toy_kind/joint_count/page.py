"""The report of a study of joint counts."""

from spinepipe.studies.joint_count.settings import JointCount
from spinepipe.studies.joint_count.tables import TOTALS

from spinepipe.cohort import Cohort
from spinepipe.report.page.document import Document, ResultTables
from spinepipe.report.page.tables import sortable

READ = ("totals",)


def document(study: JointCount, cohort: Cohort, results: ResultTables) -> Document:
    """One finding, one figure, one table."""
    rows = results.table("totals")
    return Document(
        question="How many joints are there?",
        findings=[f"There are {rows['joints'].iloc[0]} joints."],
        pictures=list(results.pictures.values()),
        tables=[sortable("totals", "Joints", TOTALS.about, rows, TOTALS.columns)],
        metadata=results.metadata,
        left_out=[],
    )
