"""The model file that a search names an effect in lowers a cohort study's held-out error.

On the shipped cohort ``stiffening_spines``, whose motion OpenSim and numpy made. The search never
sees the third specimen; the cohort study then predicts each load case of it from fits to the
other load cases, with and without that file beneath.
"""

import json
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from discrepancy_cases import files_of_a_search

from spinepipe.studies.cohort_stiffness import fit
from spinepipe.studies.discrepancy import job as search
from spinepipe.tables import read_frame

ROOT = Path(__file__).parents[3]
COHORT, UNSEEN = "stiffening_spines", "s03"
TESTS = ("axial_rotation", "flexion_extension", "lateral_bending")
SD_DEG = 0.1
"""SD of one reading, deg: truth.json of the cohort."""

SEARCH = """\
study: lack
kind: discrepancy
cohort: seen
base: {stiffness: per_specimen}
effects: [nonlinear_stiffening, neutral_zone]
"""
STUDY = """\
kind: cohort_stiffness
cohort: stiffening_spines
representations: [per_specimen]
starts: 1
"""
MODEL = "results/lack/discrepancy/model_with_effects.yaml"


def studies_of(root: Path) -> None:
    """The cohort, the same without a specimen, a search and two studies of stiffness."""
    cohorts, studies = root / "config" / "cohorts", root / "config" / "studies"
    studies.mkdir(parents=True)
    for name in (COHORT, "seen"):
        shutil.copytree(ROOT / "config" / "cohorts" / COHORT, cohorts / name)
    for path in (cohorts / "seen").glob("*.csv"):
        rows = pd.read_csv(path, dtype=str, keep_default_na=False)
        if "specimen" in rows:
            rows[rows["specimen"] != UNSEEN].to_csv(path, index=False)
    header = cohorts / "seen" / "cohort.yaml"
    header.write_text(header.read_text().replace(f'cohort: "{COHORT}"', 'cohort: "seen"'))
    (studies / "lack.yaml").write_text(SEARCH)
    (studies / "without.yaml").write_text(f"study: without\n{STUDY}")
    (studies / "beneath.yaml").write_text(f"study: beneath\n{STUDY}base: {{model: {MODEL}}}\n")


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A project in which the search is done."""
    root = tmp_path_factory.mktemp("named") / "project"
    studies_of(root)
    folder = root / "results" / "lack" / "discrepancy"
    folder.mkdir(parents=True)
    search.run(str(root), "lack", **files_of_a_search(folder))
    return root


def held_out_deg(root: Path, study: str, test: str) -> float:
    """Root mean square error of a load case of the unseen specimen that no fit has seen."""
    files = {
        name: str(root / f"{study}_{name}.parquet")
        for name in ("stiffness", "fits", "errors", "nuisances")
    }
    fit.run(str(root), study, UNSEEN, "per_specimen", f"all_but_{test}", **files)
    errors = read_frame(files["errors"])
    rows = errors[(errors["stage"] == "left_out_case") & (errors["test"] == test)]
    rows = rows[rows["coordinate"].isin(["extension", "right_bending", "left_rotation"])]
    assert len(rows) == 6 * 3  # joints and rotations
    return float(np.sqrt((rows["rmse"] ** 2).mean()))


def test_the_search_names_what_the_cohort_hides(project: Path) -> None:
    verdict = json.loads((project / "results/lack/discrepancy/verdict.json").read_text())
    assert (verdict["verdict"], [one["name"] for one in verdict["effects"]]) == (
        "NAMED",
        ["nonlinear_stiffening"],
    )


def test_held_out_error_falls(project: Path) -> None:
    """Of the flexion-extension test, in which the spines stiffen; the other two lose nothing."""
    found = {
        (study, test): held_out_deg(project, study, test)
        for study in ("without", "beneath")
        for test in TESTS
    }
    noise_left = {key: np.sqrt(max(value**2 - SD_DEG**2, 0.0)) for key, value in found.items()}
    assert noise_left["beneath", TESTS[1]] < 0.5 * noise_left["without", TESTS[1]]
    for test in (TESTS[0], TESTS[2]):
        assert found["beneath", test] < 1.02 * found["without", test]
    means = [
        np.sqrt(np.mean([found[study, test] ** 2 for test in TESTS]))
        for study in ("without", "beneath")
    ]
    assert means[1] < 0.8 * means[0]
