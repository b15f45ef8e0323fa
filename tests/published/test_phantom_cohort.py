"""The shipped cohort ``t12s1_phantom``: regenerated, readable, spread as published, noise as said.

Published numbers are entered here a second time, from the tables of Gould et al. 2024b
(doi 10.3389/fbioe.2024.1372088).
"""

import ast
import shutil
import subprocess
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from sweeps import sweep

from spinepipe.anatomy import published
from spinepipe.cohort import read
from spinepipe.cohort.specimen import joint_frames
from spinepipe.frames import Pose, reexpress
from tests.generators.phantom import SEED, Phantom, phantom, write

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "config" / "cohorts" / "t12s1_phantom"
SCRIPT = ROOT / "tests" / "generators" / "t12s1_phantom.py"
VERTEBRAE = ("S1", "L5", "L4", "L3", "L2", "L1", "T12")
JOINTS = ("L5S1", "L4L5", "L3L4", "L2L3", "L1L2", "T12L1")
MOMENTS = ["mx_nm", "my_nm", "mz_nm"]

# Table 1: sex, age, height, mass of specimens 1 to 6.
TABLE_1 = [
    ["female", 57, 1.57, 59],
    ["female", 54, 1.57, 36],
    ["female", 56, 1.72, 48],
    ["female", 59, 1.65, 113],
    ["female", 44, 1.63, 49],
    ["male", 49, 1.72, 59],
]
# Table 3, specimens 1 to 6 in the loaded direction; 2 and 6 did not converge in axial rotation.
TABLE_3 = {
    "right_bending_nm_per_rad": [107.0, 63.0, 77.8, 105.5, 68.8, 87.5],
    "left_rotation_nm_per_rad": [295.1, 282.7, 418.7, 310.9],
    "extension_nm_per_rad": [61.9, 65.2, 60.5, 79, 94.2, 102.2],
}
MAIN = {
    "flexion": ("mz_nm", -1),
    "left_lateral_bending": ("mx_nm", -1),
    "left_axial_rotation": ("my_nm", 1),
}


@cache
def made(**choices: object) -> Phantom:
    return phantom(SEED, **choices)  # type: ignore[arg-type]


def truth() -> pd.DataFrame:
    return pd.read_csv(FOLDER / "truth.csv")


# --- files --------------------------------------------------------------------------------------


def test_files_are_what_the_script_writes(tmp_path: Path) -> None:
    again = tmp_path / FOLDER.name
    subprocess.run([sys.executable, str(SCRIPT), str(again)], check=True)
    written = {path.name: path.read_bytes() for path in again.iterdir()}
    assert written == {path.name: path.read_bytes() for path in FOLDER.iterdir()}


def test_the_generator_shares_no_code_with_the_library() -> None:
    imported = set()
    for path in (SCRIPT, *(SCRIPT.parent / "phantom").glob("*.py")):
        for node in ast.walk(ast.parse(path.read_bytes())):
            if isinstance(node, ast.Import):
                imported |= {alias.name.split(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.level == 0:
                imported.add(str(node.module).split(".")[0])
    allowed = {"collections", "csv", "dataclasses", "itertools", "pathlib", "sys", "typing"}
    assert imported <= allowed | {"numpy", "scipy", "phantom"}


def test_the_cohort_is_read() -> None:
    cohort = read(FOLDER)
    assert cohort.vertebrae == VERTEBRAE
    assert cohort.joint_names == JOINTS
    assert cohort.tests == tuple(MAIN)
    assert cohort.gravity
    assert cohort.zeroed_at_step_0
    assert cohort.measurement_sd is not None
    assert cohort.measurement_sd.rotation_deg == cohort.measurement_sd.translation_mm == 0.1
    assert cohort.motion is not None
    assert len(cohort.motion) == 6 * 3 * 3 * 11 * 6
    assert not cohort.motion.isna().any(axis=None)


def test_no_reader_sees_the_truth(tmp_path: Path) -> None:
    copy = tmp_path / FOLDER.name
    shutil.copytree(FOLDER, copy)
    (copy / "truth.csv").write_text("anything", encoding="utf-8")
    assert read(copy).digest == read(FOLDER).digest


# --- specimens and geometry ---------------------------------------------------------------------


def test_donors_are_table_1() -> None:
    table = pd.read_csv(FOLDER / "specimens.csv")
    columns = ["sex", "age_years", "height_m", "mass_kg"]
    assert table[columns].to_numpy().tolist() == TABLE_1


def test_frames_from_the_files_are_those_of_the_true_motion() -> None:
    """Rounding in two different ways to the same frames leaves 1e-15."""
    cohort, of = read(FOLDER), made()
    for name, bones in zip(cohort.specimen_names, of.specimens, strict=True):
        frames = joint_frames(cohort, name)
        rotations = np.stack([frame.rotation for frame in frames])
        np.testing.assert_allclose(rotations, bones.rotations, rtol=0, atol=1e-13)
        origins = np.stack([frame.origin for frame in frames])
        np.testing.assert_allclose(origins, bones.origins, rtol=0, atol=1e-15)


def test_segments_are_as_long_as_published_ones() -> None:
    """L5S1 to T12L1: bodies L1-L5, four whole and two half discs, a chord a little shorter."""
    bodies = 22.9 + 24.1 + 23.8 + 24.3 + 23.8
    discs = 10.56 / 2 + 11.44 + 10.71 + 9.64 + 8.37 + 7.0 / 2
    for row, bones in zip(TABLE_1, made().specimens, strict=True):
        chord = 1000.0 * np.linalg.norm(bones.origins[-1] - bones.origins[0])
        assert 0.9 < chord / ((bodies + discs) * row[2] / 1.68) < 1.05


def test_no_specimen_is_symmetric() -> None:
    for bones in made().specimens:
        assert np.abs(bones.rotations[:, 2, :2]).max() > 0.01
        assert np.ptp(bones.origins[:, 2]) > 1e-4


# --- truth --------------------------------------------------------------------------------------


@sweep("column", TABLE_3)
def test_specimens_spread_as_in_table_3(column: str) -> None:
    """A specimen's geometric mean over its joints stands for a uniform stiffness as in Table 3."""
    specimens = np.log(truth()[column].to_numpy().reshape(6, 6)).mean(axis=1)
    table = np.log(TABLE_3[column])
    assert np.median(specimens) == pytest.approx(np.median(table), abs=1e-5)
    assert specimens.std(ddof=1) == pytest.approx(table.std(ddof=1), abs=1e-5)


def test_levels_differ_mildly() -> None:
    """Common pattern and residual together; Table 2's levels differ up to 5.5-fold."""
    for column in TABLE_3:
        logs = np.log(truth()[column].to_numpy().reshape(6, 6))
        within = (logs - logs.mean(axis=1, keepdims=True)).std(ddof=6)
        assert 0.1 < within < 0.25


def test_translations_are_table_2() -> None:
    uniform = published("gould_2024b")["uniform_stiffness"]
    for column in ("anterior_n_per_m", "superior_n_per_m", "right_n_per_m"):
        assert (truth()[column] == uniform[column]).all()


# --- loads --------------------------------------------------------------------------------------


@sweep("test", MAIN)
def test_moments_rise_to_the_published_peak(test: str) -> None:
    table = pd.read_csv(FOLDER / "loads.csv")
    column, sign = MAIN[test]
    of_test = table[table["test"] == test]
    main = sign * of_test[column].to_numpy().reshape(18, 11)
    assert main == pytest.approx(np.tile(np.linspace(0.0, 7.5, 11), (18, 1)))
    assert not of_test[["fx_n", "fy_n", "fz_n"]].any(axis=None)
    assert set(of_test["vertebra"]) == {"T12"}


@sweep("test", MAIN)
def test_coupled_moments_are_small_smooth_and_never_the_same(test: str) -> None:
    table = pd.read_csv(FOLDER / "loads.csv")
    others = [name for name in MOMENTS if name != MAIN[test][0]]
    coupled = table[table["test"] == test][others].to_numpy().reshape(6, 3, 11, 2)
    assert not coupled[:, :, 0].any()
    assert 0.3 < np.abs(coupled).max() < 0.12 * 7.5
    assert np.abs(np.diff(coupled, axis=2)).max() < 0.3
    assert len(np.unique(coupled[:, :, -1])) == 36
    largest = np.abs(made().moments).max(axis=3)
    coupled_largest = largest[largest < 7.5].reshape(6, 3, 3, 2).mean(axis=(0, 1, 3))
    assert coupled_largest[0] > coupled_largest[1:].mean()


# --- measurement --------------------------------------------------------------------------------


def noise(of: Phantom) -> np.ndarray:
    """(P, T, C, S, J, 6) mm and deg: what zeroing and noise made of the true motion."""
    true = of.motion * np.array([1000.0] * 3 + [180.0 / np.pi] * 3)
    return of.measured - (true - true[:, :, :, :1] if of.zeroed else true)


@sweep("zeroed", [False, True])
def test_noise_is_as_cohort_yaml_says(zeroed: bool) -> None:
    """Zeroing puts step 0's noise into every reading of the cycle: two SDs in quadrature, of
    which half is common to all steps. 32,400 readings give an SD to 0.4 %, 3,240 cycles to 1.2 %.
    """
    errors = noise(made(zeroed=zeroed))
    later = errors[:, :, :, 1:]
    assert later.std() == pytest.approx(0.1 * np.sqrt(2.0 if zeroed else 1.0), rel=0.04)
    assert np.diff(later, axis=3).std() == pytest.approx(0.1 * np.sqrt(2.0), rel=0.02)
    common = 0.1 * np.sqrt(1.1 if zeroed else 0.1)
    assert later.mean(axis=3).std() == pytest.approx(common, rel=0.05)
    assert errors[:, :, :, 0].any() != zeroed


def test_motion_csv_holds_the_measured_motion() -> None:
    table = pd.read_csv(FOLDER / "motion.csv")
    columns = ["anterior_mm", "superior_mm", "right_mm"]
    columns += ["extension_deg", "right_bending_deg", "left_rotation_deg"]
    cells = table[columns].to_numpy().reshape(6, 3, 3, 11, 6, 6)
    np.testing.assert_allclose(cells, made().measured, rtol=0, atol=0.5001e-4)
    assert table["joint"].to_list() == list(JOINTS) * 594


# --- variants -----------------------------------------------------------------------------------


def test_another_seed_is_another_phantom() -> None:
    one, other = made(), phantom(SEED + 1)
    for name in ("stiffness", "moments", "motion", "measured"):
        assert not np.allclose(getattr(one, name), getattr(other, name))


def test_the_law_changes_nothing_but_the_motion() -> None:
    linear, stiffening = made(), made(law="stiffening")
    assert np.array_equal(linear.stiffness, stiffening.stiffness)
    assert np.array_equal(linear.moments, stiffening.moments)
    np.testing.assert_allclose(noise(linear), noise(stiffening), rtol=0, atol=1e-12)
    assert np.abs(stiffening.motion).max() < 0.8 * np.abs(linear.motion).max()


def test_bridged_joints_are_stiffer_in_rotation_and_turn_less() -> None:
    usual, bridged = made(), made(bridged=True)
    factors = bridged.stiffness / usual.stiffness
    assert (factors[:, :, :3] == 1.0).all()
    assert factors[:, :, 3:].min() > 2.99
    assert factors[:, :, 3:].max() < 50.01
    assert np.unique(factors[:, :, 3:].round(6)).size == factors[:, :, 3:].size
    np.testing.assert_allclose(noise(usual), noise(bridged), rtol=0, atol=1e-12)
    assert np.abs(bridged.motion[..., 3:]).max() < 0.4 * np.abs(usual.motion[..., 3:]).max()


def test_wrong_joint_centres_show_the_same_rigid_motion(tmp_path: Path) -> None:
    """spinepipe's own change of frame, from what joints.csv states, undoes the lab's mistake."""
    of, right = made(frame_error_mm=3.0, zeroed=False), made(zeroed=False)
    folder = tmp_path / "wrong_centres"
    write(of, folder)
    assert not (folder / "landmarks.csv").exists()
    cohort = read(folder)
    assert not cohort.zeroed_at_step_0
    border = np.array([1000.0] * 3 + [180.0 / np.pi] * 3)
    shown = of.measured - noise(right)
    errors = []
    for number, bones in enumerate(of.specimens):
        stated = joint_frames(cohort, cohort.specimen_names[number])
        for joint, frame in enumerate(stated):
            np.testing.assert_allclose(frame.rotation, bones.rotations[joint], rtol=0, atol=1e-10)
            true = Pose(bones.rotations[joint], bones.origins[joint])
            errors.append(frame.origin - true.origin)
            for q, seen in zip(
                of.motion[number, :, 1, 10, joint], shown[number, :, 1, 10, joint], strict=True
            ):
                expected = reexpress(q, true, frame) * border
                np.testing.assert_allclose(seen, expected, rtol=0, atol=1e-9)
    assert np.std(errors) == pytest.approx(0.003, rel=0.25)  # 108 draws: 7 % is one SE
    assert np.array_equal(of.motion, right.motion)
