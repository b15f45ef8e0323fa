"""The job of the posterior on made-up joints whose truth is known, and what is told of it.

Would catch intervals that miss the truth, weights of poses that are no evidence (both in `make
test-full`), and numbers told of chains that are too short.
"""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from spinepipe.report.page.study_page import ResultTables
from spinepipe.studies.joint_pose_sensitivity import poses, posterior
from spinepipe.studies.joint_pose_sensitivity.charts import posterior as posterior_chart
from spinepipe.studies.joint_pose_sensitivity.conclusions_of_parts import conclusions
from spinepipe.studies.joint_pose_sensitivity.inputs import study_and_cohort
from spinepipe.tables import StudyTables
from tests.generators.palpated_joints import START, joint, write

SEED = 6
"""A joint of which all three stiffnesses are seen."""

NAMES = ("posterior", "posterior_motion", "pose_weights")
STUDY = """\
study: felt
kind: joint_pose_sensitivity
cohort: felt
poses: {poses}
best_models: 2
stiffness: {{anterior_n_per_m: {0}, superior_n_per_m: {1}, right_n_per_m: {2},
  extension_nm_per_rad: {3}, right_bending_nm_per_rad: {4}, left_rotation_nm_per_rad: {5}}}
calibration: {{free: [anterior, superior, extension]}}
posterior: {{draws: {draws}, warm_up: {warm_up}, noise: declared, stiffness_factor: 10}}
"""


def made(root: Path, draws: int, poses_: int, warm_up: int) -> dict[str, pd.DataFrame]:
    """The three tables of one phantom."""
    cohort = root / "config" / "cohorts" / "felt"
    write({"p": joint(SEED)}, cohort)
    (root / "config" / "studies").mkdir()
    (root / "config" / "config.yaml").write_text("studies: [felt]\n")
    text = STUDY.format(*START.tolist(), draws=draws, poses=poses_, warm_up=warm_up)
    (root / "config" / "studies" / "felt.yaml").write_text(text)
    marks, placed = str(root / "landmarks.parquet"), str(root / "poses.parquet")
    poses.sample(str(root), "felt", "p", marks)
    poses.build(str(root), "felt", marks, "p", placed)
    files = [str(root / f"{name}.parquet") for name in NAMES]
    posterior.run(str(root), "felt", placed, "p", *files)
    return {name: pd.read_parquet(file) for name, file in zip(NAMES, files, strict=True)}


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, pd.DataFrame]]:
    root = tmp_path_factory.mktemp("felt")
    return root, made(root, draws=600, poses_=30, warm_up=100)


@pytest.mark.full
def test_the_truth_lies_in_the_intervals(found: tuple[Path, dict[str, pd.DataFrame]]) -> None:
    """Of one phantom; how often, `make validate` counts. Intervals of 99 %: half as wide again."""
    rows = found[1]["posterior"]
    assert (rows["status"] == "converged").all()
    truth = joint(SEED)
    stiffness = rows[rows["quantity"] == "stiffness"].set_index("unknown")
    for name, value in (
        ("anterior_n_per_m", truth.stiffness[0]),
        ("superior_n_per_m", truth.stiffness[1]),
        ("extension_nm_per_rad", truth.stiffness[3]),
    ):
        row = stiffness.loc[name]
        slack = (row["high"] / row["low"]) ** 0.2
        assert row["low"] / slack < value < row["high"] * slack
        assert not row["prior_dominated"]
    assert set(rows["quantity"]) == {"stiffness", "landmark", "joint_centre", "joint_axes"}
    assert (rows["r_hat"] <= 1.01).all()


@pytest.mark.full
def test_readings_lie_in_their_bands(found: tuple[Path, dict[str, pd.DataFrame]]) -> None:
    motion = found[1]["posterior_motion"]
    read = motion[motion["inside"].notna()]
    assert read["measured"].notna().all()
    assert read["inside"].mean() > 0.8
    assert (read["reading_high"] - read["reading_low"] > read["high"] - read["low"]).all()


@pytest.mark.full
def test_a_pose_weighs_as_its_evidence(found: tuple[Path, dict[str, pd.DataFrame]]) -> None:
    weights = found[1]["pose_weights"]
    each = weights.drop_duplicates("pose").set_index("pose")
    assert each["weight"].sum() == pytest.approx(1.0)
    assert (weights.groupby("pose").size() == 3).all()
    evidence = each["log_evidence"]
    assert np.allclose(each["weight"] / each["weight"].max(), np.exp(evidence - evidence.max()))


def test_chains_too_short_tell_no_numbers(tmp_path: Path) -> None:
    tables = made(tmp_path, draws=10, poses_=3, warm_up=20)
    rows, motion = tables["posterior"], tables["posterior_motion"]
    drawn = rows[rows["r_hat"].notna()]
    assert (drawn["status"] == "not_converged").all()
    assert drawn["message"].str.contains("take more draws").all()
    assert drawn[["mean", "median", "low", "high", "prior_dominated"]].isna().all(axis=None)
    assert drawn["laplace_mean"].notna().all()
    assert motion[["median", "inside"]].isna().all(axis=None)
    settings, cohort = study_and_cohort(str(tmp_path), "felt")
    told = {one.rule: one for one in conclusions(settings, ResultTables(StudyTables(tables)))}
    assert told["sampler"].names == {"specimens": "p"}
    assert "band" not in told
    assert "did not converge" in posterior_chart(settings, cohort, tables).caption
