"""What a cohort study does with data that are not complete, not sound, or not enough."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from chain_cases import (
    DEGREES,
    JOINTS,
    MILLIMETRES,
    MOMENT_OF,
    ROTATIONS,
    STUDY,
    TOP,
    WRENCH,
    Chains,
    Tables,
    Written,
    by_joint,
)

from spinepipe.calibrate import pool as pooled
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.status import Status
from spinepipe.studies import read as studies
from spinepipe.studies.cohort_stiffness import findings, literature, mae, pool, ranking
from spinepipe.studies.cohort_stiffness import significance as statistics
from spinepipe.studies.cohort_stiffness.kind import KIND, CohortLayout
from spinepipe.studies.cohort_stiffness.predict import predicted
from spinepipe.studies.cohort_stiffness.problem import specimen_tests, start_stiffness
from spinepipe.studies.cohort_stiffness.settings import CohortStiffness
from spinepipe.studies.cohort_stiffness.significance import load_case_specific
from spinepipe.tables import read, read_frame, to_arrow
from spinepipe.tables import write as write_table
from spinepipe.units import COORDINATES
from tests.generators.phantom import SEED, phantom, write

A = np.array([[50.0, 60.0, 200.0], [55.0, 66.0, 220.0], [60.0, 70.0, 240.0]])
TRUTH = {"a": A, "b": 0.8 * A, "c": 1.5 * A}
TESTS = tuple(MOMENT_OF)


def no_nan(root: Path) -> None:
    """Empty cells of the files are nulls; no number is NaN or infinite.

    (Frames cannot tell: reading turns nulls into NaN.)
    """
    files = list(root.glob("*.parquet"))
    assert files
    for path in files:
        for column in read(path).columns:
            if pa.types.is_floating(column.type):
                known = column.drop_null().to_numpy()
                assert np.isfinite(known).all(), path.stem


def test_a_nan_in_a_file_does_not_pass(tmp_path: Path) -> None:
    pq.write_table(pa.table({"x": pa.array([1.0, None])}), tmp_path / "nulls.parquet")
    no_nan(tmp_path)
    pq.write_table(pa.table({"x": pa.array([1.0, np.nan])}), tmp_path / "nans.parquet")
    with pytest.raises(AssertionError, match="nans"):
        no_nan(tmp_path)


def dropped(chains: Chains, **where: object) -> Chains:
    """Without the rows of motion where all of these columns have these values."""
    rows = pd.Series(True, index=chains.motion.index)
    for column, value in where.items():
        rows &= chains.motion[column] == value
    chains.motion = chains.motion[~rows]
    return chains


# --- a specimen without one test ----------------------------------------------------------------


def without_a_test(root: Path) -> Written:
    return dropped(Chains(TRUTH, noise_deg=0.02), specimen="a", test="flexion").write(root)


def test_without_a_test_the_others_are_fitted(tmp_path: Path) -> None:
    project = without_a_test(tmp_path)
    found = project.fit("a", "per_joint", "all")
    assert found["fits"]["readings"].item() == 2 * 4 * 3 * 3
    assert set(found["errors"]["test"]) == set(TESTS[1:])
    identifiable = by_joint(found["stiffness"], "identifiable")
    assert not identifiable["extension"].any()
    assert identifiable[["right_bending", "left_rotation"]].all(axis=None)
    no_nan(project.root)


@pytest.mark.parametrize(
    ("fitted_to", "says"),
    [
        ("flexion", "a: no motion to fit for flexion"),
        ("all_but_flexion", "a: not measured in flexion: nothing would be held out"),
    ],
)
def test_without_a_test_its_fit_is_refused(fitted_to: str, says: str, tmp_path: Path) -> None:
    found = without_a_test(tmp_path).fit("a", "per_joint", fitted_to)
    for table in ("stiffness", "fits"):
        assert set(found[table]["status"]) == {"refused"}
        assert set(found[table]["message"]) == {says}
    assert len(found["stiffness"]) == 9
    assert found["stiffness"]["stiffness"].isna().all()
    assert found["errors"].empty


def test_without_a_test_medians_and_pools_say_who_is_in(tmp_path: Path) -> None:
    project = without_a_test(tmp_path)
    median = project.left_out(["a", "c"], "b", "per_joint", "flexion")["stiffness"]
    assert set(median["message"]) == {"median of 1 specimen; 1 of 2 have no stiffness"}
    np.testing.assert_allclose(by_joint(median)["extension"], 1.5 * A[:, 0], rtol=0.05)
    pooled = project.pool("flexion")
    own = pooled["stiffness"].set_index("specimen")
    assert own.loc["a", "stiffness"].isna().all()
    assert set(own.loc["a", "message"]) == {"a: no motion to fit for flexion"}
    assert own.loc[["b", "c"], "stiffness"].notna().all()
    assert pooled["fits"].set_index("specimen")["status"].tolist() == [
        "refused",
        *["converged"] * 2,
    ]
    assert set(pooled["errors"]["specimen"]) == {"b", "c"}
    assert set(pooled["pooling"]["specimens"]) == {2}


def test_left_out_of_a_test_it_never_had(tmp_path: Path) -> None:
    found = without_a_test(tmp_path).pool("flexion", without="a")
    assert found["errors"].empty
    assert found["stiffness"]["stiffness"].notna().all()
    assert set(found["stiffness"]["source"]) == {"others_pooled"}


# --- one level not measured, one cycle ----------------------------------------------------------


def test_a_level_without_readings_is_not_identifiable_and_harms_no_other(tmp_path: Path) -> None:
    chains = Chains(TRUTH, noise_deg=0.02)
    chains.motion.loc[chains.motion["joint"] == "L4L5", list(DEGREES)] = np.nan
    found = chains.write(tmp_path).fit("a", "per_joint")
    values = by_joint(found["stiffness"])
    np.testing.assert_allclose(values.loc[["L5S1", "L3L4"], list(ROTATIONS)], A[[0, 2]], rtol=0.1)
    identifiable = by_joint(found["stiffness"], "identifiable")
    assert identifiable.any(axis=1).tolist() == [True, False, True]
    assert by_joint(found["stiffness"], "standard_error").loc["L4L5"].isna().all()
    assert set(found["errors"]["joint"]) == {"L5S1", "L3L4"}
    signs = Written(tmp_path).literature("a")["sign_checks"]
    assert set(signs["joint"]) == {"L5S1", "L3L4"}


def test_a_level_without_readings_is_pooled_from_the_others(tmp_path: Path) -> None:
    chains = Chains(TRUTH, noise_deg=0.02)
    gone = (chains.motion["joint"] == "L4L5") & (chains.motion["specimen"] == "a")
    chains.motion.loc[gone, list(DEGREES)] = np.nan
    found = chains.write(tmp_path).pool()["stiffness"]
    own = found[found["specimen"] == "a"]
    error = by_joint(own, "standard_error") / by_joint(own)
    assert (error.loc["L4L5"] > 1.5 * error.loc[["L5S1", "L3L4"]].max()).all()
    np.testing.assert_allclose(by_joint(own).loc["L4L5", "extension"], A[1, 0], rtol=0.2)


def test_what_only_the_cohort_tells_is_not_identifiable(tmp_path: Path) -> None:
    """Its standard error is small enough; but it is that of anybody's joint."""
    found = without_a_test(tmp_path).pool()["stiffness"]
    assert (found["standard_error"] < found["stiffness"]).all()
    unread = (found["specimen"] == "a") & (found["coordinate"] == "extension")
    assert (~found["identifiable"].astype(bool)).tolist() == unread.tolist()
    assert found["message"].str.contains("readings do not decide").tolist() == unread.tolist()


@pytest.mark.parametrize("cycles", ["after_first", "quietest", "all"])
def test_one_cycle_is_used_whatever_is_asked(cycles: str, tmp_path: Path) -> None:
    project = Chains(TRUTH, study=f"cycles: {cycles}\n").write(tmp_path)
    found = project.fit("a", "per_joint")["stiffness"]
    np.testing.assert_allclose(by_joint(found)[list(ROTATIONS)], A, rtol=1e-6)


def test_one_specimen_with_one_cycle_beside_others_with_three(tmp_path: Path) -> None:
    chains = Chains(TRUTH, cycles=3)
    chains = dropped(dropped(chains, specimen="a", cycle=2), specimen="a", cycle=3)
    settings, cohort = study_of_kind(CohortStiffness, str(chains.write(tmp_path).root), STUDY)
    used = {
        name: {one.case.cycle for one in specimen_tests(settings, cohort, name).tested}
        for name in cohort.specimen_names
    }
    assert used == {"a": {1}, "b": {2, 3}, "c": {2, 3}}


# --- signs --------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def phantom_project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The phantom with one sign flipped: s03, left lateral bending, L2L3."""
    root = tmp_path_factory.mktemp("phantom")
    (root / "config" / "studies").mkdir(parents=True)
    head = f"study: {STUDY}\nkind: cohort_stiffness\ncohort: flipped\n"
    (root / "config" / "studies" / f"{STUDY}.yaml").write_text(head)
    folder = root / "config" / "cohorts" / "flipped"
    write(phantom(SEED), folder)
    motion = pd.read_csv(folder / "motion.csv")
    here = (
        (motion["specimen"] == "s03")
        & (motion["test"] == "left_lateral_bending")
        & (motion["joint"] == "L2L3")
    )
    motion.loc[here, "right_bending_deg"] *= -1.0
    gone = (motion["specimen"] == "s01") & (motion["joint"] == "L3L4")
    motion.loc[gone, motion.columns[5:]] = np.nan
    motion.to_csv(folder / "motion.csv", index=False)
    return root


def test_a_flipped_sign_is_found_where_it_is_and_nowhere_else(
    phantom_project: Path, tmp_path: Path
) -> None:
    _, cohort = study_of_kind(CohortStiffness, str(phantom_project), STUDY)
    rows = []
    for specimen in cohort.specimen_names:
        files = {name: str(tmp_path / name) for name in ("stiffness", "errors", "sign_checks")}
        literature.run(str(phantom_project), STUDY, specimen, **files)
        rows.append(read_frame(files["sign_checks"]).assign(specimen=specimen))
    found = pd.concat(rows)
    assert len(found) == 6 * 3 * 6 - 3  # L3L4 of s01 was not measured
    flipped = found[found["verdict"] != "as_expected"]
    keys = ["specimen", "test", "joint", "coordinate", "verdict"]
    assert flipped[keys].to_numpy().tolist() == [
        ["s03", "left_lateral_bending", "L2L3", "right_bending", "flipped"]
    ]
    assert "the sign of this coordinate is most likely flipped in motion.csv" in (
        flipped["message"].item()
    )
    assert flipped["measured_over_expected"].item() < -0.5
    assert set(found.loc[found["verdict"] == "as_expected", "message"]) == {""}


def test_a_level_without_readings_in_a_curved_spine(phantom_project: Path) -> None:
    """Its stiffness shows in the others' motion, but hardly: no number runs over."""
    found = Written(phantom_project).fit("s01", "per_joint")
    identifiable = found["stiffness"].groupby("joint")["identifiable"].all()
    assert not identifiable["L3L4"]
    assert identifiable.drop("L3L4").all()
    no_nan(phantom_project)


def test_a_flipped_sign_drives_a_joint_to_its_bound(phantom_project: Path) -> None:
    found = Written(phantom_project).fit("s03", "per_joint")["stiffness"]
    bound = found[found["at_bound"] != "no"]
    assert ["L2L3", "right_bending", "upper"] in (
        bound[["joint", "coordinate", "at_bound"]].to_numpy().tolist()
    )


def test_a_joint_that_does_not_move_is_undecided_though_zeroing_shifts_it(tmp_path: Path) -> None:
    """All readings of a cycle share the error of step 0, which looks like motion of one sign."""
    verdicts = []
    for seed in range(20):
        chains = Chains({"a": A}, ["flexion"], cycles=2, steps=11)
        noise = np.random.default_rng(seed).normal(0.0, 0.1, (2, 11, len(JOINTS)))
        read = noise - noise[:, :1]
        chains.motion["extension_deg"] = read.reshape(-1)
        chains.zeroed = True
        root = tmp_path / str(seed)
        verdicts += chains.write(root).literature("a")["sign_checks"]["verdict"].tolist()
    assert verdicts.count("undecided") >= 0.97 * len(verdicts)


def test_one_reading_tells_no_sign(tmp_path: Path) -> None:
    chains = Chains({"a": A}, ["flexion"], steps=2, zeroed=True)
    found = chains.write(tmp_path).literature("a")["sign_checks"]
    assert set(found["verdict"]) == {"undecided"}
    assert set(found["message"]) == {"one reading does not tell how sure it is"}
    assert found["standard_error"].isna().all()


def flexion_of_l5s1(residual: float, root: Path) -> pd.Series:
    """Measured extension -1 times the expected (0, 1, 2), plus (0, 2, -1) times ``residual``."""
    chains = Chains({"a": A}, ["flexion"], steps=3)
    expected = -np.rad2deg(np.arange(3) / 51.0)
    measured = -expected + residual * np.rad2deg(np.array([0.0, 2.0, -1.0]) / 51.0)
    chains.motion.loc[chains.motion["joint"] == "L5S1", "extension_deg"] = measured
    return chains.write(root).literature("a")["sign_checks"].set_index("joint").loc["L5S1"]


@pytest.mark.parametrize(("errors", "verdict"), [(5.0, "undecided"), (25.0, "flipped")])
def test_few_readings_need_more_than_three_standard_errors(
    errors: float, verdict: str, tmp_path: Path
) -> None:
    """Of two degrees of freedom, 0.135 % lie beyond 19.2 (tables of Student's t)."""
    row = flexion_of_l5s1(np.sqrt(2.0) / errors, tmp_path)
    assert row["measured_over_expected"] / row["standard_error"] == pytest.approx(-errors, rel=1e-3)
    assert row["verdict"] == verdict


def flipped(chains: Chains, **where: object) -> Chains:
    """Extension with the other sign where all of these columns have these values."""
    here = pd.Series(True, index=chains.motion.index)
    for column, value in where.items():
        here &= chains.motion[column] == value
    chains.motion.loc[here, "extension_deg"] *= -1.0
    return chains


def test_a_sign_flipped_in_one_cycle_is_not_averaged_away(tmp_path: Path) -> None:
    chains = Chains({"a": A}, ["flexion"], cycles=3, noise_deg=0.01)
    chains = flipped(chains, cycle=3, joint="L4L5")
    rows = chains.write(tmp_path).literature("a")["sign_checks"].set_index("joint")
    assert rows.loc["L4L5", "measured_over_expected"] == pytest.approx(0.0, abs=0.05)
    assert rows["verdict"].to_dict() == {
        "L5S1": "as_expected",
        "L4L5": "flipped",
        "L3L4": "as_expected",
    }
    assert "moves against the load in cycle 3: " in rows.loc["L4L5", "message"]


def test_a_whole_test_that_is_flipped_may_be_its_moment(tmp_path: Path) -> None:
    chains = flipped(Chains({"a": A}, noise_deg=0.01), test="flexion")
    rows = chains.write(tmp_path).literature("a")["sign_checks"]
    against = rows["verdict"] == "flipped"
    assert set(rows.loc[against, "test"]) == {"flexion"}
    assert against.sum() == 3
    assert rows.loc[against, "message"].str.contains("in all readings together").all()
    assert rows["message"].str.contains("loads.csv").tolist() == against.tolist()
    one = flipped(Chains({"a": A}, noise_deg=0.01), test="flexion", joint="L4L5")
    alone = one.write(tmp_path / "one").literature("a")["sign_checks"]
    assert (alone["verdict"] == "flipped").sum() == 1
    assert not alone["message"].str.contains("loads.csv").any()


# --- small cohorts ------------------------------------------------------------------------------


def layout_of(project: Written) -> CohortLayout:
    return CohortLayout.of(*study_of_kind(CohortStiffness, str(project.root), STUDY))


def test_one_specimen_alone(tmp_path: Path) -> None:
    project = Chains({"a": A}, noise_deg=0.02).write(tmp_path)
    files = [
        file
        for t in layout_of(project).made_of_jobs
        for file in layout_of(project).absent(t, False)
    ]
    assert not [file for file in files if "left_out" in file or "without=a" in file]
    pooled = project.pool()
    np.testing.assert_allclose(by_joint(pooled["stiffness"])[list(ROTATIONS)], A, rtol=0.15)
    assert pooled["pooling"][["between_levels", "between_specimens"]].isna().all(axis=None)
    assert pooled["pooling"]["between_joints"].notna().all()


@pytest.mark.parametrize(
    ("tests", "sets"),
    [
        (TESTS[:1], ("flexion",)),
        (TESTS[:2], (*TESTS[:2], "all")),
        (TESTS, (*TESTS, "all", *(f"all_but_{test}" for test in TESTS))),
    ],
)
def test_what_is_fitted_hangs_on_the_number_of_tests(
    tests: tuple[str, ...], sets: tuple[str, ...], tmp_path: Path
) -> None:
    """Of two tests, all but one is the other, which is fitted anyway."""
    project = Chains(TRUTH, tests).write(tmp_path)
    assert layout_of(project).load_sets == sets


def test_no_load_case_is_left_out_when_not_asked(tmp_path: Path) -> None:
    project = Chains(TRUTH, study="cross_validation: {load_cases: false}\n").write(tmp_path)
    assert layout_of(project).load_sets == (*TESTS, "all")


@pytest.mark.parametrize("representations", ["[partially_pooled]", "[per_joint]"])
def test_every_block_is_made_of_files(representations: str, tmp_path: Path) -> None:
    """A block of no files is none: nothing could be joined."""
    layout = layout_of(Chains(TRUTH, study=f"representations: {representations}\n").write(tmp_path))
    for table in layout.made_of_jobs:
        assert layout.blocks(table)
        for specimen, block in layout.blocks(table):
            assert layout.job_files(table, specimen, block)


def test_tests_without_any_reading_are_none(tmp_path: Path) -> None:
    chains = Chains(TRUTH)
    chains.motion.loc[chains.motion["test"] == "flexion", list(DEGREES)] = np.nan
    assert layout_of(chains.write(tmp_path)).tests == TESTS[1:]


ODD = "flexion, 7.5 N·m (left) #2 50 %"


def test_a_test_may_have_an_odd_name(tmp_path: Path) -> None:
    chains = Chains(TRUTH, TESTS[:2])
    for table in (chains.loads, chains.motion):
        table["test"] = table["test"].replace("flexion", ODD)
    project = chains.write(tmp_path)
    assert layout_of(project).tests == (ODD, TESTS[1])
    assert set(project.fit("a", "per_joint", ODD)["stiffness"]["status"]) == {"converged"}


# --- a specimen that falls over -----------------------------------------------------------------


def falling(root: Path, study: str = "bound_factor: 2\n") -> Written:
    """Specimen b is pressed by a force that no stiffness within the bounds carries."""
    chains = Chains(TRUTH, study=study, noise_deg=0.02)
    here = (chains.loads["specimen"] == "b") & (chains.loads["step"] > 0)
    chains.loads["fy_n"] = np.where(here, -19e3, 0.0)
    for column, value in (("px_mm", 1.0), ("py_mm", 100.0), ("pz_mm", 0.0)):
        chains.loads[column] = value
    return chains.write(root)


def test_a_fit_that_falls_says_so(tmp_path: Path) -> None:
    found = falling(tmp_path).fit("b", "per_joint")
    assert set(found["stiffness"]["status"]) == {"unstable"}
    assert found["stiffness"]["stiffness"].isna().all()
    assert not found["stiffness"]["identifiable"].any()
    record = found["fits"].iloc[0]
    assert "the loads tip the segment over" in record["message"]
    assert record["readings"] == 108
    assert np.isnan(record["cost"])
    assert np.isnan(record["aicc"])
    assert found["errors"].empty


def test_who_falls_harms_no_other(tmp_path: Path) -> None:
    project = falling(tmp_path)
    for table in project.literature("b").values():
        assert len(table)
    errors = project.literature("b")["errors"]
    assert errors["rmse"].isna().all()
    assert set(errors["status"]) <= {"unstable", "not_converged"}
    assert errors["measured"].notna().all()
    signs = project.literature("b")["sign_checks"]
    assert set(signs["verdict"]) == {"undecided"}
    assert set(project.fit("a", "per_joint")["stiffness"]["status"]) == {"converged"}
    median = project.left_out(["b", "c"], "a", "per_joint")["stiffness"]
    assert set(median["message"]) == {"median of 1 specimen; 1 of 2 have no stiffness"}


def test_who_falls_is_told_apart_in_the_pool(tmp_path: Path) -> None:
    pooled = falling(tmp_path).pool()
    own = pooled["stiffness"].set_index("specimen")
    assert own.loc["b", "stiffness"].isna().all()
    assert set(own.loc["b", "status"]) == {"unstable"}
    fits = pooled["fits"].set_index("specimen")
    assert fits["status"].to_dict() == {"a": "converged", "b": "unstable", "c": "converged"}
    assert np.isnan(fits.loc["b", "cost"])
    assert set(pooled["errors"]["specimen"]) == {"a", "c"}
    assert set(pooled["pooling"]["message"]) == {"1 of 3 specimens without a usable fit"}
    assert set(pooled["pooling"]["specimens"]) == {2}
    np.testing.assert_allclose(
        by_joint(pooled["stiffness"][lambda t: t["specimen"] == "a"]), A[:, [0, 2, 1]], rtol=0.15
    )


def test_a_newcomer_hears_of_who_fell(tmp_path: Path) -> None:
    rows = falling(tmp_path).pool(without="a")["stiffness"]
    (message,) = set(rows["message"])
    assert message == "what the others lead one to expect; 1 of 2 specimens without a usable fit"
    assert rows["stiffness"].notna().all()


def test_nobody_stands(tmp_path: Path) -> None:
    project = falling(tmp_path)
    alone = project.left_out(["b"], "a", "per_joint")
    assert set(alone["stiffness"]["message"]) == {"no other specimen has a stiffness"}
    assert alone["stiffness"]["stiffness"].isna().all()
    assert alone["errors"].empty


def test_a_pool_of_nobody(tmp_path: Path) -> None:
    """All that is left when a is left out of the two is b, which falls."""
    chains = Chains({"a": A, "b": A}, study="bound_factor: 2\n")
    here = (chains.loads["specimen"] == "b") & (chains.loads["step"] > 0)
    chains.loads["fy_n"] = np.where(here, -19e3, 0.0)
    for column, value in (("px_mm", 1.0), ("py_mm", 100.0), ("pz_mm", 0.0)):
        chains.loads[column] = value
    found = chains.write(tmp_path).pool(without="a")
    assert found["stiffness"]["stiffness"].isna().all()
    assert set(found["stiffness"]["status"]) == {"unstable"}
    assert found["errors"].empty
    no_nan(tmp_path)


# --- translations -------------------------------------------------------------------------------

ALL_FREE = f"free: [{', '.join(COORDINATES)}]\n"


def pulled(root: Path, pulls: dict[str, tuple[float, float, float]]) -> Written:
    """Chain a with tests that pull at its top beside the moments; motion as the library predicts.

    A round trip: which unknowns can be told from which tests is asked here, not the mechanics.
    """
    chains = Chains({"a": A}, study=ALL_FREE)
    for name, force in pulls.items():
        step = np.arange(chains.steps)
        key = {"specimen": "a", "test": name, "cycle": 1, "step": step, "vertebra": TOP}
        loads = pd.DataFrame({**key, **dict.fromkeys(WRENCH, 0.0)})
        loads[["fx_n", "fy_n", "fz_n"]] = step[:, None] * np.array(force)
        chains.loads = pd.concat([chains.loads, loads], ignore_index=True)
        rows = [{**key, "step": s, "joint": joint} for s in step for joint in JOINTS]
        chains.motion = pd.concat([chains.motion, pd.DataFrame(rows)], ignore_index=True)
    for column, value in (("px_mm", 0.0), ("py_mm", 90.0), ("pz_mm", 0.0)):
        chains.loads[column] = value
    for column in (*DEGREES, *MILLIMETRES):
        chains.motion[column] = 0.0  # readings to be replaced
    chains.motion = chains.motion.drop(columns="vertebra", errors="ignore")
    project = chains.write(root)
    settings, cohort = study_of_kind(CohortStiffness, str(root), STUDY)
    tests = specimen_tests(settings, cohort, "a")
    k = start_stiffness(settings, cohort, "literature")
    k[:, :3] *= 0.5
    k[:, 3:] = A
    rng = np.random.default_rng(3)
    motions = predicted(cohort, "a", tests.frames, tests.tested, k)
    rows = []
    for one, (motion, _, _) in zip(tests.tested, motions, strict=True):
        assert motion is not None
        read = motion * ([1000.0] * 3 + [180 / np.pi] * 3)
        read += rng.normal(0.0, 1e-5, read.shape)
        for step, joint in np.ndindex(read.shape[:2]):
            cells = dict(zip((*MILLIMETRES, *DEGREES), read[step, joint], strict=True))
            key = {"specimen": "a", "test": one.case.test, "cycle": 1, "step": step}
            rows.append({**key, "joint": JOINTS[joint], **cells})
    chains.motion = pd.DataFrame(rows)
    replace_motion(root, chains.motion)
    return project


def replace_motion(root: Path, motion: pd.DataFrame) -> None:
    motion.to_csv(root / "config" / "cohorts" / "chains" / "motion.csv", index=False)


def test_all_six_coordinates_are_found_where_forces_show_them(tmp_path: Path) -> None:
    pulls = {"up": (0.0, 50.0, 0.0), "forward": (20.0, 50.0, 0.0), "right": (0.0, 50.0, 20.0)}
    found = pulled(tmp_path, pulls).fit("a", "per_joint")
    assert found["fits"]["unknowns"].item() == 18
    assert found["stiffness"]["identifiable"].all()
    values = by_joint(found["stiffness"])
    np.testing.assert_allclose(values[list(ROTATIONS)], A, rtol=1e-2)
    np.testing.assert_allclose(values["superior"], 0.5 * 1_890_000, rtol=1e-2)
    np.testing.assert_allclose(values["anterior"], 0.5 * 149_000, rtol=1e-2)
    np.testing.assert_allclose(values["right"], 0.5 * 135_000, rtol=1e-2)
    assert set(found["stiffness"].query("coordinate == 'right'")["unit"]) == {"N/m"}


def test_translations_that_no_force_drives_are_not_identifiable(tmp_path: Path) -> None:
    """A pull upwards along the chain moves its joints apart, and nothing else."""
    found = pulled(tmp_path, {"up": (0.0, 50.0, 0.0)}).fit("a", "per_joint")
    known = by_joint(found["stiffness"], "identifiable")
    assert known[[*ROTATIONS, "superior"]].all(axis=None)
    assert not known[["anterior", "right"]].any(axis=None)
    no_nan(tmp_path)


def test_pure_moments_tell_nothing_of_translations(tmp_path: Path) -> None:
    found = pulled(tmp_path, {}).fit("a", "per_joint")
    known = by_joint(found["stiffness"], "identifiable")
    assert known[list(ROTATIONS)].all(axis=None)
    assert not known[["anterior", "superior", "right"]].any(axis=None)
    error = by_joint(found["stiffness"], "standard_error")
    assert error[["anterior", "superior", "right"]].isna().all(axis=None)


# --- the rest -----------------------------------------------------------------------------------


def test_a_cohort_without_measurement_sd_is_fitted_at_the_published_cost(tmp_path: Path) -> None:
    project = Chains(TRUTH, sd=False, study="cost: published\n").write(tmp_path)
    found = project.fit("a", "per_joint")["stiffness"]
    np.testing.assert_allclose(by_joint(found)[list(ROTATIONS)], A, rtol=1e-6)


SHARED = "readings zeroed at step 0 share its error"
PUBLISHED = "cost: published\n"
LIKELIHOOD = ["log_likelihood", "aicc", "bic"]


def test_correlated_readings_at_the_published_cost_have_no_likelihood(tmp_path: Path) -> None:
    project = Chains(TRUTH, noise_deg=0.02, zeroed=True, study=PUBLISHED).write(tmp_path)
    labels = (*TESTS, "all")
    by = {"specimen": "a", "representation": "per_specimen"}
    fits = pd.concat(
        project.fit("a", "per_specimen", label)["fits"].assign(fitted_to=label, **by)
        for label in labels
    )
    pooled = project.pool()
    for rows in (fits, pooled["fits"]):
        assert rows[LIKELIHOOD].isna().all(axis=None)
        assert rows["scatter"].notna().all()
        assert rows["message"].str.contains(SHARED).all()
    assert pooled["pooling"]["log_likelihood"].isna().all()
    assert pooled["pooling"]["message"].str.contains(SHARED).all()
    (tested,) = load_case_specific(fits)
    assert tested.outcome.p is None
    assert SHARED in tested.outcome.message
    no_nan(tmp_path)


@pytest.mark.parametrize(
    ("zeroed", "study"), [(False, PUBLISHED), (True, f"{PUBLISHED}steps: peak\n"), (True, "")]
)
def test_independent_readings_have_a_likelihood(zeroed: bool, study: str, tmp_path: Path) -> None:
    """Not zeroed, one reading of each cycle, or a cost that allows for what they share."""
    project = Chains(TRUTH, noise_deg=0.02, zeroed=zeroed, study=study).write(tmp_path)
    found = project.fit("a", "per_specimen")["fits"]
    assert found[LIKELIHOOD].notna().all(axis=None)
    assert found["message"].item() == ""


def test_readings_under_no_load_are_fitted_to_nothing(tmp_path: Path) -> None:
    chains = Chains(TRUTH, ["flexion"])
    chains.loads["mz_nm"] = 0.0
    project = chains.write(tmp_path)
    found = project.fit("a", "per_joint", "flexion")
    assert not found["stiffness"]["identifiable"].any()
    assert project.literature("a")["sign_checks"].empty
    no_nan(tmp_path)


def test_every_table_is_made_of_a_small_study(tmp_path: Path) -> None:
    project = Chains(TRUTH, noise_deg=0.02).write(tmp_path)
    study, _ = studies.check(tmp_path, STUDY)
    assert isinstance(study, CohortStiffness)
    project.literature("a")
    no_nan(tmp_path)
    project.fit("a", "per_specimen")
    no_nan(tmp_path)
    project.pool()
    no_nan(tmp_path)


# --- all jobs one after the other ---------------------------------------------------------------


def analysed(project: Written) -> Tables:
    """All tables of the study: job files made, joined and analysed, each by its job."""
    settings, cohort = study_of_kind(CohortStiffness, str(project.root), STUDY)
    layout = CohortLayout.of(settings, cohort)
    parts = made_of_jobs(project, settings.representations, layout.load_sets)
    for name, frames in parts.items():
        shape = KIND.table(name)
        columns = {c.name: list(pd.concat(frames)[c.name]) for c in shape.columns}
        write_table(to_arrow(shape, columns), project.root / f"{name}.parquet", {})
    for name in ("mae", "ranking", "statistics", "findings"):
        files = [
            str(project.root / f"{one}.parquet")
            for one in KIND.job(name).reads
            if one in layout.tables
        ]
        output = str(project.root / f"{name}.parquet")
        JOBS[name](str(project.root), STUDY, files, output)
        parts[name] = [read_frame(output)]
    no_nan(project.root)
    return {name: pd.concat(frames, ignore_index=True) for name, frames in parts.items()}


JOBS = {
    "mae": mae.run,
    "ranking": ranking.run,
    "statistics": statistics.run,
    "findings": findings.run,
}


def made_of_jobs(
    project: Written, representations: Sequence[str], labels: Sequence[str]
) -> dict[str, list[pd.DataFrame]]:
    """Tables of literature and own fits, with the columns that folders carry."""
    parts: dict[str, list[pd.DataFrame]] = {"stiffness": [], "errors": [], "fits": []}

    def keep(tables: Tables, **carried: str) -> None:
        for name, frame in tables.items():
            if name in parts and len(frame):
                parts[name].append(frame.assign(**carried))

    for specimen in TRUTH:
        keep(project.literature(specimen), specimen=specimen)
        for name, label in product(representations, labels):
            carried = {"specimen": specimen, "representation": name, "fitted_to": label}
            keep(project.fit(specimen, name, label), **carried)
    return parts


def test_the_settings_of_the_paper_leave_too_few_readings_for_each_joint(tmp_path: Path) -> None:
    """One step, rotations only: 6, 6 and 9 readings, 9 unknowns each: -6 degrees of freedom."""
    settings = "steps: peak\ncost: published\nrepresentations: [per_joint]\nstarts: 1\n"
    found = analysed(Chains(TRUTH, noise_deg=0.02, study=settings).write(tmp_path))
    tests = found["statistics"]
    nested = tests[tests["family"] == "load_case_specific/per_joint"]
    assert len(nested) == len(TRUTH)
    assert set(nested["status"]) == {"too_few"}
    assert set(nested["n"]) == {0}
    assert nested["message"].str.startswith("-6 degrees of freedom").all()
    claim = found["findings"].set_index("finding").loc["stiffness_is_load_case_specific"]
    assert claim["holds"] == "undecided"
    assert "-6 degrees of freedom" in claim["message"]


def with_a_pull(chains: Chains, instead_of: str, translations: bool) -> Chains:
    """One test pulls upwards and has no moment; read in a translation only, or in rotations."""
    here = chains.loads["test"] == instead_of
    chains.loads.loc[here, list(WRENCH)] = 0.0
    chains.loads.loc[here, "fy_n"] = 10.0 * chains.loads.loc[here, "step"]
    for column, value in (("px_mm", 0.0), ("py_mm", 90.0), ("pz_mm", 0.0)):
        chains.loads[column] = value
    for column in MILLIMETRES:
        chains.motion[column] = np.nan
    here = chains.motion["test"] == instead_of
    chains.motion.loc[here, list(DEGREES)] = np.nan if translations else 0.01
    if translations:
        chains.motion.loc[here, "superior_mm"] = 0.01 * chains.motion.loc[here, "step"]
    return chains


PULLED = "free: [extension, right_bending, superior]\nrepresentations: [per_specimen]\nstarts: 1\n"


@pytest.mark.parametrize("translations", [True, False])
@pytest.mark.parametrize("tests", [TESTS, (TESTS[0], TESTS[2])])
def test_a_test_that_only_pulls(tests: tuple[str, ...], translations: bool, tmp_path: Path) -> None:
    """It has no loaded coordinate, and errors of rotations only where these were read."""
    chains = Chains(TRUTH, tests, noise_deg=0.02, study=PULLED)
    found = analysed(with_a_pull(chains, TESTS[2], translations).write(tmp_path))
    turned = set(tests[:-1])
    assert set(found["mae"]["test"]) == turned
    tested = found["statistics"]
    family = tested["family"] == "between_levels/per_specimen/left_out_case"
    of = family & (tested["response"] == "rotation_error")
    assert set(tested.loc[of, "stratum"]) == (turned if translations else set(tests))
    order = found["ranking"]
    held_out = order[(order["criterion"] == "left_out_case") & (order["source"] == "own")]
    assert held_out["rank"].notna().all()
    assert set(held_out["specimens"]) == {len(TRUTH)}


# --- pools that do not end, and bounds ----------------------------------------------------------


def test_a_pool_that_does_not_settle_tells_nobody_a_stiffness(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each specimen is at rest, the spreads are not: so each stiffness would go on."""
    unsettled = {"status": Status.NOT_CONVERGED, "message": "the spreads do not settle"}
    monkeypatch.setattr(pool, "pool", lambda problems: replace(pooled(problems), **unsettled))
    project = Chains(TRUTH, noise_deg=0.02).write(tmp_path)
    for without in ("nobody", "a"):
        found = project.pool(without=without)
        rows = found["stiffness"]
        assert set(rows["status"]) == {"not_converged"}
        assert rows["message"].str.contains("the spreads do not settle").all()
        assert rows["stiffness"].isna().all()
        assert not rows["identifiable"].eq(True).any()
        assert found["errors"].empty
        assert found["fits"][["cost", "aicc", "bic", "effective_unknowns"]].isna().all(axis=None)
        assert set(found["pooling"]["status"]) == {"not_converged"}
        no_nan(tmp_path)


def test_a_pooled_stiffness_at_a_bound_is_not_known(tmp_path: Path) -> None:
    """Bounds of 2 around the published values: 1.5 x 240 N m/rad lies inside, 20 does not."""
    stiff = A.copy()
    stiff[:, 0] = 20.0
    truth = {"a": stiff, "b": 0.9 * stiff, "c": 0.8 * stiff}
    project = Chains(truth, study="bound_factor: 2\n", noise_deg=0.02).write(tmp_path)
    rows = project.pool()["stiffness"]
    at = rows["at_bound"] != "no"
    assert set(rows.loc[at, "coordinate"]) == {"extension"}
    assert at.sum() == 9
    assert not rows.loc[at, "identifiable"].any()
    assert rows.loc[at, ["standard_error", "low", "high"]].isna().all(axis=None)
    assert rows.loc[~at, "identifiable"].all()


def test_what_is_expected_of_a_newcomer_was_not_fitted(tmp_path: Path) -> None:
    """Two others leave one degree of freedom: Student's t is 12.706 at 97.5 % (tables)."""
    rows = Chains(TRUTH, noise_deg=0.02).write(tmp_path).pool(without="a")["stiffness"]
    assert rows["identifiable"].isna().all()
    assert rows["standard_error"].notna().all()
    reach = np.log(rows["high"] / rows["stiffness"]) / (rows["standard_error"] / rows["stiffness"])
    np.testing.assert_allclose(reach, 12.706, rtol=1e-4)


def test_one_other_specimen_gives_a_newcomer_no_interval(tmp_path: Path) -> None:
    project = Chains({"a": A, "b": 0.8 * A}, noise_deg=0.02).write(tmp_path)
    rows = project.pool(without="a")["stiffness"]
    assert rows["stiffness"].notna().all()
    assert rows[["low", "high"]].isna().all(axis=None)


def test_cycles_that_differ_in_their_main_moment(tmp_path: Path) -> None:
    """Two of three cycles bend sideways: that is what the test loads, and what signs are of."""
    chains = Chains({"a": A}, ["flexion"], cycles=3, study="cycles: all\n")
    chains.loads.loc[chains.loads["cycle"] > 1, ["mx_nm", "mz_nm"]] = chains.loads.loc[
        chains.loads["cycle"] > 1, ["mz_nm", "mx_nm"]
    ].to_numpy()
    chains.motion.loc[chains.motion["cycle"] > 1, ["right_bending_deg", "extension_deg"]] = (
        chains.motion.loc[chains.motion["cycle"] > 1, ["extension_deg", "right_bending_deg"]]
    ).to_numpy()
    found = chains.write(tmp_path).literature("a")
    assert set(found["errors"].loc[found["errors"]["loaded"], "coordinate"]) == {"right_bending"}
    signs = found["sign_checks"]
    assert set(signs["coordinate"]) == {"right_bending"}
    assert set(signs["readings"]) == {2 * 4}
    assert set(signs["verdict"]) == {"as_expected"}
