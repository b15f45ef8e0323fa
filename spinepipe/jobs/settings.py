"""Which settings of a study a job depends on: what else is changed leaves its results alone."""

from typing import Any

from spinepipe.studies import Study

_SOLVING = {"loading", "settle_time_s"}
_GROUPING = {"best_models", "block"}
IRRELEVANT = {
    "sample_landmarks": {
        *("tests", "load_point_shift_mm", "stiffness", "damping", "calibration"),
        *(_SOLVING | _GROUPING),
    },
    "build_models": {"calibration", *(_SOLVING | _GROUPING)},
    "calibrate": {"poses", *(_SOLVING | _GROUPING)},
    "rank": {"block"},
    "simulate": {"poses", "calibration", "stiffness", *_GROUPING},
    "figures": {"block"},
}
"""Settings that a job does not look at. All others count, so one added later is not overlooked."""


def relevant_settings(job: str, study: Study) -> dict[str, Any]:
    """The settings of a study that a job depends on, as plain values."""
    return study.model_dump(mode="json", exclude=IRRELEVANT[job])
