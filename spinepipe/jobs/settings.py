"""Which settings of a study a job depends on: what else is changed leaves its results alone."""

from typing import Any

from spinepipe.studies import Study

_SOLVING = {"loading", "settle_time_s"}
_GROUPING = {"best_models", "block"}
_MODEL = {"tests", "load_point_shift_mm", "stiffness", "damping", "calibration"}
_BOOTSTRAPS = {"start_bootstrap", "damping_bootstrap", "dynamic"}
_JUDGING = {"success", "significance"}
_PARTS = {"methods", "landmark_precision", *_BOOTSTRAPS, *_JUDGING}
"""What was added to the sampled poses: their fits and simulations do not hang on it."""


def _whole(*names: str) -> dict[str, Any]:
    return dict.fromkeys(names, True)


IRRELEVANT: dict[str, dict[str, Any]] = {
    "sample_landmarks": _whole(*_MODEL, *_SOLVING, *_GROUPING, *_PARTS),
    "build_models": _whole("calibration", *_SOLVING, *_GROUPING, *_PARTS),
    "calibrate": _whole("poses", *_SOLVING, *_GROUPING, *_PARTS),
    "rank": _whole("block", *(_PARTS - {"success"})),
    "simulate": _whole("poses", "calibration", "stiffness", *_GROUPING, *_PARTS),
    "bootstrap": {
        **_whole("poses", "landmark_sd_mm", "loading", "methods", "landmark_precision"),
        **_whole(*_GROUPING, *_JUDGING),
        "start_bootstrap": {"loadings"},
        "damping_bootstrap": {"loadings"},
    },
    "landmark_errors": {
        **_whole("poses", "landmark_sd_mm", "damping", "methods", *_SOLVING, *_GROUPING),
        **_whole(*_BOOTSTRAPS, *_JUDGING),
        "landmark_precision": {"sd_mm", "translation_limit_mm", "rotation_limit_deg", "share"},
    },
    "fit_by_method": {
        **_whole("poses", "loading", "landmark_precision", "significance"),
        **_whole(*_GROUPING, *_BOOTSTRAPS),
        "methods": {"poses"},
        "success": {"failed_when", "outlier_times_start"},
    },
    "success_by_method": _whole("block", *(_PARTS - {"success"})),
    "landmark_precision": _whole("block", *(_PARTS - {"landmark_precision"})),
    "success": _whole("block", *(_PARTS - {"success"})),
    "counts": _whole("block", *(_PARTS - {"success"})),
    "summary": _whole("block", *(_PARTS - {"success"})),
    "statistics": _whole("block", *(_PARTS - {"success"})),
    "two_factor": _whole("block", *(_PARTS - {"success"})),
    "agreement": _whole("block", *(_PARTS - {"success"})),
    "against_gould_2024a": _whole("block"),
    "figures": _whole("block"),
    "report": {},  # it prints all of them
}
"""Settings that a job does not look at. All others count, so one added later is not overlooked."""


def relevant_settings(job: str, study: Study) -> dict[str, Any]:
    """The settings of a study that a job depends on, as plain values."""
    return study.model_dump(mode="json", exclude=IRRELEVANT[job])
