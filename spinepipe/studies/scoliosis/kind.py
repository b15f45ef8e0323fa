"""The kind scoliosis: personal stiffness of scoliotic spines from bending films."""

from dataclasses import dataclass

from spinepipe.cohort import Cohort
from spinepipe.studies.kind import Job, Kind, ignoring
from spinepipe.studies.scoliosis.checks import check_scoliosis
from spinepipe.studies.scoliosis.films import FILMS, PATIENTS
from spinepipe.studies.scoliosis.jalalian_2017 import stands_for
from spinepipe.studies.scoliosis.settings import Scoliosis
from spinepipe.studies.scoliosis.tables import (
    ACCURACY,
    AGAINST_JALALIAN_2017,
    BY_RANGE,
    CURVES,
    DISPLACEMENTS,
    LAWS,
    POSITIONS,
)
from spinepipe.studies.study_files import StudyFiles
from spinepipe.tables.shared import STATISTICS

OF_JOBS = ("laws", "positions", "displacements", "curves")
"""Tables joined from job files, one for each patient and model."""

_ANALYSES = (
    Job("accuracy", "", ("positions", "displacements", "curves"), ("accuracy",)),
    Job("by_range", "", ("displacements",), ("by_range",)),
    Job("statistics", "significance", ("positions", "displacements", "curves"), ("statistics",)),
    Job(
        "against_jalalian_2017",
        "jalalian_2017.against",
        ("laws", "positions", "displacements", "accuracy", "by_range", "variants", "variation"),
        ("against_jalalian_2017",),
    ),
)
"""What is computed from tables."""

_BLOCK = "000"


@dataclass(frozen=True)
class ScoliosisFiles(StudyFiles):
    """The result files of one study of scoliotic spines.

    Attributes
    ----------
    rebuilt : whether the cohort stands for that of a paper.
    """

    joined = OF_JOBS

    study: Scoliosis
    rebuilt: bool

    @classmethod
    def of(cls, study: Scoliosis, cohort: Cohort) -> "ScoliosisFiles":
        """The files of a study of a cohort."""
        return cls(study, cohort.specimen_names, stands_for(cohort.name))

    @property
    def tables(self) -> tuple[str, ...]:
        """The tables that this study has."""
        analysed = (
            job.name for job in _ANALYSES if self.rebuilt or not job.name.startswith("against")
        )
        return (*OF_JOBS, *analysed)

    @property
    def made_of_jobs(self) -> tuple[str, ...]:
        """The tables that are made of job files."""
        return OF_JOBS

    def job_of(self, table: str, path: str) -> str:
        """The job that writes a file of which a table is made."""
        return "personalise"

    def blocks(self, table: str) -> list[tuple[str, str]]:
        """One block per patient."""
        return [(name, _BLOCK) for name in self.specimens]

    def job_files(self, table: str, specimen: str, block: str) -> list[str]:
        """The job files of which a block is made."""
        place = f"{self.folder}/jobs/specimen={specimen}"
        return [f"{place}/model={model}/{table}.parquet" for model in self.study.models]


KIND = Kind(
    settings=Scoliosis,
    files=ScoliosisFiles,
    checks=(check_scoliosis,),
    tables=(
        *(LAWS, POSITIONS, DISPLACEMENTS, CURVES),
        *(ACCURACY, BY_RANGE, STATISTICS, AGAINST_JALALIAN_2017),
    ),
    jobs=(
        Job("personalise", many=True, ignores=ignoring("models")),
        *_ANALYSES,
    ),
    forms=(FILMS, PATIENTS),
)
