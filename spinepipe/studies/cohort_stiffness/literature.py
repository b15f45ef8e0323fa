"""Job: what the published stiffness predicts of one specimen, and whether it moves that way."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from scipy import stats

from spinepipe.calibration.problem import whitened
from spinepipe.cohort import Cohort
from spinepipe.cohort.measured import MeasuredCycle
from spinepipe.effects.contract import Array
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.model import ScopedEffect
from spinepipe.plausibility.score import implausible, unit_of
from spinepipe.status import Status, joined
from spinepipe.studies.cohort_stiffness.fit_rows import stiffness_rows
from spinepipe.studies.cohort_stiffness.predict import error_rows, predict_motion
from spinepipe.studies.cohort_stiffness.problem import (
    SpecimenTests,
    base_effects,
    base_of,
    driven,
    origin,
    specimen_tests,
    start_stiffness,
)
from spinepipe.studies.cohort_stiffness.representations import PUBLISHED, named
from spinepipe.studies.cohort_stiffness.settings import NOTHING, CohortStiffness, has_levels
from spinepipe.studies.cohort_stiffness.tables import ERRORS, SIGN_CHECKS, STIFFNESS
from spinepipe.tables import from_rows, write
from spinepipe.units import COORDINATES

Row = dict[str, Any]

Reading = tuple[int, Array, Array]
"""Number of a cycle, and measured and expected motion in it."""

FALSE_ALARM = 0.00135
"""Chance that a joint that does not move seems to move against the load: three SDs to one side."""

FLIPPED = (
    "moves against the load in {where}: the sign of this coordinate is most likely flipped in "
    "motion.csv (or the vertebrae are exchanged), or motion is strongly coupled"
)

ALL_FLIPPED = "so do all joints of this test: look at the sign of its moment in loads.csv too"
UNDECIDED = "moves too little to tell with or against the load"
ONE_READING = "one reading does not tell how sure it is"
NO_POSE = "no pose was found with the published stiffness: nothing to compare with"


def run(
    root: str, study: str, specimen: str, stiffness: str, errors: str, sign_checks: str
) -> None:
    """Write published stiffness, its errors, and the sign checks of the specimen."""
    settings, cohort = study_of_kind(CohortStiffness, root, study)
    tests = specimen_tests(settings, cohort, specimen)
    others = base_effects(base_of(root, settings), cohort, specimen)
    values: list[Row] = []
    seen: list[Row] = []
    levels = has_levels(settings, cohort.joint_names)
    for name in (one for one in PUBLISHED if levels or not named(one).by_level):
        k = start_stiffness(settings, cohort, name)
        common = {"representation": name, "fitted_to": NOTHING, "source": "literature"}
        none = np.zeros(k.shape, dtype=int)
        rows = stiffness_rows(
            cohort.joint_names, settings.free, k, np.full(k.shape, np.inf), 0.0, None, none
        )
        ended = {"status": Status.CONVERGED.value, "message": ""}
        values += [{**row, **common, **ended} for row in rows]
        found = error_rows(cohort, specimen, tests, k, others)
        seen += [{**row, **common, "stage": "literature"} for row in found]
    k = start_stiffness(settings, cohort, PUBLISHED[0])
    signs = sign_rows(cohort, specimen, tests, k, others)
    made = origin("literature", root, settings, cohort, [specimen])
    write(from_rows(STIFFNESS, values, specimen=specimen), stiffness, made)
    write(from_rows(ERRORS, seen, specimen=specimen), errors, made)
    write(from_rows(SIGN_CHECKS, signs, specimen=specimen), sign_checks, made)


def sign_rows(
    cohort: Cohort,
    specimen: str,
    tests: SpecimenTests,
    k: Array,
    others: tuple[ScopedEffect, ...] = (),
) -> list[Row]:
    """One row per test and joint with readings in the loaded coordinate.

    A passive segment cannot give energy: moments times rotations are positive in sum. Along the
    coordinate that the main moment drives a joint then moves with the load too, unless motion is
    strongly coupled, as it may be in axial rotation of inclined joints.

    Parameters
    ----------
    k : (J, 6) published stiffness, SI, for the expected motion; ``others`` act besides it.
    """
    ended = predict_motion(cohort, specimen, tests.frames, tests.tested, k, others)
    rows: list[Row] = []
    for test in tests.tests:
        loaded = driven([one for one in tests.tested if one.case.test == test])
        if loaded is None:
            continue
        read = [
            (one.case.cycle, *_independent(one, motion, cohort.zeroed_at_step_0))
            for one, (motion, _, _) in zip(tests.tested, ended, strict=True)
            if one.case.test == test and one.loaded == loaded
        ]
        found = list(_of_joints(cohort.joint_names, read, COORDINATES.index(loaded)))
        if all(row["verdict"] == "flipped" for row in found):
            found = [{**row, "message": f"{row['message']}; {ALL_FLIPPED}"} for row in found]
        # rows of a wrong size with what may be behind it
        slopes = [row["measured_over_expected"] for row in found if row["verdict"] != "undecided"]
        unit = unit_of([slope for slope in slopes if slope is not None], loaded)
        why = f"as {unit} would give" if unit else "a joint that is fused or cut, or a wrong unit"
        for row in found:
            if row["verdict"] == "implausible":
                row["message"] = joined(row["message"], why)
            rows.append({"test": test, "coordinate": loaded, **row})
    return rows


def _independent(one: MeasuredCycle, motion: Array | None, zeroed: bool) -> tuple[Array, Array]:
    """Measured and expected motion (T, J, 6), NaN where there is none.

    Zeroed readings share the error of step 0, which would pass for motion: both are whitened.
    """
    read = np.isfinite(one.readings)
    expected = np.full(read.shape, np.nan) if motion is None else motion
    if not zeroed:
        return one.readings, expected
    measured = np.where(read, whitened(one.readings, read), np.nan)
    return measured, expected if motion is None else whitened(motion, read)


def _of_joints(joints: Sequence[str], read: Sequence[Reading], place: int) -> Iterator[Row]:
    """What each joint with readings (T, J, 6) of a test tells."""
    for joint, name in enumerate(joints):
        cycles = []
        for number, *motions in read:
            measured, expected = (motion[:, joint, place] for motion in motions)
            known = np.isfinite(measured)
            if known.any():
                cycles.append((number, measured[known], expected[known]))
        if cycles:
            yield {"joint": name, **_judged(cycles)}


def _judged(cycles: Sequence[Reading]) -> Row:
    """Slope of measured on expected motion of a joint, and what it tells.

    Each cycle is judged too: in all together, one that is flipped cancels another.
    """
    measured, expected = (np.concatenate(values) for values in list(zip(*cycles, strict=True))[1:])
    slope, error = _slope(measured, expected)
    certain = _sign(measured, expected)
    against = [number for number, *readings in cycles if _sign(*readings) < 0]
    verdict, told = "as_expected", ""
    if certain < 0 or against:
        where = "all readings together"
        if len(against) not in (0, len(cycles)):
            where = f"cycle{'s' if len(against) > 1 else ''} {', '.join(map(str, against))}"
        verdict, told = "flipped", FLIPPED.format(where=where)
    elif certain == 0:
        verdict, told = "undecided", UNDECIDED if len(measured) > 1 else ONE_READING
        told = told if np.isfinite(expected).all() else NO_POSE
    elif size := implausible(slope):
        verdict, told = "implausible", size
    return {
        "readings": len(measured),
        "measured_over_expected": slope,
        "standard_error": error,
        "verdict": verdict,
        "message": told,
    }


def _slope(measured: Array, expected: Array) -> tuple[float | None, float | None]:
    """Slope through zero and its standard error, None where there is none."""
    # Least squares through zero: a joint without load has not moved.
    n, size = len(measured), float(expected @ expected)
    if not np.isfinite(size) or size <= 0.0:
        return None, None
    slope = float(measured @ expected / size)
    left = measured - slope * expected
    return slope, float(np.sqrt(left @ left / (n - 1) / size)) if n > 1 else None


def _sign(measured: Array, expected: Array) -> int:
    """Sign of the slope, 0 where it is not certain (Student's t, one-sided)."""
    slope, error = _slope(measured, expected)
    if slope is None or error is None:
        return 0
    # t test of a slope through zero, of one unknown
    reach = float(stats.t.isf(FALSE_ALARM, len(measured) - 1)) * error
    return int(np.sign(slope)) if abs(slope) > reach else 0
