"""Stiffness that no reading depends on: a pure moment tells of one direction alone.

What would be caught: where fits start told as if it had been fitted, in whatever table, model file
or page; a prediction that takes another value there than the published one.
"""

from dataclasses import replace
from io import StringIO
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from chain_cases import JOINTS, MOMENT_OF, ROTATIONS, STUDY, Chains, Written
from cohort_edge_cases import TRUTH

import spinepipe as sp
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.studies.cohort_stiffness.conclusions_of_stiffness import (
    joint_values,
    stiffness_conclusions,
)
from spinepipe.studies.cohort_stiffness.export import exported
from spinepipe.studies.cohort_stiffness.representations import FITTED
from spinepipe.studies.cohort_stiffness.settings import CohortStiffness
from spinepipe.studies.kind import WantedFiles

START = {"extension": 51.0, "right_bending": 68.8, "left_rotation": 291.0}
BENT = "left_lateral_bending"
OTHERS = [name for name in ROTATIONS if name != MOMENT_OF[BENT][2]]


@pytest.fixture
def project(tmp_path: Path) -> Written:
    study = f"representations: [{', '.join(FITTED)}]\nnuisance: {{axes_deg: 2}}\n"
    return Chains(TRUTH, noise_deg=0.02, study=study).write(tmp_path)


def assert_empty(rows: pd.DataFrame, fitted: list[str]) -> None:
    """Rows of these coordinates alone have numbers, all others say that they were not fitted."""
    there = rows["coordinate"].isin(fitted)
    assert rows.loc[there, "stiffness"].notna().all()
    assert rows.loc[there, "status"].str.startswith("converged").all()
    numbers = ["stiffness", "standard_error", "low", "high", "identifiable", "growth"]
    assert rows.loc[~there, numbers].isna().all(axis=None)
    assert set(rows.loc[~there, "status"]) == {"not_fitted"}
    assert (rows.loc[~there, "at_bound"] == "no").all()


@pytest.mark.parametrize(
    "name", [one for one in FITTED if not one.startswith(("partially", "pool"))]
)
def test_a_fit_to_one_load_case_tells_of_its_own_direction(name: str, project: Written) -> None:
    found = project.fit("a", name, BENT)
    assert len(found["stiffness"]) == 9
    assert_empty(found["stiffness"], [MOMENT_OF[BENT][2]])
    assert found["fits"]["status"].item() == "converged"
    errors = found["errors"].query("test == 'flexion' and coordinate == 'extension'")
    # predicted with published stiffness, on average over steps of 0 to 3 N m
    wanted = -1.5 * np.rad2deg(1.0 / START["extension"])
    if name in ("per_joint", "per_specimen"):
        moved = errors["bias"] - 1.5 * np.rad2deg(1.0 / TRUTH["a"][:, 0])
        np.testing.assert_allclose(moved, wanted, atol=0.05)


def test_the_median_of_others_that_were_not_fitted_is_none(project: Written) -> None:
    found = project.left_out(["b", "c"], "a", "per_joint", BENT)
    assert_empty(found["stiffness"], [MOMENT_OF[BENT][2]])


@pytest.mark.parametrize("name", ["partially_pooled", "pooled_stiffening"])
@pytest.mark.parametrize("without", ["nobody", "a"])
def test_a_pool_tells_of_what_some_specimen_was_read_in(
    name: str, without: str, project: Written
) -> None:
    found = project.pool(BENT, without, name)
    assert_empty(found["stiffness"], [MOMENT_OF[BENT][2]])
    pooling = found["pooling"].set_index("coordinate")
    assert (pooling.loc[OTHERS, "status"] == "not_fitted").all()
    assert pooling.loc[OTHERS, ["centre", "between_joints"]].isna().all(axis=None)


def test_the_rest_of_the_house_reads_the_empty_rows(tmp_path: Path) -> None:
    """One load case alone: in OpenSim's file, the model of the API, curves, and on the page."""
    project = Chains(TRUTH, [BENT], study="representations: [per_joint]\n").write(tmp_path)
    rows = project.fit("a", "per_joint", BENT)["stiffness"].assign(
        specimen="a", representation="per_joint", fitted_to=BENT
    )
    values = joint_values(rows)
    assert set(values["coordinate"]) == {MOMENT_OF[BENT][2]}
    told = {(one.rule, one.verdict): one.names for one in stiffness_conclusions(values, ROTATIONS)}
    assert "flexion" in told["not_fitted", "directions"]["directions"]
    assert "axial rotation" in told["not_fitted", "directions"]["directions"]
    curves = project.experiment("a")["load_displacement"]
    model = curves[curves["source"] == "simulated"]
    assert (model["status"] == "converged").all()

    settings, cohort = study_of_kind(CohortStiffness, str(project.root), STUDY)
    rows.to_parquet(tmp_path / "stiffness.parquet")
    wanted = WantedFiles(project.root, tmp_path, "a", representation="per_joint")
    document, words, _ = exported(settings, cohort, wanted)
    assert "291" in document
    assert "6 of 9 as published" in words
    csv, words, _ = exported(settings, cohort, replace(wanted, point_mm=(0.0, 10.0, 0.0)))
    told = pd.read_csv(StringIO(csv)).query("joint == 'L4L5' and row == column").set_index("row")
    assert told["stiffness"].notna().to_dict() == {
        **dict.fromkeys(("anterior", "superior", "right", "right_bending"), True),
        **dict.fromkeys(("left_rotation", "extension"), False),
    }
    assert "about (0, 10, 0) mm from its origin" in words

    fit = sp.calibrate(cohort, stiffness="per_joint", leave_out="specimen")
    assert fit.table["stiffness"].notna().sum() == 9
    assert_empty(fit.table, [MOMENT_OF[BENT][2]])
    assert set(fit.stiffness["source"]) == {"own"}
    assert set(fit.predicted_stiffness["source"]) == {"others_median"}
    assert_empty(fit.predicted_stiffness, [MOMENT_OF[BENT][2]])
    (bushing,) = fit.model.effects
    assert {one.parameters["extension_nm_per_rad"] for one in bushing.values} == {51.0}


def test_no_table_of_fits_holds_where_they_start(project: Written) -> None:
    """Eleven values of one joint in flexion: seven fits and four predictions, five of them none."""
    labels = [*MOMENT_OF, "all", *(f"all_but_{one}" for one in MOMENT_OF)]
    fits = [project.fit("a", "per_joint", label)["stiffness"] for label in labels]
    every = pd.concat(fits)
    flexion = every[(every["joint"] == JOINTS[1]) & (every["coordinate"] == "extension")]
    assert len(flexion) == 7
    assert (flexion["status"] == "not_fitted").sum() == 3
    assert not np.isclose(flexion["stiffness"].dropna(), 51.0, rtol=1e-3).any()
