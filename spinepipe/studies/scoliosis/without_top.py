"""Job: errors on left-out films whose uppermost vertebra is not given either.

Given the top, a model has only to fill in what lies between. Here it is told nothing of the film
but its posture: it is pulled at the top as others' films of this posture are, with the median of
the pulls that the same law needs for them (`pulled`), and nothing holds it aside. What a spine that
stays as on the erect film would miss stands beside it.
"""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.model import SpineModel
from spinepipe.studies.scoliosis.films import weights
from spinepipe.studies.scoliosis.fixed_end_spine import FixedEndSpine
from spinepipe.studies.scoliosis.personal import ERRORS, Patient, model_of_law, patient_of
from spinepipe.studies.scoliosis.pulled import pull_of, pulled_spine, under_pull
from spinepipe.studies.scoliosis.settings import Scoliosis
from spinepipe.studies.scoliosis.tables import ACCURACY_WITHOUT_TOP, MEASURES
from spinepipe.studies.scoliosis.tangent_laws import EndRotations
from spinepipe.tables import from_rows, read_frames, write
from spinepipe.units import DEG_PER_RAD

_MEASURED = dict(zip(ERRORS, ("rotation", "place", "tilt"), strict=True))


def run(root: str, study: str, tables: list[str], output: str) -> None:
    """Write ``accuracy_without_top.parquet``."""
    settings, cohort = study_of_kind(Scoliosis, root, study)
    read = read_frames(tables)
    rows = list(without_top_rows(settings, cohort, read["laws"], read["positions"]))
    made_by = provenance("accuracy_without_top", settings, cohort)
    write(from_rows(ACCURACY_WITHOUT_TOP, rows), output, made_by)


def without_top_rows(
    settings: Scoliosis, cohort: Cohort, laws: pd.DataFrame, positions: pd.DataFrame
) -> Iterator[dict[str, Any]]:
    """Rows by left-out position, measure and model."""
    patients = {name: patient_of(settings, cohort, name) for name in cohort.specimen_names}
    sd, depth = weights(settings, cohort), settings.profile.endplate_depth_mm
    given = positions.set_index(["model", "position", "specimen"])
    left_out = positions.loc[~positions["fitted"].astype(bool), "position"].unique()
    for model, of_model in laws.groupby("model", sort=False):
        spines = {
            str(name): pulled_spine(patients[str(name)], _model(patients[str(name)], own), depth)
            for name, own in of_model.groupby("specimen", sort=False)
        }
        for position in left_out:
            there = {n: s for n, s in spines.items() if position in patients[n].read.films}
            pulls = {}
            for name, spine in there.items():
                read = patients[name].read
                own = pull_of(spine, read.films[position], sd, read.compared(position))
                if own is not None:
                    pulls[name] = own.newton
            rows = [
                errors | {f"{one}_given": given.loc[(model, position, name), one] for one in ERRORS}
                for name, errors in _errors(position, patients, there, pulls)
            ]
            names = [*ERRORS, *(f"{one}_{how}" for one in ERRORS for how in ("given", "unmoved"))]
            errors = pd.DataFrame(rows, columns=names).astype(float).dropna()
            found = np.sqrt((errors**2).mean())
            for one, measure in _MEASURED.items():
                told = found[[one, f"{one}_given", f"{one}_unmoved"]].to_numpy(float)
                cells = told.tolist() if len(errors) else [None] * 3
                yield {
                    "position": position,
                    "measure": measure,
                    "model": model,
                    "unit": MEASURES[measure][0],
                    "n_patients": len(errors),
                    **dict(zip(("rmse", "rmse_given_top", "rmse_unmoved"), cells, strict=True)),
                    "pull_n": float(np.median(list(pulls.values()))) if pulls else None,
                }


def _model(patient: Patient, own: pd.DataFrame) -> SpineModel:
    """The model of a patient's rows of `laws`."""
    own = own.set_index("joint").loc[list(patient.chain.joints)]
    lower, upper = (
        own[name].to_numpy(float) / DEG_PER_RAD for name in ("lower_end_deg", "upper_end_deg")
    )
    ends = EndRotations(lower, upper) if np.isfinite(lower).all() else None
    return model_of_law(patient, own["at_rest_nm_per_rad"].to_numpy(float), ends)


def _errors(
    position: str,
    patients: Mapping[str, Patient],
    spines: Mapping[str, FixedEndSpine],
    pulls: Mapping[str, float],
) -> Iterator[tuple[str, dict[str, float | None]]]:
    """Names and errors of spines that have a pose under the median of the others' pulls."""
    for name, spine in spines.items():
        others = [pull for other, pull in pulls.items() if other != name]
        pulled = under_pull(spine, float(np.median(others))) if others else None
        erect = under_pull(spine, 0.0)
        if pulled is not None and erect is not None:
            stays = patients[name].errors(position, erect)
            unmoved = {f"{one}_unmoved": stays[one] for one in ERRORS}
            yield name, patients[name].errors(position, pulled) | unmoved
