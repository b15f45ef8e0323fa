"""A small cohort study run by Snakemake: all of its results, and what is computed again."""

from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
from small_project import Project, Shared, copy_project
from straight_chains import JOINTS, SPECIMENS, STUDY, TESTS, write_cohort

from spinepipe.studies.cohort_stiffness.kind import KIND

pytestmark = pytest.mark.slow

JOINED = ("stiffness", "fits", "errors", "sign_checks", "pooling")
FIT = "small/fits/specimen=b/representation=per_joint/fitted_to=flexion"


def build(folder: Path) -> Project:
    project = copy_project(folder)
    write_cohort(project.path("config/cohorts/chains"))
    project.path("config/studies/small.yaml").write_text(STUDY)
    project.run()
    return project


@pytest.fixture
def built(shared: Shared) -> Project:
    """A project whose study has been computed; built once and not to be changed."""
    return shared.project("cohort", build)


@pytest.fixture
def cohort_project(built: Project, tmp_path: Path) -> Project:
    """The same, for one test to change."""
    return built.copy(tmp_path / "project")


def table(project: Project, name: str) -> pd.DataFrame:
    return pd.read_parquet(project.path(f"results/small/{name}.parquet"))


def test_every_table_is_made_and_keeps_its_schema(built: Project) -> None:
    for name in JOINED:
        found = pq.read_table(built.path(f"results/small/{name}.parquet"))
        assert found.schema.remove_metadata() == KIND.table(name).schema, name
        told = set(found.schema.metadata)
        assert b"seed" in told, name
        assert told >= {b"code_digest", b"config_digest", b"data_digest", b"result_digest"}, name
        for column in found.columns:
            if pd.api.types.is_float_dtype(column.type.to_pandas_dtype()):
                assert np.isfinite(column.drop_null().to_numpy()).all(), name
    assert not list(built.path("results").rglob("*.log"))
    assert built.path("results/small/report.html").stat().st_size > 1e5


def test_rows_are_those_that_were_asked_for(built: Project) -> None:
    """Two tests: fits to each and to both; three specimens, one of two representations pooled."""
    fits = table(built, "fits")
    assert set(fits["fitted_to"]) == {*TESTS, "all"}
    assert len(fits) == 3 * 2 * 3
    stiffness = table(built, "stiffness")
    of_one = len(JOINTS) * 3
    assert stiffness["source"].value_counts().to_dict() == {
        "literature": 3 * 2 * of_one,
        "own": 3 * 2 * 3 * of_one,
        "others_median": 3 * 3 * of_one,
        "others_pooled": 3 * 3 * of_one,
    }
    assert len(table(built, "sign_checks")) == 3 * 2 * len(JOINTS)
    assert set(table(built, "pooling")["without"]) == {"nobody", *SPECIMENS}


def test_specimens_keep_their_stiffness_through_the_joins(built: Project) -> None:
    rows = table(built, "stiffness").query(
        "representation == 'per_joint' and fitted_to == 'flexion' and coordinate == 'extension'"
    )
    own = rows[rows["source"] == "own"].groupby("specimen")["stiffness"].mean()
    assert own.to_dict() == pytest.approx(SPECIMENS, rel=1e-3)
    others = rows[rows["source"] == "others_median"].groupby("specimen")["stiffness"].mean()
    assert others.to_dict() == pytest.approx({"a": 55.0, "b": 60.0, "c": 45.0}, rel=1e-3)


def test_a_deleted_fit_reruns_what_hangs_on_it(cohort_project: Project) -> None:
    content = cohort_project.contents()
    assert cohort_project.planned() == set()
    cohort_project.path(f"results/{FIT}/stiffness.parquet").unlink()
    again = cohort_project.rerun()
    jobs = {name for name in again if "specimen=" in name and "blocks" not in name}
    fitted = {f"{FIT}/{name}.parquet" for name in ("stiffness", "fits", "errors", "nuisances")}
    medians = {
        FIT.replace("fits/specimen=b", f"left_out/specimen={name}") + f"/{file}.parquet"
        for name in ("a", "c")
        for file in ("stiffness", "errors")
    }
    assert jobs == fitted | medians
    assert cohort_project.contents() == content


def test_another_significance_computes_no_fit_again(cohort_project: Project) -> None:
    cohort_project.edit("config/studies/small.yaml", "significance: 0.05", "significance: 0.01")
    again = cohort_project.planned()
    assert "small/findings.parquet" in again
    assert not {name for name in again if "=" in name}


def test_a_changed_reading_reruns_a_fit(cohort_project: Project) -> None:
    path = cohort_project.path("config/cohorts/chains/motion.csv")
    motion = pd.read_csv(path)
    here = (motion["specimen"] == "b") & (motion["test"] == "flexion") & (motion["step"] == 2)
    motion.loc[here, "extension_deg"] *= 0.5
    motion.to_csv(path, index=False)
    cohort_project.run(f"results/{FIT}/stiffness.parquet")
    rows = pd.read_parquet(cohort_project.path(f"results/{FIT}/stiffness.parquet"))
    found = rows.loc[rows["coordinate"] == "extension", "stiffness"]
    # least squares of 1 / k on 1 and 2 N m: (1 * 1 + 2 * 1) / (1 + 4) of what it was
    np.testing.assert_allclose(found, SPECIMENS["b"] * 5 / 3, rtol=1e-3)
