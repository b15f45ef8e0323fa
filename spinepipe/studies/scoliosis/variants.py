"""Job: the published tangent of one patient with another enlargement, or stiffer in all.

Both ask what a choice that films do not settle does to the poses. Held at the top and with lateral
springs alone, stiffness in all changes nothing; in space the other rotations have a size of their
own, and how much it matters is told here.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np

from spinepipe.cohort import Cohort
from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.studies.scoliosis.films import ERECT, LEFT, RIGHT
from spinepipe.studies.scoliosis.fixed_end_spine import FixedEndSpine, SpinePose, with_laws
from spinepipe.studies.scoliosis.personal import POSED, Patient, patient_of, tangent
from spinepipe.studies.scoliosis.settings import Scoliosis
from spinepipe.studies.scoliosis.tables import SINGULAR, VARIANTS
from spinepipe.studies.scoliosis.tangent_laws import characterise, ends_of
from spinepipe.tables import from_rows, write
from spinepipe.units import DEG_PER_RAD

Row = dict[str, Any]

ON_THE_ENDS = "without enlargement the bending films lie on the ends, where loads are infinite"


def run(root: str, study: str, specimen: str, output: str) -> None:
    """Write the variants of one patient."""
    settings, cohort = study_of_kind(Scoliosis, root, study)
    rows = list(variant_rows(settings, cohort, specimen))
    write(from_rows(VARIANTS, rows), output, provenance("variants", settings, cohort, [specimen]))


def variant_rows(settings: Scoliosis, cohort: Cohort, specimen: str) -> Iterator[Row]:
    """A row for each choice, value and position."""
    patient = patient_of(settings, cohort, specimen)
    studied = tangent(patient, settings).model
    spine = patient.fixed_end(studied)
    # what the study has is what every variant is told against
    usual = {name: spine.at(film.top) for name, film in _others(patient)}
    for percent in settings.variants.enlargement_percent:
        known: Row = {"specimen": specimen, "varied": "enlargement", "value": percent}
        if percent == 0.0:
            nothing = ("law_rmse_deg", "rotation_rmse_deg", "place_rmse_mm", "moved_deg")
            for name, _ in _others(patient):
                place = {"position": name, "fitted": name in (RIGHT, LEFT)}
                ended = {"status": SINGULAR, "message": ON_THE_ENDS}
                yield {**known, **place, **dict.fromkeys(nothing), **ended}
            continue
        other = settings.model_copy(update={"enlargement": 1.0 + percent / 100.0})
        # of the laws' rotations under the two forces, all segments and both films
        ends = ends_of(patient.pairs, other.enlargement)
        errors = characterise(patient.pairs, ends, other.scale.apical_moment_nm).errors
        known["law_rmse_deg"] = DEG_PER_RAD * float(np.sqrt(np.mean(errors**2)))
        model = tangent(patient, other).model
        yield from (known | row for row in _poses(patient, spine.with_model(model), usual))
    for factor in settings.variants.scale:
        known = {"specimen": specimen, "varied": "scale", "value": factor, "law_rmse_deg": None}
        stretched = studied.effects[1].values * np.array([factor, 1.0, 1.0])
        stiffer = spine.with_model(with_laws(patient.chain, patient.springs, stretched))
        yield from (known | row for row in _poses(patient, stiffer, usual))


def _others(patient: Patient) -> Iterator[tuple[str, Any]]:
    return ((name, film) for name, film in patient.read.films.items() if name != ERECT)


def _poses(patient: Patient, spine: FixedEndSpine, usual: dict[str, SpinePose]) -> Iterator[Row]:
    """A row for each film."""
    for position, film in _others(patient):
        posed = spine.at(film.top)
        there = posed.result.status in POSED and usual[position].result.status in POSED
        moved = np.abs(posed.r - usual[position].r).max()
        errors = patient.errors(position, posed)
        yield {
            "position": position,
            "fitted": position in (RIGHT, LEFT),
            "rotation_rmse_deg": errors["rotation_rmse_deg"],
            "place_rmse_mm": errors["place_rmse_mm"],
            "moved_deg": DEG_PER_RAD * float(moved) if there else None,
            "status": posed.result.status.value,
            "message": posed.result.message,
        }
