"""Which files the results of a global sensitivity study consist of."""

from collections.abc import Mapping
from dataclasses import dataclass

from spinepipe.cohort import Cohort
from spinepipe.studies.global_sensitivity.settings import GlobalSensitivity
from spinepipe.studies.study_files import StudyFiles

OF_JOBS = ("responses", "calibrated", "indices", "convergence")
"""Tables joined from job files: of batches of samples, the last two of whole specimens."""

_BY_SPECIMEN = ("indices", "convergence")

_MADE_BY = {
    "responses": "respond",
    "calibrated": "calibrate",
    **dict.fromkeys(_BY_SPECIMEN, "analyse"),
}
"""The job that writes the files of each of them."""

SENSITIVITY_FIGURES: dict[str, tuple[str, ...]] = {
    "factor_indices": ("indices",),
    "index_convergence": ("convergence", "indices"),
    "top_factors": ("responses", "design", "indices"),
}
"""Figures and the tables each is drawn from."""

_MOST_FILES_PER_BLOCK = 300


@dataclass(frozen=True)
class SensitivityFiles(StudyFiles):
    """The result files of one global sensitivity study.

    Samples are computed in batches of `GlobalSensitivity.batch_size`; one file holds one batch of
    one specimen. A batch of one is a target of its own for each sample.
    """

    study: GlobalSensitivity

    @classmethod
    def of(cls, study: GlobalSensitivity, cohort: Cohort) -> "SensitivityFiles":
        """The files of a study of a cohort."""
        return cls(study, study.chosen_specimens(cohort))

    @property
    def tables(self) -> tuple[str, ...]:
        """The tables that this study has."""
        calibrated = ("calibrated",) if self.study.outputs.stiffness else ()
        return ("design", "responses", *calibrated, "indices", "convergence")

    @property
    def drawn_from(self) -> Mapping[str, tuple[str, ...]]:
        """Figures and the tables each is drawn from."""
        return SENSITIVITY_FIGURES

    @property
    def made_of_jobs(self) -> tuple[str, ...]:
        """The tables that are made of job files."""
        return tuple(name for name in OF_JOBS if name in self.tables)

    def job_of(self, table: str, path: str) -> str:
        """The job that writes a file of which a table is made."""
        return f"global_sensitivity.{_MADE_BY[table]}"

    def blocks(self, table: str) -> list[tuple[str, str]]:
        """All (specimen, block) of a table, blocks numbered `000`, `001`, ..."""
        files = 1 if table in _BY_SPECIMEN else self.n_batches
        count = -(-files // _MOST_FILES_PER_BLOCK)
        return [(name, f"{block:03d}") for name in self.specimens for block in range(count)]

    def job_files(self, table: str, specimen: str, block: str) -> list[str]:
        """The job files of which a block is made."""
        if table in _BY_SPECIMEN:
            return [f"{self.folder}/analysis/specimen={specimen}/{table}.parquet"]
        first = int(block) * _MOST_FILES_PER_BLOCK
        last = min(first + _MOST_FILES_PER_BLOCK, self.n_batches)
        return [self._batch_file(table, specimen, number) for number in range(first, last)]

    def blocks_of(self, table: str, specimen: str) -> list[str]:
        """The blocks of a table that hold a specimen; none where there is no such table."""
        blocks = [block for block in self.blocks(table) if block[0] == specimen]
        return [self.block_file(table, *one) for one in blocks] if table in self.tables else []

    @property
    def n_batches(self) -> int:
        """Number of batches of a specimen."""
        return -(-self.study.n_runs // self.study.batch_size(len(self.specimens)))

    def _batch_file(self, table: str, specimen: str, number: int) -> str:
        return f"{self.folder}/jobs/{table}/specimen={specimen}/batch={number:05d}.parquet"
