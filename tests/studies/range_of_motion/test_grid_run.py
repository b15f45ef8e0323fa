"""A small study of range of motion run by Snakemake: its rows, job files and page.

What would be caught: poses and stiffness sets joined to other runs, job files that are no data
set, runs that are left out or counted twice.
"""

from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.dataset as ds
import pytest
from small_project import Project

pytestmark = pytest.mark.slow

STUDY = "range_of_motion"


def jobs(files: set[str]) -> set[str]:
    return {name for name in files if name.startswith(f"{STUDY}/jobs/")}


def table(project: Project, name: str) -> pd.DataFrame:
    return pd.read_parquet(project.path(f"results/{STUDY}/{name}.parquet"))


def test_every_pose_is_tested_with_every_stiffness(eight: Project) -> None:
    assert len(jobs(set(eight.files()))) == 2 * 4 * 4
    rows = table(eight, "range_of_motion")
    assert len(rows) == 32 * 2 * 3
    assert set(rows["stiffness"]) == {0, 1, 2, 3}
    assert set(rows["status"]) == {"converged"}


def test_joints_of_the_own_frames_turn_by_moment_over_stiffness(eight: Project) -> None:
    rows = table(eight, "range_of_motion")
    sets = table(eight, "stiffness_sets").set_index(["stiffness", "joint"])
    own = rows[(rows["pose"] == 0) & (rows["test"] == "flexion")]
    for _, row in own.iterrows():
        stiffness = sets.loc[(row["stiffness"], row["joint"]), "extension_nm_per_rad"]
        assert row["predicted_extension_deg"] == pytest.approx(np.rad2deg(-7.5 / stiffness))


def test_job_files_open_as_one_data_set(eight: Project) -> None:
    found = ds.dataset(eight.path(f"results/{STUDY}/jobs"), partitioning="hive").to_table()
    assert found.num_rows == len(table(eight, "range_of_motion"))


def test_the_page_counts_the_runs(eight: Project) -> None:
    page = eight.path(f"results/{STUDY}/report.html").read_text()
    assert page.count('<details class="tab" id="table-') == 3
    assert "All 64 runs reached a stable equilibrium." in page


@pytest.mark.full
def test_other_draws_of_stiffness_leave_the_frames_alone(eight: Project, tmp_path: Path) -> None:
    grid = eight.copy(tmp_path / "project")
    spread = "stiffness_spread: 3\nposes: 4"
    grid.edit(f"config/studies/{STUDY}.yaml", "poses: 4", spread)
    planned = grid.planned()
    assert f"{STUDY}/stiffness_sets.parquet" in planned
    assert not [name for name in planned if "frames" in name]
    blocks = {name for name in grid.files() if "/blocks/range_of_motion/" in name}
    assert blocks
    assert blocks <= planned
