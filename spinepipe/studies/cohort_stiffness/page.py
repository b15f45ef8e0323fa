"""The report of a cohort study."""

from spinepipe.cohort import Cohort
from spinepipe.report.cohort.findings import findings
from spinepipe.report.cohort.tables import SHOWN, shown_tables
from spinepipe.report.page.document import Document, Picture
from spinepipe.report.page.results import Results
from spinepipe.studies import CohortStiffness

QUESTION = (
    "Does stiffness differ between specimens, levels and load cases, how should it be described, "
    "and does it carry over to what it was not fitted to?"
)
TITLES = {
    "stiffness_by_level": "Fitted stiffness of every specimen, level by level",
    "error_map": "Errors by specimen and level",
    "held_out_error": "Errors of fitted and of held-out motion",
    "load_case_stiffness": "Stiffness fitted to one load case",
}
READ = SHOWN
"""Tables whose rows the page needs; of the others it tells where they come from."""


def cohort_page(study: CohortStiffness, cohort: Cohort, results: Results) -> str:
    """The report as one HTML document that fetches nothing; the same results, the same bytes."""
    whole = Document(
        question=QUESTION,
        findings=findings(study, results),
        pictures=[
            Picture.of(name, TITLES.get(name, name.replace("_", " ")), svg,
                       " ".join(results.captions[name].split()))
            for name, svg in results.pictures.items()
        ],
        tables=shown_tables(results),
        metadata=results.metadata,
        left_out=left_out(study, len(cohort.specimen_names)),
        poses=results.table("poses"),
    )  # fmt: skip
    return whole.html(study, cohort)


def left_out(study: CohortStiffness, specimens: int) -> tuple[str, ...]:
    """Parts that the settings or the cohort leave out, each with the reason."""
    held = study.cross_validation
    parts = (
        ("prediction of left-out specimens", "cross_validation: specimens: false",
         held.specimens),
        ("prediction of left-out specimens", "the cohort has one specimen",
         not held.specimens or specimens > 1),
        ("prediction of left-out load cases", "cross_validation: load_cases: false",
         held.load_cases),
    )  # fmt: skip
    return tuple(f"{part} ({why})" for part, why, done in parts if not done)
