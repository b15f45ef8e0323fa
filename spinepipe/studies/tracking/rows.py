"""Rows of a motion that an approach found: how it moved, how the fit ended and what it left."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from spinepipe.motion.points import marker_places
from spinepipe.motion.residual_terms import Markers, MuscleDemand
from spinepipe.motion.skeleton import PELVIS
from spinepipe.status import Status
from spinepipe.studies.tracking.approaches import ApproachMotion
from spinepipe.studies.tracking.reload_motions import IN_ORDER
from spinepipe.studies.tracking.settings import Tracking
from spinepipe.studies.tracking.tables import FITS, MARKER_OFF
from spinepipe.units import COORDINATE_COLUMNS, DEG_PER_RAD, DISPLAY_PER_SI, MM_PER_M

Row = dict[str, Any]

_TURNS = slice(3, 6)


def motion_rows(found: ApproachMotion) -> Iterator[Row]:
    """All joints and the pelvis at all nodes."""
    times = found.watched.grid.times_s
    shown = found.q * DISPLAY_PER_SI
    for frame, now in enumerate(shown):
        for name, values in zip(IN_ORDER, now.tolist(), strict=True):
            yield {
                "frame": frame,
                "joint": name,
                "time_s": float(times[frame]),
                **dict(zip(COORDINATE_COLUMNS, values, strict=True)),
            }


def failed_row(message: str) -> Row:
    """Of a fit that found no posture."""
    blank = dict.fromkeys(column.name for column in FITS.columns)
    return blank | {"status": Status.NOT_CONVERGED, "message": message, "frames": 0}


def fit_row(settings: Tracking, found: ApproachMotion, spent_s: float) -> Row:
    """How a fit ended, and what it left."""
    apart = deviations(found)
    largest = float(apart.max())
    beyond = largest > settings.largest_deviation_mm
    status = MARKER_OFF if beyond and found.status.usable else found.status
    moved = found.watched.grid.intervals > 0
    fast = found.motion[2][:, PELVIS + 1 :, _TURNS]
    cost, load = _loads(found)
    return {
        "status": status,
        "message": f"{_farthest(found)}; {found.message}".strip("; ") if beyond else found.message,
        "iterations": found.steps,
        "unknowns": found.unknowns,
        "marker_rmse_mm": float(np.sqrt(np.mean(apart**2))),
        "largest_deviation_mm": largest,
        "markers_cost": _squares(Markers(found.watched, found.ask).residuals(found.q)),
        "loads_cost": cost,
        "acceleration_rms_deg_per_s2": DEG_PER_RAD * _rms(fast) if moved else None,
        "load_rms_nm": load,
        "cpu_s": spent_s,
        "frames": len(found.q),
    }


def deviations(found: ApproachMotion) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """(S,) mm of model from measured markers, of all that were seen."""
    seen = found.watched
    at = marker_places(seen.skeleton, seen.markers, found.q)
    apart = MM_PER_M * np.linalg.norm(at - seen.places, axis=-1)
    return np.asarray(apart[seen.weight > 0.0], dtype=float)


def _farthest(found: ApproachMotion) -> str:
    seen = found.watched
    at = marker_places(seen.skeleton, seen.markers, found.q)
    apart = np.linalg.norm(at - seen.places, axis=-1) * (seen.weight > 0.0)
    frame, marker = np.unravel_index(int(np.argmax(apart)), apart.shape)
    time_s = seen.grid.times_s[frame]
    return f"{seen.markers.names[marker]} is farthest off, at {time_s:.2f} s"


def _loads(found: ApproachMotion) -> tuple[float | None, float | None]:
    """What loads cost, and their RMS in N m; None where nobody asks for them."""
    if not found.ask.loads:
        return None, None
    loads = MuscleDemand.of(found.watched, found.ask)
    active = loads.active(found.ask.passive, found.motion)
    cost = _squares(loads.residuals(found.ask.passive, found.motion))
    return cost, _rms(active[:, :, _TURNS])


def _squares(residuals: np.ndarray[Any, np.dtype[np.float64]]) -> float:
    return float(np.sum(residuals**2))


def _rms(values: np.ndarray[Any, np.dtype[np.float64]]) -> float:
    return float(np.sqrt(np.mean(values**2)))
