"""The kind joint_pose_sensitivity: how much of the answer hangs on where joints were placed."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from spinepipe.cohort import Cohort
from spinepipe.comparison.papers import beside, hangs_on
from spinepipe.schema import all_declared
from spinepipe.studies.free import settle_calibration
from spinepipe.studies.joint_pose_sensitivity.checks import check_joint_pose_sensitivity
from spinepipe.studies.joint_pose_sensitivity.gould_2024a import GOULD_2024A
from spinepipe.studies.joint_pose_sensitivity.ranking import judging
from spinepipe.studies.joint_pose_sensitivity.settings import (
    SETS_PER_BATCH,
    JointPoseSensitivity,
)
from spinepipe.studies.kind import Job, Kind, ignoring
from spinepipe.studies.study_files import MOST_FILES_PER_BLOCK, Figure, StudyFiles

ALWAYS = (
    *("landmarks", "poses", "calibrations", "simulations", "success", "counts", "summary"),
    *("statistics", "agreement", "variance_shares", "importance"),
)
"""Tables that every study has."""

COMPARED = (
    *("summary", "counts", "statistics", "importance", "variance_shares", "success_by_method"),
    *("bootstrap", "required_precision", "landmark_precision", "landmarks"),
    *("calibrations", "simulations", "success"),
    *("spread_over_landmark_sd", "stiffness_over_load_point"),
)
"""Tables that are compared with the paper's."""

METHODS = (
    "exact",
    "forward_run_default_step",
    "forward_run_sane_step",
    "forward_run_raw_units",
)
"""Ways of fitting that are compared."""

_JOBS = {
    "calibrations": "calibrations",
    "simulations": "jobs",
    "bootstrap": "bootstrap",
    "method_fits": "methods",
    "precision_errors": "precision",
}
"""Folder of the job files of each table that is made of them."""

POSTERIOR = ("posterior", "posterior_motion", "pose_weights")
"""Tables that the job of the posterior writes."""

BY_SPECIMEN = (
    *("landmarks", "poses", "spread_over_landmark_sd", "stiffness_over_load_point"),
    *POSTERIOR,
)
"""Tables joined from one file per specimen."""

FULL = (
    *("method_fits", "success_by_method"),
    *("precision_errors", "landmark_precision", "required_precision", "spread_over_landmark_sd"),
    *(*POSTERIOR, "against_gould_2024a"),
)
"""Emulated optimisers, fits under other settings, samplers, and the comparison that needs them."""

OF_JOBS = (*_JOBS, *BY_SPECIMEN)
"""Tables joined from job files."""

_MADE_BY = {
    "landmarks": "sample_landmarks",
    "poses": "build_models",
    "calibrations": "calibrate",
    "simulations": "simulate",
    "bootstrap": "bootstrap",
    "method_fits": "fit_by_method",
    "precision_errors": "landmark_errors",
    "spread_over_landmark_sd": "spread_over_landmark_sd",
    "stiffness_over_load_point": "over_load_point",
    **dict.fromkeys(POSTERIOR, "posterior"),
}
"""The job that writes the files of each of them."""

_FILES_PER_BLOCK = 100


@dataclass(frozen=True)
class Layout(StudyFiles):
    """The result files of one joint-pose study.

    Attributes
    ----------
    rebuilt
        Whether its cohort was rebuilt from a paper whose numbers are at hand.
    """

    joined = OF_JOBS
    full = FULL
    drawings = (
        Figure(
            "stiffness",
            "Calibrated stiffness",
            "figures.stiffness:stiffness_figure",
            ("calibrations",),
        ),
        Figure(
            "errors",
            "Errors of predicted motion",
            "figures.errors:errors_figure",
            ("simulations",),
        ),
        Figure(
            "agreement",
            "Agreement with measured motion",
            "figures.agreement:agreement_figure",
            ("agreement", "simulations", "success"),
        ),
        Figure(
            "joint_pose",
            "Joint frames from uncertain landmarks",
            "figures.joint_pose:joint_pose_figure",
            ("poses",),
        ),
        Figure(
            "pose_against_stiffness",
            "Joint pose against stiffness",
            "figures.pose_against_stiffness:pose_against_stiffness_figure",
            ("variance_shares", "importance"),
        ),
        Figure(
            "posterior",
            "What the data make likely",
            "figures.posterior:posterior_figure",
            ("posterior", "posterior_motion", "pose_weights"),
        ),
        Figure(
            "landmark_precision",
            "Landmark precision needed",
            "figures.landmark_precision:landmark_precision_figure",
            ("landmark_precision", "required_precision"),
        ),
        Figure(
            "bootstrap",
            "Start values, damping and loading",
            "figures.bootstrap:bootstrap_figure",
            ("bootstrap",),
        ),
        Figure(
            "success_by_method",
            "Success by method",
            "figures.success:success_figure",
            ("success_by_method", "method_fits"),
        ),
        Figure(
            "load_point",
            "Where the load acts",
            "figures.load_point:load_point_figure",
            ("stiffness_over_load_point", "load_point_effect"),
        ),
    )

    study: JointPoseSensitivity
    rebuilt: bool

    @classmethod
    def of(cls, study: JointPoseSensitivity, cohort: Cohort) -> "Layout":
        """The files of a study of a cohort."""
        rebuilt = GOULD_2024A.stands_for(cohort.name) and beside()
        return cls(study, cohort.specimen_names, rebuilt)

    @cached_property
    def stiffnesses(self) -> list[str]:
        """What a pose is simulated with: its own calibration and the best sets of all poses."""
        best = range(1, self.study.best_models + 1)
        return ["calibrated", *(f"best{rank:02d}" for rank in best)]

    @cached_property
    def bootstraps(self) -> list[str]:
        """Folders and names of all batches of bootstrap fits of a specimen."""
        parts = {"start": self.study.start_bootstrap, "damping": self.study.damping_bootstrap}
        return [
            f"bootstrap={name}/loading={loading}/batch={number:05d}"
            for name, part in parts.items()
            for loading in part.loadings
            for number in range(-(-part.sets // SETS_PER_BATCH))
        ]

    @property
    def tables(self) -> tuple[str, ...]:
        """The tables that this study has."""
        parts = {
            ("bootstrap",): self._count("bootstrap"),
            ("method_fits", "success_by_method"): self._count("method_fits"),
            ("precision_errors", "landmark_precision", "required_precision"): self._count(
                "precision_errors"
            ),
            POSTERIOR: self.study.posterior.draws,
            ("against_gould_2024a",): int(self.rebuilt),
            ("spread_over_landmark_sd",): self.study.landmark_precision.poses,
            ("stiffness_over_load_point", "load_point_effect"): int(self.study.load_point.asked),
        }
        return (*ALWAYS, *(name for names, count in parts.items() if count for name in names))

    @property
    def made_of_jobs(self) -> tuple[str, ...]:
        """The tables of this study that are made of job files."""
        return tuple(name for name in _JOBS if self._count(name))

    def job_of(self, table: str, path: str) -> str:
        """The job that writes a file of which a table is made."""
        return _MADE_BY[table]

    @property
    def by_specimen(self) -> tuple[str, ...]:
        """What is sampled, and what one job of a specimen makes."""
        return tuple(name for name in BY_SPECIMEN if name in self.tables)

    @property
    def others(self) -> tuple[str, ...]:
        """The ranking and the base model."""
        return "best.json", "model.yaml"

    def blocks(self, table: str) -> list[tuple[str, str]]:
        """All (specimen, block) of a table, blocks numbered `000`, `001`, ..."""
        count = -(-self._count(table) // self._per_block(table))
        return [(name, f"{block:03d}") for name in self.specimens for block in range(count)]

    def job_files(self, table: str, specimen: str, block: str) -> list[str]:
        """The job files of which a block is made."""
        size = self._per_block(table)
        first = int(block) * size
        numbers = range(first, min(first + size, self._count(table)))
        return [self._job_file(table, specimen, number) for number in numbers]

    def blocks_of_calibrations(self, specimen: str) -> list[str]:
        """The blocks that hold the calibrations of a specimen."""
        blocks = (one for one in self.blocks("calibrations") if one[0] == specimen)
        return [self.block_file("calibrations", *one) for one in blocks]

    def _count(self, table: str) -> int:
        """Number of job files of a table per specimen."""
        study = self.study
        return {
            "calibrations": study.poses,
            "simulations": study.poses * len(self.stiffnesses),
            "bootstrap": len(self.bootstraps),
            "method_fits": min(study.methods.poses, study.poses) * len(METHODS),
            "precision_errors": len(study.landmark_precision.sd_mm)
            * (study.landmark_precision.poses > 0),
        }[table]

    def _per_block(self, table: str) -> int:
        """Number of job files that are joined at a time."""
        if table not in ("calibrations", "simulations"):
            return _FILES_PER_BLOCK
        files = 1 if table == "calibrations" else len(self.stiffnesses)
        return files * min(self.study.block, max(1, MOST_FILES_PER_BLOCK // files))

    def _job_file(self, table: str, specimen: str, number: int) -> str:
        return (
            f"{self.folder}/{_JOBS[table]}/specimen={specimen}/{self._job(table, number)}.parquet"
        )

    def _job(self, table: str, number: int) -> str:
        """Place of a job file in its specimen's folder."""
        match table:
            case "calibrations":
                return f"pose={number:04d}"
            case "simulations":
                pose, which = divmod(number, len(self.stiffnesses))
                return f"pose={pose:04d}/stiffness={self.stiffnesses[which]}"
            case "bootstrap":
                return self.bootstraps[number]
            case "method_fits":
                pose, which = divmod(number, len(METHODS))
                return f"pose={pose:04d}/method={METHODS[which]}"
            case "precision_errors":
                return f"sd_mm={self.study.landmark_precision.sd_mm[number]:.15g}"
        raise ValueError(f"{table} is not made of job files")


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
    rule = [] if place["stiffness"] == "calibrated" else [judging(expected.study)]
    return [*_frames(expected, place), *read, *rule]


_SOLVING = ("loading", "settle_time_s")
_GROUPING = ("best_models", "block")
_MODEL = ("tests", "load_point_shift_mm", "stiffness", "damping", "calibration")
_BOOTSTRAPS = ("start_bootstrap", "damping_bootstrap", "dynamic")
_JUDGING = ("success", "significance")
_PARTS = (
    *("methods", "landmark_precision", "load_point", "posterior"),
    *(*_BOOTSTRAPS, *_JUDGING),
)
"""Settings by what they decide; the last were added to the sampled poses, whose fits and
simulations do not hang on them."""

_NOT_JUDGED = tuple(name for name in _PARTS if name != "success")
_NOT_PRECISE = tuple(name for name in _PARTS if name != "landmark_precision")

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
        ignores=ignoring("block", *_NOT_JUDGED),
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
            *("load_point", "posterior"),
            *(*_GROUPING, *_JUDGING),
            start_bootstrap={"loadings"},
            damping_bootstrap={"loadings"},
        ),
    ),
    Job(
        "landmark_errors",
        ignores=ignoring(
            *("poses", "landmark_sd_mm", "methods", *_SOLVING, *_GROUPING),
            *("load_point", "posterior", *_BOOTSTRAPS, *_JUDGING),
            landmark_precision={"sd_mm", "translation_limit_mm", "rotation_limit_deg", "share"},
        ),
    ),
    Job(
        "fit_by_method",
        ignores=ignoring(
            *("poses", "loading", "landmark_precision", "load_point", "posterior"),
            "significance",
            *(*_GROUPING, *_BOOTSTRAPS),
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
            *(name for name in _PARTS if name != "landmark_precision"),
            landmark_precision={"poses", "translation_limit_mm", "rotation_limit_deg", "share"},
        ),
    ),
    Job(
        "over_load_point",
        ignores=ignoring(
            *("poses", "landmark_sd_mm", *_SOLVING, *_GROUPING),
            *(name for name in _PARTS if name != "load_point"),
            load_point={"anterior_sd_mm", "superior_sd_mm"},
        ),
    ),
    Job(
        "posterior",
        ignores=ignoring(
            *("methods", "landmark_precision", "load_point", *_SOLVING, *_GROUPING),
            *(*_BOOTSTRAPS, *_JUDGING),
        ),
        also=_frames,
    ),
)


def _analysis(name: str, at: str, reads: tuple[str, ...], writes: tuple[str, ...] = ()) -> Job:
    """A job that makes tables of tables; by default the one of its own name."""
    return Job(name, at, reads, writes or (name,), ignoring("block", *_NOT_JUDGED))


_FITTED = ("calibrations", "simulations", "poses", "success")
_ANALYSES = (
    _analysis("success", "success:success", ("calibrations",)),
    _analysis("counts", "success:counts", ("success", "bootstrap")),
    _analysis("summary", "summary", (*_FITTED, "bootstrap", "best.json")),
    _analysis("statistics", "significance", (*_FITTED, "best.json")),
    _analysis("agreement", "agreement", ("simulations", "success")),
    _analysis(
        "two_factor",
        "two_factor",
        ("simulations", "poses", "success", "best.json"),
        ("variance_shares", "importance"),
    ),
    _analysis("success_by_method", "success:success_by_method", ("method_fits",)),
    Job(
        "landmark_precision",
        "landmark_precision",
        ("precision_errors",),
        ("landmark_precision", "required_precision"),
        ignoring("block", *_NOT_PRECISE),
    ),
    Job(
        "load_point_effect",
        "load_point_effect",
        ("stiffness_over_load_point",),
        ("load_point_effect",),
        ignoring("block", *(name for name in _PARTS if name != "load_point")),
    ),
    Job(
        "against_gould_2024a",
        "",
        COMPARED,
        ("against_gould_2024a",),
        ignoring("block"),
        also=hangs_on("gould_2024a"),
    ),
)

KIND = Kind(
    settings=JointPoseSensitivity,
    files=Layout,
    checks=(check_joint_pose_sensitivity,),
    tables=all_declared(__file__),
    jobs=(*_SAMPLED, *_ADDED, *_ANALYSES),
    ignored_by_figures=("block",),
    makes_models="start_model",
    exports="export:exported",
    settled=settle_calibration,
    told_by_check="identifiability_preview:told",
)
