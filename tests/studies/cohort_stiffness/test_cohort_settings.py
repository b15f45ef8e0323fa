"""Which coordinates are fitted at which cost, and whole studies of few data.

Seen here: a stiffness told that no reading tells of, a likelihood of readings that share an error,
a pool that has not settled taken for one that has, tests whose main load is not what they drive.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from chain_cases import (
    DEGREES,
    JOINTS,
    MILLIMETRES,
    ROTATIONS,
    STUDY,
    TOP,
    WRENCH,
    Chains,
    Tables,
    Written,
    by_joint,
)
from cohort_edge_cases import TESTS, TRUTH, A, joined_jobs

from spinepipe.calibration import pool as pooled
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.status import Status
from spinepipe.studies.cohort_stiffness import findings, mae, pool, ranking
from spinepipe.studies.cohort_stiffness import significance as statistics
from spinepipe.studies.cohort_stiffness.kind import KIND, CohortLayout
from spinepipe.studies.cohort_stiffness.predict import predict_motion
from spinepipe.studies.cohort_stiffness.problem import specimen_tests, start_stiffness
from spinepipe.studies.cohort_stiffness.settings import CohortStiffness
from spinepipe.studies.cohort_stiffness.significance import load_case_specific
from spinepipe.tables import read_frame, to_arrow
from spinepipe.tables import write as write_table
from spinepipe.units import COORDINATES

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
    motions = predict_motion(cohort, "a", tests.frames, tests.tested, k)
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


def test_pure_moments_tell_nothing_of_translations(tmp_path: Path) -> None:
    found = pulled(tmp_path, {}).fit("a", "per_joint")
    known = by_joint(found["stiffness"], "identifiable")
    assert known[list(ROTATIONS)].all(axis=None)
    assert not known[["anterior", "superior", "right"]].any(axis=None)
    error = by_joint(found["stiffness"], "standard_error")
    assert error[["anterior", "superior", "right"]].isna().all(axis=None)


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


def analysed(project: Written) -> Tables:
    """All tables of the study: job files made, joined and analysed, each by its job."""
    settings, cohort = study_of_kind(CohortStiffness, str(project.root), STUDY)
    layout = CohortLayout.of(settings, cohort)
    parts = joined_jobs(
        project, list(TRUTH), settings.representations, layout.load_sets, left_out=False
    )
    for name in ("stiffness", "errors", "fits"):
        cells = parts[name].astype(object).where(parts[name].notna(), None)
        shape = KIND.table(name)
        columns = {c.name: cells[c.name].tolist() for c in shape.columns}
        write_table(to_arrow(shape, columns), project.root / f"{name}.parquet", {})
    for name, job in JOBS.items():
        reads = [one for one in KIND.job(name).reads if one in layout.tables]
        output = str(project.root / f"{name}.parquet")
        job.run(
            str(project.root), STUDY, [str(project.root / f"{n}.parquet") for n in reads], output
        )
        parts[name] = read_frame(output)
    return parts


JOBS = {"mae": mae, "ranking": ranking, "statistics": statistics, "findings": findings}


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


@pytest.mark.parametrize(
    ("tests", "translations"),
    [
        (TESTS, True),
        ((TESTS[0], TESTS[2]), False),
        pytest.param(TESTS, False, marks=pytest.mark.full),
        pytest.param((TESTS[0], TESTS[2]), True, marks=pytest.mark.full),
    ],
)
def test_a_test_that_only_pulls(tests: tuple[str, ...], translations: bool, tmp_path: Path) -> None:
    """It drives a translation where that was read; errors of rotations are of what turned."""
    chains = Chains(TRUTH, tests, noise_deg=0.02, study=PULLED)
    found = analysed(with_a_pull(chains, TESTS[2], translations).write(tmp_path))
    turned = set(tests[:-1])
    assert set(found["mae"]["test"]) == (set(tests) if translations else turned)
    assert set(found["mae"].loc[found["mae"]["test"] == TESTS[2], "unit"]) <= {"mm"}
    assert set(found["mae"].loc[found["mae"]["test"] != TESTS[2], "unit"]) == {"deg"}
    tested = found["statistics"]
    family = tested["family"] == "between_levels/per_specimen/left_out_case"
    of = family & (tested["response"] == "rotation_error")
    assert set(tested.loc[of, "stratum"]) == (turned if translations else set(tests))
    order = found["ranking"]
    held_out = order[(order["criterion"] == "left_out_case") & (order["source"] == "own")]
    assert held_out["rank"].notna().all()
    assert set(held_out["specimens"]) == {len(TRUTH)}


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
