"""Job: one motion of one person by one approach, and what the animation shows of it."""

import time
from collections.abc import Iterator, Mapping

import numpy as np
import pandas as pd

from spinepipe.effects.contract import Array
from spinepipe.frames import zxy_angles
from spinepipe.jobs.digest import mark_of, provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.motion.joint_tables import SIDES
from spinepipe.motion.objective import SampledTrial
from spinepipe.motion.passive import PassiveElements, PassiveLaw
from spinepipe.motion.points import marker_places
from spinepipe.motion.skeleton import BODIES, JOINTS, body_poses
from spinepipe.studies.recordings import motion_digests
from spinepipe.studies.tracking.approaches import (
    ApproachMotion,
    find_motion,
    objective_of,
    sample_at_nodes,
)
from spinepipe.studies.tracking.fit_rows import Row, failed_row, fit_row
from spinepipe.studies.tracking.persons import TrackedPerson, person_of, ratios_of
from spinepipe.studies.tracking.settings import LEARNT, OWN, Approach, Tracking
from spinepipe.studies.tracking.tables import DRAWN, FITS, TRACKED
from spinepipe.studies.tracking.tracked_motions import IN_ORDER
from spinepipe.tables import from_rows, read_frame, write
from spinepipe.units import (
    COORDINATE_COLUMNS,
    COORDINATES,
    DEG_PER_RAD,
    DISPLAY_PER_SI,
    MM_PER_M,
    ROTATIONS,
)

MOST_FRAMES = 40
"""Of the animation; more are thinned out evenly."""

_PLACE = ("x_mm", "y_mm", "z_mm")
_TURN = tuple(f"{name}_deg" for name in ROTATIONS)


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
    person = person_of(cohort, specimen, cohort.folder, settings.scaling)
    taken = [law_in(read_frame(path), person.passive) for path in law]
    learnt = taken[0] if taken else None
    known: Row = {"specimen": specimen, "trial": trial, "approach": approach}
    begun = time.process_time()
    found, message = _motion(settings, person, trial, approach, learnt, ratios_of(cohort))
    spent = time.process_time() - begun
    others = [*motion_digests(cohort, specimen), *(mark_of(path) for path in law)]
    made_by = provenance("track", settings, cohort, [specimen], others)
    motion = list(motion_rows(found)) if found else []
    fit = fit_row(settings, found, spent) if found else failed_row(message)
    write(from_rows(TRACKED, [known | row for row in motion]), tracked, made_by)
    write(from_rows(FITS, [fit | known]), fits, made_by)
    shown = approach in settings.drawn_approaches
    scenes = drawn_rows(found.watched, found.q) if found and shown else ()
    write(from_rows(DRAWN, [known | row for row in scenes]), drawn, made_by)


def law_in(rows: pd.DataFrame, generic: PassiveElements) -> PassiveLaw | None:
    """Passive elements of rows of table `stiffness`; None where calibration ended without."""
    if rows["a"].isna().any():
        return None
    a, b = generic.a.copy(), generic.b.copy()
    at = (
        rows["joint"].map(JOINTS.index).to_numpy(int),
        rows["coordinate"].map(COORDINATES.index).to_numpy(int),
        rows["side"].map(SIDES.index).to_numpy(int),
    )
    a[at], b[at] = rows["a"].to_numpy(float), rows["b"].to_numpy(float)
    return PassiveLaw(a, b)


def _motion(
    settings: Tracking,
    person: TrackedPerson,
    trial: str,
    approach: Approach,
    learnt: PassiveLaw | None,
    ratios: Mapping[str, Array],
) -> tuple[ApproachMotion | None, str]:
    """The motion, or why there is none."""
    if learnt is None and (approach in LEARNT or approach == OWN):
        return None, "no passive elements were calibrated"
    chosen = next(one for one in person.trials if one.name == trial)
    ask = objective_of(settings, person, approach, learnt)
    try:
        found = find_motion(approach, ask, sample_at_nodes(settings, person, chosen), ratios)
    except (ValueError, np.linalg.LinAlgError) as why:
        return None, str(why)
    if not np.isfinite(found.q).all():
        return None, "coordinates are not finite"
    return found, ""


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


def drawn_rows(watched: SampledTrial, q: Array) -> Iterator[Row]:
    """Bodies, markers as measured and markers of the model, of postures (F, 18, 6) m and rad."""
    frames = np.unique(np.linspace(0, len(q) - 1, min(len(q), MOST_FRAMES)).round().astype(int))
    turns, origins = body_poses(watched.skeleton, q[frames])
    modelled = marker_places(watched.skeleton, watched.markers, q[frames])
    still = dict.fromkeys(_TURN)

    def at(place: Array) -> dict[str, float]:
        return dict(zip(_PLACE, (MM_PER_M * place).tolist(), strict=True))

    for k, frame in enumerate(frames.tolist()):
        now = {"frame": frame, "time_s": float(watched.grid.times_s[frame])}
        for body, turn, place in zip(BODIES, turns[k], origins[k], strict=True):
            angles = DEG_PER_RAD * zxy_angles(turn)
            turned = dict(zip(_TURN, angles.tolist(), strict=True))
            yield now | {"kind": "body", "name": body, **at(place), **turned}
        for m, name in enumerate(watched.markers.names):
            yield now | {"kind": "modelled", "name": name, **at(modelled[k, m]), **still}
            if watched.weight[frame, m] > 0.0:
                measured = at(watched.places[frame, m])
                yield now | {"kind": "measured", "name": name, **measured, **still}
