"""The kind joint_pose_sensitivity: how much of the answer hangs on where joints were placed."""

from collections.abc import Mapping
from typing import Any

from spinepipe.comparison.papers import hangs_on
from spinepipe.schema import all_declared
from spinepipe.studies.free import settle_calibration
from spinepipe.studies.joint_pose_sensitivity.checks import check_joint_pose_sensitivity
from spinepipe.studies.joint_pose_sensitivity.files import JointPoseFiles
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.studies.kind import Job, Kind, ignoring

# Settings by what they decide. The parts were added to the sampled poses, whose fits and
# simulations do not hang on them.
_SOLVING = ("loading", "settle_time_s")
_GROUPING = ("best_models", "block")
_MODEL = ("tests", "load_point_shift_mm", "stiffness", "damping", "calibration")
_BOOTSTRAPS = ("start_bootstrap", "damping_bootstrap", "dynamic")
_JUDGING = ("success", "significance")
_PARTS = (
    *("methods", "landmark_precision", "load_point", "posterior"),
    *(*_BOOTSTRAPS, *_JUDGING),
)


def _parts_but(name: str) -> tuple[str, ...]:
    return tuple(part for part in _PARTS if part != name)


def _landmarks(expected: Any, place: Mapping[str, str]) -> list[str]:
    """The mark of the landmarks that joint frames are made of."""
    return [expected.of_job("sample_landmarks", place)]


def _frames(expected: Any, place: Mapping[str, str]) -> list[str]:
    """The mark of the joint frames of a specimen."""
    return [expected.of_job("build_models", place)]


def _simulated(expected: Any, place: Mapping[str, str]) -> list[str]:
    """The marks of joint frames and calibrations; of the best sets also what decides of them."""
    blocks = expected.files.blocks_of_calibrations(place["specimen"])
    read = [expected.of_part("calibrations", one) for one in blocks]
    own = place["stiffness"] == "calibrated"
    rule = [] if own else [expected.study.success.model_dump_json()]
    return [*_frames(expected, place), *read, *rule]


_SAMPLED = (
    Job(
        "start_model",
        ignores=ignoring("calibration", *_SOLVING, *_GROUPING, *_PARTS),
        header_alone=True,
        makes=("model.yaml",),
    ),
    Job(
        "sample_landmarks",
        "poses:sample",
        ignores=ignoring(*_MODEL, *_SOLVING, *_GROUPING, *_PARTS),
    ),
    Job(
        "build_models",
        "poses:build",
        ignores=ignoring("calibration", *_SOLVING, *_GROUPING, *_PARTS),
        also=_landmarks,
    ),
    Job(
        "calibrate",
        in_blocks="calibrations",
        ignores=ignoring("poses", *_SOLVING, *_GROUPING, *_PARTS),
        also=_frames,
    ),
    Job(
        "rank",
        reads=("calibrations",),
        makes=("best.json",),
        ignores=ignoring("block", *_parts_but("success")),
    ),
    Job(
        "simulate",
        in_blocks="simulations",
        ignores=ignoring("poses", "calibration", "stiffness", *_GROUPING, *_PARTS),
        also=_simulated,
    ),
)
_ADDED = (
    Job(
        "bootstrap",
        many=True,
        ignores=ignoring(
            *("poses", "landmark_sd_mm", "loading", "methods", "landmark_precision"),
            *("load_point", "posterior", *_GROUPING, *_JUDGING),
            start_bootstrap={"loadings"},
            damping_bootstrap={"loadings"},
        ),
    ),
    Job(
        "landmark_errors",
        ignores=ignoring(
            *("poses", "landmark_sd_mm", *_SOLVING, *_GROUPING),
            *_parts_but("landmark_precision"),
            landmark_precision={"sd_mm", "translation_limit_mm", "rotation_limit_deg", "share"},
        ),
    ),
    Job(
        "fit_by_method",
        ignores=ignoring(
            *("poses", "loading", "landmark_precision", "load_point", "posterior"),
            *("significance", *_GROUPING, *_BOOTSTRAPS),
            methods={"poses"},
            success={"failed_when", "outlier_times_start"},
        ),
        also=_frames,
    ),
    Job(
        "spread_over_landmark_sd",
        "spread",
        ignores=ignoring(
            *("landmark_sd_mm", *_MODEL, *_SOLVING, *_GROUPING),
            *_parts_but("landmark_precision"),
            landmark_precision={"poses", "translation_limit_mm", "rotation_limit_deg", "share"},
        ),
    ),
    Job(
        "over_load_point",
        ignores=ignoring(
            *("poses", "landmark_sd_mm", *_SOLVING, *_GROUPING),
            *_parts_but("load_point"),
            load_point={"anterior_sd_mm", "superior_sd_mm"},
        ),
    ),
    Job(
        "posterior",
        ignores=ignoring(*_SOLVING, *_GROUPING, *_parts_but("posterior")),
        also=_frames,
    ),
)


def _analysis(
    name: str,
    reads: tuple[str, ...],
    writes: tuple[str, ...] = (),
    at: str = "",
    looks_at: str = "success",
) -> Job:
    """A job that makes tables of tables; by default the one of its own name."""
    ignores = ignoring("block", *_parts_but(looks_at))
    return Job(name, at, reads, writes or (name,), ignores)


_FITTED = ("calibrations", "simulations", "poses", "success")
_ANALYSES = (
    _analysis("success", ("calibrations",), at="success:success"),
    _analysis("counts", ("success", "bootstrap"), at="success:counts"),
    _analysis("summary", (*_FITTED, "bootstrap", "best.json")),
    _analysis("statistics", (*_FITTED, "best.json"), at="significance"),
    _analysis("agreement", ("simulations", "success")),
    _analysis(
        "two_factor",
        ("simulations", "poses", "success", "best.json"),
        ("variance_shares", "importance"),
    ),
    _analysis("success_by_method", ("method_fits",), at="success:success_by_method"),
    _analysis(
        "landmark_precision",
        ("precision_errors",),
        ("landmark_precision", "required_precision"),
        looks_at="landmark_precision",
    ),
    _analysis("load_point_effect", ("stiffness_over_load_point",), looks_at="load_point"),
    Job(
        "against_gould_2024a",
        reads=(
            *("summary", "counts", "statistics", "importance", "variance_shares"),
            *("success_by_method", "bootstrap", "required_precision", "landmark_precision"),
            *("landmarks", "calibrations", "simulations", "success"),
            *("spread_over_landmark_sd", "stiffness_over_load_point"),
        ),
        writes=("against_gould_2024a",),
        ignores=ignoring("block"),
        also=hangs_on("gould_2024a"),
    ),
)

KIND = Kind(
    question="How stiff are the joints?",
    cost="500 poses, a fit of each",
    settings=JointPoseSensitivity,
    files=JointPoseFiles,
    checks=(check_joint_pose_sensitivity,),
    tables=all_declared(__file__),
    jobs=(*_SAMPLED, *_ADDED, *_ANALYSES),
    ignored_by_figures=("block",),
    makes_models="start_model",
    exports="export:exported",
    settled=settle_calibration,
    told_by_check="identifiability_preview:told",
)
