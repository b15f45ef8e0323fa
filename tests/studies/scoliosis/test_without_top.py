"""Left-out films without the top: given how others are pulled, and nothing of the film itself.

Would catch a prediction that knows the film, a pull of its own among the others', a pose under
another pull than was asked for, and errors of other patients beside each other.
"""

import numpy as np
import pandas as pd
import pytest
from scoliosis_cases import STUDY, shipped

from spinepipe.cohort import Cohort
from spinepipe.studies.scoliosis.personal import WAYS, Patient, patient_of, tangent
from spinepipe.studies.scoliosis.personalise import rows_of
from spinepipe.studies.scoliosis.pulled import pulled_spine, under_pull
from spinepipe.studies.scoliosis.tables import LAWS, POSITIONS
from spinepipe.studies.scoliosis.without_top import _errors, _model, without_top_rows
from spinepipe.tables import from_rows

COHORT = shipped(3)
DEPTH_MM = STUDY.profile.endplate_depth_mm


@pytest.fixture(scope="module")
def patients() -> dict[str, Patient]:
    return {name: patient_of(STUDY, COHORT, name) for name in COHORT.specimen_names}


def made(cohort: Cohort, *models: str) -> tuple[pd.DataFrame, ...]:
    """Laws and positions."""
    rows = [rows_of(STUDY, cohort, name, one) for name in cohort.specimen_names for one in models]
    return tuple(
        from_rows(table, [row for one in rows for row in one[table.name]]).to_pandas()
        for table in (LAWS, POSITIONS)
    )


@pytest.fixture(scope="module")
def tables() -> tuple[pd.DataFrame, ...]:
    return made(COHORT, "tangent", "uniform")


@pytest.mark.parametrize("newton", [-20.0, 0.0, 150.0, 2000.0])
def test_a_pose_has_the_pull_that_was_asked_for(
    patients: dict[str, Patient], newton: float
) -> None:
    """Up to pulls that a step along the first tangent far overshoots."""
    one = patients["p01"]
    posed = under_pull(pulled_spine(one, tangent(one, STUDY).model, DEPTH_MM), newton)
    assert posed is not None
    assert posed.result.pushes[0] == pytest.approx(newton, abs=1.0)
    longer = float(np.hypot(*posed.film.top[:2]) - np.hypot(*one.erect.top[:2]))
    assert np.sign(round(1e6 * longer)) == np.sign(newton)


def test_a_model_is_that_of_its_rows(
    patients: dict[str, Patient], tables: tuple[pd.DataFrame, ...]
) -> None:
    one = patients["p02"]
    laws = tables[0][tables[0]["specimen"] == "p02"]
    for model in ("tangent", "uniform"):
        found = _model(one, laws[laws["model"] == model].iloc[::-1])  # in whatever order
        sound = WAYS[model](one, STUDY).model
        for effect, other in zip(found.effects, sound.effects, strict=True):
            np.testing.assert_allclose(effect.values, other.values, rtol=1e-9)


def test_each_is_pulled_as_the_others_are(patients: dict[str, Patient]) -> None:
    spines = {
        name: pulled_spine(one, tangent(one, STUDY).model, DEPTH_MM)
        for name, one in patients.items()
    }
    alone, shared = (
        dict(_errors("neutral", patients, spines, pulls))
        for pulls in ({"p01": 1e9}, {"p01": 1e9, "p02": 50.0, "p03": 70.0})
    )
    assert "p01" not in alone
    posed = under_pull(spines["p01"], 60.0)
    assert posed is not None
    expected = patients["p01"].errors("neutral", posed)
    assert shared["p01"]["place_rmse_mm"] == pytest.approx(expected["place_rmse_mm"], rel=1e-6)
    measured = np.rad2deg(np.sqrt(np.mean(patients["p01"].read.turned("neutral") ** 2)))
    assert shared["p01"]["rotation_rmse_deg_unmoved"] == pytest.approx(measured, rel=1e-6)


def test_rows_are_of_left_out_films_and_beside_the_errors_with_the_top(
    tables: tuple[pd.DataFrame, ...],
) -> None:
    laws, positions = tables
    rows = list(without_top_rows(STUDY, COHORT, laws, positions))
    assert len(rows) == 2 * 2 * 3
    assert {row["position"] for row in rows} == {"neutral", "traction"}
    for row in rows:
        assert row["n_patients"] == 3
        column = {"rotation": "rotation_rmse_deg", "place": "place_rmse_mm"}.get(row["measure"])
        own = positions[(positions["model"] == row["model"])]
        own = own[own["position"] == row["position"]]
        if column:
            assert row["rmse_given_top"] == pytest.approx(np.sqrt((own[column] ** 2).mean()))
        if row["position"] == "traction":
            assert row["rmse"] < row["rmse_unmoved"]
            assert row["pull_n"] > 100.0


def test_a_patient_alone_has_no_others(tables: tuple[pd.DataFrame, ...]) -> None:
    cohort = shipped(1)
    rows = list(without_top_rows(STUDY, cohort, *made(cohort, "uniform")))
    assert {row["n_patients"] for row in rows} == {0}
    assert {row["rmse"] for row in rows} == {None}
