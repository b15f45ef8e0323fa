"""A global sensitivity study through the whole workflow, its indices known in closed form.

One stiff joint without weight under a small force F at a point p: it extends by
(p_x F_y - p_y F_x) / k, linear in the point. With normal offsets of the point the shares of the
variance are (F_y s_x)^2 and (F_x s_y)^2 over their sum; nothing else moves the joint.
"""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from lever import FORCE_N, MEASURED_DEG, POINT_MM, lever, table
from small_project import Project, Shared

pytestmark = pytest.mark.slow

RESTS_ON = ("base_stiffness", "base_motion", "failed_runs")
SHARES = {"load_point_x": 0.8, "load_point_y": 0.2, "bending": 0.0, "dummy": 0.0}


def moment_nm(design: pd.DataFrame) -> "pd.Series[float]":
    """Of the force about the joint, by sample."""
    x = (POINT_MM[0] + design["load_point_x"]) / 1000.0
    y = (POINT_MM[1] + design["load_point_y"]) / 1000.0
    return x * FORCE_N[1] - y * FORCE_N[0]


def build(folder: Path) -> Project:
    """A study large enough to tell shares; two that differ in how many samples a job computes."""
    few = ("single", 8, ""), ("batches", 8, "samples_per_target: 7")
    project = lever(folder, ("known", 64, "samples_per_target: 100"), *few)
    project.run(*(file for name in ("known", "single", "batches") for file in tables(name)))
    return project


def tables(study: str) -> list[str]:
    """All tables of a study."""
    names = ("design", "responses", "indices", "convergence", *RESTS_ON)
    return [f"results/{study}/{name}.parquet" for name in names]


@pytest.fixture
def computed(shared: Shared) -> Project:
    """The same, built once and not to be changed."""
    return shared.project("lever", build)


def test_known_shares_lie_in_their_intervals(computed: Project) -> None:
    rows = table(computed, "known", "indices")
    assert set(rows["specimen"]) == {"a", "b"}
    assert set(rows["output"]) == {"motion", "joint_load"}
    assert (rows["status"] == "done").all()
    assert (rows["failed"] == 0).all()
    assert (rows["runs"] == 64 * (4 + 2)).all()
    for row in rows[rows["index"].isin(["S1", "ST"])].itertuples():
        expected = SHARES[row.factor]
        assert row.ci_low - 1e-3 <= expected <= row.ci_high + 1e-3, row
        assert row.estimate == pytest.approx(expected, abs=0.25)


def test_motion_is_the_lever_s(computed: Project) -> None:
    """Each run by hand: moment of the force about the joint over its stiffness, 51 N m/rad."""
    design = table(computed, "known", "design").pivot(
        index="sample", columns="factor", values="value"
    )
    responses = table(computed, "known", "responses")
    responses = responses[responses["specimen"] == "a"].set_index("sample")
    moment = moment_nm(design)
    found = responses["load_extension_nm"].reindex(design.index)
    assert (found - moment).abs().max() < 2e-3 * moment.abs().max()
    motion = responses["predicted_extension_deg"].reindex(design.index)
    assert (motion - 57.29578 * found / 51.0).abs().max() < 1e-9


def test_the_base_is_the_lever_too(computed: Project) -> None:
    """2 N at 20 mm less 1 N at 30 mm over 51 N m/rad; 0.01 deg were measured."""
    rows = table(computed, "known", "base_motion")
    row = rows[(rows["joint"] == "*") & (rows["specimen"] == "b")].iloc[0]
    assert row["predicted"] == pytest.approx(57.29578 * 0.01 / 51.0, rel=2e-3)
    assert row["measured"] == MEASURED_DEG
    assert row["verdict"] == "near"
    failed = table(computed, "known", "failed_runs")
    assert set(failed["factor"]) == set(SHARES)
    assert (failed["failed"] == 0).all()


def test_samples_per_target_change_no_row(computed: Project) -> None:
    jobs = "jobs/responses/specimen=a"
    count = {
        name: len(list(computed.path(f"results/{name}/{jobs}").glob("*.parquet")))
        for name in ("single", "batches")
    }
    assert count == {"single": 48, "batches": 7}
    for name in ("design", "responses", "indices", "convergence", *RESTS_ON):
        one, other = (table(computed, study, name) for study in ("single", "batches"))
        pd.testing.assert_frame_equal(one, other)


def test_a_lost_sample_is_computed_again_and_nothing_else_changes(
    computed: Project, tmp_path: Path
) -> None:
    project = lever(tmp_path / "project", ("single", 8, ""))
    project.run(cores=1)
    before, files = project.contents(), project.files()
    for name, content in before.items():
        if name.endswith("parquet"):  # made on one core, the other on two
            assert computed.path(f"results/{name}").read_bytes() == content, name
    lost = "single/jobs/responses/specimen=b/batch=00017.parquet"
    project.path(f"results/{lost}").unlink()
    project.run()
    after = project.files()
    assert after[lost] != files[lost]
    others = {name for name in files if "/jobs/" in name and name != lost}
    assert all(after[name] == files[name] for name in others)
    assert project.contents() == before


def test_calibrated_stiffness_is_the_lever_s(tmp_path: Path) -> None:
    """Fitted to one reading, each sample's stiffness is its moment over that angle."""
    more = "seed: 3\ncalibration: {free: [extension]}"
    project = lever(tmp_path / "project", ("fitted", 16, more))
    project.edit("config/studies/fitted.yaml", "sd: 5", "sd: 0.5")
    project.edit("config/studies/fitted.yaml", "joint_load: [extension]}", "stiffness: true}")
    project.edit("config/studies/fitted.yaml", "bootstraps: 200", "stiffness: fitted")
    project.run()
    base = table(project, "fitted", "base_stiffness").query("coordinate == 'extension'")
    by_hand = 0.01 / np.deg2rad(MEASURED_DEG)  # N m over rad, without factors
    assert base["stiffness"].to_numpy() == pytest.approx([by_hand, by_hand], rel=0.01)
    assert set(base["source"]) == {"fitted"}
    design = table(project, "fitted", "design").pivot(
        index="sample", columns="factor", values="value"
    )
    fitted = table(project, "fitted", "calibrated")
    assert (fitted["status"] == "converged").all()
    fitted = fitted[fitted["specimen"] == "a"].set_index("sample")
    expected = moment_nm(design) / np.deg2rad(MEASURED_DEG)
    ratio = fitted["extension_nm_per_rad"].reindex(design.index) / expected
    assert ratio.between(0.99, 1.01).all()
    indices = table(project, "fitted", "indices")
    of_fit = indices[(indices["output"] == "stiffness") & (indices["index"] == "S1")]
    assert set(of_fit["factor"]) == set(SHARES)
    assert (of_fit["status"] == "done").all()
    biggest = of_fit.loc[of_fit["estimate"].idxmax(), "factor"]
    assert biggest == "load_point_x"
