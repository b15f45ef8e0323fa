"""Calibrations of the poses of a block in one stack.

Would catch a pose whose fit hangs on its neighbours, and one whose refusal gets lost.
"""

import shutil
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from spinepipe.calibration import fit_alike
from spinepipe.designs import specimen_seed
from spinepipe.model import RefusedModel
from spinepipe.studies.joint_pose_sensitivity import calibrate, poses
from spinepipe.studies.joint_pose_sensitivity.inputs import study_and_cohort
from spinepipe.tables import read_frame

STUDY, SPECIMEN, COUNT = "few", "s01", 4
TEXT = f"""\
study: {STUDY}
kind: joint_pose_sensitivity
cohort: palanca_l1l4
poses: {COUNT}
best_models: 1
calibration:
  starts: 2
  free: [anterior, superior, extension]
  weights: {{anterior: 10, superior: 100, right: 1, extension: 1}}
"""


@pytest.fixture(scope="module")
def root(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study of a few sampled poses."""
    folder, cohort = tmp_path_factory.mktemp("few"), Path("config/cohorts/palanca_l1l4")
    shutil.copytree(Path(__file__).parents[3] / cohort, folder / cohort)
    (folder / "config/studies").mkdir()
    (folder / f"config/studies/{STUDY}.yaml").write_text(TEXT)
    landmarks, sampled = str(folder / "landmarks.parquet"), str(folder / "poses.parquet")
    poses.sample(str(folder), STUDY, SPECIMEN, landmarks)
    poses.build(str(folder), STUDY, landmarks, SPECIMEN, sampled)
    return folder


def run(root: Path, folder: Path, *numbers: int) -> dict[int, Any]:
    """Row of each pose from the file that the job writes of it."""
    folder.mkdir(exist_ok=True)
    files = {n: folder / f"pose-{n:04d}.parquet" for n in numbers}
    parts = {str(path): {"pose": f"{n:04d}"} for n, path in files.items()}
    calibrate.run(str(root), STUDY, str(root / "poses.parquet"), SPECIMEN, parts)
    return {n: read_frame(path).iloc[0] for n, path in files.items()}


def test_a_pose_alone_is_as_among_its_neighbours(root: Path, tmp_path: Path) -> None:
    together = run(root, tmp_path, *range(COUNT))
    for pose in range(COUNT):
        alone = run(root, tmp_path / "alone", pose)[pose]
        assert alone["status"] == "converged"
        for name, value in alone.items():
            assert together[pose][name] == value or pd.isna(value), name


def test_a_pose_that_is_refused_by_the_fit_is_told_in_its_row(
    root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Among others it is an error, after which each is fitted alone (`spinepipe.jobs.block`)."""
    bad = specimen_seed(study_and_cohort(str(root), STUDY)[0].seed, f"{SPECIMEN}/1")

    def fitted(problems: Any, starts: int, seeds: Any, *others: Any, **named: Any) -> Any:
        if bad in seeds:
            raise RefusedModel("not taken")
        return fit_alike(problems, starts, seeds, *others, **named)

    monkeypatch.setattr(calibrate, "fit_alike", fitted)
    with pytest.raises(RefusedModel, match="not taken"):
        run(root, tmp_path, 0, 1)
    row = run(root, tmp_path, 1)[1]
    assert (row["status"], row["message"]) == ("refused", "not taken")
