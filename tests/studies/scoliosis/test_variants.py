"""Variants of the published model, and what stiffness in all does in space.

Would catch a variant that varies something else, and wrong derivatives of regions.
"""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import scoliosis_cases
from scoliosis_cases import shipped

from spinepipe.studies.scoliosis.films import RIGHT
from spinepipe.studies.scoliosis.fixed_end_spine import with_laws
from spinepipe.studies.scoliosis.personal import Patient, RegionFit, _regions, patient_of, tangent
from spinepipe.studies.scoliosis.settings import Scoliosis
from spinepipe.studies.scoliosis.tables import VARIANTS, VARIATION
from spinepipe.studies.scoliosis.variants import variant_rows
from spinepipe.studies.scoliosis.variation import variation_rows
from spinepipe.tables import from_rows

VARIANTS_ASKED = {"enlargement_percent": [0, 20, 40], "scale": [0.3, 3.0]}
STUDY = Scoliosis.model_validate(scoliosis_cases.STUDY.model_dump() | {"variants": VARIANTS_ASKED})


@pytest.fixture(scope="module")
def patient() -> Patient:
    return patient_of(STUDY, shipped(1), "p01")


@pytest.fixture(scope="module")
def variants() -> pd.DataFrame:
    return from_rows(VARIANTS, list(variant_rows(STUDY, shipped(1), "p01"))).to_pandas()


def test_films_on_the_ends_are_singular_and_have_no_pose(variants: pd.DataFrame) -> None:
    rows = variants[(variants["varied"] == "enlargement") & (variants["value"] == 0.0)]
    assert len(rows) == 4
    assert (rows["status"] == "singular").all()
    assert rows["rotation_rmse_deg"].isna().all()
    assert rows["moved_deg"].isna().all()


def test_the_enlargement_of_the_study_moves_nothing(variants: pd.DataFrame) -> None:
    rows = variants[variants["varied"] == "enlargement"].set_index("value")
    assert (rows.loc[20.0, "moved_deg"] < 1e-6).all()
    assert (rows.loc[40.0, "moved_deg"] > 1e-3).all()


def test_stiffness_in_all_moves_nothing_and_lateral_alone_does(
    patient: Patient, variants: pd.DataFrame
) -> None:
    model = tangent(patient, STUDY).model
    laws = model.effects[1].values * np.array([10.0, 1.0, 1.0])
    stiffer = with_laws(patient.chain, 10.0 * patient.springs, laws)
    top = patient.read.films[RIGHT].top
    one, two = (patient.fixed_end(which).at(top) for which in (model, stiffer))
    # the least bushing of a tangent does not grow along: a millionth of a joint
    np.testing.assert_allclose(two.r, one.r, rtol=0, atol=1e-7)
    assert variants.loc[variants["varied"] == "scale", "moved_deg"].max() > 0.1


def test_variants_are_pooled_over_whole_patients() -> None:
    rows = [
        {
            "specimen": name,
            "varied": "scale",
            "value": 3.0,
            "position": position,
            "fitted": False,
            "law_rmse_deg": None,
            "rotation_rmse_deg": error,
            "place_rmse_mm": error,
            "moved_deg": error,
            "status": "unstable" if error is None else "converged",
            "message": "",
        }
        for name, errors in {"a": (3.0, 4.0), "b": (1.0, None)}.items()
        for position, error in zip(("neutral", "traction"), errors, strict=True)
    ]
    made = from_rows(VARIANTS, rows).to_pandas()
    found = from_rows(VARIATION, list(variation_rows(made))).to_pandas()
    assert len(found) == 1
    assert found["n_patients"][0] == 1
    assert found["rotation_rmse_deg"][0] == pytest.approx(np.sqrt(12.5))
    assert found["moved_deg"][0] == 4.0


def test_the_top_is_kept_from_tipping_unless_it_may(patient: Patient) -> None:
    top, model = patient.read.films["traction"].top, tangent(patient, STUDY).model
    level, free = (replace(patient, level=one).fixed_end(model).at(top) for one in (True, False))
    assert len(level.result.pushes) == len(free.result.pushes) + 1
    extension = level.result.q.reshape(-1, 6)[:, 3].sum()
    assert abs(extension) < np.deg2rad(0.5) < abs(free.result.q.reshape(-1, 6)[:, 3].sum())


def test_ferguson_angles_change_with_places_as_told(patient: Patient) -> None:
    film, step = patient.erect, 1e-7
    for curve in patient.curves:
        told = curve.ferguson_by(film)
        for row, name in enumerate(("right", "up")):
            for number in range(len(film.right)):
                ends = []
                for sign in (1.0, -1.0):
                    moved = getattr(film, name).copy()
                    moved[number] += sign * step
                    ends.append(curve.ferguson(replace(film, **{name: moved})))
                assert told[row, number] == pytest.approx((ends[0] - ends[1]) / 2e-7, abs=1e-5)


def test_regions_are_fitted_with_exact_derivatives(patient: Patient) -> None:
    fit, logs = RegionFit(patient, _regions(patient)), np.array([0.2, -0.3])
    found = fit.missed(logs)
    assert found is not None
    for number, step in enumerate(1e-5 * np.eye(2)):
        ends = [fit.missed(logs + s * step) for s in (1.0, -1.0)]
        change = (ends[0][0] - ends[1][0]) / 2e-5
        np.testing.assert_allclose(found[1][:, number], change, rtol=1e-5, atol=1e-9)
