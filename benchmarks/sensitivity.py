"""Global sensitivity studies of full size, as a user runs them: time, memory, repeats."""

import contextlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from pyarrow import parquet

from benchmarks.memory import per_row
from benchmarks.study import Run, copy_of_project, run_workflow
from spinepipe.marks import read_mark
from spinepipe.sensitivity_analysis.global_indices.spread import values_of
from spinepipe.statics.batched import solve_many
from spinepipe.studies.global_sensitivity.batch import start_of_specimen
from spinepipe.studies.global_sensitivity.sampling import design_of, spreads_of
from spinepipe.studies.global_sensitivity.settings import GlobalSensitivity
from spinepipe.studies.global_sensitivity.vary import vary
from spinepipe.studies.read import check

STUDY = "bench_factors"
JOINTS = {
    "palanca_l1l4": ("L3L4", "L2L3", "L1L2"),
    "t12s1_phantom": ("L5S1", "L4L5", "L3L4", "L2L3", "L1L2", "T12L1"),
}
ROTATIONS = ("extension", "right_bending", "left_rotation")
FACTORS = 23
"""Factors of each study; the dummy is the 24th."""

FIRST_SAMPLES = 2000
"""Of which it is counted how many the engine of record had to solve."""

_TEXT = """\
study: {study}
kind: global_sensitivity
cohort: {cohort}
specimens: [{specimen}]
factors:
{factors}
design: {{method: {method}, samples: {samples}}}
samples_per_target: {per_target}
"""


@dataclass(frozen=True)
class Size:
    """A study to time: what is said of it, its cohort, settings, and the goal of its cold run."""

    what: str
    cohort: str
    specimen: str
    method: str
    samples: int
    per_target: str
    goal: str


SOBOL = (
    Size(
        "L1-L4, Sobol, 24 factors, N = 1024",
        "palanca_l1l4",
        "s01",
        "sobol",
        1024,
        "null",
        "60 s, 1.5 GB",
    ),
    Size(
        "T12-S1, Sobol, 24 factors, N = 1024",
        "t12s1_phantom",
        "s01",
        "sobol",
        1024,
        "null",
        "120 s",
    ),
)
TARGETS = tuple(
    Size(f"{n:,} samples, a target each", "palanca_l1l4", "s01", "latin_hypercube", n, "1", goal)
    for n, goal in ((100, ""), (1000, ""), (5000, ""), (20_000, "240 s"))
)


@dataclass(frozen=True)
class Sobol:
    """A study of full size.

    Attributes
    ----------
    equilibria : that its table holds. handed_on : share of them, of its first samples, that the
        engine of record had to solve, in each test.
    design_bytes, join_bytes : memory per row of drawing the design and of joining the responses.
    """

    joints: int
    equilibria: int
    handed_on: dict[str, float]
    design_bytes: float
    join_bytes: float
    responses: Run
    indices: Run
    rest: Run

    @property
    def runs(self) -> tuple[Run, ...]:
        """Runs of the workflow."""
        return self.responses, self.indices, self.rest


@dataclass(frozen=True)
class Targets:
    """A study of so many targets: cold, again, and after losing one sample in a hundred."""

    targets: int
    cold: Run
    again: Run
    lost: Run

    @property
    def runs(self) -> tuple[Run, ...]:
        """Runs of the workflow."""
        return self.cold, self.again, self.lost


def sobol_runs() -> Iterator[Sobol]:
    """Responses, then indices, of each study."""
    for size in SOBOL:
        with _project(size) as folder:
            table, joints = f"results/{STUDY}/responses.parquet", len(JOINTS[size.cohort])
            cold = run_workflow(f"{size.what}: responses", folder, [table], size.goal)
            indices = [f"results/{STUDY}/indices.parquet"]
            rows = parquet.read_metadata(Path(folder, table)).num_rows
            yield Sobol(
                joints,
                rows // joints,
                _handed_on(folder, size.specimen),
                _design_bytes(folder),
                _join_bytes(folder, rows),
                cold,
                run_workflow(f"{size.what}: indices", folder, indices, "60 s"),
                run_workflow(f"{size.what}: all the rest", folder, ["all"], ""),
            )


def _handed_on(folder: str, specimen: str) -> dict[str, float]:
    """Share of spines that are not solved among many, by test."""
    study, cohort = check(Path(folder), STUDY)
    assert isinstance(study, GlobalSensitivity)
    values = values_of(design_of(study), spreads_of(study))[:FIRST_SAMPLES]
    start = start_of_specimen(folder, STUDY, specimen, False, cohort.digest, ())
    varied = vary(start, study.changes, values)
    return {
        cases.like.test: float(solve_many(varied.spines, cases).by_engine.mean())
        for cases in varied.cases
    }


def _design_bytes(folder: str) -> float:
    rows = parquet.read_metadata(f"{folder}/results/{STUDY}/design.parquet").num_rows
    call = f"job.run({folder!r}, {STUDY!r}, {f'{folder}/drawn.parquet'!r})"
    return per_row("studies.global_sensitivity.design", call, rows)


def _join_bytes(folder: str, rows: int) -> float:
    blocks = Path(folder, f"results/{STUDY}/blocks/responses").rglob("*.parquet")
    paths = [str(path) for path in sorted(blocks)]
    marks, output = {path: read_mark(path) for path in paths}, f"{folder}/joined.parquet"
    shape = "kind_of('global_sensitivity').table('responses')"
    call = f"job.join_files({shape}, {marks!r}, {output!r})"
    return per_row("jobs.collect", f"from spinepipe.studies.registry import kind_of; {call}", rows)


def target_runs() -> Iterator[Targets]:
    """Growth with the number of targets."""
    for size in TARGETS:
        with _project(size) as folder:
            wanted = [f"results/{STUDY}/responses.parquet"]
            last = size.samples == TARGETS[-1].samples
            cold = run_workflow(f"{size.what}: cold", folder, wanted, size.goal)
            again = run_workflow(f"{size.what}: nothing to do", folder, wanted, "20 s" * last)
            jobs = Path(folder, f"results/{STUDY}/jobs/responses")
            lost = sorted(jobs.glob("*/*.parquet"))[::100]
            for path in lost:
                path.unlink()
            files = [path.relative_to(folder).as_posix() for path in lost]
            run = run_workflow(f"{size.what}: 1 % lost", folder, [*wanted, *files], "30 s" * last)
            yield Targets(size.samples, cold, again, run)


@contextlib.contextmanager
def _project(size: Size) -> Iterator[str]:
    """A copy of the project with this study alone."""
    with copy_of_project() as folder:
        for other in Path(folder, "config", "studies").glob("*.yaml"):
            other.unlink()
        Path(folder, "config/studies", f"{STUDY}.yaml").write_text(text_of(size), encoding="utf-8")
        Path(folder, "config/config.yaml").write_text(f"studies: [{STUDY}]\n", encoding="utf-8")
        yield folder


def text_of(size: Size) -> str:
    """The study file."""
    lines = "\n".join(f"  - {{{line}}}" for line in _factors(JOINTS[size.cohort]))
    return _TEXT.format(
        study=STUDY,
        cohort=size.cohort,
        specimen=size.specimen,
        factors=lines,
        method=size.method,
        samples=size.samples,
        per_target=size.per_target,
    )


def _factors(joints: Sequence[str]) -> list[str]:
    """Loads, then stiffness and centre joint by joint, as many as there are places for."""
    found = [f"of: load_direction, axis: {axis}, offset_deg: {{sd: 2}}" for axis in "xyz"]
    found.append("of: load_size, times: {sd: 0.05}")
    found += [
        f"of: stiffness, coordinate: {name}, joints: [{joint}], times: {{low: 0.5, high: 2}}"
        for name in ROTATIONS
        for joint in joints
    ]
    found += [
        f"of: {of}, axis: {axis}, joints: [{joint}], {offset}"
        for of, axis, offset in (
            ("joint_centre", "anterior", "offset_mm: {sd: 2}"),
            ("joint_centre", "superior", "offset_mm: {sd: 2}"),
            ("joint_axes", "extension", "offset_deg: {sd: 2}"),
            ("joint_axes", "right_bending", "offset_deg: {sd: 2}"),
        )
        for joint in joints
    ]
    return found[:FACTORS]
