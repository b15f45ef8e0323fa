"""The shipped cohort ``palanca_l1l4`` meets the paper's tables, and its files are regenerated."""

import runpy
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from sweeps import sweep
import yaml
from scipy.spatial.transform import Rotation

from spinepipe.anatomy import published
from spinepipe.frames import joint_pose, zxy_angles

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "config" / "cohorts" / "palanca_l1l4"
GENERATOR = ROOT / "tests" / "generators" / "palanca_l1l4.py"
FILES = ("specimens.csv", "landmarks.csv", "bodies.csv", "loads.csv", "motion.csv")
JOINTS = {"L3L4": ("L4", "L3"), "L2L3": ("L3", "L2"), "L1L2": ("L2", "L1")}
ANGLES = ("extension_deg", "right_bending_deg", "left_rotation_deg")

ROUNDING_MM = 1e-6
"""The files hold six decimals in mm."""
ROUNDING_DEG = 1e-5
"""Half a nanometre at each end of a 25 mm line turns it by a few 1e-6 deg."""


def landmarks_m() -> dict[str, dict[str, np.ndarray]]:
    table = pd.read_csv(FOLDER / "landmarks.csv")
    points: dict[str, dict[str, np.ndarray]] = {}
    for line in table.itertuples():
        point = np.array([line.x_mm, line.y_mm, line.z_mm]) / 1000.0
        points.setdefault(line.vertebra, {})[line.landmark] = point
    return points


def table_7(joint: str, statistic: str) -> np.ndarray:
    values = published("gould_2024a")["joint_origin"]["complete"][joint][statistic]
    return np.array([values[name] for name in ("anterior_mm", "superior_mm", "right_mm")])


def table_8(joint: str, statistic: str) -> np.ndarray:
    values = published("gould_2024a")["joint_orientation"]["complete"][joint][statistic]
    return np.array([values[name] for name in ANGLES])


@sweep("name", FILES)
def test_files_are_what_the_generator_writes(name: str, tmp_path: Path) -> None:
    runpy.run_path(str(GENERATOR))["write"](tmp_path)
    assert (tmp_path / name).read_bytes() == (FOLDER / name).read_bytes()


def test_cohort_yaml() -> None:
    text = yaml.safe_load((FOLDER / "cohort.yaml").read_text(encoding="utf-8"))
    assert text["cohort"] == FOLDER.name
    assert text["vertebrae"] == ["L4", "L3", "L2", "L1"]
    assert text["gravity"] is True
    assert text["zeroed_at_step_0"] is False
    uncertainty = published("gould_2024a")["measurement_uncertainty"]
    assert text["measurement_sd"]["translation_mm"] == uncertainty["anterior_mm"]
    assert published("gould_2024a")["doi"] in text["source"]


@sweep("joint", JOINTS)
def test_joint_origins_are_table_7(joint: str) -> None:
    points = landmarks_m()
    lower, upper = JOINTS[joint]
    origin = joint_pose(points[lower], points[upper]).origin
    assert 1000.0 * origin == pytest.approx(table_7(joint, "median"), abs=ROUNDING_MM)


@sweep("joint", ["L1L2", "L3L4"])
def test_end_joint_orientations_are_table_8(joint: str) -> None:
    points = landmarks_m()
    lower, upper = JOINTS[joint]
    angles = np.rad2deg(zxy_angles(joint_pose(points[lower], points[upper]).rotation))
    assert angles == pytest.approx(table_8(joint, "median"), abs=ROUNDING_DEG)


def test_middle_joint_misses_table_8_by_what_the_decision_says() -> None:
    """Two of the three frames fix the third, so this one cannot be met: see decision 0001."""
    points = landmarks_m()
    angles = np.rad2deg(zxy_angles(joint_pose(points["L3"], points["L2"]).rotation))
    difference = angles - table_8("L2L3", "median")
    assert difference == pytest.approx([-2.63, -0.96, -0.32], abs=0.005)


def test_only_the_landmarks_that_could_be_palpated_are_given() -> None:
    assert {name: len(marks) for name, marks in landmarks_m().items()} == {
        "L4": 1,
        "L3": 4,
        "L2": 4,
        "L1": 1,
    }
    assert "superior_endplate_centre" in landmarks_m()["L4"]
    assert "inferior_endplate_centre" in landmarks_m()["L1"]


# --- spread of the joint frames under the assumed landmark SD -----------------------------------

SAMPLES = 5000


@cache
def sampled_landmarks_mm() -> dict[str, dict[str, np.ndarray]]:
    """(SAMPLES, 3) independent normal samples of every landmark."""
    rng = np.random.default_rng(20240515)
    table = pd.read_csv(FOLDER / "landmarks.csv")
    samples: dict[str, dict[str, np.ndarray]] = {}
    for line in table.itertuples():
        mean = np.array([line.x_mm, line.y_mm, line.z_mm])
        sample = mean + line.sd_mm * rng.normal(size=(SAMPLES, 3))
        samples.setdefault(line.vertebra, {})[line.landmark] = sample
    return samples


def sampled_frames(marks: dict[str, np.ndarray]) -> Rotation:
    """Frame rule of the cohort format for many landmark sets at once."""
    z = marks["right_pedicle_base"] - marks["left_pedicle_base"]
    z /= np.linalg.norm(z, axis=1, keepdims=True)
    x = np.cross(marks["superior_endplate_centre"] - marks["inferior_endplate_centre"], z)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    return Rotation.from_matrix(np.stack([x, np.cross(z, x), z], axis=-1))


def iqr(values: np.ndarray) -> np.ndarray:
    low, high = np.percentile(values, [25, 75], axis=0)
    return high - low


@cache
def orientation_iqr(joint: str) -> np.ndarray:
    samples = sampled_landmarks_mm()
    lower, upper = (sampled_frames(samples[name]) for name in ("L3", "L2"))
    midway = Rotation.from_rotvec((lower.inv() * upper).as_rotvec() / 2.0)
    frames = {"L1L2": upper, "L2L3": lower * midway, "L3L4": lower}[joint]
    return iqr(np.rad2deg(zxy_angles(frames.as_matrix())))


@sweep("joint", JOINTS)
def test_origin_spread_is_table_7(joint: str) -> None:
    """Both are sampled: 500 poses give an IQR to 5 %, so 15 % is three standard errors."""
    samples = sampled_landmarks_mm()
    lower, upper = JOINTS[joint]
    facing = samples[upper]["inferior_endplate_centre"], samples[lower]["superior_endplate_centre"]
    assert iqr((facing[0] + facing[1]) / 2.0) == pytest.approx(table_7(joint, "iqr"), rel=0.15)


@sweep("joint", ["L1L2", "L3L4"])
def test_bending_and_rotation_spread_of_the_end_joints_is_table_8(joint: str) -> None:
    assert orientation_iqr(joint)[1:] == pytest.approx(table_8(joint, "iqr")[1:], rel=0.15)


@sweep(
    "joint, ratios",
    [("L1L2", (0.44, None, None)), ("L2L3", (0.79, 0.74, 0.73)), ("L3L4", (0.59, None, None))],
)
def test_spread_that_table_8_prints_larger(joint: str, ratios: tuple[float | None, ...]) -> None:
    """Known misses of decision 0001: sampled IQR over printed IQR."""
    for ratio, sampled, printed in zip(
        ratios, orientation_iqr(joint), table_8(joint, "iqr"), strict=True
    ):
        if ratio is not None:
            assert sampled / printed == pytest.approx(ratio, abs=0.05)


# --- planar estimate of decision 0001 -----------------------------------------------------------

FLEXION_RAD = np.deg2rad([1.8, 1.4, 1.4])
"""L3L4 and L2L3 published; L1L2 not measured, taken like L2L3."""
SHEAR_M = np.array([0.33 + 0.34, 0.34, 0.0]) / 1000.0
"""Forward travel of the load point relative to each joint through shear there and above."""


def lever_arms_m() -> tuple[np.ndarray, np.ndarray]:
    """Static arm in front of each joint (3,), and its growth per radian of each joint (3, 3)."""
    load = pd.read_csv(FOLDER / "loads.csv").iloc[1]
    x, y, _ = np.stack([table_7(joint, "median") for joint in JOINTS]).T / 1000.0
    return load.px_mm / 1000.0 - x, load.py_mm / 1000.0 - np.maximum.outer(y, y)


def test_planar_moments_of_the_decision() -> None:
    arm, travel = lever_arms_m()
    static = 54.0 * arm
    loaded = 54.0 * (arm + travel @ FLEXION_RAD + SHEAR_M)
    assert static == pytest.approx([0.240, 0.189, 0.323], abs=0.001)
    assert loaded == pytest.approx([0.673, 0.542, 0.540], abs=0.001)
    assert loaded / FLEXION_RAD == pytest.approx([21.4, 22.2, 22.1], abs=0.1)
    best = published("gould_2024a")["best_model"]["stiffness"]["extension_nm_per_rad"]
    assert best * FLEXION_RAD == pytest.approx([0.468, 0.364, 0.364], abs=0.001)


def test_planar_critical_stiffness_of_the_decision() -> None:
    """Below this uniform stiffness the column of three springs has no stable state."""
    _, travel = lever_arms_m()
    largest = np.linalg.eigvalsh(travel)[-1]
    assert 54.0 * largest == pytest.approx(12.2, abs=0.05)
    assert (54.0 + 9.81) * largest == pytest.approx(14.4, abs=0.05)
