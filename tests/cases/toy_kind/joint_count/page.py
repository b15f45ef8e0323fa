"""The page of a study of joint counts."""

from spinepipe.studies.joint_count.settings import JointCount
from spinepipe.studies.joint_count.tables import TOTALS

from spinepipe.cohort import Cohort
from spinepipe.report.conclusions import Conclusion, Value, sentences_of
from spinepipe.report.page.study_page import Page, ResultTables
from spinepipe.report.page.tables import page_tables

READ = ("totals",)


def page(study: JointCount, cohort: Cohort, results: ResultTables) -> Page:
    """One answer, one figure, one table."""
    rows = results.table("totals")
    joints = Value(int(rows["joints"].iloc[0]), source="totals: joints")
    return Page(
        conclusions=[Conclusion("total", "counted", {"joints": joints})],
        sentences=sentences_of(__package__),
        key_figure="joint_bars",
        tables=page_tables(TOTALS, "Joints", rows),
    )
