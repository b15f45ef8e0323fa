"""What labs report of straight chains and made-up loops, against what was put in, by hand."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from chain_cases import JOINTS, MILLIMETRES, MOMENT_OF, Chains, Tables
from cohort_edge_cases import A
from cohort_study_cases import Size, tables_of
from scipy import stats
from scipy.spatial.transform import Rotation

from spinepipe.cohort import read
from spinepipe.cohort.measured import measured_specimen
from spinepipe.experiment.loop import Loop
from spinepipe.studies.cohort_stiffness.conclusions import ranges
from spinepipe.studies.cohort_stiffness.experiment import loading_loops
from spinepipe.studies.cohort_stiffness.loop_rows import paired_curves
from spinepipe.units import COORDINATES

KEY = ["joint", "test", "cycle", "source"]
SD_DEG = 0.1
ROOT = Path(__file__).parents[3]


def curve(found: Tables, joint: str, test: str, source: str = "measured") -> pd.Series:
    """The row of a joint."""
    rows = found["load_displacement"]
    chosen = (rows["joint"] == joint) & (rows["test"] == test) & (rows["source"] == source)
    (row,) = (one for _, one in rows[chosen].iterrows())
    return row


def both_sides(chains: Chains) -> Chains:
    """Flexion, and the same to the other side as a test of its own."""
    mirrored = {"test": "extension"}
    loads, motion = (table.assign(**mirrored) for table in (chains.loads, chains.motion))
    loads["mz_nm"] *= -1.0
    motion["extension_deg"] *= -1.0
    chains.loads = pd.concat([chains.loads, loads])
    chains.motion = pd.concat([chains.motion, motion])
    return chains


def looped(chains: Chains, moment: np.ndarray, turned_deg: np.ndarray) -> Chains:
    """One test of these moments, in which every joint turns like this in extension."""
    steps = len(moment)
    loads = pd.concat([chains.loads.iloc[:1]] * steps, ignore_index=True)
    chains.loads = loads.assign(step=range(steps), mz_nm=moment)
    motion = chains.motion.iloc[: len(JOINTS)]
    chains.motion = pd.concat(
        [motion.assign(step=step, extension_deg=turned) for step, turned in enumerate(turned_deg)],
        ignore_index=True,
    )
    return chains


def test_one_side_alone_has_a_range_and_a_stiffness(tmp_path: Path) -> None:
    found = Chains({"a": A}, steps=9, noise_deg=0.0).write(tmp_path).experiment("a")
    for place, joint in enumerate(JOINTS):
        for test, (_, sign, driven) in MOMENT_OF.items():
            row = curve(found, joint, test)
            k = A[place, list(MOMENT_OF).index(test)]
            assert row["coordinate"] == driven
            assert row["range_of_motion_deg"] == pytest.approx(np.rad2deg(8.0 / k))
            way = row["range_of_motion_high_deg"] - row["range_of_motion_deg"]
            assert way == pytest.approx(1.96 * np.sqrt(2.0) * SD_DEG, rel=1e-3)
            side = "positive" if sign > 0 else "negative"
            assert row[f"elastic_zone_stiffness_{side}_nm_per_rad"] == pytest.approx(k)
            assert row["neutral_zone"] == "one_side"
            assert row["elastic_zone"] == "upper_half"
            assert pd.isna(row["hysteresis_area_j"])
            assert "no unloading was read" in row["message"]
            model = curve(found, joint, test, "simulated")
            assert model["range_of_motion_deg"] == pytest.approx(np.rad2deg(8.0 / k), rel=1e-5)
            assert model["representation"] == "per_joint"
    assert not found["load_displacement"].duplicated(KEY).any()


@pytest.mark.parametrize("zeroed", [False, True])
def test_opposite_tests_are_one_curve(zeroed: bool, tmp_path: Path) -> None:
    """Told apart where each has its own zero: peak less peak is then noisier."""
    chains = both_sides(Chains({"a": A}, ["flexion"], steps=7, zeroed=zeroed))
    found = chains.write(tmp_path).experiment("a")
    assert set(found["load_displacement"]["test"]) == {"flexion+extension"}
    row = curve(found, "L4L5", "flexion+extension")
    assert row["range_of_motion_deg"] == pytest.approx(np.rad2deg(12.0 / 55.0))
    way = row["range_of_motion_high_deg"] - row["range_of_motion_deg"]
    noises = 4.0 if zeroed else 2.0
    assert way == pytest.approx(1.96 * np.sqrt(noises) * SD_DEG, rel=1e-3)
    assert ("its own zero" in row["message"]) == zeroed
    assert row["neutral_zone"] == "not_meaningful", "thirteen loads on a straight line"
    for side in ("positive", "negative"):
        assert row[f"elastic_zone_stiffness_{side}_nm_per_rad"] == pytest.approx(55.0)
    axis = found["helical_axes"].query("joint == 'L4L5' and source == 'measured'").iloc[0]
    assert (axis["from_nm"], axis["to_nm"]) == (-6.0, 6.0)


def test_a_loop_that_lags_and_softens_and_a_model_that_does_neither(tmp_path: Path) -> None:
    up = np.linspace(0.0, 7.5, 11)
    moment = np.concatenate([up, up[-2::-1], -up[1:], -up[-2::-1]])
    way = np.concatenate([-np.ones(11), np.ones(20), -np.ones(10)])  # 1 on the way down
    rise, steep, lag = 16.0, 0.9, 0.4
    turned = rise / (1.0 + np.exp(-steep * (moment + lag * way))) - rise / 2.0
    chains = looped(Chains({"a": A}, ["flexion"]), moment, turned)
    found = chains.write(tmp_path).experiment("a")
    row = curve(found, "L4L5", "flexion")
    assert row["neutral_zone"] == "found"
    assert row["neutral_zone_deg"] == pytest.approx(rise / np.sqrt(3.0), rel=0.03)
    assert row["neutral_zone_low_deg"] < rise / np.sqrt(3.0) < row["neutral_zone_high_deg"] + 0.3
    assert row["elastic_zone"] == "beyond_neutral_zone"
    # between the branches the load differs by twice the lag, over nearly all of the rise
    closed = 2.0 * lag * np.deg2rad(np.ptp(turned))
    assert row["hysteresis_area_j"] == pytest.approx(closed, rel=0.1)
    assert row["hysteresis_area_low_j"] > 0.0
    model = curve(found, "L4L5", "flexion", "simulated")
    assert model["neutral_zone"] == "not_meaningful"
    assert pd.isna(model["neutral_zone_deg"])
    assert model["hysteresis_area_j"] == pytest.approx(0.0, abs=1e-9)


def test_the_interval_of_a_simulated_range_is_that_of_its_stiffness(tmp_path: Path) -> None:
    """One unknown and a line through zero: range is moment times compliance, so is its interval."""
    study = "free: [extension]\nmeasurement_sd: {rotation_deg: 1.0, translation_mm: 1.0}\n"
    study += "representations: [per_specimen]\n"
    project = Chains({"a": A}, ["flexion"], noise_deg=0.2, study=study).write(tmp_path)
    kept = project.fit("a", "per_specimen", "flexion")["stiffness"].iloc[0]
    found = project.experiment("a", None, [str(tmp_path / "stiffness.parquet")])
    row = curve(found, "L4L5", "flexion", "simulated")
    turned = np.rad2deg(3.0 / kept["stiffness"])
    assert row["range_of_motion_deg"] == pytest.approx(turned, rel=1e-5)
    reach = stats.t.ppf(0.975, 11) * kept["standard_error"] / kept["stiffness"]
    assert row["range_of_motion_high_deg"] - turned == pytest.approx(turned * reach, rel=1e-3)


def test_a_turn_about_a_known_centre(tmp_path: Path) -> None:
    """8 N m turn the joint about a line 12 mm below and 5 mm behind its origin; 0.1 mm, 0.1 deg."""
    chains = Chains({"a": A}, ["flexion"], steps=9)
    centre = np.array([-5.0, -12.0, 0.0])
    turns = Rotation.from_euler("z", chains.motion[["extension_deg"]], degrees=True)
    chains.motion[list(MILLIMETRES)] = centre - turns.apply(centre)
    found = chains.write(tmp_path).experiment("a")["helical_axes"]
    row = found.query("joint == 'L5S1' and source == 'measured'").iloc[0]
    angle = 8.0 / 50.0
    assert row["status"] == "found"
    assert row["angle_deg"] == pytest.approx(np.rad2deg(angle))
    assert row["direction_right"] == pytest.approx(1.0), "from flexed to upright it extends"
    assert row["centre_anterior_mm"] == pytest.approx(-5.0)
    assert row["centre_superior_mm"] == pytest.approx(-12.0)
    assert row["along_mm"] == pytest.approx(0.0, abs=1e-9)
    assert row["angle_sd_deg"] == pytest.approx(np.sqrt(2.0) * SD_DEG, rel=1e-3)
    # Woltring et al. 1985: translations over twice the sine of half the angle, angle beside it
    of_translation = 0.1 * np.sqrt(2.0) / (2.0 * np.sin(0.5 * angle))
    of_angle = 12.0 * np.sqrt(2.0) * np.deg2rad(SD_DEG) / (2.0 * np.sin(0.5 * angle))
    sd = row["centre_superior_sd_mm"]
    assert of_translation < sd < np.hypot(of_translation, of_angle) * 1.1
    model = found.query("joint == 'L5S1' and source == 'simulated'").iloc[0]
    assert model["centre_superior_mm"] == pytest.approx(0.0, abs=1e-3), "bushings turn there"


def test_what_has_no_axis_says_why(tmp_path: Path) -> None:
    chains = Chains({"a": A}, steps=4)
    chains.motion.loc[chains.motion["joint"] == "L3L4", "right_bending_deg"] = np.nan
    found = chains.write(tmp_path).experiment("a")["helical_axes"]
    measured = found[found["source"] == "measured"].set_index(["joint", "test"])
    assert measured.loc[("L5S1", "flexion"), "status"] == "direction_only"
    assert measured.loc[("L3L4", "flexion"), "status"] == "not_read"
    small = measured.loc[("L5S1", "left_axial_rotation")]  # 3 N m over 200 N m/rad: 0.86 deg
    assert small["status"] == "too_small"
    assert small["angle_deg"] == pytest.approx(np.rad2deg(3.0 / 200.0))
    assert pd.isna(small["direction_superior"])
    assert "less than 2 deg" in small["message"]


def test_without_a_fit_or_a_noise_rows_say_so(tmp_path: Path) -> None:
    chains = Chains({"a": A}, ["flexion"], sd=False, study="cost: published\n")
    found = chains.write(tmp_path).experiment("a", None)
    row, model = (curve(found, "L4L5", "flexion", s) for s in ("measured", "simulated"))
    assert row["range_of_motion_deg"] == pytest.approx(np.rad2deg(3.0 / 55.0))
    assert pd.isna(row["range_of_motion_low_deg"])
    assert "no measurement_sd" in row["message"]
    assert model["status"] == "refused"
    assert "no stiffness" in model["message"]
    assert set(found["helical_axes"].query("source == 'simulated'")["status"]) == {"no_pose"}


def test_tests_without_a_moment_are_rows_without_a_curve(tmp_path: Path) -> None:
    chains = Chains({"a": A}, ["flexion", "left_lateral_bending"])
    chains.loads.loc[chains.loads["test"] == "flexion", "mz_nm"] = 0.0
    found = chains.write(tmp_path).experiment("a", None)
    row = curve(found, "L4L5", "flexion")
    assert row["status"] == "refused"
    assert "no moment" in row["message"]
    assert set(found["helical_axes"]["test"]) == {"left_lateral_bending"}


def test_cycles_that_were_not_numbered_are_refused(tmp_path: Path) -> None:
    moment = np.tile([0.0, 4.0, 0.0, -4.0], 3)
    chains = looped(Chains({"a": A}, ["flexion"]), moment, moment)
    row = curve(chains.write(tmp_path).experiment("a", None), "L4L5", "flexion")
    assert row["status"] == "refused"
    assert "number its cycles" in row["message"]
    assert pd.isna(row["range_of_motion_deg"])


def test_published_discs_have_the_range_and_stiffness_of_their_points() -> None:
    """Heuer et al. 2007, L4-L5 disc: -10.11 and 10.28 deg at 7.5 N m, -8.38 and 7.92 at 5."""
    cohort = read(ROOT / "config/cohorts/l4l5_disc")
    tested = measured_specimen(cohort, "heuer_2007", cohort.tests).tested
    (cycle,) = (one for one in loading_loops(tested) if one.test == "flexion+extension")
    assert cycle.coordinate == "extension"
    place = COORDINATES.index("extension")
    loop = Loop(cycle.load, cycle.measured[:, 0, place])
    assert np.rad2deg(loop.range_of_motion().value) == pytest.approx(10.11 + 10.28)
    slopes = [loop.elastic_compliance(side, None) for side in (-1, 1)]
    found = [1.0 / one.value for one in slopes if one is not None]
    assert found == pytest.approx([2.5 / np.deg2rad(10.11 - 8.38), 2.5 / np.deg2rad(10.28 - 7.92)])
    sides = {one.test for one in loading_loops(tested)}
    assert {"right_bending", "left_rotation"} < sides, "one side of each was tested"


def within(rows: pd.DataFrame) -> tuple[str, float, float]:
    """Verdict on range of motion, curves within noise, and curves of which a limit is known."""
    (found,) = ranges(paired_curves(rows, "range_of_motion", "deg"))
    return found.verdict, found.values["inside"].number, found.values["known"].number


RANGE = [f"range_of_motion_{part}deg" for part in ("", "low_", "high_")]


def test_ranges_agree_within_the_noise_that_a_fit_leaves() -> None:
    """Readings sure to 0.5 deg and a model of them to 0.3: their difference to 0.4, not 0.58."""
    rows = tables_of(Size(("a", "b")))["load_displacement"]
    model = rows["source"] == "simulated"
    middle = rows.loc[~model, RANGE[0]].to_numpy()
    rows.loc[~model, RANGE] = middle[:, None] + np.array([0.0, -0.5, 0.5])
    rows.loc[model, RANGE] = middle[:, None] + 0.39 + np.array([0.0, -0.3, 0.3])
    assert within(rows) == ("agree", 24, 24)
    rows.loc[model, RANGE] += 0.02
    assert within(rows) == ("differ", 0, 24)
    rows.loc[model, RANGE] = middle[:, None] + np.array([0.0, -0.5, 0.5])
    assert within(rows) == ("no_noise", 0, 0)


def test_of_springs_fitted_to_their_readings_95_in_100_are_within_the_limit() -> None:
    """Five loads to each side, noise of 0.1 deg: the limit of both as independent held all but 1 in
    100. Four SDs of a share of 2,000."""
    load = np.linspace(-1.0, 1.0, 11)
    fresh = np.random.default_rng(38).normal(0.0, 0.1, (2000, 11)) + 4.0 * load
    slope = fresh @ load / (load @ load)
    ways = 1.96 * np.array([0.1 * np.sqrt(2.0), 0.1 * 2.0 / np.sqrt(load @ load)])
    rows = pd.DataFrame(
        [
            {"source": source, "representation": name, "specimen": str(at), "joint": "L1L2"}
            | {"test": "flexion", "cycle": 1}
            | dict(zip(RANGE, (number, number - way, number + way), strict=True))
            for at in range(len(fresh))
            for source, name, number, way in (
                ("measured", "", fresh[at, -1] - fresh[at, 0], ways[0]),
                ("simulated", "per_joint", 2.0 * slope[at], ways[1]),
            )
        ]
    )
    _, agree, known = within(rows)
    assert known == 2000
    assert agree / 2000 == pytest.approx(0.95, abs=4.0 * np.sqrt(0.05 * 0.95 / 2000))


@pytest.mark.parametrize(
    ("setting", "zone_deg", "from_nm", "formula"),
    [
        ("", 12.0 / np.sqrt(3.0), 1.975, "(Smit et al. 2011"),
        ("neutral_zone: at_zero_load\n", 12.0 * np.tanh(1.0 / 6.0), 0.0, "rotation at M = 0"),
        (
            "neutral_zone: threshold\nneutral_zone_below_nm_per_deg: 1.0\n",
            12.0 * np.sqrt(0.5),  # 2 (1 - tanh2) = 1 deg/(N m)
            3.0 * np.arctanh(np.sqrt(0.5)),
            "below 1 N m/deg",
        ),
    ],
)
def test_the_definition_that_is_named_makes_the_zone_and_is_told(
    setting: str, zone_deg: float, from_nm: float, formula: str, tmp_path: Path
) -> None:
    """Up by 6 tanh((M - 0.5) / 3) deg, down by 6 tanh((M + 0.5) / 3) deg, to 7.5 N m."""
    up = np.linspace(0.0, 7.5, 16)
    moment = np.concatenate([up, up[-2::-1], -up[1:], -up[-2::-1]])
    way = np.concatenate([-np.ones(16), np.ones(30), -np.ones(15)])
    turned = 6.0 * np.tanh((moment + 0.5 * way) / 3.0)
    found = looped(Chains({"a": A}, ["flexion"], study=setting), moment, turned).write(tmp_path)
    tables = found.experiment("a")
    row = curve(tables, "L4L5", "flexion")
    assert row["neutral_zone"] == "found"
    assert row["neutral_zone_deg"] == pytest.approx(zone_deg, rel=5e-3)
    assert row["neutral_zone_low_deg"] < row["neutral_zone_deg"] < row["neutral_zone_high_deg"]
    assert -row["neutral_zone_from_nm"] == pytest.approx(from_nm, abs=0.02)
    at_zero = "at_zero_load" in setting
    assert row["elastic_zone"] == ("upper_half" if at_zero else "beyond_neutral_zone")
    rows = tables["load_displacement"]
    assert rows["neutral_zone_formula"].str.contains(formula, regex=False).all()
    named = setting.partition("\n")[0].removeprefix("neutral_zone: ") or "double_sigmoid"
    assert set(rows["neutral_zone_definition"]) == {named}
    model = curve(tables, "L4L5", "flexion", "simulated")
    if at_zero:  # a linear joint comes back the way it went
        assert model["neutral_zone_deg"] == pytest.approx(0.0, abs=1e-9)
