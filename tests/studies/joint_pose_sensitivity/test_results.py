"""What the tables of a real run say must agree with one another.

What would be caught: simulations with another stiffness or pose than they are filed under, or that
hang on more of the ranking than the set that they take from it.
"""

import json
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.dataset as ds
import pytest
from small_project import Project

from spinepipe.jobs.expected import Expected
from spinepipe.marks import read_json, read_mark, with_mark
from spinepipe.studies.read import check
from spinepipe.units import COORDINATE_COLUMNS

pytestmark = pytest.mark.slow


def table(eight: Project, name: str) -> pd.DataFrame:
    return pd.read_parquet(eight.path(f"results/joint_pose_sensitivity/{name}.parquet"))


def test_errors_of_a_calibration_are_those_of_its_simulation(eight: Project) -> None:
    """The fit solves each pose from its neighbour, the simulation along the load path."""
    simulated = table(eight, "simulations")
    simulated = simulated[simulated["stiffness"] == "calibrated"]
    for _, row in table(eight, "calibrations").iterrows():
        own = simulated[simulated["pose"] == row["pose"]]
        for column in COORDINATE_COLUMNS:
            name, unit = column.rsplit("_", 1)
            expected = own[f"error_{column}"].abs().mean()
            np.testing.assert_allclose(row[f"{name}_error_{unit}"], expected, rtol=0, atol=1e-6)


def test_job_files_open_as_one_data_set(eight: Project) -> None:
    jobs = ds.dataset(
        eight.path("results/joint_pose_sensitivity/jobs"), partitioning="hive"
    ).to_table()
    rows = table(eight, "simulations")
    assert jobs.num_rows == len(rows)
    assert set(jobs["pose"].to_pylist()) == set(rows["pose"])


def test_a_simulation_hangs_on_its_own_set_of_the_ranking(eight: Project, tmp_path: Path) -> None:
    study = "joint_pose_sensitivity"
    shutil.copytree(eight.path("config"), tmp_path / "config")
    best = tmp_path / f"results/{study}/best.json"
    best.parent.mkdir(parents=True)
    shutil.copy(eight.path(f"results/{study}/best.json"), best)

    def marks() -> dict[str, str]:
        told = Expected(str(tmp_path), *check(tmp_path, study))
        place = {"specimen": "s01", "pose": "0000"}
        names = ("best01", "best02", "calibrated")
        return {name: told.of_job("simulate", {**place, "stiffness": name}) for name in names}

    before, ranked, mark = marks(), read_json(best), read_mark(best)
    ranked["s01"][1]["stiffness"] = ranked["s01"][0]["stiffness"]
    best.write_text(json.dumps(with_mark(ranked, mark), indent=1))
    after = marks()
    assert {name for name in before if before[name] != after[name]} == {"best02"}
