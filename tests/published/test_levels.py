"""Sizes and attitudes by level, entered again from their sources or measured again in CT."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from spinepipe.plausibility.score import usual
from spinepipe.plausibility.warnings.levels import (
    DISC_MM,
    EXTENSION_DEG,
    SPACING_MM,
    extension_range_deg,
    height_mm,
    least_kg,
    spacing_mm,
)

DATA = Path(__file__).resolve().parents[3] / "shared" / "data"


@pytest.fixture(scope="module")
def spines() -> Path:
    """83 spines in CT (VID), where they are; no part of this repository."""
    if not (DATA / "vid_t1l5").is_dir():
        pytest.skip("no CT of spines beside this repository")
    return DATA / "vid_t1l5"


def test_spacing_is_that_of_spines_in_ct(spines: Path) -> None:
    """Straight from joint to joint."""
    measured: dict[str, list[float]] = {}
    for _, rows in pd.read_csv(spines / "joints.csv").groupby("specimen", sort=False):
        points = rows[["x_mm", "y_mm", "z_mm"]].to_numpy()
        for joint, distance in zip(
            rows["joint"], np.linalg.norm(np.diff(points, axis=0), axis=1), strict=False
        ):
            measured.setdefault(joint, []).append(float(distance))
    found = {name: np.mean(values) for name, values in measured.items()}
    for joint, mean in found.items():
        assert SPACING_MM[upper(joint)] == pytest.approx(mean, abs=0.06), joint
    assert len(found) == 15


def upper(joint: str) -> str:
    """The upper vertebra of a joint: T12 of T12L1."""
    return joint[: next(k for k in range(1, len(joint)) if joint[k].isalpha())]


def test_attitude_is_that_of_spines_in_ct(spines: Path) -> None:
    rows = pd.read_csv(spines / "joints.csv")
    told = rows.groupby("joint", sort=False)["extension_deg"].agg(["mean", "std"])
    smooth = [smoothed(told[name].to_numpy()) for name in ("mean", "std")]
    lower = [joint[len(upper(joint)) :] for joint in told.index]
    for vertebra, mean, sd in zip(lower, *smooth, strict=True):
        assert EXTENSION_DEG[vertebra] == pytest.approx((mean, sd), abs=0.06), vertebra
    ranges = rows["joint"].map(dict(zip(told.index, map(extension_range_deg, lower), strict=True)))
    inside = [
        low < angle < high for (low, high), angle in zip(ranges, rows["extension_deg"], strict=True)
    ]
    assert all(inside)


def smoothed(values: np.ndarray) -> np.ndarray:
    """A quarter, a half, a quarter; past the ends the line goes on."""
    padded = [2 * values[0] - values[1], *values, 2 * values[-1] - values[-2]]
    return np.convolve(padded, [0.25, 0.5, 0.25], mode="valid")


def test_pedicles_are_those_of_spines_in_ct(spines: Path) -> None:
    """18.0 to 60.3 mm apart."""
    points = pd.read_csv(spines / "landmarks.csv").set_index(["specimen", "vertebra", "landmark"])
    sides = [points.xs(f"{side}_pedicle", level="landmark") for side in ("left", "right")]
    apart = np.linalg.norm(sides[1] - sides[0], axis=1)
    assert (apart.min(), apart.max()) == pytest.approx((18.0, 60.3), abs=0.06)
    limits = usual("pedicles_apart")
    assert limits.low * 1.8 * 1.2 < apart.min() * 1.01
    assert apart.max() * 1.2 < limits.high


def test_l5_is_that_of_two_men() -> None:
    """The full-body model's, 39.6 mm, and the Visible Human's, 40.0 mm."""
    if not (DATA / "thoracolumbar_male").is_dir():
        pytest.skip("no geometry of spines beside this repository")
    points = pd.read_csv(DATA / "thoracolumbar_male" / "joints.csv")[["x_mm", "y_mm", "z_mm"]]
    one = float(np.linalg.norm(points.iloc[1] - points.iloc[0]))
    assert one == pytest.approx(39.6, abs=0.05)
    assert spacing_mm("L5") == pytest.approx((one + 40.0) / 2.0, abs=0.05)


def test_discs_and_bodies() -> None:
    """Shukri 2013: L1L2 to L5S1; Kunkel 2011: 4.5 to 7.2 mm; L5 26.3 mm behind, 30.3 in front."""
    discs = {"T12L1": 7.0, "L1L2": 8.37, "L2L3": 9.64, "L3L4": 10.71, "L4L5": 11.44, "L5S1": 10.56}
    pairs = zip(
        ("L1", "L2", "L3", "L4", "L5"), list(discs.values()), list(discs.values())[1:], strict=False
    )
    for vertebra, above, below in pairs:
        assert DISC_MM[vertebra] == pytest.approx((above + below) / 2.0, abs=0.06)
    assert pytest.approx((4.5 + 7.2) / 2.0, abs=0.06) == DISC_MM["T"]
    assert height_mm("L5") == pytest.approx((26.3 + 30.3) / 2.0, abs=0.6)
    assert height_mm("C5") == pytest.approx(11.1)
    assert height_mm("T9") == pytest.approx((18.83 + 20.46) / 2.0, abs=1.0)
    assert height_mm("V3") is spacing_mm("V3") is extension_range_deg("V3") is None


def test_sacral_slope() -> None:
    """24 to 55 deg is the mean and two SDs to each side; half of the disc's 21.6 (SD 7.7) less."""
    slope, sd = (24 + 55) / 2, (55 - 24) / 4
    wanted = (-(slope - 21.6 / 2), float(np.hypot(sd, 7.7 / 2)))
    assert EXTENSION_DEG["S1"] == pytest.approx(wanted, abs=0.06)


def test_masses_of_dry_vertebrae() -> None:
    """6.3, 8.7 and 17.9 g."""
    found = [least_kg(name) for name in ("C4", "T3", "L2", "V2")]
    assert found == pytest.approx([0.00315, 0.00435, 0.00895, 0.00315])
