"""Motion of a specimen under all its tests with a given stiffness, and its errors."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from spinepipe.cohort import Cohort
from spinepipe.cohort.measured import MeasuredCycle
from spinepipe.effects.contract import Array
from spinepipe.frames import Pose
from spinepipe.model import RefusedModel, ScopedEffect
from spinepipe.statics import System, follow, observe
from spinepipe.status import Status
from spinepipe.studies.cohort_stiffness.problem import SpecimenTests, driven, stiff_model
from spinepipe.units import BORDER_PER_SI, COORDINATE_UNITS, COORDINATES, less_step_0
from spinepipe.world import Chain

Row = dict[str, Any]


def predicted(
    cohort: Cohort,
    specimen: str,
    frames: tuple[Pose, ...],
    tested: Sequence[MeasuredCycle],
    k: Array,
    others: tuple[ScopedEffect, ...] = (),
) -> list[tuple[Array | None, Status, str]]:
    """(T, J, 6) m and rad of each case as it was measured, or why there is none.

    Parameters
    ----------
    k : (J, 6) stiffness, SI. others : effects besides the bushings.
    """
    try:
        model = stiff_model(cohort, specimen, frames, k, others)
        chain = Chain(model)
        systems = [System(chain, model, one.case) for one in tested]
    except RefusedModel as error:
        return [(None, Status.REFUSED, str(error)) for _ in tested]
    return [_motion(system, cohort.zeroed_at_step_0) for system in systems]


def _motion(system: System, zeroed: bool) -> tuple[Array | None, Status, str]:
    steps = follow(system)
    for step in steps:
        if not step.usable:
            return None, step.equilibrium.status, step.equilibrium.message
    q = np.stack([observe(system, step.equilibrium.q, k) for k, step in enumerate(steps)])
    return less_step_0(q, zeroed), Status.CONVERGED, ""


def error_rows(
    cohort: Cohort,
    specimen: str,
    tests: SpecimenTests,
    k: Array,
    others: tuple[ScopedEffect, ...] = (),
) -> list[Row]:
    """Errors by test, joint and measured coordinate, all cycles together; see table ``errors``."""
    ended = predicted(cohort, specimen, tests.frames, tests.tested, k, others)
    rows = []
    for test in tests.tests:
        here = [
            (one, end)
            for one, end in zip(tests.tested, ended, strict=True)
            if one.case.test == test
        ]
        loaded = driven([one for one, _ in here])
        failed = [end for _, end in here if end[0] is None]
        status, message = (failed[0][1], failed[0][2]) if failed else (Status.CONVERGED, "")
        for joint, name in enumerate(cohort.joint_names):
            for place, coordinate in enumerate(COORDINATES):
                numbers = _numbers(here, joint, place, lost=bool(failed))
                if numbers is not None:
                    rows.append(
                        {
                            "test": test,
                            "joint": name,
                            "coordinate": coordinate,
                            "loaded": loaded == coordinate,
                            "unit": COORDINATE_UNITS[coordinate],
                            **numbers,
                            "status": status.value,
                            "message": message,
                        }
                    )
    return rows


def _numbers(
    here: Sequence[tuple[MeasuredCycle, tuple[Array | None, Status, str]]],
    joint: int,
    place: int,
    lost: bool,
) -> Row | None:
    """Mean errors of one joint and coordinate over steps and cycles; None where not measured."""
    border = BORDER_PER_SI[place]
    measured = [one.readings[:, joint, place] * border for one, _ in here]
    read = [np.isfinite(values) for values in measured]
    if not any(known.any() for known in read):
        return None
    known_peak = np.array([known[one.peak] for known, (one, _) in zip(read, here, strict=True)])
    sizes = np.concatenate(
        [np.abs(values[known]) for values, known in zip(measured, read, strict=True)]
    )
    at_peak = np.array([values[one.peak] for values, (one, _) in zip(measured, here, strict=True)])
    row: Row = {
        "readings": len(sizes),
        "measured": float(sizes.mean()),
        "measured_peak": float(at_peak[known_peak].mean()) if known_peak.any() else None,
    }
    if lost:
        return row | dict.fromkeys(("bias", "mae", "rmse", "peak_error"))
    errors = [
        _error(end[0], joint, place, values)
        for (_, end), values in zip(here, measured, strict=True)
    ]
    every = np.concatenate([error[known] for error, known in zip(errors, read, strict=True)])
    peaks = np.array([error[one.peak] for error, (one, _) in zip(errors, here, strict=True)])
    return row | {
        "bias": float(every.mean()),
        "mae": float(np.abs(every).mean()),
        "rmse": float(np.sqrt(np.mean(every**2))),
        "peak_error": float(peaks[known_peak].mean()) if known_peak.any() else None,
    }


def _error(motion: Array | None, joint: int, place: int, measured: Array) -> Array:
    assert motion is not None
    error: Array = motion[:, joint, place] * BORDER_PER_SI[place] - measured
    return error
