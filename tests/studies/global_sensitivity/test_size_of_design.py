"""How much a study computes: runs as SALib draws them, rows and bytes by hand, too much refused."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from cohort_cases import write
from SALib.sample import fast_sampler, latin, sobol
from SALib.sample.morris import morris
from sweeps import sweep

from spinepipe import cohort as cohorts
from spinepipe.problems import InputError
from spinepipe.studies import read as studies
from spinepipe.studies.global_sensitivity import size_of_design
from spinepipe.studies.global_sensitivity.settings import GlobalSensitivity
from spinepipe.studies.global_sensitivity.size_of_design import (
    DesignSize,
    available_memory,
    free_disk,
)
from spinepipe.studies.global_sensitivity.tables import RESPONSES
from spinepipe.tables import to_arrow
from spinepipe.tables import write as write_table

FACTORS = [
    {"of": "stiffness", "coordinate": name, "times": {"sd": 0.1}, "group": group}
    for name, group in (("extension", "stiff"), ("right_bending", "stiff"), ("superior", None))
] + [{"of": "load_size", "times": {"sd": 0.1}}]


def study(method: str, samples: int, grouped: bool = False, **more: object) -> GlobalSensitivity:
    """A study of four factors and the dummy, perhaps two of them in a group."""
    factors = [{**factor, "group": factor.get("group") if grouped else None} for factor in FACTORS]
    design = {"method": method, "samples": samples} | {
        key: more.pop(key) for key in ("second_order",) if key in more
    }
    return GlobalSensitivity(
        study="probe",
        kind="global_sensitivity",
        cohort="small",
        factors=factors,
        design=design,
        **more,
    )


def drawn(found: GlobalSensitivity) -> int:
    """Runs of SALib's own design."""
    names = list(found.factor_names)
    problem = {"num_vars": len(names), "names": names, "bounds": [[0.0, 1.0]] * len(names)}
    if found.groups != found.factor_names:
        problem["groups"] = list(found.groups)
    n, design = found.design.samples, found.design
    if design.method == "sobol":
        return len(sobol.sample(problem, n, calc_second_order=design.second_order, seed=1))
    sampler = {"latin_hypercube": latin, "morris": morris, "fast": fast_sampler}[design.method]
    return len(sampler.sample(problem, n, seed=1))


@sweep(
    "asked, runs",
    [
        (study("sobol", 16), 16 * 12),
        (study("sobol", 16, second_order=False), 16 * 7),
        (study("sobol", 16, grouped=True), 16 * 10),
        (study("sobol", 16, dummy=False), 16 * 10),
        (study("morris", 10), 10 * 6),
        (study("morris", 10, grouped=True), 10 * 5),
        (study("fast", 65), 65 * 5),
        (study("latin_hypercube", 50), 50),
    ],
)
def test_runs_are_those_that_are_drawn(asked: GlobalSensitivity, runs: int) -> None:
    assert asked.n_runs == runs == drawn(asked)


@pytest.fixture
def root(tmp_path: Path) -> Path:
    """A project with two specimens of two joints, one test of three steps, and a study."""
    (tmp_path / "config" / "studies").mkdir(parents=True)
    write(tmp_path / "config" / "cohorts" / "small")
    (tmp_path / "config" / "studies" / "probe.yaml").write_text(
        "study: probe\nkind: global_sensitivity\ncohort: small\ndesign: {samples: 64}\nfactors:\n"
        "  - {of: load_size, times: {sd: 0.1}}\n  - {of: damping, times: {sd: 0.1}}\n"
    )
    return tmp_path


def test_rows_and_files_of_a_small_study(root: Path) -> None:
    cohort = cohorts.read(root / "config" / "cohorts" / "small")
    of_all_steps = study("latin_hypercube", 50, steps="all", samples_per_target=20)
    found = size_of_design.size_of_design(of_all_steps, cohort)
    # 2 specimens x 50 runs x 3 steps x 2 joints; 3 batches each; 6 coordinates of 2 joints, 3 steps
    assert found == DesignSize(50, 36, 250, 600, 0, 6)
    free = ["extension", "right_bending", "left_rotation"]
    outputs = {"motion": ["right"], "stiffness": True}
    with_stiffness = study("latin_hypercube", 50, outputs=outputs, calibration={"free": free})
    found = size_of_design.size_of_design(with_stiffness, cohort)
    assert found == DesignSize(50, 2 * 4 + 3, 250, 200, 100, 200)


def test_bytes_grow_with_rows() -> None:
    one = DesignSize(1000, 6, 5000, 10**6, 0, 10)
    ten = DesignSize(1000, 6, 5000, 10**7, 0, 10)
    assert ten.on_disk - one.on_disk == 3 * 120 * 9 * 10**6
    assert ten.in_memory - one.in_memory == 400 * 9 * 10**6


def test_stated_bytes_per_row_hold(tmp_path: Path) -> None:
    """Random numbers cannot be packed: no rows take more than these."""
    rows = 20_000
    rng = np.random.default_rng(3)
    columns = {c.name: rng.normal(size=rows) for c in RESPONSES.columns if c.type == "number"}
    samples = np.repeat(np.arange(rows // 4), 4).tolist()
    names = {
        "specimen": ["s01"] * rows,
        "sample": samples,
        "test": ["flexion_extension"] * rows,
        "step": [1] * rows,
        "joint": ["L4L5", "L3L4", "L2L3", "L1L2"] * (rows // 4),
        "status": ["converged"] * rows,
        "message": [""] * rows,
    }
    write_table(to_arrow(RESPONSES, columns | names), tmp_path / "r.parquet", {})
    per_row = (tmp_path / "r.parquet").stat().st_size / rows
    assert 0.8 * size_of_design.RESPONSE_ON_DISK < per_row < size_of_design.RESPONSE_ON_DISK


def complaint(root: Path) -> str:
    with pytest.raises(InputError) as caught:
        studies.check(root, "probe")
    (problem,) = caught.value.problems
    assert (problem.row, problem.column) == (4, "design.samples")
    return str(problem)


def short_of_disk(monkeypatch: pytest.MonkeyPatch, free: int) -> None:
    usage = shutil.disk_usage(Path.cwd())
    monkeypatch.setattr(shutil, "disk_usage", lambda _: usage._replace(free=free))


def test_too_little_disk_is_refused_with_the_estimate(
    root: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    short_of_disk(monkeypatch, 3_000_000)
    # 64 x 8 = 512 runs x 2 specimens x 2 joints = 2,048 rows, 1,024 files of one run
    rows, files, design = 3 * 120 * 2048, 12_000 * 1024, 10 * 512 * 3
    said = complaint(root)
    assert "512 runs per specimen and 2,048 rows of responses" in said
    assert f"about {(rows + files + design) / 1e6:,.0f} MB of disk" in said
    assert "what there is, 3 MB of disk" in said
    study, _ = studies.check(root, "probe", starting=False)
    assert study.study == "probe", "a job of a study that runs asks no more"


def test_what_was_stored_already_counts_as_there(
    root: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = root / "results" / "probe" / "jobs"
    folder.mkdir(parents=True)
    (folder / "old.parquet").write_bytes(b"0" * 12_000_000)
    short_of_disk(monkeypatch, 3_000_000)
    assert studies.check(root, "probe")[0].study == "probe"


def test_too_little_memory_is_refused(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(size_of_design, "available_memory", lambda: 500_000_000)
    assert "what there is, 0.5 GB of memory" in complaint(root)
    monkeypatch.setattr(size_of_design, "available_memory", lambda: None)
    assert studies.check(root, "probe")[0].study == "probe"


def test_a_study_with_faults_is_not_measured(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = root / "config" / "studies" / "probe.yaml"
    file.write_text(file.read_text() + "tests: [flexon]\n")
    short_of_disk(monkeypatch, 0)
    with pytest.raises(InputError) as caught:
        studies.check(root, "probe")
    assert [problem.column for problem in caught.value.problems] == ["tests.0"]


def test_available_memory_is_what_the_system_says(tmp_path: Path) -> None:
    file = tmp_path / "meminfo"
    file.write_text("MemTotal:       16000 kB\nMemAvailable:    8000 kB\n")
    assert available_memory(file) == 8000 * 1024
    file.write_text("MemTotal:       16000 kB\n")
    assert available_memory(file) is None
    assert available_memory(tmp_path / "nothing") is None


def test_free_disk_of_a_folder_that_is_not_there_yet(tmp_path: Path) -> None:
    there = shutil.disk_usage(tmp_path).free
    assert free_disk(tmp_path / "results" / "probe") == pytest.approx(there, rel=0.05)
