"""A study of range of motion from beginning to end, and what is computed again."""

from pathlib import Path

import grid_cases
import numpy as np
import pandas as pd
import pyarrow.dataset as ds
import pyarrow.parquet as pq
import pytest
from small_project import Project, Shared, copy_project

from spinepipe.studies.range_of_motion.kind import KIND

pytestmark = pytest.mark.slow

TABLES = [table.name for table in KIND.tables]
FIGURES = [figure.name for figure in KIND.figures]
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
        *(f"figures/{name}.{kind}" for name in FIGURES for kind in ("svg", "png")),
    )
}
"""What is made of job files, but for their blocks."""


def build(folder: Path) -> Project:
    project = copy_project(folder)
    grid_cases.project(folder, STUDY)
    project.run()
    return project


@pytest.fixture
def computed(shared: Shared) -> Project:
    """A project whose study has been computed; built once and not to be changed."""
    return shared.project("grid", build)


@pytest.fixture
def grid(computed: Project, tmp_path: Path) -> Project:
    """The same, for one test to change."""
    return computed.copy(tmp_path / "project")


def jobs(files: set[str]) -> set[str]:
    return {name for name in files if name.startswith(f"{RESULTS}jobs/")}


def table(project: Project, name: str) -> pd.DataFrame:
    return pd.read_parquet(project.path(f"results/{RESULTS}{name}.parquet"))


def test_a_run_makes_every_table_figure_and_job_file(computed: Project) -> None:
    files = set(computed.files())
    assert OF_MOTION | {f"{RESULTS}{name}.parquet" for name in TABLES} <= files
    assert len(jobs(files)) == 3 * 4 * 4
    rows = table(computed, "range_of_motion")
    assert len(rows) == 48 * 2 * 3
    assert set(rows["stiffness"]) == {0, 1, 2, 3}
    assert set(rows["status"]) == {"converged"}


def test_tables_keep_their_schemas_name_their_makers_and_have_no_nan(computed: Project) -> None:
    for name in TABLES:
        found = pq.read_table(computed.path(f"results/{RESULTS}{name}.parquet"))
        assert found.schema.remove_metadata() == KIND.table(name).schema, name
        assert {b"seed", b"code_digest", b"config_digest"} <= set(found.schema.metadata), name
        for column in found.column_names:
            if str(found.schema.field(column).type) == "double":
                assert np.isfinite(found[column].drop_null().to_numpy()).all(), (name, column)


def test_joints_of_the_own_frames_turn_by_moment_over_stiffness(computed: Project) -> None:
    rows = table(computed, "range_of_motion")
    sets = table(computed, "stiffness_sets").set_index(["stiffness", "joint"])
    own = rows[(rows["pose"] == 0) & (rows["test"] == "flexion")]
    for _, row in own.iterrows():
        stiffness = sets.loc[(row["stiffness"], row["joint"]), "extension_nm_per_rad"]
        assert row["predicted_extension_deg"] == pytest.approx(np.rad2deg(-7.5 / stiffness))


def test_job_files_open_as_one_data_set(computed: Project) -> None:
    found = ds.dataset(computed.path(f"results/{RESULTS}jobs"), partitioning="hive").to_table()
    assert found.num_rows == len(table(computed, "range_of_motion"))


def test_a_lost_job_file_is_computed_again_alone(grid: Project) -> None:
    before = grid.contents()
    assert grid.planned() == set()
    grid.path(f"results/{JOB}").unlink()
    assert jobs(grid.rerun()) == {JOB}
    after = grid.contents()
    assert {name for name in before if before[name] != after[name]} == set()


def test_other_draws_of_stiffness_leave_the_frames_alone(grid: Project) -> None:
    grid.edit(
        f"config/studies/{grid_cases.STUDY}.yaml", "poses: 4", "stiffness_spread: 3\nposes: 4"
    )
    planned = grid.planned()
    assert f"{RESULTS}stiffness_sets.parquet" in planned
    assert not [name for name in planned if "frames" in name]
    assert len(jobs(planned)) == 48


def test_one_changed_number_of_a_specimen_reruns_its_jobs_alone(grid: Project) -> None:
    grid.edit("config/cohorts/stack/joints.csv", "b,L2L3,0,36,", "b,L2L3,0,37,")
    of_b = {name for name in jobs(set(grid.files())) if "specimen=b/" in name}
    planned = grid.planned()
    assert len(of_b) == 16
    assert jobs(planned) == of_b
    frames = {name for name in planned if name.startswith(f"{RESULTS}frames")}
    assert frames == {f"{RESULTS}frames{part}.parquet" for part in ("", "/specimen=b")}


def test_the_report_holds_its_figures_and_fetches_nothing(computed: Project) -> None:
    page = computed.path(f"results/{RESULTS}report.html").read_text()
    for name in FIGURES:
        assert f'id="figure-{name}"' in page
    assert "default-src 'none'" in page
    assert 'src="http' not in page
    assert page.count('<table class="sortable"') == 3
    assert "96 runs of 2 tests: none without a stable equilibrium" in page
