"""The shipped cohort ``l4l5_disc`` has the published points, entered here a second time.

Where the lists of published numbers lie beside this repository, every row of theirs is looked for.
"""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from spinepipe import cohort as cohorts

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "config" / "cohorts" / "l4l5_disc"
CURVES = ROOT.parent / "shared" / "published" / "motion-segment-curves.csv"

# At the largest moment: its axis and sign, the coordinate it drives and its sign, both readings.
LAST = {
    "flexion": (("mz_nm", -1), ("extension_deg", -1), (10.11, 11.87)),
    "extension": (("mz_nm", 1), ("extension_deg", 1), (10.28, 8.27)),
    "right_bending": (("mx_nm", 1), ("right_bending_deg", 1), (6.43, 7.10)),
    "left_rotation": (("my_nm", 1), ("left_rotation_deg", 1), (5.73, 5.79)),
}
MOMENTS = {"heuer_2007": (0, 1, 2.5, 5, 7.5), "jaramillo": (0, 2, 4, 6, 8)}
DIRECTIONS = {
    "lateral_bending": "right_bending",
    "lateral_bending_right": "right_bending",
    "axial_rotation": "left_rotation",
    "axial_rotation_left": "left_rotation",
}
"""Sides as the cohort's ``source`` says."""


def points() -> pd.DataFrame:
    """Size of moment and rotation of every specimen, test and step, the way the test goes."""
    cohort = cohorts.read(FOLDER)
    assert cohort.loads is not None
    assert cohort.motion is not None
    both = cohort.loads.merge(cohort.motion, on=["specimen", "test", "step"])
    rows = []
    for row in both.to_dict("records"):
        (axis, way), (coordinate, turn), _ = LAST[row["test"]]
        told = {"moment_nm": way * row[axis], "deg": turn * row[coordinate]}
        rows.append({name: row[name] for name in ("specimen", "test", "step")} | told)
    return pd.DataFrame(rows)


def test_every_curve_begins_at_zero_and_ends_where_the_papers_say() -> None:
    curves = points()
    assert len(curves) == 2 * 4 * 5
    for (specimen, test), curve in curves.groupby(["specimen", "test"]):
        assert tuple(curve["moment_nm"]) == MOMENTS[specimen]
        assert curve["deg"].iloc[0] == 0.0
        assert curve["deg"].is_monotonic_increasing
        assert curve["deg"].iloc[-1] == LAST[test][2][list(MOMENTS).index(specimen)]


def test_only_the_moment_of_the_test_acts() -> None:
    loads = cohorts.read(FOLDER).loads
    assert loads is not None
    assert not loads[["fx_n", "fy_n", "fz_n"]].to_numpy().any()
    applied = (loads[["mx_nm", "my_nm", "mz_nm"]] != 0).sum(axis=1)
    assert set(applied[loads["step"] > 0]) == {1}
    assert set(loads["vertebra"]) == {"L4"}


def test_noise_is_below_what_separates_specimens_and_above_what_was_rounded() -> None:
    cohort = cohorts.read(FOLDER)
    assert cohort.measurement_sd is not None
    between = pd.read_csv(FOLDER / "sd_between_specimens.csv")["sd_between_specimens_deg"]
    assert 0.01 < cohort.measurement_sd.rotation_deg < between.min()


def published() -> pd.DataFrame:
    if not CURVES.is_file():
        pytest.skip("the lists of published numbers do not lie beside this repository")
    rows = pd.read_csv(CURVES)
    return rows[rows["source_set"].isin(MOMENTS)].replace({"direction": DIRECTIONS})


def test_every_published_point_is_in_the_cohort_and_no_other() -> None:
    listed = published()
    ours = points().query("step > 0").set_index(["specimen", "test", "moment_nm"])["deg"]
    theirs = listed.astype({"moment_nm": float, "value": float}).set_index(
        ["source_set", "direction", "moment_nm"]
    )["value"]
    assert set(ours.index) == set(theirs.index)
    np.testing.assert_array_equal(ours.sort_index(), theirs.sort_index())


def test_the_spread_between_specimens_is_the_published_one() -> None:
    listed = published().dropna(subset=["low"])
    steps = listed.groupby("direction").cumcount() + 1
    half = (listed["high"] - listed["low"]) / 2
    theirs = dict(zip(zip(listed["direction"], steps, strict=True), half, strict=True))
    between = pd.read_csv(FOLDER / "sd_between_specimens.csv")
    ours = dict(
        zip(
            zip(between["test"], between["step"], strict=True),
            between["sd_between_specimens_deg"],
            strict=True,
        )
    )
    assert set(ours) == set(theirs)
    for place, sd in ours.items():
        assert sd == pytest.approx(theirs[place], abs=0.005), place  # both have two decimals
