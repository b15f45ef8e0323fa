"""Which files the results of a cohort study consist of, and which of them make up a table."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

from spinepipe.cohort import Cohort
from spinepipe.report.published import OF_COHORTS, stands_for
from spinepipe.studies.cohort_stiffness.settings import (
    ALL,
    NOBODY,
    POOLED,
    CohortStiffness,
    load_sets,
    tests_of,
)
from spinepipe.studies.study_files import StudyFiles

OF_JOBS = ("stiffness", "errors", "fits", "sign_checks", "pooling")
"""Tables joined from job files."""

COHORT_ANALYSES: dict[str, tuple[str, ...]] = {
    "mae": ("errors",),
    "ranking": ("errors", "fits", "pooling"),
    "statistics": ("errors", "fits"),
    "findings": ("stiffness", "errors", "statistics", "pooling"),
    "against_gould_2024b": ("stiffness", "fits", "errors", "mae", "statistics"),
}
"""Tables computed from others, and which."""

COHORT_FIGURES: dict[str, tuple[str, ...]] = {
    "stiffness_by_level": ("stiffness",),
    "error_map": ("errors", "sign_checks"),
    "held_out_error": ("errors",),
    "load_case_stiffness": ("stiffness", "errors", "statistics"),
}
"""Figures and the tables each is drawn from."""

EVERYONE, POOLED_BLOCK = "everyone", "pooled"
"""Place of the block of the pooled fits, which are of no single specimen."""

_MADE_BY = {"literature": "literature", "fits": "fit", "left_out": "left_out", "pooled": "pool"}
"""The job that writes the files in each folder."""

_SINGLE_BLOCK = "000"


@dataclass(frozen=True)
class CohortLayout(StudyFiles):
    """The result files of one cohort study.

    Attributes
    ----------
    tests : load cases of the study. rebuilt : whether the cohort stands for that of a paper.
    """

    study: CohortStiffness
    tests: tuple[str, ...]
    rebuilt: bool

    @classmethod
    def of(cls, study: CohortStiffness, cohort: Cohort) -> "CohortLayout":
        """The files of a study of a cohort."""
        rebuilt = stands_for(cohort.name, OF_COHORTS)
        return cls(study, cohort.specimen_names, tests_of(study, cohort), rebuilt)

    @property
    def tables(self) -> tuple[str, ...]:
        """The tables that this study has."""
        pooled = ("pooling",) if POOLED in self.study.representations else ()
        analysed = (
            name for name in COHORT_ANALYSES if self.rebuilt or not name.startswith("against")
        )
        return ("stiffness", "fits", "errors", "sign_checks", *pooled, *analysed)

    @property
    def drawn_from(self) -> Mapping[str, tuple[str, ...]]:
        """Figures and the tables each is drawn from."""
        return COHORT_FIGURES

    @property
    def made_of_jobs(self) -> tuple[str, ...]:
        """The tables of this study that are made of job files."""
        return tuple(table for table in OF_JOBS if table in self.tables)

    @cached_property
    def load_sets(self) -> tuple[str, ...]:
        """What stiffness is fitted to."""
        return load_sets(self.study, self.tests)

    def job_of(self, table: str, path: str) -> str:
        """The job that writes a file of which a table is made."""
        folder = path.removeprefix(f"{self.folder}/").split("/")[0]
        return f"cohort_stiffness.{_MADE_BY[folder]}"

    def blocks(self, table: str) -> list[tuple[str, str]]:
        """One block per specimen, and one of the pooled fits."""
        nobody = table == "pooling" or (table == "fits" and not self._single)
        own = [] if nobody else [(name, _SINGLE_BLOCK) for name in self.specimens]
        whole = table != "sign_checks" and POOLED in self.study.representations
        return [*own, *([(EVERYONE, POOLED_BLOCK)] if whole else [])]

    def job_files(self, table: str, specimen: str, block: str) -> list[str]:
        """The job files of which a block is made."""
        if block == POOLED_BLOCK:
            return [f"{self.folder}/pooled/{place}/{table}.parquet" for place in self._pooled()]
        places = [f"literature/specimen={specimen}"] if table != "fits" else []
        if table in ("stiffness", "errors", "fits"):
            places += [f"fits/specimen={specimen}/{place}" for place in self._fits()]
        if table in ("stiffness", "errors"):
            places += [f"left_out/specimen={specimen}/{place}" for place in self._left_out()]
        return [f"{self.folder}/{place}/{table}.parquet" for place in places]

    def fits_of_others(self, specimen: str, representation: str, fitted_to: str) -> list[str]:
        """Stiffness files of the other specimens' own fits."""
        place = f"representation={representation}/fitted_to={fitted_to}/stiffness.parquet"
        return [
            f"{self.folder}/fits/specimen={name}/{place}"
            for name in self.specimens
            if name != specimen
        ]

    @property
    def _single(self) -> tuple[str, ...]:
        """Representations fitted specimen by specimen."""
        return tuple(name for name in self.study.representations if name != POOLED)

    def _fits(self) -> list[str]:
        return [
            f"representation={representation}/fitted_to={label}"
            for representation in self._single
            for label in self.load_sets
        ]

    @property
    def _held_out(self) -> bool:
        """Whether specimens are predicted from the others."""
        return self.study.cross_validation.specimens and len(self.specimens) > 1

    def _left_out(self) -> list[str]:
        if not self._held_out:
            return []
        return [
            f"representation={representation}/fitted_to={label}"
            for representation in self._single
            for label in self._without_case_folds()
        ]

    def _without_case_folds(self) -> tuple[str, ...]:
        """The load sets that leave no load case out."""
        return tuple(label for label in self.load_sets if label == ALL or label in self.tests)

    def _pooled(self) -> list[str]:
        places = [f"fitted_to={label}/without={NOBODY}" for label in self.load_sets]
        if self._held_out:
            places += [
                f"fitted_to={label}/without={name}"
                for label in self._without_case_folds()
                for name in self.specimens
            ]
        return places
