"""What a cohort study does with data that are not complete, not sound, or not enough.

Seen here: a specimen that is refused for another, a NaN in a file, a stiffness told that nothing
tells of, a message without who and why.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from chain_cases import DEGREES, ROTATIONS, STUDY, Chains, Written, by_joint
from cohort_edge_cases import TESTS, TRUTH, A, layout_of

from spinepipe.jobs.inputs import study_of_kind
from spinepipe.studies.cohort_stiffness.problem import specimen_tests
from spinepipe.studies.cohort_stiffness.settings import CohortStiffness


def dropped(chains: Chains, **where: object) -> Chains:
    """Without the rows of motion where all of these columns have these values."""
    chains.motion = chains.motion[~chains.where(**where)]
    return chains


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
    driven = median[median["coordinate"] == "extension"]
    assert set(driven["message"]) == {"median of 1 specimen; 1 of 2 have no stiffness"}
    np.testing.assert_allclose(by_joint(median)["extension"], 1.5 * A[:, 0], rtol=0.05)
    pooled = project.pool("flexion")
    own = pooled["stiffness"].set_index("specimen")
    assert own.loc["a", "stiffness"].isna().all()
    assert set(own.loc["a", "message"]) == {"a: no motion to fit for flexion"}
    others = own.loc[["b", "c"]]
    assert (others["stiffness"].notna() == (others["coordinate"] == "extension")).all()
    assert pooled["fits"].set_index("specimen")["status"].tolist() == [
        "refused",
        *["converged"] * 2,
    ]
    assert set(pooled["errors"]["specimen"]) == {"b", "c"}
    assert set(pooled["pooling"]["specimens"]) == {2}


def test_left_out_of_a_test_it_never_had(tmp_path: Path) -> None:
    found = without_a_test(tmp_path).pool("flexion", without="a")
    assert found["errors"].empty
    told = found["stiffness"]["stiffness"].notna()
    assert (told == (found["stiffness"]["coordinate"] == "extension")).all()
    assert set(found["stiffness"]["source"]) == {"others_pooled"}


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


def test_one_specimen_alone(tmp_path: Path) -> None:
    project = Chains({"a": A}, noise_deg=0.02).write(tmp_path)
    layout = layout_of(project)
    files = [
        file
        for table in layout.made_of_jobs
        for block in layout.blocks(table)
        for file in layout.job_files(table, *block)
    ]
    assert not [file for file in files if "left_out" in file or "without-a" in file]
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
    rows = project.fit("a", "per_joint", ODD)["stiffness"].set_index("coordinate")
    assert set(rows.loc["extension", "status"]) == {"converged"}


def falling(root: Path, truth: Mapping[str, np.ndarray] = TRUTH, noise: float = 0.02) -> Written:
    """Specimen b is pressed by a force that no stiffness within the bounds carries."""
    chains = Chains(truth, study="bound_factor: 2\n", noise_deg=noise)
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
    found = falling(tmp_path, {"a": A, "b": A}, noise=0.0).pool(without="a")
    assert found["stiffness"]["stiffness"].isna().all()
    assert set(found["stiffness"]["status"]) == {"unstable"}
    assert found["errors"].empty
