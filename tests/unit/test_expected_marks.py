"""The mark told beforehand is the one a job writes, and hangs on no more than the job reads.

Catches stale files that are joined, and files made anew though nothing of theirs changed.
"""

import dataclasses
import re
import shutil
from collections.abc import Callable
from pathlib import Path

import grid_cases
import pyarrow.parquet as pq
import pytest
from mistaken_cohorts import good

from spinepipe.jobs import collect, inputs
from spinepipe.jobs.block import run_joined
from spinepipe.jobs.collect import StaleFile
from spinepipe.jobs.digest import base_marks, digest_of
from spinepipe.jobs.expected import Expected, place_of
from spinepipe.marks import DamagedFile, read_mark
from spinepipe.model.file import EffectEntry, ModelFile, write_model
from spinepipe.studies.range_of_motion import draw, simulate
from spinepipe.studies.read import check
from spinepipe.tables import metadata_of, read

STUDY = grid_cases.STUDY
SETTINGS = (
    "poses: 2\nstiffness_sets: 2\n"
    "virtual_tests: {moment_nm: 7.5, tests: [flexion, left_rotation], steps: 3}\n"
)
BLOCK = f"results/{STUDY}/blocks/range_of_motion/specimen-a/block-000.parquet"


def job_files(told: Expected, specimen: str) -> list[str]:
    """All job files of a specimen."""
    return [
        path
        for place in told.files.blocks("range_of_motion")
        if place[0] == specimen
        for path in told.files.job_files("range_of_motion", *place)
    ]


@pytest.fixture
def root(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A project with a study of two specimens; paths of results are relative to it."""
    monkeypatch.chdir(tmp_path)
    return grid_cases.project(tmp_path, SETTINGS, specimens=("a", "b"))


def expected(root: Path) -> Expected:
    return Expected(str(root), *check(root, STUDY))


def made(root: Path) -> Expected:
    """Job files of specimen a, and what their marks must be."""
    told = expected(root)
    frames, sets = told.files.specimen_file("frames", "a"), "results/sets.parquet"
    draw.sample_frames(str(root), STUDY, "a", frames)
    draw.draw_stiffness(str(root), STUDY, sets)
    parts = {path: place_of(path) for path in job_files(told, "a")}
    simulate.run(str(root), STUDY, frames, sets, "a", parts)
    return told


def join(told: Expected) -> None:
    files = told.files.job_files("range_of_motion", "a", "000")
    run_joined(told.root, STUDY, "range_of_motion", files, BLOCK)


def test_jobs_write_the_marks_that_are_expected(root: Path) -> None:
    told = made(root)
    join(told)
    for path in told.files.job_files("range_of_motion", "a", "000"):
        assert read_mark(path) == told.of_part("range_of_motion", path)
    frames = told.files.specimen_file("frames", "a")
    assert read_mark(frames) == told.of_part("frames", frames)
    assert read_mark("results/sets.parquet") == told.of_job("draw_stiffness", {})
    assert read_mark(BLOCK) == told.of_block("range_of_motion", "a", "000")


def test_a_file_of_other_settings_is_not_joined(root: Path) -> None:
    before = made(root)
    study = root / f"config/studies/{STUDY}.yaml"
    study.write_text(study.read_text().replace("7.5", "7.25"))
    inputs._study.cache_clear()
    told = expected(root)
    (first, *_) = told.files.job_files("range_of_motion", "a", "000")
    wanted, found = (one.of_part("range_of_motion", first) for one in (told, before))
    with pytest.raises(StaleFile) as caught:
        join(told)
    for said in (first, f"found the mark {found}", f"expected {wanted}", "Run again"):
        assert said in str(caught.value)
    assert not Path(BLOCK).exists()


def test_a_file_without_a_mark_is_not_joined(root: Path) -> None:
    told = made(root)
    (first, *_) = told.files.job_files("range_of_motion", "a", "000")
    pq.write_table(read(first).replace_schema_metadata(None), first)
    with pytest.raises(StaleFile, match=r"found the mark none, expected [0-9a-f]{64}"):
        join(told)


def test_a_file_with_one_flipped_bit_is_not_joined(root: Path) -> None:
    """It has the mark that is expected: of settings, data and code."""
    told = made(root)
    (first, *_) = told.files.job_files("range_of_motion", "a", "000")
    whole = Path(first).read_bytes()
    Path(first).write_bytes(whole[:99] + bytes([whole[99] ^ 8]) + whole[100:])
    with pytest.raises(DamagedFile, match="counts as lost"):
        join(told)
    assert not Path(BLOCK).exists()


def test_digests_of_joined_files_are_kept_also_where_they_differ(root: Path) -> None:
    told = made(root)
    join(told)
    one, other = ({"code_digest": code, "seed": "0", "version": code} for code in "xy")
    together = collect._together([one, other])
    assert together["seed"] == "0"
    assert together["version"] == "x, y"
    assert together["code_digest"] == collect._together([other, one])["code_digest"]
    assert together["code_digest"] not in ("x", "y")
    assert {"code_digest", "config_digest", "specimens_digest"} <= set(metadata_of(read(BLOCK)))


def jobs(told: Expected) -> dict[str, str]:
    """Marks of all files of all kinds of jobs of the study, and of what is joined from them."""
    specimens = told.files.specimens
    marks = {
        f"{table} {s}": told.of_part(table, told.files.specimen_file(table, s))
        for table in told.files.by_specimen
        for s in specimens
    }
    marks |= {f"table {table}": told.of_table(table) for table in told.files.by_specimen}
    for table in told.files.made_of_jobs:
        for s, block in told.files.blocks(table):
            files = told.files.job_files(table, s, block)
            marks |= {path: told.of_part(table, path) for path in files}
            marks[f"block {table} {s} {block}"] = told.of_block(table, s, block)
        marks[f"table {table}"] = told.of_table(table)
    return marks


def changed(told: Callable[[], Expected], change: Callable[[], object]) -> set[str]:
    before = jobs(told())
    change()
    after = jobs(told())
    assert before.keys() == after.keys()
    return {name for name in before if before[name] != after[name]}


def replace(path: Path, old: str, new: str) -> None:
    text = path.read_text()
    assert text.count(old) == 1
    path.write_text(text.replace(old, new))


def test_a_changed_number_of_a_specimen_changes_what_it_makes_and_is_joined_to(root: Path) -> None:
    joints = root / "config/cohorts/stack/joints.csv"
    again = changed(lambda: expected(root), lambda: replace(joints, "b,L2L3,0,36,", "b,L2L3,0,37,"))
    files = expected(root).files
    own = set(job_files(expected(root), "b"))
    blocks = {f"block range_of_motion {one} {n}" for one, n in files.blocks("range_of_motion")}
    of_it = {"frames b", "table frames", "table range_of_motion"}
    of_it |= {name for name in blocks if " b " in name}
    assert again == own | of_it


def test_the_title_of_the_cohort_changes_no_job_file(root: Path) -> None:
    cohort = root / "config/cohorts/stack/cohort.yaml"
    assert changed(lambda: expected(root), lambda: replace(cohort, "stacked", "piled")) == set()


def test_numbers_count_as_they_were_read(tmp_path: Path) -> None:
    """Also of a whole cohort, where the code that reads them has changed and no byte of a file."""
    shutil.copytree(ROOT / "config", tmp_path / "config")
    study, cohort = check(tmp_path, "l4l5_disc")
    assert cohort.motion is not None
    other = cohort.motion.assign(extension_deg=cohort.motion["extension_deg"] * (1.0 + 1e-15))
    marks = {
        digest_of("search", study, dataclasses.replace(cohort, motion=motion))
        for motion in (cohort.motion, other)
    }
    assert len(marks) == 2


def test_what_all_specimens_share_changes_all(root: Path) -> None:
    header = root / "config/cohorts/stack/cohort.yaml"
    again = changed(
        lambda: expected(root), lambda: replace(header, "rotation_deg: 3.0", "rotation_deg: 2.0")
    )
    assert again == set(jobs(expected(root)))


ROOT = Path(__file__).resolve().parents[2]
COHORT = "t12s1_phantom"
JOINT_POSES = f"""\
study: poses
kind: joint_pose_sensitivity
cohort: {COHORT}
seed: 1
poses: 2
best_models: 1
methods: {{poses: 1}}
start_bootstrap: {{sets: 2}}
landmark_precision: {{sd_mm: [1.0, 3.0], poses: 4}}
"""


def expected_of(root: Path, name: str) -> Expected:
    return Expected(str(root), *check(root, name))


def poses(tmp_path: Path) -> Path:
    """The file of a joint-pose study in a project with the phantom."""
    cohort, studies = Path("config/cohorts", COHORT), tmp_path / "config/studies"
    good(COHORT, tmp_path / cohort.parent)
    studies.mkdir()
    study = studies / "poses.yaml"
    study.write_text(JOINT_POSES)
    return study


def test_limits_are_applied_to_fits_that_are_there(tmp_path: Path) -> None:
    """No fit changes; what judges the fits does, and of simulations those with the best sets."""
    study = poses(tmp_path)
    before = expected_of(tmp_path, "poses")
    files = jobs(before)
    for old, new, job in (
        ("poses: 4", "poses: 4, rotation_limit_deg: 2.0", "landmark_precision"),
        ("best_models: 1", "best_models: 1\nsignificance: 0.01", "against_gould_2024a"),
        ("best_models: 1", "best_models: 1\nsuccess: {outlier_times_start: 50}", "success"),
    ):
        replace(study, old, new)
        after = expected_of(tmp_path, "poses")
        now = jobs(after)
        hang = {name for name in files if now[name] != files[name]}
        if job == "success":
            assert {name for name in hang if "/" in name} == {n for n in files if "best01" in n}
        else:
            assert not hang, new
        assert after.of_job(job, {}) != before.of_job(job, {}), job
        before = after


def test_another_seed_samples_again_in_its_own_study_alone(tmp_path: Path) -> None:
    study = poses(tmp_path)
    (study.parent / "twin.yaml").write_text(JOINT_POSES.replace("study: poses", "study: twin"))
    twin = jobs(expected_of(tmp_path, "twin"))
    again = changed(
        lambda: expected_of(tmp_path, "poses"), lambda: replace(study, "seed: 1", "seed: 2")
    )
    assert {"table landmarks", "table simulations", "landmarks s02"} <= again
    assert jobs(expected_of(tmp_path, "twin")) == twin


@pytest.mark.parametrize(
    "study",
    [
        "t12s1_cohort_stiffness",
        pytest.param("poses", marks=pytest.mark.full),
        pytest.param("t12s1_range_of_motion", marks=pytest.mark.full),
    ],
)
def test_a_reading_of_one_specimen_reruns_no_fit_of_another(tmp_path: Path, study: str) -> None:
    """In studies of every kind with job files; only what predicts from all hangs on all."""
    studies = poses(tmp_path).parent
    if study != "poses":
        shutil.copy2(ROOT / "config/studies" / f"{study}.yaml", studies)
    loads = tmp_path / "config/cohorts" / COHORT / "loads.csv"
    rows = loads.read_text().splitlines(keepends=True)
    at = next(place for place, row in enumerate(rows) if row.startswith("s02,flexion,2,9,"))
    rows[at] = re.sub(r"(\d)(\n)$", lambda m: f"{(int(m[1]) + 1) % 10}{m[2]}", rows[at])
    again = changed(lambda: expected_of(tmp_path, study), lambda: loads.write_text("".join(rows)))
    files = {name for name in jobs(expected_of(tmp_path, study)) if name.endswith(".parquet")}
    joint = {name for name in files if "/pooled/" in name or "/left_out/" in name}
    own = {name for name in files if "specimen-s02" in name}
    assert own
    assert again & files == own | joint


def test_a_model_made_by_another_study_counts_before_it_is_there(tmp_path: Path) -> None:
    """By the mark that it will have; a file of one's own beside it by its content."""
    for part in ("cohorts/stiffening_spines", "studies"):
        shutil.copytree(ROOT / "config" / part, tmp_path / "config" / part)
    maker = expected_of(tmp_path, "stiffening_spines")
    model = maker.files.folder + "/model_with_effects.yaml"
    place = {"specimen": "s01", "representation": "per_specimen", "fitted_to": "all"}

    def mark_of_fit() -> str:
        return expected_of(tmp_path, "stiffening_spines_stiffness").of_job("fit", place)

    before = mark_of_fit()
    made = maker.of_job("search", {})
    entry = EffectEntry(effect="linear_bushing")
    whole = ModelFile(model="m", cohort="stiffening_spines", effects=(entry,))
    (tmp_path / model).parent.mkdir(parents=True)
    write_model(whole, tmp_path / model, made)
    assert mark_of_fit() == before
    assert base_marks(str(tmp_path), model) == [made]
    file = tmp_path / "config/studies/stiffening_spines.yaml"
    file.write_text(file.read_text() + "seed: 77\n")
    assert mark_of_fit() != before
