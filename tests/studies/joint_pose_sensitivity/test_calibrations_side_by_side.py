"""Calibrations of neighbouring poses in one stack, and the files that wait for their own jobs.

Would catch a pose whose fit hangs on its neighbours, one whose failure spoils theirs, and a waiting
file that is taken although it is damaged, of another setting, or older than what it hangs on.
"""

import shutil
from pathlib import Path
from typing import Any

import pytest

from spinepipe.calibrate import fit_alike
from spinepipe.designs import specimen_seed
from spinepipe.files import stamp
from spinepipe.jobs.waiting import alone_at, is_to_make, take, waiting
from spinepipe.marks import write_marked
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
TO_SUM = 1e-9
"""Relative: what sums of another number of lanes may differ by."""


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


def run(root: Path, folder: Path, pose: int) -> Path:
    output = folder / f"pose={pose:04d}.parquet"
    calibrate.run(
        str(root), STUDY, str(root / "poses.parquet"), SPECIMEN, f"{pose:04d}", str(output)
    )
    return output


def test_a_pose_alone_is_as_among_its_neighbours(root: Path, tmp_path: Path) -> None:
    run(root, tmp_path, 1)
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        *(f".pose={pose:04d}.parquet" for pose in (0, 2, 3)),
        "pose=0001.parquet",
    ]
    settings, _ = study_and_cohort(str(root), STUDY)
    sampled = str(root / "poses.parquet")
    for pose in range(COUNT):
        found = read_frame(run(root, tmp_path, pose))
        (alone,) = calibrate._calibrated(str(root), settings, SPECIMEN, [pose], sampled)[pose]
        assert alone["status"] == "converged"
        for name, value in alone.items():
            if isinstance(value, float):
                assert found[name][0] == pytest.approx(value, rel=TO_SUM), name
            elif value is not None:
                assert found[name][0] == value, name
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".")]


def test_who_finds_a_block_at_work_takes_the_next(
    root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(calibrate, "BLOCK", 2)
    with alone_at(tmp_path / ".block=0000.lock") as alone:
        assert alone
        run(root, tmp_path, 1)
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        *(f".pose={pose:04d}.parquet" for pose in (2, 3)),
        "pose=0001.parquet",
    ]


def test_only_what_is_lost_is_made_again(
    root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for pose in range(COUNT):
        run(root, tmp_path, pose)
    before = {path: stamp(path) for path in tmp_path.iterdir()}
    asked: list[Any] = []
    whole = calibrate._calibrated

    def seen(*given: Any) -> Any:
        asked.append(given[3])
        return whole(*given)

    monkeypatch.setattr(calibrate, "_calibrated", seen)
    (lost := tmp_path / "pose=0002.parquet").unlink()
    assert run(root, tmp_path, 2) == lost
    assert asked == [[2]]
    after = {path: stamp(path) for path in tmp_path.iterdir()}
    assert {path for path in after if after[path] != before[path]} == {lost}


def test_a_pose_that_fails_harms_no_neighbour(
    root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole, seed = fit_alike, study_and_cohort(str(root), STUDY)[0].seed
    bad = specimen_seed(seed, f"{SPECIMEN}/1")

    def failing(trouble: Exception) -> Any:
        def fitted(problems: Any, starts: int, seeds: Any, *others: Any, **named: Any) -> Any:
            if bad in seeds:
                raise trouble
            return whole(problems, starts, seeds, *others, **named)

        return fitted

    for trouble in (RuntimeError("lost"), RefusedModel("not taken")):
        folder = tmp_path / type(trouble).__name__
        monkeypatch.setattr(calibrate, "fit_alike", failing(trouble))
        assert read_frame(run(root, folder, 0))["status"][0] == "converged"
        if isinstance(trouble, RefusedModel):
            row = read_frame(run(root, folder, 1))
            assert (row["status"][0], row["message"][0]) == ("refused", "not taken")
        else:
            with pytest.raises(RuntimeError, match="lost"):
                run(root, folder, 1)


def test_a_waiting_file_is_taken_only_if_it_is_what_the_job_would_write(tmp_path: Path) -> None:
    output, mark = tmp_path / "file.csv", "a" * 64
    assert is_to_make(output, mark)
    assert not take(output, mark)
    write_marked("1\n", waiting(output), mark)
    assert not is_to_make(output, mark)
    assert not take(output, "b" * 64)
    sound = waiting(output).read_bytes()
    waiting(output).write_bytes(sound.replace(b"1\n", b"2\n", 1))
    assert not take(output, mark)
    waiting(output).write_bytes(sound)
    assert take(output, mark)
    assert output.read_bytes() == sound
    assert not waiting(output).exists()
    assert not is_to_make(output, mark)
