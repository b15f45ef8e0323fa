"""Patients as models: mirrors, what films do not tell, poses held where the films have the top.

Would catch a model that is not mirrored by mirrored films, a top that is not where the film has
it, and size of stiffness that seeps into poses.
"""

from dataclasses import replace

import numpy as np
import pytest
from scoliosis_cases import STUDY, mirrored, shipped
from sweeps import sweep

from spinepipe.studies.scoliosis.film_fit import READINGS, FilmFit
from spinepipe.studies.scoliosis.films import ERECT, LEFT, RIGHT, PatientFilms, film_sd
from spinepipe.studies.scoliosis.fixed_end_spine import geometry, with_laws
from spinepipe.studies.scoliosis.personal import (
    WAYS,
    Patient,
    geometric_mean,
    patient_of,
    tangent,
)
from spinepipe.studies.scoliosis.population import usual_population
from spinepipe.studies.scoliosis.settings import Scoliosis
from spinepipe.studies.scoliosis.tangent_laws import Pairs


@pytest.fixture(scope="module")
def patient() -> Patient:
    return patient_of(STUDY, shipped(1), "p01")


def turned_over(patient: Patient) -> Patient:
    """The same patient on films that are turned over."""
    exchanged = {RIGHT: LEFT, LEFT: RIGHT}
    films = {exchanged.get(n, n): mirrored(film) for n, film in patient.read.films.items()}
    read: PatientFilms = replace(patient.read, films=films)
    pairs = patient.pairs
    return Patient(
        patient.name,
        read,
        geometry(patient.name, patient.chain.joints, films[ERECT], STUDY.profile),
        patient.size,
        patient.springs,
        Pairs(-pairs.left, -pairs.right, pairs.arm_left, pairs.arm_right, pairs.apex),
        patient.level,
    )


@sweep("model", list(WAYS))
def test_a_mirrored_patient_has_mirrored_poses(patient: Patient, model: str) -> None:
    other = turned_over(patient)
    for position, opposite in ((RIGHT, LEFT), ("neutral", "neutral")):
        one, two = (
            who.fixed_end(WAYS[model](who, STUDY).model).at(who.read.films[film].top)
            for who, film in ((patient, position), (other, opposite))
        )
        assert one.result.status == two.result.status == "converged"
        # the two forces of a tangent law are searched for, to a hundred-millionth
        np.testing.assert_allclose(two.r, -one.r, rtol=0, atol=1e-6)
        np.testing.assert_allclose(two.film.up, one.film.up, rtol=0, atol=1e-7)


@sweep("model", list(WAYS))
def test_the_uppermost_vertebra_is_where_the_film_has_it(patient: Patient, model: str) -> None:
    spine = patient.fixed_end(WAYS[model](patient, STUDY).model)
    for film in patient.read.films.values():
        posed = spine.at(film.top)
        assert posed.result.status == "converged"
        np.testing.assert_allclose(posed.film.top, film.top, rtol=0, atol=1e-12)
        assert not posed.result.q.reshape(-1, 6)[:, :3].any()
        assert posed.r.sum() == pytest.approx(film.turned.sum() - patient.erect.turned.sum())


def test_the_erect_film_takes_no_push(patient: Patient) -> None:
    spine = patient.fixed_end(tangent(patient, STUDY).model)
    posed = spine.at(patient.erect.top)
    assert np.abs(posed.result.pushes).max() < 1e-9
    assert np.abs(posed.r).max() < 1e-12


def test_films_do_not_tell_how_stiff_a_spine_is_in_all(patient: Patient) -> None:
    """All lateral laws ten times as stiff, the other rotations too: no vertebra moves."""
    personal = tangent(patient, STUDY)
    laws, springs = personal.model.effects[1].values.copy(), personal.model.effects[0].values.copy()
    laws[:, 0] *= 10.0
    stiffer = with_laws(patient.chain, 10.0 * springs, laws)
    for position in (RIGHT, "traction"):
        top = patient.read.films[position].top
        one, two = (patient.fixed_end(m).at(top) for m in (personal.model, stiffer))
        np.testing.assert_allclose(two.r, one.r, rtol=0, atol=1e-6)


def test_a_stated_mean_stiffness_is_the_mean() -> None:
    scale = {"of": "mean_stiffness", "mean_stiffness_nm_per_rad": 80.0}
    study = Scoliosis.model_validate({**STUDY.model_dump(), "scale": scale})
    patient = patient_of(study, shipped(1), "p01")
    for way in WAYS.values():
        assert geometric_mean(way(patient, study).at_rest) == pytest.approx(80.0)


def test_models_say_how_much_they_take_from_the_films(patient: Patient) -> None:
    free = {name: way(patient, STUDY).free for name, way in WAYS.items()}
    count = patient.chain.n_joints
    assert free == {
        "tangent": 3 * count + 1,
        "linear_per_segment": count + 1,
        "linear_regions": len(patient.curves) - 1,
        "uniform": 0,
    }


def test_a_mirrored_patient_has_the_mirrored_fit(patient: Patient) -> None:
    """The fit to films: ratios alike, ends exchanged, as many optima."""
    population = usual_population(patient.chain.n_joints)
    one, other = (FilmFit(p, film_sd(0.5, 0.4, 0.7, 0.3)) for p in (patient, turned_over(patient)))
    fits = one.fit(population), other.fit(population)
    assert fits[0].n_optima == fits[1].n_optima
    assert fits[0].cost == pytest.approx(fits[1].cost, rel=1e-3)
    ratio, lower, upper = fits[0].unknowns[:-READINGS].reshape(3, -1)
    turned = np.concatenate([ratio, upper, lower])
    np.testing.assert_allclose(fits[1].unknowns[:-READINGS], turned, rtol=0, atol=0.01)
