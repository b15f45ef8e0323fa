"""A study of range of motion from beginning to end, and what is computed again."""

import shutil
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.dataset as ds
import pyarrow.parquet as pq
import pytest
from small_project import SKIPPED, Project, copy_project, written

from spinepipe.studies.range_of_motion.kind import ROM_FIGURES, TABLES
from spinepipe.tables import TABLES as SCHEMAS

sys.path.insert(0, str(Path(__file__).parents[1] / "unit"))
import grid_cases

pytestmark = pytest.mark.slow

RESULTS = f"{grid_cases.STUDY}/"
JOB = f"{RESULTS}jobs/specimen=b/pose=0002/stiffness=01.parquet"
STUDY = (
    "poses: 4\nstiffness_sets: 4\n"
    "virtual_tests: {moment_nm: 7.5, tests: [flexion, left_rotation], steps: 3}\n"
)
OF_MOTION = {
    f"{RESULTS}{name}"
    for name in (
        *("range_of_motion.parquet", "rom_summary.parquet", "rom_variance.parquet", "report.html"),
        *(f"figures/{name}.{kind}" for name in ROM_FIGURES for kind in ("svg", "png")),
    )
}
"""What is made of job files, but for their blocks."""


@pytest.fixture(scope="module")
def _finished(tmp_path_factory: pytest.TempPathFactory) -> Project:
    folder = tmp_path_factory.mktemp("grid") / "project"
    project = copy_project(folder)
    grid_cases.project(folder, STUDY)
    project.run_all()
    return project


@pytest.fixture
def grid(_finished: Project, tmp_path: Path) -> Project:
    """A project whose study has been computed; each test has its own."""
    shutil.copytree(_finished.folder, tmp_path / "project", ignore=SKIPPED)
    return Project(tmp_path / "project")


def rerun(project: Project) -> set[str]:
    before = project.files()
    project.run_all()
    return written(before, project.files())


def jobs(files: set[str]) -> set[str]:
    return {name for name in files if name.startswith(f"{RESULTS}jobs/")}


def table(project: Project, name: str) -> pd.DataFrame:
    return pd.read_parquet(project.path(f"results/{RESULTS}{name}.parquet"))


def test_a_run_makes_every_table_figure_and_job_file(grid: Project) -> None:
    files = set(grid.files())
    assert OF_MOTION | {f"{RESULTS}{name}.parquet" for name in TABLES} <= files
    assert len(jobs(files)) == 3 * 4 * 4
    rows = table(grid, "range_of_motion")
    assert len(rows) == 48 * 2 * 3
    assert set(rows["stiffness"]) == {0, 1, 2, 3}
    assert set(rows["status"]) == {"converged"}


def test_tables_keep_their_schemas_name_their_makers_and_have_no_nan(grid: Project) -> None:
    for name in TABLES:
        found = pq.read_table(grid.path(f"results/{RESULTS}{name}.parquet"))
        assert found.schema.remove_metadata() == SCHEMAS[name].schema, name
        assert {b"seed", b"code_digest", b"config_digest"} <= set(found.schema.metadata), name
        for column in found.column_names:
            if str(found.schema.field(column).type) == "double":
                assert np.isfinite(found[column].drop_null().to_numpy()).all(), (name, column)


def test_joints_of_the_own_frames_turn_by_moment_over_stiffness(grid: Project) -> None:
    rows = table(grid, "range_of_motion")
    sets = table(grid, "stiffness_sets").set_index(["stiffness", "joint"])
    own = rows[(rows["pose"] == 0) & (rows["test"] == "flexion")]
    for _, row in own.iterrows():
        stiffness = sets.loc[(row["stiffness"], row["joint"]), "extension_nm_per_rad"]
        assert row["predicted_extension_deg"] == pytest.approx(np.rad2deg(-7.5 / stiffness))


def test_job_files_open_as_one_data_set(grid: Project) -> None:
    found = ds.dataset(grid.path(f"results/{RESULTS}jobs"), partitioning="hive").to_table()
    assert found.num_rows == len(table(grid, "range_of_motion"))


def test_nothing_is_computed_twice(grid: Project) -> None:
    assert rerun(grid) == set()


def test_a_lost_job_file_is_computed_again_alone(grid: Project) -> None:
    before = grid.contents()
    grid.path(f"results/{JOB}").unlink()
    assert jobs(rerun(grid)) == {JOB}
    after = grid.contents()
    assert {name for name in before if before[name] != after[name]} == set()


def test_other_draws_of_stiffness_leave_the_frames_alone(grid: Project) -> None:
    grid.edit(
        f"config/studies/{grid_cases.STUDY}.yaml", "poses: 4", "stiffness_spread: 3\nposes: 4"
    )
    done = rerun(grid)
    assert f"{RESULTS}stiffness_sets.parquet" in done
    assert f"{RESULTS}frames.parquet" not in done
    assert len(jobs(done)) == 48


def test_one_changed_number_of_a_specimen_reruns_its_jobs_alone(grid: Project) -> None:
    grid.edit("config/cohorts/stack/joints.csv", "b,L2L3,0,36,", "b,L2L3,0,37,")
    done = rerun(grid)
    of_b = {name for name in jobs(set(grid.files())) if "specimen=b/" in name}
    assert len(of_b) == 16
    assert jobs(done) == of_b
    frames = {name for name in done if name.startswith(f"{RESULTS}frames")}
    assert frames == {f"{RESULTS}frames{part}.parquet" for part in ("", "/specimen=b")}


def test_the_report_holds_its_figures_and_fetches_nothing(grid: Project) -> None:
    page = grid.path(f"results/{RESULTS}report.html").read_text()
    for name in ROM_FIGURES:
        assert f'id="figure-{name}"' in page
    assert "default-src 'none'" in page
    assert 'src="http' not in page
    assert page.count('<table class="sortable"') == 3
    assert "96 runs of 2 tests: none without a stable equilibrium" in page
