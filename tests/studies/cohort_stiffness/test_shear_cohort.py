"""A cohort of forces and translations: one joint pushed forwards and backwards, by hand.

Seen here: degrees where millimetres are meant, in any table, claim, figure or message of the kind.

The force acts at the joint's centre, so that the upper vertebra shifts and does not turn:
displacement is force over stiffness.
"""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from chain_cases import STUDY, Written
from cohort_analysis_cases import analysed
from cohort_edge_cases import joined_jobs

from spinepipe.jobs.inputs import study_of_kind
from spinepipe.problems import InputError
from spinepipe.report.page.study_page import ResultTables
from spinepipe.studies import read as studies
from spinepipe.studies.cohort_stiffness.charts import held_out_error
from spinepipe.studies.cohort_stiffness.claims_of_errors import overprediction_percent
from spinepipe.studies.cohort_stiffness.conclusions import conclusions
from spinepipe.studies.cohort_stiffness.kind import CohortLayout
from spinepipe.studies.cohort_stiffness.settings import CohortStiffness, representations_of
from spinepipe.tables import StudyTables

TRUE_N_PER_MM = {"a": 95.0, "b": 120.0, "c": 150.0, "d": 80.0}
PUBLISHED_N_PER_M = 149_000.0
"""Anterior-posterior, of all joints: docs/studies/cohort_stiffness.md."""

TESTS = {"anterior_shear": 1.0, "posterior_shear": -1.0}
STEPS, STEP_N, NOISE_MM, SD_MM = 6, 20.0, 0.002, 0.005
STUDY_FILE = f"study: {STUDY}\nkind: cohort_stiffness\ncohort: shear\nfree: [anterior]\n"
FITTED = ("per_specimen", "per_joint")


def written(root: Path, study: str = STUDY_FILE) -> Written:
    folder = root / "config/cohorts/shear"
    folder.mkdir(parents=True)
    (root / "config/studies").mkdir()
    (root / "config/config.yaml").write_text(f"studies: [{STUDY}]\n")
    (root / f"config/studies/{STUDY}.yaml").write_text(study)
    (folder / "cohort.yaml").write_text(
        "cohort: shear\ntitle: C6-C7 in shear\nsource: written for the tests\nvertebrae: [C7, C6]\n"
        f"gravity: false\nmeasurement_sd: {{rotation_deg: 0.1, translation_mm: {SD_MM}}}\n"
    )
    (folder / "specimens.csv").write_text("\n".join(["specimen", *TRUE_N_PER_MM]) + "\n")
    poses = "specimen,joint,x_mm,y_mm,z_mm,extension_deg,right_bending_deg,left_rotation_deg\n"
    poses += "".join(f"{name},C6C7,2,18,0,0,0,0\n" for name in TRUE_N_PER_MM)
    (folder / "joints.csv").write_text(poses)
    rng = np.random.default_rng(3)
    loads, motion = [], []
    for test, sign in TESTS.items():
        for step in range(STEPS):
            force = sign * STEP_N * step
            at = {"px_mm": 2.0, "py_mm": 18.0, "pz_mm": 0.0}
            wrench = dict.fromkeys(("fx_n", "fy_n", "fz_n", "mx_nm", "my_nm", "mz_nm"), 0.0)
            row = {"specimen": "*", "test": test, "step": step, "vertebra": "C6"}
            loads.append({**row, **wrench, "fx_n": force, **at})
            for name, k in TRUE_N_PER_MM.items():
                seen = force / k + NOISE_MM * rng.normal()
                key = {"specimen": name, "test": test, "step": step, "joint": "C6C7"}
                motion.append({**key, "anterior_mm": seen})
    pd.DataFrame(loads).to_csv(folder / "loads.csv", index=False)
    pd.DataFrame(motion).to_csv(folder / "motion.csv", index=False)
    return Written(root)


Frames = dict[str, pd.DataFrame]


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Written:
    return written(tmp_path_factory.mktemp("shear"))


@pytest.fixture(scope="module")
def frames(project: Written) -> Frames:
    """All tables of the study, job by job."""
    names, labels = list(TRUE_N_PER_MM), (*TESTS, "all")
    pooled = [(label, "nobody") for label in labels] + [("all", name) for name in names]
    joined = joined_jobs(project, names, FITTED, labels, pooled=pooled)
    return joined | analysed(joined)


def of(frame: pd.DataFrame, **chosen: str) -> pd.DataFrame:
    for column, value in chosen.items():
        frame = frame[frame[column] == value]
    return frame


def test_the_stiffness_is_found(frames: Frames) -> None:
    """Least squares of the displacements on 1 / k: force over stiffness, a line through zero."""
    rows = of(frames["stiffness"], source="own", fitted_to="all").set_index("specimen")
    assert set(rows["unit"]) == {"N/m"}
    assert set(rows["coordinate"]) == {"anterior"}
    forces = np.array([s * STEP_N * n for s in TESTS.values() for n in range(STEPS)])
    error = NOISE_MM / np.sqrt(forces @ forces)  # of 1 / k, in mm/N
    for name, k in TRUE_N_PER_MM.items():
        for value in rows.loc[[name], "stiffness"]:
            assert abs(1e3 / value - 1.0 / k) < 4.0 * error
    assert rows.loc[:, "identifiable"].eq(True).all()


def test_every_table_has_rows(frames: Frames) -> None:
    empty = {name for name, rows in frames.items() if not len(rows)}
    assert empty == {"nuisances"}  # no representation with nuisances is asked for
    assert set(frames["errors"]["unit"]) == {"mm"}
    assert frames["errors"]["loaded"].all()
    assert set(frames["sign_checks"]["verdict"]) == {"as_expected"}
    assert frames["sign_checks"]["measured_over_expected"].between(0.9, 2.2).all()


def test_errors_are_those_of_the_published_stiffness(frames: Frames) -> None:
    published = of(frames["errors"], stage="literature").set_index(["specimen", "test"])
    for (name, test), row in published.iterrows():
        largest = TESTS[test] * STEP_N * (STEPS - 1)
        error = largest * (1e3 / PUBLISHED_N_PER_M - 1.0 / TRUE_N_PER_MM[name])
        assert row["peak_error"] == pytest.approx(error, abs=4 * NOISE_MM)
    excess = overprediction_percent(of(frames["errors"], stage="literature"))
    for name, k in TRUE_N_PER_MM.items():
        assert excess[name] == pytest.approx(100 * (1e3 * k / PUBLISHED_N_PER_M - 1), abs=1.0)


def test_the_order_of_representations_is_in_millimetres(frames: Frames) -> None:
    ranking = frames["ranking"]
    fitted = of(ranking, criterion="fitted")
    assert set(fitted["unit"]) == {"mm"}
    assert fitted["value"].notna().all()
    worst = fitted.sort_values("value").iloc[-1]
    assert worst["representation"] == "literature"
    assert fitted["value"].min() == pytest.approx(NOISE_MM, rel=0.5)
    assert set(ranking["representation"]) == {*FITTED, "partially_pooled", "literature"}


def test_mean_absolute_errors_are_in_millimetres(frames: Frames) -> None:
    rows = of(frames["mae"], stage="fitted", steps="peak", fitted_to="all")
    assert set(rows["unit"]) == {"mm"}
    assert set(rows["coordinate"]) == {"anterior"}
    assert (rows["mae"] < 3 * NOISE_MM).all()
    assert rows["largest_motion"].to_numpy() == pytest.approx(100.0 / 80.0, rel=0.01)


def test_claims_are_decided(frames: Frames) -> None:
    found = frames["findings"].set_index("finding")
    better = found.loc["optimised_beats_literature"]
    assert (better["holds"], better["unit"]) in {("circular", "mm"), ("undecided", "mm")}
    assert "all measured translations" in better["quantity"]
    assert better["value"] > 0.05
    assert found.loc["literature_overpredicts_motion_anterior_shear", "value"] < 0.0
    ratio = found.loc["wrong_level_ratio_worse_than_uniform"]
    assert ratio["holds"] == "not_asked"
    assert "not computed in this study" in ratio["message"]


def test_tests_of_significance_speak_of_translations(frames: Frames) -> None:
    rows = frames["statistics"]
    assert "translation_error" in set(rows["response"])
    assert "rotation_error" not in set(rows["response"])


def inputs(project: Written) -> tuple[CohortStiffness, Any]:
    return study_of_kind(CohortStiffness, str(project.root), STUDY)


def test_ratios_of_levels_are_left_out(project: Written) -> None:
    study, cohort = inputs(project)
    kept = (*FITTED, "partially_pooled")
    assert representations_of(study, cohort.joint_names) == kept
    assert CohortLayout.of(study, cohort).representations == kept


def test_who_asks_for_ratios_of_levels_is_told_why_not(tmp_path: Path) -> None:
    written(tmp_path, f"{STUDY_FILE}representations: [level_ratio]\n")
    with pytest.raises(InputError) as refused:
        studies.check(tmp_path, STUDY)
    assert [one.found for one in refused.value.problems] == ["no value for C6C7"]


def test_page_and_figures_are_in_millimetres(project: Written, frames: Frames) -> None:
    study, cohort = inputs(project)
    told = list(conclusions(study, cohort, ResultTables(StudyTables(frames))))
    (answer,) = (one for one in told if one.rule == "typical")
    assert {value.unit for value in answer.values.values()} == {"N/mm"}
    assert "ratios" in {one.rule for one in told}, "levels that are left out are told of"
    (panel,) = held_out_error(study, cohort, frames).panels
    assert panel.x_label == "root mean square error (mm)"
