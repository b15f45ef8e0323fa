"""Which settings of a study a job depends on: what else is changed leaves its results alone."""

from typing import Any

from spinepipe.studies.study import Study

_SOLVING = {"loading", "settle_time_s"}
_GROUPING = {"best_models", "block"}
_MODEL = {"tests", "load_point_shift_mm", "stiffness", "damping", "calibration"}
_BOOTSTRAPS = {"start_bootstrap", "damping_bootstrap", "dynamic"}
_JUDGING = {"success", "significance"}
_PARTS = {"methods", "landmark_precision", *_BOOTSTRAPS, *_JUDGING}
"""What was added to the sampled poses: their fits and simulations do not hang on it."""


_HELD_OUT = {"representations", "cross_validation", "significance"}
_FITTING = {"seed", "steps", "cost", "measurement_sd", "bound_factor", "starts"}


_MOVING = {"virtual_tests", "tests", "rows", "damping"}
_SETS = {"stiffness", "level_stiffness", "stiffness_sets", "stiffness_spread"}
_FRAMES = {"poses", "pose_sd"}
"""Settings of range of motion: what is computed, of which stiffness sets, in which frames."""


_RESPONDING = {"specimens", "tests", "steps", "stiffness", "level_stiffness", "damping", "loading"}
_ANALYSING = {"bootstraps", "confidence", "indices", "most_failed", "outputs"}
"""Settings of global sensitivity: what the samples are done with, and what is made of them."""


def _whole(*names: str) -> dict[str, Any]:
    return dict.fromkeys(names, True)


IRRELEVANT: dict[str, dict[str, Any]] = {
    "sample_landmarks": _whole(*_MODEL, *_SOLVING, *_GROUPING, *_PARTS),
    "build_models": _whole("calibration", *_SOLVING, *_GROUPING, *_PARTS),
    "start_model": _whole("calibration", *_SOLVING, *_GROUPING, *_PARTS),
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
    "cohort_stiffness.fit": _whole(*_HELD_OUT),
    "cohort_stiffness.literature": _whole(*_HELD_OUT, *_FITTING),
    "cohort_stiffness.left_out": _whole(*_HELD_OUT),
    "cohort_stiffness.pool": _whole(*_HELD_OUT, "seed", "starts", "level_stiffness"),
    "cohort_stiffness.mae": {},
    "cohort_stiffness.ranking": {},
    "cohort_stiffness.statistics": {},
    "cohort_stiffness.findings": {},
    "cohort_stiffness.against_gould_2024b": {},
    "cohort_stiffness.figures": {},
    "cohort_stiffness.report": {},
    "figures": _whole("block"),
    "report": {},  # it prints all of them
    "range_of_motion.sample_frames": _whole(*_MOVING, *_SETS),
    "range_of_motion.draw_stiffness": _whole(*_MOVING, *_FRAMES),
    "range_of_motion.simulate": _whole("seed", *_SETS, *_FRAMES),
    "range_of_motion.summary": {},
    "range_of_motion.variance": {},
    "range_of_motion.figures": {},
    "range_of_motion.report": {},
    "global_sensitivity.design": _whole(*_RESPONDING, *_ANALYSING),
    "global_sensitivity.respond": _whole(*_ANALYSING, "calibration", "seed"),
    "global_sensitivity.calibrate": _whole(*_ANALYSING, "steps"),
    "global_sensitivity.analyse": {},
    "global_sensitivity.figures": {},
    "global_sensitivity.report": {},
    "discrepancy.search": {},  # every setting says something about the search
    "discrepancy.figures": {},
    "discrepancy.report": {},
}
"""Settings that a job does not look at. All others count, so one added later is not overlooked."""


def relevant_settings(job: str, study: Study) -> dict[str, Any]:
    """The settings of a study that a job depends on, as plain values."""
    return study.model_dump(mode="json", exclude=IRRELEVANT[job])
