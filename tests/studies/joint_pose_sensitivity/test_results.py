"""What the tables of a real run say must agree with one another."""

import numpy as np
import pandas as pd
import pyarrow.dataset as ds
import pyarrow.parquet as pq
import pytest
from small_project import Project

from spinepipe.studies.joint_pose_sensitivity.kind import ALWAYS, KIND
from spinepipe.units import COORDINATE_COLUMNS

pytestmark = pytest.mark.slow


def table(finished: Project, name: str) -> pd.DataFrame:
    return pd.read_parquet(finished.path(f"results/small/{name}.parquet"))


def test_errors_of_a_calibration_are_those_of_its_simulation(finished: Project) -> None:
    """The fit solves each pose from its neighbour, the simulation along the load path."""
    simulated = table(finished, "simulations")
    simulated = simulated[simulated["stiffness"] == "calibrated"]
    for _, row in table(finished, "calibrations").iterrows():
        own = simulated[simulated["pose"] == row["pose"]]
        for column in COORDINATE_COLUMNS:
            name, unit = column.rsplit("_", 1)
            expected = own[f"error_{column}"].abs().mean()
            np.testing.assert_allclose(row[f"{name}_error_{unit}"], expected, rtol=0, atol=1e-6)


def made(finished: Project) -> list[str]:
    """Names of all tables of the study."""
    names = [path.stem for path in finished.path("results/small").glob("*.parquet")]
    assert set(ALWAYS) < set(names)
    return names


def test_no_number_is_nan_or_infinite(finished: Project) -> None:
    for name in made(finished):
        for column in table(finished, name).select_dtypes("number"):
            values = ds.dataset(finished.path(f"results/small/{name}.parquet")).to_table([column])
            assert np.isfinite(values[column].drop_null().to_numpy()).all(), column


def test_every_table_keeps_its_schema_and_names_its_makers(finished: Project) -> None:
    for name in made(finished):
        found = pq.read_table(finished.path(f"results/small/{name}.parquet"))
        assert found.schema.remove_metadata() == KIND.table(name).schema, name
        assert {b"seed", b"code_digest", b"config_digest"} <= set(found.schema.metadata), name


def test_job_files_open_as_one_data_set(finished: Project) -> None:
    jobs = ds.dataset(finished.path("results/small/jobs"), partitioning="hive").to_table()
    rows = table(finished, "simulations")
    assert jobs.num_rows == len(rows)
    assert set(jobs["pose"].to_pylist()) == set(rows["pose"])
