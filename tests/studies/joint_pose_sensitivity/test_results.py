"""What the tables of a real run say must agree with one another.

What would be caught: simulations with another stiffness or pose than they are filed under, or that
hang on more of the ranking than the set that they take from it.
"""

import numpy as np
import pandas as pd
import pyarrow.dataset as ds
import pytest
from small_project import Project

from spinepipe.marks import read_json
from spinepipe.studies.joint_pose_sensitivity.filters import rank_fits
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


def test_simulations_are_with_the_sets_of_the_ranking(eight: Project) -> None:
    """That each specimen's own calibrations give, as `best.json` has them for people."""
    study = "joint_pose_sensitivity"
    settings, _ = check(eight.folder, study)
    fits = table(eight, "calibrations")
    best = read_json(eight.path(f"results/{study}/best.json"))
    assert set(best) == {"s01"}
    assert best["s01"] == rank_fits(settings, fits)[: settings.best_models]
    names = {one["name"] for one in best["s01"]}
    assert set(table(eight, "simulations")["stiffness"]) == {"calibrated", *names}
