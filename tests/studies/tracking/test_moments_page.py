"""The page of recorded lifts: every verdict from moments that make it, a figure that fits."""

from dataclasses import replace
from functools import cache

import lifts
from page_rules import faults_of_chart, faults_of_page, faults_of_told, verdicts
from tracking_table_cases import frame

from spinepipe.report.conclusions import Told, sentences_of, told
from spinepipe.report.page.study_page import ResultTables
from spinepipe.studies.tracking.charts_of_moments import moments
from spinepipe.studies.tracking.conclusions_of_moments import conclusions_of_moments
from spinepipe.studies.tracking.joint_moments import table_rows
from spinepipe.studies.tracking.page import page
from spinepipe.studies.tracking.settings import Tracking
from spinepipe.studies.tracking.tables import JOINT_MOMENTS, MOMENT_AGREEMENT
from spinepipe.tables import StudyTables

STUDY = Tracking(study="lifts", kind="tracking", cohort="stoop_lift", marker_set="plug_in_gait")


@cache
def made() -> StudyTables:
    shapes, rows = (JOINT_MOMENTS, MOMENT_AGREEMENT), table_rows(STUDY, lifts.lifts())
    tables = zip(shapes, rows, strict=True)
    return StudyTables({shape.name: frame(shape, part) for shape, part in tables})


def far() -> StudyTables:
    """As if moments were not those that were measured."""
    beside = made()["moment_agreement"].assign(rmse_nm=20.0, peak_percent=11.0)
    return StudyTables(made() | {"moment_agreement": beside})


def opposite() -> StudyTables:
    """As if measured moments had the other sign."""
    cohort = lifts.lifts()
    rows = cohort.further["measured_moments"]
    turned = cohort.further | {"measured_moments": rows.assign(mz_nm=-rows["mz_nm"])}
    beside = frame(MOMENT_AGREEMENT, table_rows(STUDY, replace(cohort, further=turned))[1])
    return StudyTables(made() | {"moment_agreement": beside})


def alone() -> StudyTables:
    return StudyTables(made() | {"moment_agreement": made()["moment_agreement"][:0]})


def nothing() -> StudyTables:
    return StudyTables({name: table[:0] for name, table in made().items()})


def said(tables: StudyTables) -> list[Told]:
    return told(conclusions_of_moments(STUDY, tables), sentences_of("spinepipe.studies.tracking"))


def test_sentences_follow_the_numbers() -> None:
    found = {
        name: verdicts(conclusions_of_moments(STUDY, tables))
        for name, tables in (
            ("made", made()),
            ("far", far()),
            ("opposite", opposite()),
            ("alone", alone()),
            ("nothing", nothing()),
        )
    }
    assert {("moment", "agrees"), ("compared", "ok"), ("other", "told")} <= found["made"]
    assert {("moment", "differs"), ("compared", "check")} <= found["far"]
    # peaks that accelerations do not raise are not called lower
    assert ("quasi_static", "less") in found["made"]
    assert ("quasi_static", "off") in found["far"]
    assert {("moment", "opposite"), ("compared", "check_opposite")} <= found["opposite"]
    assert {("moment", "alone"), ("compared", "check_alone")} <= found["alone"]
    assert found["nothing"] == {("moment", "none")}
    told_of = {"course", "peak", "before", "quasi_static", "lifted"}
    assert told_of <= {rule for rule, _ in found["made"]}


def test_pages_and_figures_are_sound() -> None:
    for tables in (made(), far(), opposite(), alone(), nothing()):
        assert list(faults_of_told(said(tables))) == []
        assert list(faults_of_chart(moments(STUDY, lifts.lifts(), tables))) == []
        results = ResultTables(tables)
        html = page(STUDY, lifts.lifts(), results).html(STUDY, lifts.lifts(), results)
        assert list(faults_of_page(html)) == []
