"""The kind global_sensitivity: which uncertain inputs drive motion, joint loads and stiffness."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from spinepipe.cohort import Cohort
from spinepipe.schema import all_declared
from spinepipe.studies.free import settle_calibration
from spinepipe.studies.global_sensitivity.checks import check_global_sensitivity
from spinepipe.studies.global_sensitivity.settings import GlobalSensitivity
from spinepipe.studies.global_sensitivity.size_of_design import check_size_of_design
from spinepipe.studies.kind import Job, Kind, ignoring
from spinepipe.studies.study_files import Figure, StudyFiles, files_of_block, numbered_blocks

_OF_BASE = ("base_stiffness", "base_motion")
_OF_INDICES = ("indices", "convergence", "failed_runs")
_BY_SPECIMEN = (*_OF_BASE, *_OF_INDICES)

OF_JOBS = (*_OF_BASE, "responses", "calibrated", *_OF_INDICES)
"""Tables joined from job files: of whole specimens, but for those of batches of samples."""

_MADE_BY = {
    **dict.fromkeys(_OF_BASE, "base"),
    "responses": "respond",
    "calibrated": "calibrate",
    **dict.fromkeys(_OF_INDICES, "analyse"),
}
"""The job that writes the files of each of them."""

_FOLDER = {**dict.fromkeys(_OF_BASE, "base"), **dict.fromkeys(_OF_INDICES, "analysis")}
"""Where files of whole specimens are."""


@dataclass(frozen=True)
class SensitivityFiles(StudyFiles):
    """The result files of one global sensitivity study.

    Samples are computed in batches of `GlobalSensitivity.batch_size`; one file holds one batch of
    one specimen. A batch of one is a target of its own for each sample.
    """

    joined = OF_JOBS
    drawings = (
        Figure(
            "factor_indices",
            "What each output depends on",
            "charts:indices",
            ("indices",),
        ),
        Figure(
            "index_convergence",
            "Indices against the number of runs",
            "charts:convergence",
            ("convergence", "indices"),
        ),
        Figure(
            "top_factors",
            "Outputs over the leading inputs",
            "charts:runs",
            ("responses", "design", "indices"),
        ),
    )

    study: GlobalSensitivity

    @classmethod
    def of(cls, study: GlobalSensitivity, cohort: Cohort) -> "SensitivityFiles":
        """The files of a study of a cohort."""
        return cls(study, study.chosen_specimens(cohort))

    @property
    def tables(self) -> tuple[str, ...]:
        """The tables that this study has."""
        calibrated = ("calibrated",) if self.study.outputs.stiffness else ()
        return ("design", *_OF_BASE, "responses", *calibrated, *_OF_INDICES)

    @property
    def made_of_jobs(self) -> tuple[str, ...]:
        """The tables that are made of job files."""
        return tuple(name for name in OF_JOBS if name in self.tables)

    def job_of(self, table: str, path: str) -> str:
        """The job that writes a file of which a table is made."""
        return _MADE_BY[table]

    def blocks(self, table: str) -> list[tuple[str, str]]:
        """All (specimen, block) of a table, blocks numbered `000`, `001`, ..."""
        return numbered_blocks(self.specimens, 1 if table in _BY_SPECIMEN else self.n_batches)

    def job_files(self, table: str, specimen: str, block: str) -> list[str]:
        """The job files of which a block is made."""
        if table in _BY_SPECIMEN:
            return [f"{self.folder}/{_FOLDER[table]}/{table}/specimen-{specimen}.parquet"]
        numbers = files_of_block(block, len(self.specimens), self.n_batches)
        folder = f"{self.folder}/jobs/{table}/specimen-{specimen}"
        return [f"{folder}/batch-{number:05d}.parquet" for number in numbers]

    def blocks_of(self, table: str, specimen: str) -> list[str]:
        """The blocks of a table that hold a specimen; none where there is no such table."""
        blocks = [block for block in self.blocks(table) if block[0] == specimen]
        return [self.block_file(table, *one) for one in blocks] if table in self.tables else []

    def base_of(self, specimen: str) -> list[str]:
        """The file of a specimen's fitted stiffness; none where the study gives the stiffness."""
        return self.job_files("base_stiffness", specimen, "000") if self.study.is_fitted else []

    @property
    def n_batches(self) -> int:
        """Number of batches of a specimen."""
        return -(-self.study.n_runs // self.study.batch_size(len(self.specimens)))


def _of_batch(expected: Any, place: Mapping[str, str]) -> list[str]:
    """How many samples one file holds, by the number of specimens; marks of design and fit."""
    design = expected.of_job("design", {})
    size = str(expected.study.batch_size(len(expected.files.specimens)))
    base = expected.of_job("base", place) if expected.study.is_fitted else None
    return [size, design] if base is None else [size, design, base]


def _of_blocks(expected: Any, place: Mapping[str, str]) -> list[str]:
    """Marks of the design and of the blocks of a specimen's samples."""
    files, specimen = expected.files, place["specimen"]
    blocks = [
        expected.of_part(table, path)
        for table in ("responses", "calibrated")
        for path in files.blocks_of(table, specimen)
    ]
    return [expected.of_job("design", {}), *blocks]


_DRAWING = ("factors", "design", "dummy", "samples_per_target")
_RESPONDING = (
    *("specimens", "tests", "steps", "stiffness", "level_stiffness", "damping", "loading"),
)
_ANALYSING = ("bootstraps", "confidence", "indices", "most_failed", "outputs")
"""Settings by what they decide: what the samples are done with, what is made of them."""

KIND = Kind(
    question="Which inputs matter?",
    cost="256 runs times factors and two, each specimen",
    starter="stiffness: fitted\n"
    "factors:  # what is uncertain, and how far\n"
    "  - {of: stiffness, coordinate: extension, times: {low: 0.8, high: 1.25}}\n"
    "  - {of: joint_centre, axis: anterior, offset_mm: {sd: 2}}\n"
    "  - {of: load_direction, axis: z, offset_deg: {sd: 2}}\n"
    "design: {method: sobol, samples: 256}\n",
    settings=GlobalSensitivity,
    files=SensitivityFiles,
    checks=(check_global_sensitivity,),
    checks_at_start=(check_size_of_design,),
    settled=settle_calibration,
    tables=all_declared(__file__),
    jobs=(
        Job(
            "design",
            makes=("design",),
            ignores=ignoring(*_RESPONDING, *_ANALYSING),
            header_alone=True,
        ),
        Job("base", ignores=ignoring(*_DRAWING, *_ANALYSING, "steps")),
        Job(
            "respond",
            in_blocks="responses",
            ignores=ignoring(*_ANALYSING, "calibration", "seed"),
            also=_of_batch,
        ),
        Job(
            "calibrate",
            in_blocks="calibrated",
            ignores=ignoring(*_ANALYSING, "steps"),
            also=_of_batch,
        ),
        Job("analyse", also=_of_blocks),
    ),
    exports="export:exported",
)
