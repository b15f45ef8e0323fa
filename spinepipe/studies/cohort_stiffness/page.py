"""The page of a study of stiffness."""

from collections.abc import Mapping

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.comparison import papers
from spinepipe.report.conclusions import Value, sentences_of
from spinepipe.report.page.study_page import Page, ResultTables
from spinepipe.report.page.tables import Sortable, page_tables, sortable
from spinepipe.report.words import AXIS, level
from spinepipe.schema import Column, Table
from spinepipe.studies.cohort_stiffness.claims import FEWEST
from spinepipe.studies.cohort_stiffness.conclusions import conclusions
from spinepipe.studies.cohort_stiffness.conclusions_of_claims import ABOUT_UNSEEN
from spinepipe.studies.cohort_stiffness.conclusions_of_stiffness import joint_values
from spinepipe.studies.cohort_stiffness.representations import IN_WORDS
from spinepipe.studies.cohort_stiffness.settings import GOULD_2024B, CohortStiffness
from spinepipe.studies.cohort_stiffness.stages import joint_label_of
from spinepipe.studies.cohort_stiffness.tables import (
    COVARIATES_TABLE,
    FINDINGS,
    FITS,
    RANKING,
    SIGN_CHECKS,
)

_STIFFNESS = (
    Column("specimen", "text", "specimen"),
    Column("joint", "text", "joint; one row for all where they share a value"),
    Column("direction", "text", "direction of motion"),
    Column("stiffness", "number", "fitted to all load cases", empty="not bounded"),
    Column("interval", "text", "95 %; one end where readings set no other"),
    Column("unit", "text", "of both"),
)
"""The table of each specimen's stiffness, in the units of the field."""

_SHOWN: Mapping[Table, tuple[str, str]] = {
    FINDINGS: ("Claims, decided together", "statement holds value unit low high p_holm"),
    RANKING: ("Errors by description", "criterion representation value unit standard_error"),
    COVARIATES_TABLE: (
        "What stiffness goes with",
        "coordinate covariate step factor low high p_holm holds",
    ),
    SIGN_CHECKS: (
        "Does each joint move with the load?",
        "specimen test joint measured_over_expected verdict",
    ),
    FITS: ("Fits to all load cases", "specimen representation readings scatter status message"),
}
"""Tables of the page with their titles and the columns that a reader compares."""

READ = (
    *("stiffness", "nuisances", "load_displacement", "helical_axes", "against_gould_2024b"),
    *(shape.name for shape in _SHOWN),
)
"""Tables whose rows the page needs; of the others it tells where they come from."""


def page(study: CohortStiffness, cohort: Cohort, results: ResultTables) -> Page:
    """What the page says and shows."""
    return Page(
        conclusions=list(conclusions(study, cohort, results)),
        sentences=sentences_of(__package__),
        key_figure="stiffness_by_specimen",
        tables=[
            *_stiffness(results.table("stiffness")),
            *(
                table
                for shape, (title, names) in _SHOWN.items()
                for table in page_tables(
                    shape, title, _rows(study, cohort, results, shape.name), names
                )
            ),
        ],
        left_out=papers.left_out(GOULD_2024B.cited, GOULD_2024B.stands_for(cohort.name)),
    )


def _stiffness(stiffness: pd.DataFrame) -> list[Sortable]:
    """Each specimen's stiffness; a value that readings do not bound stays empty."""
    values = joint_values(stiffness)
    if values.empty:
        return []
    ends = values[["low", "high"]].astype(object).where(values[["low", "high"]].notna(), None)
    rows = values.assign(
        joint=values["joint"].map(level),
        direction=values["coordinate"].map(AXIS),
        stiffness=values["value"],
        interval=[f"{Value(0.0, '', *both):interval}" for both in ends.to_numpy()],
    ).sort_values("specimen", kind="stable")
    described = IN_WORDS[values["representation"].iloc[0]]
    about = f"Fits to all load cases, {described}. Other descriptions and fits are in the file."
    return [sortable("stiffness", "Stiffness of each specimen", about, rows, _STIFFNESS)]


def _rows(study: CohortStiffness, cohort: Cohort, results: ResultTables, name: str) -> pd.DataFrame:
    """Rows that the page shows: no claim that could not be decided or is none of unseen motion."""
    rows = results.table(name)
    if name == FINDINGS.name and len(rows):
        few = len(cohort.specimen_names) < FEWEST
        rows = rows[~few & (rows["holds"] != "not_asked")]
        unseen = rows["finding"].str.endswith(ABOUT_UNSEEN)
        return rows[~unseen] if study.base is not None else rows
    if name == FITS.name and len(rows):
        rows = rows[rows["fitted_to"] == joint_label_of(rows)]
    if "representation" in rows:
        rows = rows.assign(representation=rows["representation"].map(lambda x: IN_WORDS.get(x, x)))
    return rows
