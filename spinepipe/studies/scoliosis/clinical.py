"""Job: what clinics read off films: flexibility, apical translation, coronal balance.

Flexibility is what a film takes off the Cobb angle of the erect film, in percent of it. Apical
translation is the distance of the apex from the line through the centres of a curve's end
vertebrae. Coronal balance is how far the uppermost vertebra stands beside the lowest, across the
line between both on the erect film; films do not show the upright, so the erect one has nought,
and it is told how a film shifts the top since then. With films from the sacrum to C7 this is the
shift of the C7 plumb line.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np

from spinepipe.cohort import Cohort
from spinepipe.effects.contract import Array
from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.studies.scoliosis.curve_angles import curves, region
from spinepipe.studies.scoliosis.films import ERECT, Film, read_films
from spinepipe.studies.scoliosis.settings import Scoliosis
from spinepipe.studies.scoliosis.tables import CLINICAL
from spinepipe.tables import from_rows, write
from spinepipe.units import DEG_PER_RAD, MM_PER_M


def run(root: str, study: str, tables: list[str], output: str) -> None:
    """Write ``clinical.parquet``."""
    settings, cohort = study_of_kind(Scoliosis, root, study)
    rows = list(clinical_rows(cohort))
    write(from_rows(CLINICAL, rows), output, provenance("clinical", settings, cohort))


def clinical_rows(cohort: Cohort) -> Iterator[dict[str, Any]]:
    """A row for each patient, film and curve of the erect film."""
    for patient in cohort.specimen_names:
        read = read_films(cohort, patient)
        films, vertebrae = read.films, read.vertebrae
        erect = films[ERECT]
        for position, film in films.items():
            shifted = aside(_point(film, -1), _point(film, 0), _point(erect, -1))
            for number, curve in enumerate(curves(erect)):
                low, apex, high = (
                    _point(film, at) for at in (curve.lower, curve.apex, curve.upper)
                )
                cobb, before = curve.cobb(film), curve.cobb(erect)
                taken_off = 100.0 * (1.0 - cobb / before)
                ends, points = curve.read(read.compared(position))
                yield {
                    "specimen": patient,
                    "position": position,
                    "curve": number,
                    "region": region(vertebrae[curve.apex]),
                    "side": "right" if curve.side > 0 else "left",
                    "apex_vertebra": vertebrae[curve.apex],
                    "cobb_deg": DEG_PER_RAD * cobb if ends else None,
                    "flexibility_percent": taken_off if ends and position != ERECT else None,
                    "apical_translation_mm": MM_PER_M * curve.side * aside(apex, low, high)
                    if points
                    else None,
                    "coronal_balance_mm": MM_PER_M * shifted,
                }


def _point(film: Film, vertebra: int) -> Array:
    return np.array([film.right[vertebra], film.up[vertebra]])


def aside(point: Array, low: Array, high: Array) -> float:
    """m: how far a point (right, up) lies to the right of the line from a low one to a high one."""
    along, away = high - low, point - low
    return float((away[0] * along[1] - away[1] * along[0]) / np.linalg.norm(along))
