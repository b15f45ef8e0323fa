"""Does each joint move the way the load pushes it? A flipped sign in the measurement shows."""

from typing import Any

import numpy as np

from spinepipe.calibrate.zeroing import whitened
from spinepipe.cohort import Cohort
from spinepipe.effects.contract import Array
from spinepipe.jobs.cohort_stiffness.predict import predicted
from spinepipe.jobs.cohort_stiffness.tested import SpecimenTests, TestedCycle, driven
from spinepipe.units import COORDINATES

CERTAIN = 3.0
"""Standard errors from zero at which a slope has a sign."""

FLIPPED = (
    "moves against the load in all readings together: the sign of this coordinate is most likely "
    "flipped in motion.csv (or the vertebrae are exchanged)"
)
UNDECIDED = "moves too little to tell with or against the load"
ONE_READING = "one reading does not tell how sure it is"


def sign_rows(
    cohort: Cohort, specimen: str, tests: SpecimenTests, k: Array
) -> list[dict[str, Any]]:
    """One row per test and joint with readings in the loaded coordinate.

    A passive joint cannot give energy: along the coordinate that the main moment drives, measured
    and expected motion have the same sign whatever the stiffness.

    Parameters
    ----------
    k : (J, 6) published stiffness, SI, for the expected motion.
    """
    ended = predicted(cohort, specimen, tests.frames, tests.tested, k)
    rows = []
    for test in tests.tests:
        loaded = driven([one for one in tests.tested if one.case.test == test])
        if loaded is None:
            continue
        here = [
            (one, motion)
            for one, (motion, _, _) in zip(tests.tested, ended, strict=True)
            if one.case.test == test and one.loaded == loaded
        ]
        place = COORDINATES.index(loaded)
        read = [_independent(one, motion, cohort.zeroed_at_step_0) for one, motion in here]
        for joint, name in enumerate(cohort.joint_names):
            measured, expected = (
                np.concatenate([side[:, joint, place] for side in sides])
                for sides in zip(*read, strict=True)
            )
            known = np.isfinite(measured)
            if known.any():
                found = _judged(measured[known], expected[known])
                rows.append(
                    {"test": test, "joint": name, "coordinate": COORDINATES[place], **found}
                )
    return rows


def _independent(one: TestedCycle, motion: Array | None, zeroed: bool) -> tuple[Array, Array]:
    """Measured and expected motion (T, J, 6), NaN where there is none.

    Zeroed readings share the error of step 0, which would pass for motion: both are whitened.
    """
    read = np.isfinite(one.measured)
    expected = np.full(read.shape, np.nan) if motion is None else motion
    if not zeroed:
        return one.measured, expected
    measured = np.where(read, whitened(one.measured, read), np.nan)
    return measured, expected if motion is None else whitened(motion, read)


def _judged(measured: Array, expected: Array) -> dict[str, Any]:
    """Slope of measured on expected motion through zero, and what it tells."""
    n = len(measured)
    slope, error, told = None, None, UNDECIDED if n > 1 else ONE_READING
    if not np.isfinite(expected).all():
        told = "no pose was found with the published stiffness: nothing to compare with"
    elif expected @ expected > 0.0:
        slope = float(measured @ expected / (expected @ expected))
        if n > 1:
            left = measured - slope * expected
            error = float(np.sqrt(left @ left / (n - 1) / (expected @ expected)))
    verdict = "undecided"
    if slope is not None and error is not None and abs(slope) > CERTAIN * error:
        verdict, told = ("as_expected", "") if slope > 0.0 else ("flipped", FLIPPED)
    return {
        "readings": n,
        "measured_over_expected": slope,
        "standard_error": error,
        "verdict": verdict,
        "message": told,
    }
