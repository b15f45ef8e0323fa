"""A small cohort study run by Snakemake: rows that were asked for, and whose stiffness they hold.

What would be caught: fits, medians of others and pools that are joined under another's name.
"""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from small_project import Project
from straight_chains import JOINTS, NAME, SPECIMENS, TESTS

pytestmark = pytest.mark.slow

STUDY = "cohort_stiffness"
FIT = f"{STUDY}/fits/stiffness/specimen-b/representation-per_joint/fitted_to-flexion.parquet"


def table(project: Project, name: str) -> pd.DataFrame:
    return pd.read_parquet(project.path(f"results/{STUDY}/{name}.parquet"))


def test_rows_are_those_that_were_asked_for(eight: Project) -> None:
    """Two tests: fits to each and to both; three specimens, one of two representations pooled."""
    fits = table(eight, "fits")
    assert set(fits["fitted_to"]) == {*TESTS, "all"}
    assert len(fits) == 3 * 2 * 3
    stiffness = table(eight, "stiffness")
    of_one = len(JOINTS) * 3
    assert stiffness["source"].value_counts().to_dict() == {
        "literature": 3 * 2 * of_one,
        "own": 3 * 2 * 3 * of_one,
    }
    predicted = table(eight, "predicted_stiffness")
    assert predicted["source"].value_counts().to_dict() == {
        "others_median": 3 * 3 * of_one,
        "others_pooled": 3 * 3 * of_one,
    }
    # both tests are pure moments: none tells of axial rotation
    for rows in (stiffness[stiffness["source"] == "own"], predicted):
        untold = rows["coordinate"] == "left_rotation"
        assert set(rows.loc[untold, "status"]) == {"not_fitted"}
        assert rows.loc[untold, "stiffness"].isna().all()
    assert len(table(eight, "sign_checks")) == 3 * 2 * len(JOINTS)
    assert set(table(eight, "pooling")["without"]) == {"nobody", *SPECIMENS}


def test_specimens_keep_their_stiffness_through_the_joins(eight: Project) -> None:
    asked = "representation == 'per_joint' and fitted_to == 'flexion' and coordinate == 'extension'"
    own = table(eight, "stiffness").query(asked).groupby("specimen")["stiffness"].mean()
    assert own.to_dict() == pytest.approx(SPECIMENS, rel=1e-3)
    predicted = table(eight, "predicted_stiffness").query(asked)
    others = predicted.groupby("specimen")["stiffness"].mean()
    assert others.to_dict() == pytest.approx({"a": 55.0, "b": 60.0, "c": 45.0}, rel=1e-3)


@pytest.mark.full
def test_a_changed_reading_reruns_a_fit(eight: Project, tmp_path: Path) -> None:
    cohort_project = eight.copy(tmp_path / "project")
    path = cohort_project.path(f"config/cohorts/{NAME}/motion.csv")
    motion = pd.read_csv(path)
    here = (motion["specimen"] == "b") & (motion["test"] == "flexion") & (motion["step"] == 2)
    motion.loc[here, "extension_deg"] *= 0.5
    motion.to_csv(path, index=False)
    cohort_project.run(f"results/{FIT}")
    rows = pd.read_parquet(cohort_project.path(f"results/{FIT}"))
    found = rows.loc[rows["coordinate"] == "extension", "stiffness"]
    # least squares of 1 / k on 1 and 2 N m: (1 * 1 + 2 * 1) / (1 + 4) of what it was
    np.testing.assert_allclose(found, SPECIMENS["b"] * 5 / 3, rtol=1e-3)
