"""Spines from bending films: one patient in every model, and the study as users run it."""

from collections.abc import Iterator
from pathlib import Path

from benchmarks.study import ROOT, Run, copy_of_project, run_workflow
from benchmarks.timing import cpu_seconds
from spinepipe.cohort import Cohort
from spinepipe.studies.read import check
from spinepipe.studies.registry import files_of
from spinepipe.studies.scoliosis.film_fit import FilmFit
from spinepipe.studies.scoliosis.films import ERECT, weights
from spinepipe.studies.scoliosis.personal import WAYS, PersonalModel, patient_of
from spinepipe.studies.scoliosis.population import usual_population
from spinepipe.studies.scoliosis.settings import Scoliosis

STUDY = "ais18_scoliosis"


def patients() -> dict[str, float]:
    """CPU seconds per patient, by model: personalised and held in four positions."""
    study, cohort = check(ROOT, STUDY)
    assert isinstance(study, Scoliosis)
    return {
        model: cpu_seconds(lambda m=model: _everyone(study, cohort, m), 1, warm_up=0).median
        / len(cohort.specimen_names)
        for model in study.models
    }


def _everyone(study: Scoliosis, cohort: Cohort, model: str) -> None:
    sd = weights(study, cohort)
    for name in cohort.specimen_names:
        patient = patient_of(study, cohort, name)
        personal: PersonalModel
        if model in WAYS:
            personal = WAYS[model](patient, study)
        else:
            fit = FilmFit(patient, sd)
            personal = fit.personal(fit.fit(usual_population(len(cohort.joint_names))))
        spine = patient.fixed_end(personal.model)
        for position, film in patient.read.films.items():
            if position != ERECT:
                spine.at(film.top)


def runs() -> Iterator[Run]:
    """The shipped study in a copy of the project: cold, again, and after losing one patient."""
    wanted = files_of(*check(ROOT, STUDY)).results()
    with copy_of_project() as folder:
        yield run_workflow("study of films, cold", folder, wanted, "60 s")
        yield run_workflow("nothing to do", folder, wanted, "")
        lost = f"results/{STUDY}/jobs/laws/specimen-p01/model-tangent.parquet"
        Path(folder, lost).unlink()
        yield run_workflow("one patient lost in one model", folder, [lost, *wanted], "")
