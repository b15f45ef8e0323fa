"""Rows of table `fits`: how the fit of an approach ended, and what it left."""

from typing import Any

import numpy as np

from spinepipe.motion.points import marker_places
from spinepipe.motion.residual_terms import Markers, MuscleDemand
from spinepipe.motion.skeleton import PELVIS
from spinepipe.status import Status
from spinepipe.studies.tracking.approaches import ApproachMotion
from spinepipe.studies.tracking.settings import Tracking
from spinepipe.studies.tracking.tables import FITS, MARKER_OFF
from spinepipe.units import DEG_PER_RAD, MM_PER_M

Row = dict[str, Any]

_TURNS = slice(3, 6)


def failed_row(message: str) -> Row:
    """Of a fit that found no posture."""
    blank = dict.fromkeys(column.name for column in FITS.columns)
    return blank | {"status": Status.NOT_CONVERGED, "message": message, "frames": 0}


def fit_row(settings: Tracking, found: ApproachMotion, spent_s: float) -> Row:
    """How a fit ended, and what it left."""
    seen = found.watched
    # model from measured markers, of all that were seen
    at = marker_places(seen.skeleton, seen.markers, found.q)
    away = np.linalg.norm(at - seen.places, axis=-1)
    apart = (MM_PER_M * away)[seen.weight > 0.0]
    largest = float(apart.max())
    message: str = found.message
    status: str = found.status
    if largest > settings.largest_deviation_mm:
        frame, marker = np.unravel_index(int(np.argmax(away * (seen.weight > 0.0))), away.shape)
        when = f"at {seen.grid.times_s[frame]:.2f} s"
        farthest = f"{seen.markers.names[marker]} is farthest off, {when}"
        message = f"{farthest}; {message}".strip("; ")
        status = MARKER_OFF if found.status.usable else found.status
    # what muscles have to do, where anybody asks for it
    loads_cost = load_nm = None
    if found.ask.loads:
        loads = MuscleDemand.of(seen, found.ask)
        active = loads.active(found.ask.passive, found.motion)
        loads_cost = float(np.sum(loads.residuals(found.ask.passive, found.motion) ** 2))
        load_nm = _rms(active[:, :, _TURNS])
    fast = found.motion[2][:, PELVIS + 1 :, _TURNS]
    return {
        "status": status,
        "message": message,
        "iterations": found.steps,
        "unknowns": found.unknowns,
        "marker_rmse_mm": _rms(apart),
        "largest_deviation_mm": largest,
        "markers_cost": float(np.sum(Markers(seen, found.ask).residuals(found.q) ** 2)),
        "loads_cost": loads_cost,
        "acceleration_rms_deg_per_s2": DEG_PER_RAD * _rms(fast) if seen.grid.intervals else None,
        "load_rms_nm": load_nm,
        "cpu_s": spent_s,
        "frames": len(found.q),
    }


def _rms(values: np.ndarray[Any, np.dtype[np.float64]]) -> float:
    return float(np.sqrt(np.mean(values**2)))
