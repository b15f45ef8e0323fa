"""What decides besides study and cohort: recorded motion, and calibrations that are taken over."""

from collections.abc import Mapping
from hashlib import sha256
from typing import Any

from spinepipe.cohort import Cohort
from spinepipe.studies.tracking.approaches_of_trials import calibrated_in
from spinepipe.studies.tracking.persons import motion_files


def marks_of(cohort: Cohort, specimen: str) -> list[str]:
    """Digests of the files of motion of a person."""
    return [sha256(path.read_bytes()).hexdigest() for path in motion_files(cohort, specimen)]


def marks_of_motion(expected: Any, place: Mapping[str, str]) -> list[str]:
    """The same, as declared jobs are asked for it."""
    return marks_of(expected.cohort, place["specimen"])


def marks_of_tracking(expected: Any, place: Mapping[str, str]) -> list[str]:
    """Of motion, and of the calibration that the approach takes over."""
    found = marks_of_motion(expected, place)
    law = calibrated_in(expected.cohort, place["specimen"], place["trial"], place["approach"])
    if law is None:
        return found
    return [*found, expected.of_job("calibrate", {"specimen": place["specimen"], "law": law})]


def marks_of_export(expected: Any, place: Mapping[str, str]) -> list[str]:
    """Of the tracked motion that is written for another program."""
    return [expected.of_job("track", place)]
