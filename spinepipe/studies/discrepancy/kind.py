"""The kind discrepancy: which effect a model lacks, where, and how sure that is."""

from dataclasses import dataclass

from spinepipe.cohort import Cohort
from spinepipe.schema import all_declared
from spinepipe.studies.base_checks import BaseCheck
from spinepipe.studies.discrepancy.checks import check_discrepancy
from spinepipe.studies.discrepancy.settings import Discrepancy
from spinepipe.studies.kind import Job, Kind
from spinepipe.studies.study_files import Figure, StudyFiles

VERDICT = "verdict.json"
TABLES = tuple(table.name for table in all_declared(__file__))
"""The answer; each figure may draw from it."""

OTHERS = (VERDICT, "design.csv", "model_base.yaml", "model_with_effects.yaml")


@dataclass(frozen=True)
class DiscrepancyFiles(StudyFiles):
    """The result files of one search for missing effects."""

    subfolder = "discrepancy/"
    told_in_report = (VERDICT,)
    drawings = (
        Figure(
            "load_displacement",
            "Load over motion, measured and modelled",
            "charts:load_displacement",
            ("gap", VERDICT),
        ),
        Figure("misfit", "Misfit of the models", "charts:misfit", ("where", VERDICT)),
        Figure(
            "stiffness",
            "Stiffness at rest and under load",
            "charts:stiffness",
            ("field_numbers",),
        ),
        Figure(
            "left_out",
            "Misfit on readings left out of the fit",
            "charts:left_out",
            ("held_out", VERDICT),
        ),
        Figure("evidence", "Evidence for each effect", "charts:evidence", ("candidates", VERDICT)),
        Figure("next_tests", "What to measure next", "charts:next_tests", ("next_tests", VERDICT)),
    )

    study: Discrepancy

    @classmethod
    def of(cls, study: Discrepancy, cohort: Cohort) -> "DiscrepancyFiles":
        """The files of a study of a cohort."""
        return cls(study, cohort.specimen_names)

    @property
    def tables(self) -> tuple[str, ...]:
        """The tables that every study has."""
        return TABLES

    @property
    def others(self) -> tuple[str, ...]:
        """The verdict and the two model files."""
        return OTHERS


KIND = Kind(
    question="What is the model missing?",
    settings=Discrepancy,
    files=DiscrepancyFiles,
    checks=(check_discrepancy,),
    checks_of_files=(BaseCheck(own_bushings=False),),
    tables=all_declared(__file__),
    # every setting says something about the search
    jobs=(Job("search", at="job", reads_base=True, makes=(*TABLES, *OTHERS)),),
    makes_models="search",
    holds=True,
    exports="export:exported",
    explains="why:why",
    before_data="before_data:prospects",
    cost="quick: at most 10 fits of all readings",
    starter="base: {stiffness: per_specimen}  # what is asked what it lacks: linear joints\n"
    "# effort: standard  # quick (the default) fits 10 models, standard 40, full 100\n",
)
