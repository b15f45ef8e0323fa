"""Job: one motion of one person by one approach."""

import time
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.marks import read_mark
from spinepipe.motion.passive import PassiveLaw
from spinepipe.motion.points import marker_places
from spinepipe.motion.skeleton import PELVIS
from spinepipe.motion.terms import Loads, Markers
from spinepipe.status import Status
from spinepipe.studies.tracking.approaches import Found, asked_of, found_by, learns, seen_in
from spinepipe.studies.tracking.drawn import drawn_rows
from spinepipe.studies.tracking.laws import law_in
from spinepipe.studies.tracking.marks import marks_of
from spinepipe.studies.tracking.moved import IN_ORDER
from spinepipe.studies.tracking.persons import Person, person_of, ratio_sets
from spinepipe.studies.tracking.settings import Approach, Tracking
from spinepipe.studies.tracking.tables import DRAWN, FITS, MARKER_OFF, TRACKED
from spinepipe.tables import from_rows, read_frame, write
from spinepipe.units import BORDER_PER_SI, COORDINATE_COLUMNS, DEG_PER_RAD, MM_PER_M

Row = dict[str, Any]

_TURNS = slice(3, 6)


def run(
    root: str,
    study: str,
    specimen: str,
    trial: str,
    approach: Approach,
    tracked: str,
    fits: str,
    drawn: str,
    law: list[str],
) -> None:
    """Write a file for each table; law : the calibration that is taken over, if any."""
    settings, cohort = study_of_kind(Tracking, root, study)
    person = person_of(cohort, specimen, cohort.folder)
    taken = [law_in(read_frame(path), person.passive) for path in law]
    learnt = taken[0] if taken else None
    known: Row = {"specimen": specimen, "trial": trial, "approach": approach}
    begun = time.process_time()
    found, message = _found(settings, person, trial, approach, learnt, ratio_sets(cohort))
    spent = time.process_time() - begun
    others = [*marks_of(cohort, specimen), *(read_mark(path) for path in law)]
    made_by = provenance("track", settings, cohort, [specimen], others)
    motion = list(motion_rows(found)) if found else []
    fit = fit_row(settings, found, spent) if found else failed_row(message)
    write(from_rows(TRACKED, [known | row for row in motion]), tracked, made_by)
    write(from_rows(FITS, [known | fit]), fits, made_by)
    shown = approach in settings.drawn_approaches
    scenes = drawn_rows(found.watched, found.q) if found and shown else ()
    write(from_rows(DRAWN, [known | row for row in scenes]), drawn, made_by)


def _found(
    settings: Tracking,
    person: Person,
    trial: str,
    approach: Approach,
    learnt: PassiveLaw | None,
    ratios: Mapping[str, Any],
) -> tuple[Found | None, str]:
    """The motion, or why there is none."""
    if learns(approach) and learnt is None:
        return None, "no passive elements were calibrated"
    chosen = next(one for one in person.trials if one.name == trial)
    ask = asked_of(settings, person, approach, learnt)
    try:
        found = found_by(approach, ask, seen_in(settings, person, chosen), ratios)
    except (ValueError, np.linalg.LinAlgError) as why:
        return None, str(why)
    if not np.isfinite(found.q).all():
        return None, "coordinates are not finite"
    return found, ""


def motion_rows(found: Found) -> Iterator[Row]:
    """All joints and the pelvis at all nodes."""
    times = found.watched.grid.times_s
    shown = found.q * BORDER_PER_SI
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


def fit_row(settings: Tracking, found: Found, spent_s: float) -> Row:
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


def deviations(found: Found) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """(S,) mm of model from measured markers, of all that were seen."""
    seen = found.watched
    at = marker_places(seen.skeleton, seen.markers, found.q)
    apart = MM_PER_M * np.linalg.norm(at - seen.places, axis=-1)
    return np.asarray(apart[seen.weight > 0.0], dtype=float)


def _farthest(found: Found) -> str:
    seen = found.watched
    at = marker_places(seen.skeleton, seen.markers, found.q)
    apart = np.linalg.norm(at - seen.places, axis=-1) * (seen.weight > 0.0)
    frame, marker = np.unravel_index(int(np.argmax(apart)), apart.shape)
    time_s = seen.grid.times_s[frame]
    return f"{seen.markers.names[marker]} is farthest off, at {time_s:.2f} s"


def _loads(found: Found) -> tuple[float | None, float | None]:
    """What loads cost, and their RMS in N m; None where nobody asks for them."""
    if not found.ask.loads:
        return None, None
    loads = Loads.of(found.watched, found.ask)
    active = loads.active(found.ask.passive, found.motion)
    cost = _squares(loads.residuals(found.ask.passive, found.motion))
    return cost, _rms(active[:, :, _TURNS])


def _squares(residuals: np.ndarray[Any, np.dtype[np.float64]]) -> float:
    return float(np.sum(residuals**2))


def _rms(values: np.ndarray[Any, np.dtype[np.float64]]) -> float:
    return float(np.sqrt(np.mean(values**2)))
