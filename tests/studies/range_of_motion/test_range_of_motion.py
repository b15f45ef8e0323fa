"""Range of motion: virtual loads, drawn frames and stiffness, closed forms, what is refused.

Seen here: a sign, an axis or a unit of a test, draws that hang on other specimens, motion of
another pose or stiffness set, shares of variance over what is no draw, a fault that passes.
"""

from pathlib import Path
from typing import Any, get_args

import numpy as np
import pandas as pd
import pytest
from grid_cases import JOINTS, STIFFNESS, STUDY, made_up, project, table_of
from scipy.spatial.transform import Rotation

from spinepipe.cohort.load_tests import VIRTUAL_TESTS, loaded_coordinate, virtual_load_cases
from spinepipe.designs import sample_factors, sample_joint_frames
from spinepipe.frames import Pose, rotation_zxy
from spinepipe.problems import InputError
from spinepipe.studies import read as studies
from spinepipe.studies.range_of_motion import draw, simulate, summary, variance
from spinepipe.studies.range_of_motion.grid import asked_tests, read_grid
from spinepipe.studies.range_of_motion.settings import RangeOfMotion, VirtualTest
from spinepipe.studies.range_of_motion.tables import RANGE_OF_MOTION
from spinepipe.tables import from_rows, read_frame, write
from spinepipe.units import ROTATIONS

FILE = f"config/studies/{STUDY}.yaml"
ROTATION_COLUMNS = [f"predicted_{name}_deg" for name in ROTATIONS]
SIX = "[flexion, extension, right_bending, left_bending, left_rotation, right_rotation]"


def test_virtual_tests_are_moments_in_equal_steps() -> None:
    """On the vertebra that is named, without a force; signs are seen in the motion below."""
    cases = virtual_load_cases(tuple(VIRTUAL_TESTS), 7.5, 5, 3)
    for test, case in zip(VIRTUAL_TESTS, cases, strict=True):
        assert [step.step for step in case.steps] == [0, 1, 2, 3, 4, 5]
        wrenches = [wrench for step in case.steps for wrench in step.wrenches]
        assert {wrench.body for wrench in wrenches} == {3}
        assert not any(wrench.force.any() for wrench in wrenches)
        moments = np.array([wrench.moment for wrench in wrenches])
        assert np.linalg.norm(moments[-1]) == pytest.approx(7.5)
        shares = np.array([0.0, 0.2, 0.4, 0.6, 0.8, 1.0])
        np.testing.assert_allclose(moments, np.outer(shares, moments[-1]), atol=1e-15)
        assert VIRTUAL_TESTS[test].coordinate == loaded_coordinate(case)


def test_a_study_may_name_every_virtual_test_and_no_other() -> None:
    assert set(get_args(VirtualTest)) == set(VIRTUAL_TESTS)


def test_drawn_frames_scatter_along_and_about_their_own_axes() -> None:
    own = (
        Pose(rotation_zxy(0.5, -0.2, 0.1), np.array([0.01, 0.2, 0.0])),
        Pose(np.eye(3), np.zeros(3)),
    )
    poses = sample_joint_frames(own, 0.0012, 0.05, 4000, seed=3, specimen="a")
    assert len(poses) == 4000
    assert poses[0] == own
    for joint, frame in enumerate(own):
        shifts = np.array([frame.rotation.T @ (p[joint].origin - frame.origin) for p in poses[1:]])
        turns = Rotation.from_matrix([frame.rotation.T @ p[joint].rotation for p in poses[1:]])
        values = np.hstack([shifts / 0.0012, turns.as_euler("ZXY") / 0.05])
        np.testing.assert_allclose(values.mean(axis=0), 0.0, atol=2e-3)
        np.testing.assert_allclose(values.std(axis=0), 1.0, rtol=0.01)
        assert np.abs(np.corrcoef(values.T) - np.eye(6)).max() < 4.0 / np.sqrt(4000)


@pytest.mark.parametrize("n", [1, 2, 3])
def test_few_frames_and_factors_can_be_drawn(n: int) -> None:
    own = (Pose(np.eye(3), np.zeros(3)),)
    poses = sample_joint_frames(own, 0.001, 0.05, n, seed=3, specimen="a")
    factors = sample_factors(2.0, 6, n, seed=3)
    assert (len(poses), len(factors)) == (n, n)
    assert (factors[0] == 1.0).all()
    assert all(drawn[0].origin.all() for drawn in poses[1:])


def test_factors_fill_the_spread_evenly_on_a_logarithmic_scale() -> None:
    factors = np.log2(sample_factors(2.0, 6, 101, seed=1)[1:])
    strata = np.floor(100 * (factors + 1.0) / 2.0).astype(int)
    np.testing.assert_array_equal(np.sort(strata, axis=0), np.tile(np.arange(100)[:, None], 6))


def test_specimens_have_draws_of_their_own_that_others_do_not_change(tmp_path: Path) -> None:
    def frames(root: Path, specimen: str) -> pd.DataFrame:
        draw.sample_frames(str(root), STUDY, specimen, str(root / "frames.parquet"))
        return read_frame(root / "frames.parquet").set_index(["specimen", "pose", "joint"])

    two = project(tmp_path / "two", "poses: 5\n", specimens=("a", "b"))
    a, b = frames(two, "a"), frames(two, "b")
    pd.testing.assert_frame_equal(
        b, frames(project(tmp_path / "one", "poses: 5\n", specimens=("b",)), "b")
    )
    drawn = [rows["x_mm"].drop(0, level="pose").to_numpy() for rows in (a, b)]
    assert (drawn[0] != drawn[1]).all()
    assert (a.loc["a"].loc[0, "y_mm"] == [0.0, 36.0, 72.0]).all()


def test_levels_and_factors_make_the_stiffness_sets(tmp_path: Path) -> None:
    level = "extension_nm_per_rad: 7, right_bending_nm_per_rad: 8, left_rotation_nm_per_rad: 9"
    root = project(tmp_path, f"stiffness_sets: 6\nlevel_stiffness:\n  L2L3: {{{level}}}\n")
    path = root / "sets.parquet"
    draw.draw_stiffness(str(root), STUDY, str(path))
    sets = read_frame(path).set_index(["stiffness", "joint"])
    own = dict(STIFFNESS)
    assert sets.loc[0, "L1L2"].to_dict() == pytest.approx(own)
    own |= {"extension_nm_per_rad": 7, "right_bending_nm_per_rad": 8, "left_rotation_nm_per_rad": 9}
    assert sets.loc[0, "L2L3"].to_dict() == pytest.approx(own)
    factors = sets / sets.loc[0].reindex(sets.index, level="joint")
    for joint in JOINTS:  # one factor for all joints, its own for each coordinate
        same = factors.xs(joint, level="joint")
        np.testing.assert_allclose(same, factors.xs("L3L4", level="joint"), rtol=1e-12)
        assert (same.loc[1:].nunique(axis=1) == 6).all()
    assert ((factors > 0.5 - 1e-12) & (factors < 2.0 + 1e-12)).all(axis=None)


def moved(root: Path, pose: int = 0, stiffness: int = 0, specimen: str = "a") -> pd.DataFrame:
    """Rows of one job."""
    frames, sets, output = (str(root / f"{name}.parquet") for name in ("frames", "sets", "out"))
    asked_tests.cache_clear()  # a test changes its study in no time
    draw.sample_frames(str(root), STUDY, specimen, frames)
    draw.draw_stiffness(str(root), STUDY, sets)
    place = {"pose": f"{pose:04d}", "stiffness": f"{stiffness:02d}"}
    simulate.run(str(root), STUDY, frames, sets, specimen, {output: place})
    return read_frame(output)


def test_joints_of_a_straight_chain_turn_by_moment_over_stiffness(tmp_path: Path) -> None:
    """Each joint carries the whole moment: M/k in the loaded coordinate, nothing in the others."""
    root = project(tmp_path, f"virtual_tests: {{moment_nm: 7.5, tests: {SIX}}}\n")
    rows = moved(root)
    expected = {
        "flexion": ("extension", -7.5 / 50.0),
        "extension": ("extension", 7.5 / 50.0),
        "right_bending": ("right_bending", 7.5 / 80.0),
        "left_bending": ("right_bending", -7.5 / 80.0),
        "left_rotation": ("left_rotation", 7.5 / 250.0),
        "right_rotation": ("left_rotation", -7.5 / 250.0),
    }
    assert len(rows) == 6 * len(JOINTS)
    assert set(rows["status"]) == {"converged"}
    for test, (loaded, angle) in expected.items():
        found = rows.loc[rows["test"] == test, ROTATION_COLUMNS]
        wanted = [np.rad2deg(angle) * (name == f"predicted_{loaded}_deg") for name in found]
        np.testing.assert_allclose(found, np.tile(wanted, (len(JOINTS), 1)), atol=1e-9)
    np.testing.assert_allclose(rows.filter(like="_mm"), 0.0, atol=1e-9)


def test_a_follower_load_presses_virtual_tests_from_step_0_on(tmp_path: Path) -> None:
    """About the axis of the chain it changes nothing; a bent chain it pushes anterior, or back."""
    study = "virtual_tests: {moment_nm: 7.5, tests: [left_rotation, flexion, extension]%s}\n"
    root = project(tmp_path / "pressed", study % ", follower_n: 400")
    pressed = moved(root).set_index("test")
    free = moved(project(tmp_path / "free", study % "")).set_index("test")
    turned = pressed.loc["left_rotation"]
    np.testing.assert_allclose(turned["predicted_left_rotation_deg"], np.rad2deg(7.5 / 250.0))
    np.testing.assert_allclose(turned.filter(like="_mm"), 0.0, atol=1e-9)
    assert (free.loc["flexion", "predicted_anterior_mm"].abs() < 1e-9).all()
    ends = [pressed.loc[test, "predicted_anterior_mm"].iloc[0] for test in ("flexion", "extension")]
    assert ends[0] == pytest.approx(-ends[1], rel=1e-6)
    assert abs(ends[0]) > 0.01


def test_tilted_frames_split_a_small_moment_among_their_axes(tmp_path: Path) -> None:
    """To first order each coordinate turns by the moment about its axis over its stiffness."""
    root = project(
        tmp_path,
        "virtual_tests: {moment_nm: 1.0e-5, tests: [left_rotation]}\n",
        tilts_deg=(25.0, -10.0, 15.0),
    )
    axes = Rotation.from_euler("ZXY", (25.0, -10.0, 15.0), degrees=True).as_matrix()
    about_x, about_y, about_z = axes.T @ np.array([0.0, 1.0e-5, 0.0])
    wanted = np.rad2deg([about_z / 50.0, about_x / 80.0, about_y / 250.0])
    found = moved(root)[ROTATION_COLUMNS]
    np.testing.assert_allclose(found, np.tile(wanted, (3, 1)), rtol=1e-5)


def test_the_largest_load_alone_ends_where_all_steps_end(tmp_path: Path) -> None:
    study = f"virtual_tests: {{moment_nm: 15, tests: {SIX}, steps: 7}}\nposes: 4\n"
    every = moved(project(tmp_path, study + "rows: all_steps\n", tilts_deg=(20, 5, -5)), pose=2)
    peak = moved(project(tmp_path / "peak", study, tilts_deg=(20, 5, -5)), pose=2)
    assert sorted(set(every["step"])) == list(range(8))
    assert set(peak["step"]) == {7}
    last = every[every["largest_load"]].reset_index(drop=True)
    pd.testing.assert_frame_equal(last, peak, rtol=0.0, atol=1e-8)
    still = every.loc[every["step"] == 0].filter(like="predicted")
    np.testing.assert_allclose(still, 0.0, atol=1e-12)


def test_a_spine_that_tips_over_is_a_row_with_a_status(tmp_path: Path) -> None:
    """7.5 N m on 1 N m/rad would be 430 degrees."""
    root = project(tmp_path, "virtual_tests: {tests: [flexion]}\n")
    text = (root / FILE).read_text()
    (root / FILE).write_text(text.replace("extension_nm_per_rad: 50.0", "extension_nm_per_rad: 1"))
    rows = moved(root)
    assert set(rows["status"]) == {"unstable"}
    assert rows["message"].str.len().gt(0).all()
    assert rows.filter(like="predicted").isna().all(axis=None)


def test_a_stiffness_beyond_what_the_joint_law_takes_is_refused(tmp_path: Path) -> None:
    root = project(tmp_path, "virtual_tests: {tests: [flexion]}\nstiffness_spread: 1000\n")
    text = (root / FILE).read_text()
    (root / FILE).write_text(text.replace("anterior_n_per_m: 100000.0", "anterior_n_per_m: 1"))
    sets = [moved(root, stiffness=number) for number in range(4)]
    refused = [rows for rows in sets if set(rows["status"]) == {"refused"}]
    assert refused
    assert all("anterior_n_per_m" in rows["message"][0] for rows in refused)


LOADS = """\
specimen,test,step,vertebra,fx_n,fy_n,fz_n,mx_nm,my_nm,mz_nm,px_mm,py_mm,pz_mm,cycle
*,twist,0,L1,0,0,0,0,1,0,,,,1
*,twist,1,L1,0,0,0,0,5,0,,,,1
*,twist,2,L1,0,0,0,0,2,0,,,,1
*,twist,0,L1,0,0,0,0,9,0,,,,2
*,bend,0,L1,0,0,0,0,0,0,,,,
*,bend,1,L1,0,0,0,0,0,4,,,,
"""


def test_measured_loads_count_from_their_step_0_in_their_first_cycle(tmp_path: Path) -> None:
    root = project(tmp_path, "virtual_tests: null\n")
    (root / "config/cohorts/stack/loads.csv").write_text(LOADS)
    rows = moved(root).set_index("test")
    assert rows.loc["twist", "step"].to_list() == [1, 1, 1]
    np.testing.assert_allclose(
        rows.loc["twist", "predicted_left_rotation_deg"], np.rad2deg((5.0 - 1.0) / 250.0), rtol=1e-9
    )
    np.testing.assert_allclose(
        rows.loc["bend", "predicted_extension_deg"], np.rad2deg(4.0 / 50.0), rtol=1e-9
    )


PRELOADED = """\
specimen,test,step,vertebra,fx_n,fy_n,fz_n,mx_nm,my_nm,mz_nm,px_mm,py_mm,pz_mm
*,bend,0,L1,0,0,0,2,0,0,,,
*,bend,0,L3,0,0,0,-2,0,0,,,
*,bend,1,L1,0,0,0,5,0,0,,,
*,bend,1,L3,0,0,0,-2,0,0,,,
"""


def test_loads_that_balance_in_step_0_are_loads(tmp_path: Path) -> None:
    """Moments of 2 and -2 N m bend the joints between them already in step 0."""
    root = project(tmp_path, "virtual_tests: null\n")
    (root / "config/cohorts/stack/loads.csv").write_text(PRELOADED)
    rows = moved(root)
    assert rows["step"].to_list() == [1, 1, 1]
    found = rows["predicted_right_bending_deg"]
    np.testing.assert_allclose(found, np.rad2deg((5.0 - 2.0) / 80.0), rtol=1e-9)


DRIVEN = """\
specimen,test,step,vertebra,fx_n,fy_n,fz_n,mx_nm,my_nm,mz_nm,px_mm,py_mm,pz_mm
*,flexion,0,L1,0,0,0,0,0,0,,,
*,flexion,1,L1,0,0,0,1,0,-4,,,
*,left_rotation,0,L1,0,0,0,0,0,0,0,100,0
*,left_rotation,1,L1,50,0,0,0,0,0,0,100,0
"""


def test_the_load_tells_the_loaded_coordinate_and_motion_where_no_moment_acts(
    tmp_path: Path,
) -> None:
    size = (2, 3, 3)
    root = project(tmp_path, "poses: 3\nstiffness_sets: 3\nvirtual_tests: null\n", specimens="ab")
    (root / "config/cohorts/stack/loads.csv").write_text(DRIVEN)
    path, rows = table_of(root, size)
    rows["predicted_right_bending_deg"] += 30.0
    write(from_rows(RANGE_OF_MOTION, rows.to_dict("records")), path, {})
    study, cohort = studies.check(root, STUDY)
    assert isinstance(study, RangeOfMotion)
    grid = read_grid(str(path), study, cohort)
    assert dict(zip(grid.tests, grid.loaded, strict=True)) == {
        "flexion": "extension",  # though the made-up joints bend far more
        "left_rotation": "right_bending",
    }


def analysed(
    job: Any, root: Path, size: tuple[int, int, int], lost: tuple[tuple[int, int, int], ...] = ()
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """What a job makes of a made-up grid, and the rows of the grid."""
    path, rows = table_of(made_up(root, size), size, lost)
    job.run(str(root), STUDY, [str(path)], str(root / "out.parquet"))
    return read_frame(root / "out.parquet"), rows


def test_summary_has_the_quantiles_of_pandas(tmp_path: Path) -> None:
    found, rows = analysed(summary, tmp_path, (3, 6, 4), ((1, 2, 0), (1, 3, 3)))
    found = found.set_index(["specimen", "test", "joint", "coordinate"])
    assert len(found) == 4 * 2 * 3 * 6
    column = rows["predicted_extension_deg"]
    pooled = rows.assign(specimen="*")
    for frame in (rows, pooled):
        for key, values in column.groupby([frame["specimen"], frame["test"], frame["joint"]]):
            one = found.loc[(*key, "extension")]
            assert one["n"] + one["n_without"] == len(values)
            assert one["n"] == values.notna().sum()
            assert one["role"] == ("loaded" if key[1] == "flexion" else "coupled")
            wanted = values.quantile([0.05, 0.25, 0.5, 0.75, 0.95]).to_list()
            names = ("percentile_5", "low_quartile", "median", "high_quartile", "percentile_95")
            np.testing.assert_allclose([one[name] for name in names], wanted, rtol=1e-12)
    assert found.loc[("b", "flexion", "L1L2", "extension"), "n_without"] == 2


def test_variance_leaves_out_what_is_no_draw_and_what_is_incomplete(tmp_path: Path) -> None:
    found, _ = analysed(variance, tmp_path, (3, 7, 5), ((1, 2, 3), (0, 0, 0)))
    found = found.set_index(["specimen", "test"])
    assert set(found["status"]) == {"done"}
    assert set(found.loc["a", "n_poses"]) == {6}  # pose 0 is no draw
    assert set(found.loc["b", "n_poses"]) == {5}
    assert set(found.loc["*", "n_poses"]) == {5}
    assert set(found["n_stiffness"]) == {4}
    assert found.loc["*", "message"].str.contains("up to 1 pose of a specimen").all()
    shares = found[[f"{name}_share" for name in ("specimen", "pose", "stiffness", "rest")]]
    np.testing.assert_allclose(shares.sum(axis=1), 1.0, rtol=1e-12)
    assert found.drop("*")["specimen_share"].isna().all()


def test_variance_of_a_study_without_draws_has_a_status(tmp_path: Path) -> None:
    found, _ = analysed(variance, tmp_path, (1, 1, 1))
    assert set(found["status"]) == {"too_few"}
    assert found["pose_share"].isna().all()


def problems(root: Path) -> dict[str, str]:
    """What checking the study complains about, by key."""
    with pytest.raises(InputError) as caught:
        studies.check(root, STUDY)
    assert all(problem.file == FILE for problem in caught.value.problems)
    return {str(p.column): f"line {p.row}: {p}" for p in caught.value.problems}


def test_all_that_does_not_fit_is_told_at_once(tmp_path: Path) -> None:
    level = "extension_nm_per_rad: 7, right_bending_nm_per_rad: 8, left_rotation_nm_per_rad: 9"
    study = f"poses: 3\nvirtual_tests: null\nlevel_stiffness:\n  L2L4: {{{level}}}\n"
    found = problems(project(tmp_path, study, header=""))
    assert set(found) == {"pose_sd", "virtual_tests", "level_stiffness.L2L4"}
    assert "null with 3 poses, and cohort 'stack' has no measurement_sd" in found["pose_sd"]
    assert "set poses: 1" in found["pose_sd"]
    assert found["virtual_tests"].startswith("line 6:")
    assert "has no loads.csv" in found["virtual_tests"]
    assert found["level_stiffness.L2L4"].startswith("line 8:")
    assert "one of L3L4, L2L3, L1L2" in found["level_stiffness.L2L4"]


FAULTS = (
    ("virtual_tests: {tests: [flexon]}\n", "virtual_tests.tests.0", "'flexion'"),
    ("virtual_tests: {tests: []}\n", "virtual_tests.tests", "at least 1 of them"),
    ("virtual_tests: {moment_nm: 0}\n", "virtual_tests.moment_nm", "greater than 0"),
    ("virtual_tests: {steps: 0}\n", "virtual_tests.steps", "greater than or equal to 1"),
    ("tests: [flexion]\n", "tests", "virtual_tests, which name their own tests"),
    ("poses: -1\n", "poses", "greater than or equal to 0"),
    ("pose_sd: {translation_mm: 1}\n", "pose_sd.rotation_deg", "missing"),
    ("pose_sd: {translation_mm: -1, rotation_deg: 1}\n", "pose_sd.translation_mm", "to 0"),
    ("stiffness_sets: 0\n", "stiffness_sets", "greater than or equal to 1"),
    ("stiffness_spread: 1\n", "stiffness_spread", "greater than 1"),
    ("rows: all\n", "rows", "'peak' or 'all_steps'"),
    (
        "level_stiffness:\n  L2L3: {extension_nm_per_rad: 7}\n",
        "level_stiffness.L2L3.right_bending_nm_per_rad",
        "missing",
    ),
)


def test_faults_of_the_study_file_are_located(tmp_path: Path) -> None:
    for number, (study, key, says) in enumerate(FAULTS):
        found = problems(project(tmp_path / str(number), study))
        assert says in found.get(key, ""), (study, found)


def test_tests_of_loads_must_exist(tmp_path: Path) -> None:
    root = project(tmp_path, "virtual_tests: null\ntests: [twist, benf]\n")
    (root / "config/cohorts/stack/loads.csv").write_text(LOADS)
    assert "did you mean 'bend'" in problems(root)["tests.1"]


MOTION = """\
specimen,test,step,joint,left_rotation_deg
a,twist,0,L1L2,0
a,twist,1,L1L2,2
"""


def test_the_sd_of_a_reading_is_not_taken_for_that_of_a_frame(tmp_path: Path) -> None:
    """With motion.csv the cohort's measurement_sd speaks of motion."""

    def measured(study: str) -> Path:
        root = project(tmp_path, study)
        (root / "config/cohorts/stack/loads.csv").write_text(LOADS)
        (root / "config/cohorts/stack/motion.csv").write_text(MOTION)
        return root

    told = problems(measured("poses: 3\n"))
    assert set(told) == {"pose_sd"}
    assert (
        "cohort 'stack' has motion.csv: its measurement_sd is that of a reading" in told["pose_sd"]
    )
    for fine in ("poses: 1\n", "poses: 3\npose_sd: {translation_mm: 1, rotation_deg: 2}\n"):
        study, _ = studies.check(measured(fine), STUDY)
        assert isinstance(study, RangeOfMotion)


@pytest.mark.parametrize("poses", [0, 1])
def test_own_frames_alone_need_no_uncertainty(poses: int, tmp_path: Path) -> None:
    study, _ = studies.check(project(tmp_path, f"poses: {poses}\n", header=""), STUDY)
    assert isinstance(study, RangeOfMotion)
    assert study.n_poses == 1


def test_defaults_are_published(tmp_path: Path) -> None:
    """Gould et al. 2024b, Table 2, uniform model."""
    study = RangeOfMotion(study="s", kind="range_of_motion", cohort="c")
    assert study.stiffness.in_order() == (149000, 1890000, 135000, 51.0, 68.8, 291)
    assert study.virtual_tests is not None
    assert study.virtual_tests.moment_nm == 7.5


def test_a_stiffness_that_is_not_named_stays_the_published_one(tmp_path: Path) -> None:
    root = project(tmp_path)
    text = (root / FILE).read_text()
    given = text[text.index("stiffness:") :].splitlines()[0]
    (root / FILE).write_text(text.replace(given, "stiffness: {extension_nm_per_rad: 40}"))
    study, _ = studies.check(root, STUDY)
    assert isinstance(study, RangeOfMotion)
    assert study.stiffness.in_order() == (149000, 1890000, 135000, 40.0, 68.8, 291)
