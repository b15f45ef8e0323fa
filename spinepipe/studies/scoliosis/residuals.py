"""By how much a model's pose misses a film."""

import numpy as np

from spinepipe.status import PrescribedStatus
from spinepipe.studies.scoliosis.fixed_end_spine import Posed
from spinepipe.studies.scoliosis.personal import Patient
from spinepipe.units import DEG_PER_RAD, MM_PER_M

POSED = (PrescribedStatus.CONVERGED, PrescribedStatus.UNREACHABLE)
"""How a solve may end whose pose is held against the film."""

MISSES = ("rotation_rmse_deg", "place_rmse_mm", "tilt_rmse_deg")


def miss_of(patient: Patient, position: str, posed: Posed) -> dict[str, float | None]:
    """Root mean square errors of a pose, all segments and vertebrae; None without a pose."""
    if posed.held.status not in POSED:
        return dict.fromkeys(MISSES)
    film = patient.read.films[position]
    away = np.hypot(posed.film.right - film.right, posed.film.up - film.up)[1:]
    errors = (
        DEG_PER_RAD * (posed.r - patient.read.turned(position)),
        MM_PER_M * away,
        DEG_PER_RAD * (posed.film.tilt - film.tilt)[1:],
    )
    sizes = (float(np.sqrt(np.mean(one**2))) for one in errors)
    return dict(zip(MISSES, sizes, strict=True))
