"""How much a global sensitivity study computes and stores, and whether there is room for it."""

import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from spinepipe.cohort import Cohort
from spinepipe.documents.yaml_text import YamlDocument
from spinepipe.problems import InputProblem
from spinepipe.studies.global_sensitivity.settings import GlobalSensitivity
from spinepipe.studies.global_sensitivity.start import asked_tests

RESULTS = "results"
MEMINFO = Path("/proc/meminfo")

# Bytes were measured on tables of random numbers (zstd, 600,000 rows), rounded up.
DESIGN_ON_DISK, RESPONSE_ON_DISK, CALIBRATED_ON_DISK = 10, 120, 75
"""Bytes per row of a table."""

COPIES = 3
"""Job files, blocks of these, and the joined table hold the same rows."""

FILE_ON_DISK = 12_000
"""Bytes of a job file besides its rows: columns' descriptions and provenance."""

DESIGN_IN_MEMORY, RESPONSE_IN_MEMORY = 300, 400
"""Bytes per row while a table is made of its parts: columns, their copies and the keys.

`python -m benchmarks sensitivity`: 290 with 1.2 million rows and 450 with 0.9 million, of which 110
are libraries that are loaded on the way.
"""

OUTPUT_IN_MEMORY = 24
"""Bytes per run and output while indices are computed: numbers, centred, in blocks."""

AT_LEAST_IN_MEMORY = 900_000_000
"""Bytes of Snakemake and the workers with their libraries, and of the resamples of a bootstrap."""


@dataclass(frozen=True)
class DesignSize:
    """Counts of a study, and what they take.

    Attributes
    ----------
    runs : of each specimen. outputs : numbers per run that get indices.
    design_rows, response_rows, calibrated_rows : of the tables, all specimens together.
    files : job files.
    """

    runs: int
    outputs: int
    design_rows: int
    response_rows: int
    calibrated_rows: int
    files: int

    @property
    def on_disk(self) -> int:
        """Bytes in the results folder."""
        rows = RESPONSE_ON_DISK * self.response_rows + CALIBRATED_ON_DISK * self.calibrated_rows
        return COPIES * rows + DESIGN_ON_DISK * self.design_rows + FILE_ON_DISK * self.files

    @property
    def in_memory(self) -> int:
        """Bytes of the largest step."""
        steps = (
            DESIGN_IN_MEMORY * self.design_rows,
            RESPONSE_IN_MEMORY * self.response_rows,
            OUTPUT_IN_MEMORY * self.runs * self.outputs,
        )
        return AT_LEAST_IN_MEMORY + max(steps)


def size_of_design(study: GlobalSensitivity, cohort: Cohort) -> DesignSize:
    """Counts of a study that fits its cohort."""
    specimens, joints = study.chosen_specimens(cohort), len(cohort.joint_names)
    tests, all_steps = study.chosen_tests(cohort), study.steps == "all"
    steps = [
        sum(len(test.steps) for test in asked_tests(cohort, specimen, tests, all_steps))
        for specimen in specimens
    ]
    stiffness = study.outputs.stiffness
    batches = -(-study.n_runs // study.batch_size(len(specimens)))
    fitted = len(study.calibration.free) if stiffness else 0
    coordinates = len(study.outputs.motion) + len(study.outputs.joint_load)
    return DesignSize(
        runs=study.n_runs,
        outputs=max(steps) * joints * coordinates + fitted,
        design_rows=study.n_runs * len(study.factor_names),
        response_rows=study.n_runs * joints * sum(steps),
        calibrated_rows=study.n_runs * len(specimens) * stiffness,
        files=batches * len(specimens) * (2 if stiffness else 1),
    )


def check_size_of_design(
    document: YamlDocument, study: GlobalSensitivity, cohort: Cohort, root: Path
) -> Iterator[InputProblem]:
    """Refuse a study for which there is not enough disk or memory, before it starts.

    What an earlier run of the study has left counts as disk that is there for it.
    """
    size = size_of_design(study, cohort)
    folder = root / RESULTS / study.study
    kept = sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())
    yield from _short(document, size, "disk", size.on_disk, free_disk(folder) + kept)
    yield from _short(document, size, "memory", size.in_memory, available_memory())


def _short(
    document: YamlDocument, size: DesignSize, what: str, needed: int, there: int | None
) -> Iterator[InputProblem]:
    if there is None or needed <= there:
        return
    runs = f"{size.runs:,} runs per specimen and {size.response_rows:,} rows of responses"
    found = f"{runs}: about {_read(needed)} of {what}"
    place = document.place_of("design.samples")
    remedy = "take fewer samples, factors, tests, steps or specimens, or make room"
    yield InputProblem(*place, found, f"what there is, {_read(there)} of {what}", remedy)


def free_disk(folder: Path) -> int:
    """Bytes that are free where a folder is or will be."""
    while not folder.exists():
        folder = folder.parent
    return shutil.disk_usage(folder).free


def available_memory(meminfo: Path = MEMINFO) -> int | None:
    """Bytes that programs can have without swapping; None where the system does not say."""
    if not meminfo.is_file():
        return None
    for line in meminfo.read_text().splitlines():
        name, _, amount = line.partition(":")
        if name == "MemAvailable":
            return 1024 * int(amount.split()[0])
    return None


def _read(size: int) -> str:
    """Bytes in words."""
    return f"{size / 1e9:,.1f} GB" if size >= 1e8 else f"{size / 1e6:,.0f} MB"
