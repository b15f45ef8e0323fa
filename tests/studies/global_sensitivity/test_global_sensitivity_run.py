"""A global sensitivity study through all of its jobs, its indices known in closed form.

One stiff joint without weight under a small force F at a point p: it extends by
(p_x F_y - p_y F_x) / k, linear in the point. With normal offsets of the point the shares of the
variance are (F_y s_x)^2 and (F_x s_y)^2 over their sum; nothing else moves the joint.

What would be caught: factors that change something else than they say, responses or fits joined
to other samples, indices of another output, rows that hang on how samples are shared out to jobs.
"""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from lever import FORCE_N, MEASURED_DEG, POINT_MM, table, tables_of, write_lever
from small_project import Project

pytestmark = pytest.mark.slow

STUDY = "global_sensitivity"
SHARES = {"load_point_x": 0.8, "load_point_y": 0.2, "bending": 0.0, "dummy": 0.0}


def moment_nm(design: pd.DataFrame) -> "pd.Series[float]":
    """Of the force about the joint, by sample."""
    x = (POINT_MM[0] + design["load_point_x"]) / 1000.0
    y = (POINT_MM[1] + design["load_point_y"]) / 1000.0
    return x * FORCE_N[1] - y * FORCE_N[0]


def test_known_shares_lie_in_their_intervals(eight: Project) -> None:
    rows = table(eight, STUDY, "indices")
    assert set(rows["specimen"]) == {"a", "b"}
    assert set(rows["output"]) == {"motion", "joint_load"}
    assert (rows["status"] == "done").all()
    assert (rows["failed"] == 0).all()
    assert (rows["runs"] == 64 * (4 + 2)).all()
    for row in rows[rows["index"].isin(["S1", "ST"])].itertuples():
        expected = SHARES[row.factor]
        assert row.ci_low - 1e-3 <= expected <= row.ci_high + 1e-3, row
        assert row.estimate == pytest.approx(expected, abs=0.25)


def test_motion_is_the_lever_s(eight: Project) -> None:
    """Each run by hand: moment of the force about the joint over its stiffness, 51 N m/rad."""
    design = table(eight, STUDY, "design").pivot(index="sample", columns="factor", values="value")
    responses = table(eight, STUDY, "responses")
    responses = responses[responses["specimen"] == "a"].set_index("sample")
    moment = moment_nm(design)
    found = responses["load_extension_nm"].reindex(design.index)
    assert (found - moment).abs().max() < 2e-3 * moment.abs().max()
    motion = responses["predicted_extension_deg"].reindex(design.index)
    assert (motion - 57.29578 * found / 51.0).abs().max() < 1e-9


def test_the_base_is_the_lever_too(eight: Project) -> None:
    """2 N at 20 mm less 1 N at 30 mm over 51 N m/rad; 0.01 deg were measured."""
    rows = table(eight, STUDY, "base_motion")
    row = rows[(rows["joint"] == "*") & (rows["specimen"] == "b")].iloc[0]
    assert row["predicted"] == pytest.approx(57.29578 * 0.01 / 51.0, rel=2e-3)
    assert row["measured"] == MEASURED_DEG
    assert row["verdict"] == "near"
    failed = table(eight, STUDY, "failed_runs")
    assert set(failed["factor"]) == set(SHARES)
    assert (failed["failed"] == 0).all()


def test_samples_per_target_change_no_row(tmp_path: Path) -> None:
    few = ("single", 8, ""), ("batches", 8, "samples_per_target: 7")
    write_lever(Project(tmp_path), *few)
    single, batches = (tables_of(tmp_path, name) for name in ("single", "batches"))
    jobs = tmp_path / "results"
    assert len(list(jobs.glob("single/jobs/responses/specimen-a/*.parquet"))) == 48
    assert len(list(jobs.glob("batches/jobs/responses/specimen-a/*.parquet"))) == 7
    assert single.keys() == batches.keys()
    for name in single:
        pd.testing.assert_frame_equal(single[name], batches[name])


def test_calibrated_stiffness_is_the_lever_s(tmp_path: Path) -> None:
    """Fitted to one reading, each sample's stiffness is its moment over that angle."""
    more = "seed: 3\nsamples_per_target: 100\ncalibration: {free: [extension]}"
    project = Project(tmp_path)
    write_lever(project, ("fitted", 16, more))
    project.edit("config/studies/fitted.yaml", "sd: 5", "sd: 0.5")
    project.edit("config/studies/fitted.yaml", "joint_load: [extension]}", "stiffness: true}")
    project.edit("config/studies/fitted.yaml", "bootstraps: 200", "stiffness: fitted")
    found = tables_of(tmp_path, "fitted")
    base = found["base_stiffness"].query("coordinate == 'extension'")
    by_hand = 0.01 / np.deg2rad(MEASURED_DEG)  # N m over rad, without factors
    assert base["stiffness"].to_numpy() == pytest.approx([by_hand], rel=0.01)
    assert set(base["source"]) == {"fitted"}
    design = found["design"].pivot(index="sample", columns="factor", values="value")
    fitted = found["calibrated"].set_index("sample")
    assert (fitted["status"] == "converged").all()
    expected = moment_nm(design) / np.deg2rad(MEASURED_DEG)
    ratio = fitted["extension_nm_per_rad"].reindex(design.index) / expected
    assert ratio.between(0.99, 1.01).all()
    indices = found["indices"]
    of_fit = indices[(indices["output"] == "stiffness") & (indices["index"] == "S1")]
    assert set(of_fit["factor"]) == set(SHARES)
    assert (of_fit["status"] == "done").all()
    biggest = of_fit.loc[of_fit["estimate"].idxmax(), "factor"]
    assert biggest == "load_point_x"
