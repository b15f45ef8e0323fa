"""Range of motion of many real spines: a cohort outside the project, as a user runs it."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pyarrow.parquet as pq

from benchmarks.study import Run, copy_of_project, run_workflow
from spinepipe.studies.range_of_motion.settings import RangeOfMotion
from spinepipe.studies.read import check
from spinepipe.studies.registry import files_of

STUDY = "real_geometry"
COHORT_VARIABLE = "SPINEPIPE_REAL_COHORT"
"""Environment variable with the path of the cohort, where it is not given on the command line."""

POSES, SETS = 50, 4
TESTS = ("flexion", "left_bending", "left_rotation")
_TEXT = """\
study: {study}
kind: range_of_motion
cohort: {cohort}
poses: {poses}
stiffness_sets: {sets}
virtual_tests: {{moment_nm: 7.5, tests: [{tests}], steps: 10}}
"""


@dataclass(frozen=True)
class Grid:
    """What was computed: numbers of specimens, joints, job files and rows."""

    specimens: int
    joints: int
    targets: int
    rows: int
    without_equilibrium: int


def measure(cohort: Path) -> tuple[Grid, list[Run]]:
    """Run the study on a cohort cold, again, and after losing a file."""
    with copy_of_project() as folder:
        _write_study(Path(folder), cohort)
        runs = list(_runs(Path(folder)))
        return _grid(Path(folder)), runs


def _write_study(folder: Path, cohort: Path) -> None:
    """The only study of the project."""
    text = _TEXT.format(
        study=STUDY, cohort=cohort.resolve(), poses=POSES, sets=SETS, tests=", ".join(TESTS)
    )
    for other in (folder / "config" / "studies").glob("*.yaml"):
        other.unlink()
    (folder / "config" / "studies" / f"{STUDY}.yaml").write_text(text, encoding="utf-8")
    (folder / "config" / "config.yaml").write_text(f"studies: [{STUDY}]\n", encoding="utf-8")


def _runs(folder: Path) -> Iterator[Run]:
    yield run_workflow("whole study, cold", str(folder), ["all"], "600 s, 2 GB")
    yield run_workflow("nothing to do", str(folder), ["all"], "")
    (lost, *_) = sorted((folder / "results" / STUDY / "jobs").glob("*/pose-0007/*01.parquet"))
    lost.unlink()
    yield run_workflow("one job file lost", str(folder), ["all"], "")


def _grid(folder: Path) -> Grid:
    study, cohort = check(folder, STUDY)
    assert isinstance(study, RangeOfMotion)
    files = files_of(study, cohort)
    targets = sum(
        len(files.job_files("range_of_motion", *block)) for block in files.blocks("range_of_motion")
    )
    table = folder / "results" / STUDY / "range_of_motion.parquet"
    status = pq.read_table(table, columns=["status"])["status"].to_pylist()
    without = sum(ended != "converged" for ended in status)
    sizes = len(cohort.specimen_names), len(cohort.joint_names)
    return Grid(*sizes, targets, len(status), without)
