"""Which files the results of a search for missing effects consist of."""

import os
from collections.abc import Mapping
from dataclasses import dataclass

from spinepipe.cohort import Cohort
from spinepipe.studies.discrepancy.settings import Discrepancy
from spinepipe.studies.study_files import StudyFiles

FOLDER = "discrepancy"
"""Folder of all results inside that of the study."""

TABLES = ("gap", "candidates", "where", "confusions", "held_out")

OTHERS = ("verdict.json", "model_base.yaml", "model_with_effects.yaml")

DISCREPANCY_FIGURES: dict[str, tuple[str, ...]] = {
    "gap_map": ("where",),
    "gap_by_step": ("gap",),
    "effect_evidence": ("candidates",),
    "gap_held_out": ("held_out",),
    "effect_confusions": ("confusions", "candidates"),
}
"""Figures and the tables each is drawn from, besides the verdict."""


@dataclass(frozen=True)
class DiscrepancyFiles(StudyFiles):
    """The result files of one search for missing effects."""

    study: Discrepancy

    @classmethod
    def of(cls, study: Discrepancy, cohort: Cohort) -> "DiscrepancyFiles":
        """The files of a study of a cohort."""
        return cls(study, cohort.specimen_names)

    @property
    def folder(self) -> str:
        """Where all results of the study are."""
        return f"results/{self.study.study}/{FOLDER}"

    @property
    def tables(self) -> tuple[str, ...]:
        """The tables that every study has."""
        return TABLES

    @property
    def others(self) -> tuple[str, ...]:
        """The verdict and the two model files."""
        return OTHERS

    @property
    def drawn_from(self) -> Mapping[str, tuple[str, ...]]:
        """Figures and the tables each is drawn from."""
        return DISCREPANCY_FIGURES

    @property
    def made_of_jobs(self) -> tuple[str, ...]:
        """No table is made of job files."""
        return ()

    def job_of(self, table: str, path: str) -> str:
        """None: no table is made of job files."""
        raise ValueError(f"{table} is not made of job files")

    def blocks(self, table: str) -> list[tuple[str, str]]:
        """None: no table is made of job files."""
        return []

    def job_files(self, table: str, specimen: str, block: str) -> list[str]:
        """None: no table is made of job files."""
        return []

    def base_model(self) -> list[str]:
        """The model file that the study starts from; none where its base is stiffness alone."""
        model = self.study.base.model
        return [os.path.relpath(model)] if model else []
