"""Jobs of cohort studies on straight chains, whose motion is moment over stiffness, by hand.

Seen here: a stiffness, error, criterion or label that is not what the closed form says; readings,
cycles or steps used that should not be.
"""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import statsmodels.api as sm
from chain_cases import JOINTS, MOMENT_OF, ROTATIONS, STUDY, Chains, Written, by_joint
from cohort_edge_cases import TRUTH, A
from scipy import stats
from statsmodels.tools import eval_measures

from spinepipe.calibration import fit as calibrate
from spinepipe.calibration.profile import NEAR
from spinepipe.cohort import Cohort
from spinepipe.cohort.load_tests import coupled_range, loaded_coordinate, peak_step
from spinepipe.effects import Wrench
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.model import LoadCase, LoadStep
from spinepipe.studies.cohort_stiffness.fit_rows import criteria, interval
from spinepipe.studies.cohort_stiffness.problem import calibration_problem, specimen_tests
from spinepipe.studies.cohort_stiffness.settings import CohortStiffness

# Gould et al. 2024b (doi 10.3389/fbioe.2024.1372088), Table 2: extension, bending, rotation.
UNIFORM = (51.0, 68.8, 291.0)
LEVELS = {"L5S1": (51.0, 68.8, 183.4), "L4L5": (50.0, 13.8, 291.1), "L3L4": (49.5, 12.4, 291.1)}


def assert_stiffness(found: pd.DataFrame, expected: np.ndarray, rtol: float = 1e-6) -> None:
    np.testing.assert_allclose(by_joint(found)[list(ROTATIONS)], expected, rtol=rtol)


def inputs(project: Written) -> tuple[CohortStiffness, Cohort]:
    return study_of_kind(CohortStiffness, str(project.root), STUDY)


def test_each_joint_is_found_from_motion_without_noise(tmp_path: Path) -> None:
    project = Chains(TRUTH).write(tmp_path)
    found = project.fit("a", "per_joint")
    assert_stiffness(found["stiffness"], A)
    assert found["stiffness"]["identifiable"].all()
    assert set(found["stiffness"]["source"]) == {"own"}
    assert (found["errors"]["rmse"] < 1e-6).all()
    assert set(found["errors"]["stage"]) == {"fitted"}
    record = found["fits"].iloc[0]
    assert (record["readings"], record["unknowns"]) == (3 * 4 * 3 * 3, 9)


def test_one_stiffness_for_all_joints_is_the_harmonic_mean(tmp_path: Path) -> None:
    """Equal moments on all joints: the least squares of 1 / k is its mean."""
    found = Chains(TRUTH).write(tmp_path).fit("a", "per_specimen")
    expected = 1.0 / np.mean(1.0 / A, axis=0)
    assert_stiffness(found["stiffness"], np.tile(expected, (3, 1)))


@pytest.mark.parametrize("fitted_to", ["all", "flexion", "all_but_flexion"])
def test_level_ratio_keeps_the_ratios_exactly(fitted_to: str, tmp_path: Path) -> None:
    found = by_joint(Chains(TRUTH).write(tmp_path).fit("a", "level_ratio", fitted_to)["stiffness"])
    ratios = found[list(ROTATIONS)] / pd.DataFrame(LEVELS, index=ROTATIONS).T.loc[list(JOINTS)]
    np.testing.assert_allclose(ratios, np.tile(ratios.iloc[0], (3, 1)), rtol=1e-12)
    if fitted_to == "all":  # least squares of one factor f on 1 / (f r) against 1 / k
        r = np.array(list(LEVELS.values()))
        factor = (r**-2.0).sum(axis=0) / (1.0 / r / A).sum(axis=0)
        np.testing.assert_allclose(ratios.iloc[0], factor, rtol=1e-6)


def linear_fit(project: Written) -> Any:
    """Ordinary least squares of extension in deg on 1 / k: a line through zero."""
    motion = pd.read_csv(project.root / "config/cohorts/chains/motion.csv")
    moment = -np.rad2deg(motion["step"].to_numpy(float))
    return sm.OLS(motion["extension_deg"].to_numpy(), moment).fit()


ONE_UNKNOWN = "free: [extension]\nmeasurement_sd: {rotation_deg: 1.0, translation_mm: 1.0}\n"


@pytest.fixture
def one_unknown(tmp_path: Path) -> Written:
    """One stiffness, one noisy test, readings weighted by 1."""
    return Chains({"a": A}, ["flexion"], noise_deg=0.2, study=ONE_UNKNOWN).write(tmp_path)


def test_the_standard_error_of_one_unknown(one_unknown: Written) -> None:
    linear = linear_fit(one_unknown)
    (row,) = one_unknown.fit("a", "per_specimen", "flexion")["stiffness"].to_dict("records")[:1]
    compliance, log_error = linear.params[0], linear.bse[0] / linear.params[0]
    way = stats.t.ppf(0.975, 11) * linear.bse[0]
    assert row["stiffness"] == pytest.approx(1 / compliance, rel=1e-6)
    assert row["standard_error"] == pytest.approx(log_error / compliance, rel=1e-5)
    assert 1 / row["low"] == pytest.approx(compliance + way, abs=NEAR * way)
    assert 1 / row["high"] == pytest.approx(compliance - way, abs=NEAR * way)


def test_criteria_are_those_of_an_equal_linear_fit(one_unknown: Written) -> None:
    linear = linear_fit(one_unknown)
    (row,) = one_unknown.fit("a", "per_specimen", "flexion")["fits"].to_dict("records")
    assert (row["readings"], row["unknowns"], row["effective_unknowns"]) == (12, 1, 1.0)
    assert row["cost"] == pytest.approx(linear.ssr, rel=1e-6)
    assert row["scatter"] == pytest.approx(np.sqrt(linear.mse_resid), rel=1e-6)
    assert row["log_likelihood"] == pytest.approx(linear.llf, rel=1e-6)
    assert row["aicc"] == pytest.approx(eval_measures.aicc(linear.llf, 12, 2), rel=1e-6)
    assert row["bic"] == pytest.approx(eval_measures.bic(linear.llf, 12, 2), rel=1e-6)


@pytest.mark.parametrize(("readings", "known"), [(1, 0), (2, 1), (3, 1), (4, 4)])
def test_too_few_readings_have_no_criteria(readings: int, known: int) -> None:
    """With one unknown and the scatter, the corrected criterion needs four readings."""
    assert sum(value is not None for value in criteria(2.0, readings, 1.0).values()) == known


def test_an_unknown_at_a_bound_leaves_its_degree_of_freedom_to_the_scatter(tmp_path: Path) -> None:
    """Stiffness may only rise by a thousandth, and would by far: nothing is fitted."""
    study = "free: [extension]\nbound_factor: 1.001\n"
    chains = Chains({"a": 2.0 * A}, ["flexion"], study=study, noise_deg=0.1)
    (row,) = chains.write(tmp_path).fit("a", "per_specimen")["fits"].to_dict("records")
    assert (row["readings"], row["unknowns"], row["status"]) == (12, 1, "converged_at_bound")
    assert row["scatter"] == pytest.approx(np.sqrt(row["cost"] / 12))


def test_an_interval_without_end_is_none() -> None:
    """Hardly a trace in the data: the upper end would run over all numbers."""
    assert interval(50.0, 1e4, 2.0) == {
        "stiffness": 50.0,
        **dict.fromkeys(("standard_error", "low", "high")),
    }


def test_published_values_are_those_of_the_paper(tmp_path: Path) -> None:
    rows = Chains(TRUTH).write(tmp_path).literature("a")["stiffness"]
    uniform, levels = (
        rows[rows["representation"] == name] for name in ("literature", "literature_levels")
    )
    assert_stiffness(uniform, np.tile(UNIFORM, (3, 1)), rtol=0.0)
    assert_stiffness(levels, np.array(list(LEVELS.values())), rtol=0.0)
    assert set(rows["fitted_to"]) == {"nothing"}
    assert rows[["standard_error", "low", "high", "identifiable"]].isna().all(axis=None)


def test_levels_without_a_published_value_are_not_made_up(tmp_path: Path) -> None:
    value = "{extension_nm_per_rad: 50, right_bending_nm_per_rad: 50, left_rotation_nm_per_rad: 50}"
    study = f"representations: [per_joint]\nlevel_stiffness:\n  L5S1: {value}\n"
    found = Chains(TRUTH, study=study).write(tmp_path).literature("a")
    for table in ("stiffness", "errors"):
        assert set(found[table]["representation"]) == {"literature"}


# One N m turns each joint by exactly one degree.
ONE_DEGREE = f"stiffness: {{extension_nm_per_rad: {float(np.rad2deg(1.0))!r}}}\n"


def read_by_hand(zeroed: bool, tmp_path: Path) -> pd.DataFrame:
    """Errors of flexion by 0, 1, 2 N m in two cycles; L5S1 and L4L5 as measured by hand."""
    chains = Chains({"a": A}, ["flexion"], cycles=3, steps=3, zeroed=zeroed, study=ONE_DEGREE)
    measured = {2: [0.2, -0.5, -3.0], 3: [0.0, -1.1, -1.6]}
    for cycle, values in measured.items():
        here = (chains.motion["cycle"] == cycle) & (chains.motion["joint"] == "L5S1")
        chains.motion.loc[here, "extension_deg"] = values
    gone = (chains.motion["joint"] == "L4L5") & (chains.motion["step"] == 2)
    chains.motion.loc[gone, "extension_deg"] = np.nan
    rows = chains.write(tmp_path).literature("a")["errors"]
    rows = rows[(rows["representation"] == "literature") & (rows["coordinate"] == "extension")]
    return rows.set_index("joint")


def test_errors_by_hand(tmp_path: Path) -> None:
    """Predicted 0, -1, -2: errors -0.2, -0.5, 1 in cycle 2 and 0, 0.1, -0.4 in cycle 3."""
    rows = read_by_hand(False, tmp_path)
    row = rows.loc["L5S1"]
    assert row["readings"] == 6
    assert row["loaded"]
    assert row["bias"] == pytest.approx(0.0, abs=1e-9)
    assert row["mae"] == pytest.approx(2.2 / 6)
    assert row["rmse"] == pytest.approx(np.sqrt(1.46 / 6))
    assert row["peak_error"] == pytest.approx((1.0 - 0.4) / 2)
    assert row["measured"] == pytest.approx(6.4 / 6)
    assert row["measured_peak"] == pytest.approx(-2.3)
    lost = rows.loc["L4L5"]  # not read at the peak
    assert lost["readings"] == 4
    assert lost[["peak_error", "measured_peak"]].isna().all()


def test_zeros_that_zeroing_makes_are_no_readings(tmp_path: Path) -> None:
    """What 4 SD of a reading may leave at step 0 is subtracted: errors -0.3, 1.2, 0.1, -0.4."""
    row = read_by_hand(True, tmp_path).loc["L5S1"]
    assert row["readings"] == 4
    assert row["bias"] == pytest.approx(0.6 / 4)
    assert row["mae"] == pytest.approx(2.0 / 4)


def test_stages_of_one_load_case(tmp_path: Path) -> None:
    errors = Chains(TRUTH).write(tmp_path).fit("a", "per_joint", "flexion")["errors"]
    stages = errors.groupby("test")["stage"].unique().explode().to_dict()
    others = dict.fromkeys(("left_lateral_bending", "left_axial_rotation"), "left_out_case")
    assert stages == {"flexion": "fitted", **others}
    loaded = errors[errors["loaded"]].groupby("test")["coordinate"].unique().explode().to_dict()
    assert loaded == {test: driven for test, (_, _, driven) in MOMENT_OF.items()}


@pytest.mark.parametrize(
    ("label", "used"),
    [
        ("flexion", ["flexion"]),
        ("all", ["flexion", "left_lateral_bending", "left_axial_rotation"]),
        ("all_but_flexion", ["left_lateral_bending", "left_axial_rotation"]),
    ],
)
def test_labels_of_what_is_fitted(label: str, used: list[str], tmp_path: Path) -> None:
    settings, cohort = inputs(Chains(TRUTH).write(tmp_path))
    tests = specimen_tests(settings, cohort, "a")
    assert [one.case.test for one in tests.fitted_to(label)] == used


def with_coupled(cycles: dict[int, list[float]], study: str = "") -> Chains:
    """Flexion in 0, 1, 2 N m with moments about x by cycle and step beside."""
    chains = Chains({"a": A}, ["flexion"], cycles=len(cycles), steps=3, study=study)
    for cycle, beside in cycles.items():
        chains.loads.loc[chains.loads["cycle"] == cycle, "mx_nm"] = beside
    return chains


@pytest.mark.parametrize(
    ("cycles", "used"), [("after_first", [2, 3, 4]), ("quietest", [3]), ("all", [1, 2, 3, 4])]
)
def test_cycles_that_are_used(cycles: str, used: list[int], tmp_path: Path) -> None:
    """The first is the quietest of all, and left out; of the others 3 has the smallest range."""
    beside = {1: [0.0, 0.0, 0.0], 2: [0.0, 0.3, -0.2], 3: [0.9, 0.8, 0.6], 4: [0.0, 0.0, 0.4]}
    project = with_coupled(beside, f"cycles: {cycles}\n").write(tmp_path)
    tests = specimen_tests(*inputs(project), "a")
    assert [one.case.cycle for one in tests.tested] == used


def test_the_first_cycle_is_the_first_that_was_loaded_not_the_first_read(tmp_path: Path) -> None:
    """A lab that never read cycle 1 has left it out already."""
    chains = Chains({"a": A}, ["flexion"], cycles=3)
    chains.motion = chains.motion[chains.motion["cycle"] > 1]
    tests = specimen_tests(*inputs(chains.write(tmp_path)), "a")
    assert [one.case.cycle for one in tests.tested] == [2, 3]


def case(*moments: tuple[float, float, float], forces: bool = False) -> LoadCase:
    """Load steps of one moment each, or of one force."""
    zero = np.zeros(3)
    steps = []
    for number, vector in enumerate(moments):
        pair = (np.array(vector), zero) if forces else (zero, np.array(vector))
        steps.append(LoadStep(number, (Wrench(0, zero, *pair),), None))
    return LoadCase("test", 1, tuple(steps))


def test_main_moment_by_hand() -> None:
    twisted = case((0.0, 0.0, 0.0), (0.3, 2.0, -5.0), (-0.1, 6.0, -1.0), (0.0, 1.0, 0.0))
    assert peak_step(twisted) == 2
    assert loaded_coordinate(twisted) == "left_rotation"
    assert coupled_range(twisted) == pytest.approx(np.hypot(0.4, 5.0))
    assert loaded_coordinate(case((-7.0, 1.0, 2.0))) == "right_bending"
    assert loaded_coordinate(case((1.0, 1.0, -7.0))) == "extension"


def test_steps_without_loads_and_loads_without_moments() -> None:
    nothing = LoadCase("test", 1, (LoadStep(0, (), None), LoadStep(1, (), None)))
    assert (peak_step(nothing), loaded_coordinate(nothing), coupled_range(nothing)) == (0, None, 0)
    pulled = case((0.0, 0.0, 0.0), (0.0, -9.0, 0.0), (0.0, -3.0, 0.0), forces=True)
    assert (peak_step(pulled), loaded_coordinate(pulled)) == (1, None)


def readings_in_cost(study: str, tmp_path: Path) -> dict[str, np.ndarray]:
    """(steps, joints, 6) readings that enter the cost, by test."""
    settings, cohort = inputs(Chains({"a": A}, steps=3, study=study).write(tmp_path))
    tests = specimen_tests(settings, cohort, "a")
    problem = calibration_problem(settings, cohort, "a", "per_joint", tests.frames, tests.tested)
    counted = {c.case.test: np.isfinite(c.measured) & (problem.weights > 0) for c in problem.cases}
    assert calibrate(problem).status.usable
    return counted


def test_published_cost_has_axial_rotation_in_axial_rotation_tests_only(tmp_path: Path) -> None:
    counted = readings_in_cost("cost: published\n", tmp_path)
    for test, used in counted.items():
        axial = int(test == "left_axial_rotation")
        assert used.mean(axis=(0, 1)).tolist() == [0, 0, 0, 1, 1, axial]
    assert set(counted) == set(MOMENT_OF)


def test_peak_steps_are_those_of_the_largest_moment(tmp_path: Path) -> None:
    for used in readings_in_cost("steps: peak\n", tmp_path).values():
        assert used.any(axis=(1, 2)).tolist() == [False, False, True]


@pytest.mark.parametrize(
    ("cost", "per_square_degree"), [("published", 1.0), ("measurement_sd", 100.0)]
)
def test_cost_is_in_square_degrees_or_declared_sds(
    cost: str, per_square_degree: float, tmp_path: Path
) -> None:
    """Stiffness may only rise by a thousandth; one joint of three reads half of what it predicts.

    By 1 and 2 N m a joint then turns by 1 and 2 deg over 1.001; the SD is 0.1 deg.
    """
    study = f"cost: {cost}\nfree: [extension]\nbound_factor: 1.001\n{ONE_DEGREE}"
    stiff = np.full((3, 3), np.rad2deg(1.0))
    stiff[0] *= 2.0
    chains = Chains({"a": stiff}, ["flexion"], steps=3, study=study)
    found = chains.write(tmp_path).fit("a", "per_specimen", "flexion")
    squares = (1 + 4) * ((1 / 1.001 - 0.5) ** 2 + 2 * (1 / 1.001 - 1.0) ** 2)
    assert found["fits"]["cost"].item() == pytest.approx(per_square_degree * squares, rel=1e-6)
    assert found["fits"]["status"].item() == "converged_at_bound"
    assert set(found["stiffness"]["at_bound"]) == {"upper"}
    assert not found["stiffness"]["identifiable"].any()
    assert found["stiffness"]["standard_error"].isna().all()


def test_medians_of_the_others_by_hand(tmp_path: Path) -> None:
    project = Chains(TRUTH | {"d": 3.0 * A}).write(tmp_path)
    found = project.left_out(["b", "c", "d"], "a", "per_joint")
    assert_stiffness(found["stiffness"], 1.5 * A)
    assert set(found["stiffness"]["message"]) == {"median of 3 specimens"}
    assert found["stiffness"][["standard_error", "low", "high"]].isna().all(axis=None)
    assert set(found["errors"]["stage"]) == {"left_out_specimen"}
    rows = found["errors"][found["errors"]["loaded"]].set_index(["test", "joint"])
    peak = rows.loc[("flexion", "L5S1"), "peak_error"]
    assert peak == pytest.approx(np.rad2deg(3.0 / 50.0 - 3.0 / 75.0), rel=1e-6)


def test_a_left_out_load_case_is_not_told_of_medians(tmp_path: Path) -> None:
    found = Chains(TRUTH).write(tmp_path).left_out(["b", "c"], "a", "per_specimen", "flexion")
    assert set(found["errors"]["test"]) == {"flexion"}


def test_pooled_specimens_and_a_newcomer(tmp_path: Path) -> None:
    """With readings this sure pooling changes nothing; a newcomer is the mean of logarithms."""
    project = Chains(TRUTH, noise_deg=1e-4).write(tmp_path)
    own = project.pool()
    for name, group in own["stiffness"].groupby("specimen"):
        assert_stiffness(group, TRUTH[str(name)], rtol=1e-3)
    assert set(own["stiffness"]["source"]) == {"own"}
    assert set(own["fits"]["specimen"]) == set(TRUTH)
    assert own["pooling"]["specimens"].tolist() == [3, 3, 3]
    newcomer = project.pool(without="c")
    assert_stiffness(newcomer["stiffness"], np.sqrt(0.8) * A, rtol=1e-2)
    assert set(newcomer["stiffness"]["source"]) == {"others_pooled"}
    assert set(newcomer["stiffness"]["specimen"]) == set(newcomer["errors"]["specimen"]) == {"c"}
    assert set(newcomer["errors"]["stage"]) == {"left_out_specimen"}
    assert newcomer["fits"].empty
    assert newcomer["pooling"]["specimens"].tolist() == [2, 2, 2]
    rows = newcomer["stiffness"]
    spread = newcomer["pooling"].set_index("coordinate")
    for name, group in rows.groupby("coordinate"):  # uncertain by at least what specimens differ
        log_sd = group["standard_error"] / group["stiffness"]
        assert (log_sd > spread.loc[name, "between_specimens"]).all()


def test_pooling_of_all_sees_every_reading_of_a_specimen(tmp_path: Path) -> None:
    fits = Chains(TRUTH, noise_deg=0.05).write(tmp_path).pool("flexion")["fits"]
    assert fits["readings"].tolist() == [4 * 3 * 3] * 3
    assert (fits["effective_unknowns"] <= 9).all()
