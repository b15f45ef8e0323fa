"""Motion of a specimen under all its tests with a given stiffness, and its errors."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spinepipe.cohort import Cohort
from spinepipe.cohort.measured import MeasuredCycle
from spinepipe.effects.contract import Array
from spinepipe.frames import Pose
from spinepipe.model import LoadCase, RefusedModel, ScopedEffect, SpineModel
from spinepipe.statics.batched import Stack, readings
from spinepipe.status import Status
from spinepipe.studies.cohort_stiffness.problem import SpecimenTests, driven, stiff_model
from spinepipe.units import COORDINATE_UNITS, COORDINATES, from_si, subtract_baseline

Row = dict[str, Any]


def predict_motion(
    cohort: Cohort,
    specimen: str,
    frames: tuple[Pose, ...],
    tested: Sequence[MeasuredCycle],
    k: Array,
    others: tuple[ScopedEffect, ...] = (),
) -> list[tuple[Array | None, Status, str]]:
    """(T, J, 6) m and rad of each case as it was measured, or why there is none.

    All cases are solved together, from the neutral pose.

    Parameters
    ----------
    k : (J, 6) stiffness, SI. others : effects besides the bushings.
    """
    try:
        model = stiff_model(cohort, specimen, frames, k, others)
    except RefusedModel as error:
        return [(None, Status.REFUSED, str(error)) for _ in tested]
    return motions(model, [one.case for one in tested], cohort.zeroed_at_step_0)


def motions(
    model: SpineModel, cases: Sequence[LoadCase], zeroed: bool
) -> list[tuple[Array | None, Status, str]]:
    """(T, J, 6) m and rad of each case as it would be measured, or why there is none.

    Parameters
    ----------
    zeroed : whether motion counts from step 0.
    """
    stack = Stack.of([model], [(0, case) for case in cases])
    poses = stack.solve()
    seen = readings(stack, poses.q)
    found: list[tuple[Array | None, Status, str]] = []
    for first, end in pairwise(stack.first.tolist()):
        # A case has motion where all of its steps have a stable pose.
        lost = next((at for at in range(first, end) if not Status(poses.status[at]).usable), None)
        if lost is not None:
            found.append((None, Status(poses.status[lost]), poses.messages[lost]))
        else:
            motion = subtract_baseline(seen[first:end], zeroed)
            found.append((motion, Status.CONVERGED, ""))
    return found


def error_rows(
    cohort: Cohort,
    specimen: str,
    tests: SpecimenTests,
    k: Array,
    others: tuple[ScopedEffect, ...] = (),
) -> list[Row]:
    """Errors by test, joint and measured coordinate, all cycles together; see table ``errors``."""
    ended = predict_motion(cohort, specimen, tests.frames, tests.tested, k, others)
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
        numbers, measured = _numbers(here, lost=bool(failed))
        for joint, place in np.argwhere(measured).tolist():
            coordinate = COORDINATES[place]
            found = {name: values[joint][place] for name, values in numbers.items()}
            rows.append(
                {
                    "test": test,
                    "joint": cohort.joint_names[joint],
                    "coordinate": coordinate,
                    "loaded": loaded == coordinate,
                    "unit": COORDINATE_UNITS[coordinate],
                    **{name: None if np.isnan(one) else one for name, one in found.items()},
                    "readings": int(found["readings"]),
                    "status": status.value,
                    "message": message,
                }
            )
    return rows


def _numbers(
    here: Sequence[tuple[MeasuredCycle, tuple[Array | None, Status, str]]], lost: bool
) -> tuple[dict[str, list[list[float]]], NDArray[np.bool_]]:
    """Mean errors (J, 6) over steps and cycles in mm and deg, NaN for none; what was measured."""
    measured = np.concatenate([from_si(one.readings) for one, _ in here])
    firsts = np.cumsum([0, *(len(one.readings) for one, _ in here[:-1])])
    peaks = firsts + [one.peak for one, _ in here]
    errors = np.full(measured.shape, np.nan)
    if not lost:
        errors = np.concatenate([from_si(end[0]) for _, end in here if end[0] is not None])
        errors = errors - measured
    read = np.isfinite(measured)
    found = {
        "measured": _mean(np.abs(measured), read),
        "measured_peak": _mean(measured[peaks], read[peaks]),
        "bias": _mean(errors, read),
        "mae": _mean(np.abs(errors), read),
        "rmse": np.sqrt(_mean(errors**2, read)),
        "peak_error": _mean(errors[peaks], read[peaks]),
    }
    numbers = {"readings": read.sum(axis=0).astype(float), **found}
    return {name: values.tolist() for name, values in numbers.items()}, read.any(axis=0)


def _mean(values: Array, read: NDArray[np.bool_]) -> Array:
    """(J, 6) over what was read of (N, J, 6); NaN where nothing was."""
    count = read.sum(axis=0)
    total = np.where(read, values, 0.0).sum(axis=0)
    found: Array = np.where(count > 0, total / np.maximum(count, 1), np.nan)
    return found
