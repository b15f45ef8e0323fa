"""Size of stiffness from films under known traction.

Would catch a pull along another line, a scale of which twice the stiffness is not twice, an
interval without the truth, and a size told where no two pulls differ.
"""

from dataclasses import replace

import numpy as np
import pytest
from scoliosis_cases import STUDY, mirrored, shipped

from spinepipe.studies.scoliosis.film_fit import FilmFit
from spinepipe.studies.scoliosis.films import film_sd
from spinepipe.studies.scoliosis.fixed_end_spine import geometry
from spinepipe.studies.scoliosis.personal import Patient, patient_of, uniform
from spinepipe.studies.scoliosis.population import PatientPrior, usual_population
from spinepipe.studies.scoliosis.pulled import (
    AbsoluteStiffness,
    pull_of,
    pulled_spine,
    stiffness_by_pulls,
)
from spinepipe.units import DEG_PER_RAD
from tests.generators import ais_films

SD = film_sd(0.2, 0.2, 0.3, 0.2)
DEPTH_MM = STUDY.profile.endplate_depth_mm


@pytest.fixture(scope="module")
def patient() -> Patient:
    return patient_of(STUDY, shipped(1), "p01")


def test_a_pull_on_a_straight_leaning_spine_is_found_again(patient: Patient) -> None:
    """The film that the model itself has under a pull, whatever the frame it is read in."""
    spine = pulled_spine(patient, uniform(patient, STUDY).model, DEPTH_MM)
    posed = spine.at(np.array([np.hypot(*patient.erect.top[:2]) + 2e-3]))
    assert posed.result.status == "converged"
    found = pull_of(spine, posed.film, SD)
    assert found is not None
    assert found.newton == pytest.approx(posed.result.pushes[0], abs=0.05 * found.sd)
    assert found.newton > 0.0


def told(patient: Patient, traction: dict[str, float]) -> AbsoluteStiffness | str:
    read = replace(patient.read, traction=traction)
    mean = usual_population(patient.chain.n_joints).mean
    known = PatientPrior(mean, 1e-4 * np.eye(len(mean)))
    return stiffness_by_pulls(replace(patient, read=read), FilmFit(patient, SD), known, DEPTH_MM)


def test_twice_the_pull_is_twice_the_stiffness(patient: Patient) -> None:
    once, twice = (told(patient, {"neutral": 0.0, "traction": f}) for f in (300.0, 600.0))
    assert isinstance(once, AbsoluteStiffness)
    assert isinstance(twice, AbsoluteStiffness)
    np.testing.assert_allclose(twice.mean, 2.0 * once.mean, rtol=1e-9)
    np.testing.assert_allclose(twice.joints, 2.0 * once.joints, rtol=1e-9)
    assert once.mean[1] < once.mean[0] < once.mean[2]
    assert once.films == ("neutral", "traction")


def test_a_mirrored_spine_is_as_stiff(patient: Patient) -> None:
    films = {name: mirrored(film) for name, film in patient.read.films.items()}
    read = replace(patient.read, films=films)
    erect = geometry("p01", patient.chain.joints, read.films["erect"], STUDY.profile)
    pairs = replace(
        patient.pairs, right=read.turned("left_bending"), left=read.turned("right_bending")
    )
    other = replace(patient, read=read, chain=erect, pairs=pairs)
    one, two = (
        pull_of(pulled_spine(p, uniform(p, STUDY).model, DEPTH_MM), p.read.films["traction"], SD)
        for p in (patient, other)
    )
    assert one is not None
    assert two is not None
    assert two.newton == pytest.approx(one.newton, rel=1e-3)


@pytest.mark.parametrize("traction", [{"traction": 300.0}, {"neutral": 5.0, "traction": 5.0}])
def test_one_pull_alone_tells_no_size(patient: Patient, traction: dict[str, float]) -> None:
    assert "another traction_n is needed" in str(told(patient, traction))


def test_a_hidden_spine_is_as_stiff_as_its_films_under_traction_say() -> None:
    """Films of a generator of other laws, turned by 300 N: the geometric mean over segments of the
    hidden stiffness on the side to which traction turns each, within a quarter."""
    one = ais_films.patient(1)
    films = ais_films.filmed(one)
    turned = np.diff(films["traction"][1]) - np.diff(films["neutral"][1])
    hidden = one.stiffness[np.arange(len(turned)), (turned > 0.0).astype(int)]
    true = float(np.exp(np.log(hidden).mean())) / DEG_PER_RAD
    patient = patient_of(STUDY, shipped(1), "p01")
    fit = FilmFit(patient, SD)
    known = fit.fit(usual_population(len(turned))).known
    patient = replace(
        patient, read=replace(patient.read, traction={"neutral": 0.0, "traction": 300.0})
    )
    found = stiffness_by_pulls(patient, fit, known, DEPTH_MM)
    assert isinstance(found, AbsoluteStiffness)
    assert abs(np.log(found.mean[0] / true)) < 0.25
