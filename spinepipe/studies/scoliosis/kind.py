"""The kind scoliosis: personal stiffness of scoliotic spines from bending films."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from spinepipe.cohort import Cohort
from spinepipe.comparison.papers import beside, hangs_on
from spinepipe.schema import all_declared
from spinepipe.studies.kind import Job, Kind, ignoring
from spinepipe.studies.scoliosis.checks import check_scoliosis
from spinepipe.studies.scoliosis.films import FILMS, PATIENTS
from spinepipe.studies.scoliosis.settings import Scoliosis
from spinepipe.studies.scoliosis.tables import JALALIAN_2017_COHORTS
from spinepipe.studies.study_files import Figure, StudyFiles

OF_JOBS = ("laws", "positions", "displacements", "curves", "absolute_stiffness")
"""Tables joined from job files, one for each patient and model."""

_ANALYSES = (
    Job("accuracy", "", ("positions", "displacements", "curves"), ("accuracy",)),
    Job("clinical", "", (), ("clinical",)),
    Job("variation", "", ("variants",), ("variation",)),
    Job("by_range", "", ("displacements",), ("by_range",)),
    Job("statistics", "significance", ("positions", "displacements", "curves"), ("statistics",)),
    Job(
        "against_jalalian_2017",
        "",
        ("positions", "displacements", "accuracy", "by_range", "variants", "variation"),
        ("against_jalalian_2017",),
        also=hangs_on("jalalian_2017"),
    ),
)
"""What is computed from tables."""

COMPARED = ("accuracy", "statistics", "positions", "displacements", "curves")
"""Tables from which laws are compared."""

_BLOCK = "000"

POOLED = "tangent_fitted"
"""The model that reads the films of all patients."""

VARIED_MODEL = "tangent"
"""The model whose choices are varied."""


@dataclass(frozen=True)
class ScoliosisFiles(StudyFiles):
    """The result files of one study of scoliotic spines.

    Attributes
    ----------
    rebuilt : whether the cohort stands for that of a paper whose numbers are at hand.
    """

    joined = (*OF_JOBS, "variants")
    full = ("variants", "variation", "against_jalalian_2017")
    drawings = (
        Figure("fitted_and_held_out", "Rotation errors", "charts:fitted_and_held_out", COMPARED),
        Figure("differences", "Differences between laws", "charts:differences", COMPARED),
        Figure("other_errors", "Other errors", "charts:other_errors", COMPARED),
        Figure("identifiable_ratios", "Bounded ratios", "charts:identifiable_ratios", ("laws",)),
        Figure(
            "film_overlay",
            "Vertebrae off their places",
            "charts_of_films:film_overlay",
            ("positions", "displacements"),
        ),
        Figure(
            "load_displacement",
            "Laws of segments",
            "charts_of_films:load_displacement",
            ("laws", "displacements", "positions"),
        ),
        Figure("enlargement", "Enlargement of the ends", "charts:enlargement", ("variants",)),
        Figure("scale", "Size of stiffness", "charts:scale", ("variants", *COMPARED)),
    )

    study: Scoliosis
    rebuilt: bool

    @classmethod
    def of(cls, study: Scoliosis, cohort: Cohort) -> "ScoliosisFiles":
        """The files of a study of a cohort."""
        rebuilt = cohort.name in JALALIAN_2017_COHORTS and beside()
        return cls(study, cohort.specimen_names, rebuilt)

    @property
    def tables(self) -> tuple[str, ...]:
        """The tables that this study has."""
        population = ("population",) if POOLED in self.study.models else ()
        varied = ("variants",) if VARIED_MODEL in self.study.models else ()
        analysed = (
            job.name
            for job in _ANALYSES
            if (self.rebuilt or not job.name.startswith("against"))
            and (varied or job.name != "variation")
        )
        return (*OF_JOBS, *population, *varied, *analysed)

    def population_files(self, model: str) -> list[str]:
        """What a model reads of the population of all patients."""
        return self.table_files(("population",)) if model == POOLED else []

    @property
    def made_of_jobs(self) -> tuple[str, ...]:
        """The tables that are made of the job files of models."""
        return OF_JOBS

    @property
    def by_specimen(self) -> tuple[str, ...]:
        """The tables with one job file per patient."""
        return ("variants",)

    def job_of(self, table: str, path: str) -> str:
        """The job that writes a file of which a table is made."""
        return "variants" if table == "variants" else "personalise"

    def blocks(self, table: str) -> list[tuple[str, str]]:
        """One block per patient."""
        return [(name, _BLOCK) for name in self.specimens]

    def job_files(self, table: str, specimen: str, block: str) -> list[str]:
        """The job files of which a block is made."""
        place = f"{self.folder}/jobs/{table}/specimen-{specimen}"
        return [f"{place}/model-{model}.parquet" for model in self.study.models]


def _population(expected: Any, place: Mapping[str, str]) -> list[str]:
    """Mark of the population that a model belongs to."""
    return [expected.of_job("population", {})] if place["model"] == POOLED else []


KIND = Kind(
    question="Scoliosis films",
    settings=Scoliosis,
    files=ScoliosisFiles,
    checks=(check_scoliosis,),
    tables=all_declared(__file__),
    jobs=(
        Job("personalise", many=True, ignores=ignoring("models"), also=_population),
        Job("population", "fit_population", makes=("population",), ignores=ignoring("models")),
        Job("variants", ignores=ignoring("models")),
        *_ANALYSES,
    ),
    forms=(FILMS, PATIENTS),
    doubts="plausibility:doubts",
    why_no_export="films show rotations in one plane, without loads and masses, which a file of "
    "OpenSim needs: take the personal laws from laws.parquet",
)
