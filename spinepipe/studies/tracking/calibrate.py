"""Job: passive elements of one person, from motions of one kind or of two kinds together."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.motion.joint_tables import SIDES
from spinepipe.motion.passive import SHAPE, PassiveElements, PassiveLaw
from spinepipe.motion.skeleton import JOINTS
from spinepipe.motion.trajectory import solve
from spinepipe.status import Status
from spinepipe.studies.recordings import motion_digests
from spinepipe.studies.tracking.approaches import (
    calibration_objective,
    first_guess,
    sample_at_nodes,
)
from spinepipe.studies.tracking.persons import person_of
from spinepipe.studies.tracking.settings import Tracking
from spinepipe.studies.tracking.tables import STIFFNESS
from spinepipe.studies.tracking.trials import trials_of_law
from spinepipe.tables import from_rows, write
from spinepipe.units import COORDINATES, ROTATIONS

LOW_MOMENT_NM = 0.1
"""Wang 2021 reads stiffness where this moment resists, and at the joint's high moment."""


def run(root: str, study: str, specimen: str, law: str, output: str) -> None:
    """Write rows of `stiffness`; law : name of the calibration."""
    settings, cohort = study_of_kind(Tracking, root, study)
    person = person_of(cohort, specimen, cohort.folder, settings.scaling)
    names = trials_of_law(cohort, specimen, law)
    seen = [sample_at_nodes(settings, person, one) for one in person.trials if one.name in names]
    made_by = provenance(
        "calibrate", settings, cohort, [specimen], motion_digests(cohort, specimen)
    )
    try:
        ask = calibration_objective(settings, person)
        ready = [first_guess(ask, one) for one in seen]
        solved = solve(ask, [one for one, _ in ready], [start for _, start in ready])
    except (ValueError, np.linalg.LinAlgError) as why:
        rows = list(failed_rows(str(why)))
    else:
        assert solved.law is not None
        motions = [
            one.grid.at_nodes(coefficients)[0][:, 1:]
            for one, coefficients in zip(seen, solved.coefficients, strict=True)
        ]
        # (17, 6, 2) N and N m, largest load of each side in motions (F, 17, 6)
        loads = np.concatenate([solved.law.forces(q) for q in motions])
        high = np.stack([np.maximum(one, 0.0).max(axis=0) for one in (loads, -loads)], -1)
        rows = list(stiffness_rows(solved.law, person.passive, high, solved.status, solved.message))
    known = {"specimen": specimen, "law": law}
    write(from_rows(STIFFNESS, [row | known for row in rows]), output, made_by)


def stiffness_rows(
    law: PassiveLaw, generic: PassiveElements, high: Array, status: Status, message: str
) -> Iterator[dict[str, Any]]:
    """Of all joints, coordinates and sides.

    Parameters
    ----------
    high : (17, 6, 2) N and N m, largest passive load of each side in the motions.
    """
    # generic laws at the same loads: at both ends of their range, and as they are
    lower, usual, upper = (
        PassiveLaw(generic.a * factor, generic.b).stiffness_at(high)
        for factor in (generic.lower, np.ones(SHAPE), generic.upper)
    )
    low, own = law.stiffness_at(np.full(SHAPE, LOW_MOMENT_NM)), law.stiffness_at(high)
    for place in np.ndindex(*SHAPE):
        turns = COORDINATES[place[1]] in ROTATIONS
        loaded = turns and high[place] > 0.0
        yield {
            **_element(place),
            "a": float(law.a[place]),
            "b": float(law.b[place]),
            "at_low_moment": float(low[place]) if turns else None,
            "at_high_moment": float(own[place]) if loaded else None,
            "high_moment_nm": float(high[place]) if loaded else None,
            "generic_low": float(lower[place]) if loaded else None,
            "generic_high": float(upper[place]) if loaded else None,
            "inside_generic": bool(lower[place] <= own[place] <= upper[place]) if loaded else None,
            "ratio_to_generic": float(own[place] / usual[place]) if loaded else None,
            "status": status,
            "message": message,
        }


def failed_rows(message: str) -> Iterator[dict[str, Any]]:
    """Rows of a calibration that ended without passive elements."""
    blank: dict[str, Any] = dict.fromkeys(STIFFNESS.names)
    blank |= {"status": Status.NOT_CONVERGED, "message": message}
    for place in np.ndindex(*SHAPE):
        yield blank | _element(place)


def _element(place: tuple[int, ...]) -> dict[str, str]:
    joint, coordinate, side = place
    return {"joint": JOINTS[joint], "coordinate": COORDINATES[coordinate], "side": SIDES[side]}
