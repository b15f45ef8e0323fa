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
            "Load over displacement, measured and modelled",
            "figures.load_displacement:load_displacement_figure",
            ("gap",),
        ),
        Figure(
            "gap_map",
            "Where the model is off, before and after",
            "figures.gap_map:gap_map_figure",
            ("where",),
        ),
        Figure(
            "gap_by_step",
            "The gap along the load",
            "figures.load_displacement:gap_by_step_figure",
            ("gap",),
        ),
        Figure(
            "held_out_by_test",
            "Proof on motion held out",
            "figures.held_out_by_test:held_out_by_test_figure",
            ("held_out",),
        ),
        Figure(
            "evidence_by_round",
            "Evidence for each effect, round by round",
            "figures.evidence_by_round:evidence_by_round_figure",
            ("candidates", VERDICT),
        ),
        Figure(
            "effect_confusions",
            "What these tests could tell apart, and see",
            "figures.effect_confusions:effect_confusions_figure",
            ("confusions", "candidates", VERDICT),
        ),
        Figure(
            "imperfections",
            "What small imperfections took up",
            "figures.imperfections:imperfections_figure",
            ("imperfections", VERDICT),
        ),
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
)
